// Stores rotations as 3 × 3 matrices, nine numbers each.
// Twin: src/twin/matrix.rs.
// Needs: math/matrix, stores/matrix.

fn store(place: u32, rotation: vec4f) {
    let rows = matrix_rows(rotation, dispatch.detail);
    store_row(place * 9u, rows.first);
    store_row(place * 9u + 3u, rows.second);
    store_row(place * 9u + 6u, rows.third);
}
