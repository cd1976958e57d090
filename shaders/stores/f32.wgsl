// Stores rotations as they are: x y z w, f32.

alias Stored = vec4f;

fn store(index: u32, rotation: vec4f) {
    rotations[index] = rotation;
}
