// Stores rotations as they are, as two words of 64 bits each.

alias Stored = vec2<u64>;

fn store(index: u32, rotation: vec4f) {
    rotations[index] = wide(rotation);
}
