// Vectors as they are, without the fourth number.

@group(0) @binding(4) var<storage, read_write> rotations: array<f32>;

fn store(place: u32, rotation: vec4f) {
    rotations[place * 3u] = rotation.x;
    rotations[place * 3u + 1u] = rotation.y;
    rotations[place * 3u + 2u] = rotation.z;
}
