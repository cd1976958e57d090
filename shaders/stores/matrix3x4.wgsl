// Stores rotations as 3 × 4 matrices whose translation is 0, twelve numbers each.
// Twin: src/twin/matrix.rs.
// Needs: math/matrix, stores/matrix.

fn store(place: u32, rotation: vec4f) {
    let detail = dispatch.detail;
    let rows = matrix_rows(rotation, detail);
    // Row by row each row ends in a 0; column by column the fourth column is 0.
    let length = select(4u, 3u, detail == 1u);
    let first = place * 12u;
    store_row(first, rows.first);
    store_row(first + length, rows.second);
    store_row(first + 2u * length, rows.third);
    rotations[first + 11u] = 0.0;
    rotations[first + select(3u, 9u, detail == 1u)] = 0.0;
    rotations[first + select(7u, 10u, detail == 1u)] = 0.0;
}
