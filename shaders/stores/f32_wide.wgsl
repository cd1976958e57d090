// Stores rotations as they are, as two words of 64 bits each.

alias Stored = vec2<u64>;

fn store(place: u32, rotation: vec4f) {
    rotations[place] = wide(rotation);
}
