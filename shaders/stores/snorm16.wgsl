// Stores rotations as whole numbers of 1/32767 in 16 bits, rounded to nearest, ties to even.
// Twin: src/twin/snorm16.rs.

alias Stored = vec2u;

// 1.5 · 2^23: a sum with it has the whole number in its last bits.
const SNORM_SHIFT: f32 = 12582912.0;

// The whole number of each component, for |component| < 1 + 2^-16.
fn to_snorm(value: vec4f) -> vec4u {
    return bitcast<vec4u>(value * vec4f(32767.0) + vec4f(SNORM_SHIFT)) & vec4u(0xffffu);
}

fn store(index: u32, rotation: vec4f) {
    let whole = to_snorm(rotation);
    rotations[index] = vec2u(whole.x | (whole.y << 16u), whole.z | (whole.w << 16u));
}
