// Half precision, rounded to nearest, ties to even.
// Twin: src/twin/f16.rs.

// 2^-14, the smallest normal half.
const LEAST_NORMAL: u32 = 0x38800000;

// The bits of each component as a half, for |component| < 2.
fn to_half(value: vec4f) -> vec4u {
    let bits = bitcast<vec4u>(value);
    let sign = (bits >> vec4u(16u)) & vec4u(0x8000u);
    let magnitude = bits & vec4u(0x7fffffffu);
    // The last 13 bits are dropped. What is added before carries into the bits that stay if those
    // dropped are more than half of their range, or exactly half and the last bit that stays is 1.
    let odd = (magnitude >> vec4u(13u)) & vec4u(1u);
    let normal = (magnitude + vec4u(0x0fffu) + odd - vec4u(0x38000000u)) >> vec4u(13u);
    // Subnormal halves count in units of 2^-24, as f32 does between 1/2 and 1: the sum with 1/2
    // rounds to such a unit.
    let small = bitcast<vec4u>(bitcast<vec4f>(magnitude) + vec4f(0.5)) - vec4u(0x3f000000u);
    return sign | select(normal, small, magnitude < vec4u(LEAST_NORMAL));
}
