// Stores rotations as 3 × 3 matrices, nine numbers each.
// Twin: src/twin/matrix.rs.
// Needs: math/matrix.

alias Stored = f32;

fn store_row(place: u32, row: vec3f) {
    let settled = canonical(vec4f(row, 0.0));
    rotations[place] = settled.x;
    rotations[place + 1u] = settled.y;
    rotations[place + 2u] = settled.z;
}

fn store(place: u32, rotation: vec4f) {
    let rows = matrix_rows(rotation, dispatch.detail);
    store_row(place * 9u, rows.first);
    store_row(place * 9u + 3u, rows.second);
    store_row(place * 9u + 6u, rows.third);
}
