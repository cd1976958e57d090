// Rotations as 3 × 3 matrices, nine numbers each.

fn store(place: u32, rotation: vec4f) {
    let rows = rows(rotation, launch.detail);
    put(place * 9u, rows.first);
    put(place * 9u + 3u, rows.second);
    put(place * 9u + 6u, rows.third);
}
