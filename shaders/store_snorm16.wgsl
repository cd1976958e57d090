// Rotations as whole numbers of 1/32767, rounded to nearest, ties to even.
// Twin: src/cpu/store_snorm16.rs.

@group(0) @binding(4) var<storage, read_write> rotations: array<vec2u>;

// 1.5 · 2^23: in a sum with it the last bits are the whole number.
const WHOLE: f32 = 12582912.0;

// |value| < 1 + 2^-16.
fn to_snorm(value: vec4f) -> vec4u {
    return bitcast<vec4u>(value * vec4f(32767.0) + vec4f(WHOLE)) & vec4u(0xffffu);
}

fn store(place: u32, rotation: vec4f) {
    let whole = to_snorm(rotation);
    rotations[place] = vec2u(whole.x | (whole.y << 16u), whole.z | (whole.w << 16u));
}
