// A rotation as two words of 64 bits: lavapipe stores word by word and lane by lane, so half as
// many words take half the time.

fn wide(rotation: vec4f) -> vec2<u64> {
    let words = bitcast<vec4u>(rotation);
    return vec2<u64>(
        u64(words.x) | (u64(words.y) << 32u),
        u64(words.z) | (u64(words.w) << 32u),
    );
}
