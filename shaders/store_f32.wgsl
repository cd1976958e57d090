// Rotations as they are.

@group(0) @binding(4) var<storage, read_write> rotations: array<vec4f>;

fn store(place: u32, rotation: vec4f) {
    rotations[place] = rotation;
}
