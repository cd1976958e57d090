// Rotations as 3 × 3 matrices, nine numbers each.

@group(0) @binding(4) var<storage, read_write> rotations: array<f32>;

fn put(place: u32, row: vec3f) {
    rotations[place] = row.x;
    rotations[place + 1u] = row.y;
    rotations[place + 2u] = row.z;
}

fn store(place: u32, rotation: vec4f) {
    let rows = rows(rotation, launch.detail);
    put(place * 9u, settled(rows.first));
    put(place * 9u + 3u, settled(rows.second));
    put(place * 9u + 6u, settled(rows.third));
}
