// Rotations as they are, by `wide`.

@group(0) @binding(4) var<storage, read_write> rotations: array<vec2<u64>>;

fn store(place: u32, rotation: vec4f) {
    rotations[place] = wide(rotation);
}
