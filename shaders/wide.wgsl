// Reading 64 bits at once: lavapipe brings them lane by lane, and as fast as 32.

fn low(pair: u64) -> u32 {
    return u32(pair & 0xfffffffflu);
}

fn high(pair: u64) -> u32 {
    return u32(pair >> 32u);
}

fn quad(pairs: vec2<u64>) -> vec4u {
    return vec4u(low(pairs.x), high(pairs.x), low(pairs.y), high(pairs.y));
}

fn quad_f32(pairs: vec2<u64>) -> vec4f {
    return bitcast<vec4f>(quad(pairs));
}
