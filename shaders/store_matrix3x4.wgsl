// Rotations as 3 × 4 matrices without a translation, twelve numbers each.

fn store(place: u32, rotation: vec4f) {
    let detail = launch.detail;
    let rows = rows(rotation, detail);
    // Rows have a fourth number; columns have a fourth of them.
    let length = select(4u, 3u, detail == 1u);
    let first = place * 12u;
    put(first, rows.first);
    put(first + length, rows.second);
    put(first + 2u * length, rows.third);
    rotations[first + 11u] = 0.0;
    rotations[first + select(3u, 9u, detail == 1u)] = 0.0;
    rotations[first + select(7u, 10u, detail == 1u)] = 0.0;
}
