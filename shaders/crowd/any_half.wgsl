// Half precision of values of any magnitude: to nearest, ties to even; what is too large becomes infinite.
// Twin: src/twin/crowd_matrices.rs.

// 65520: what rounds to a number beyond the largest half.
const HALF_OVERFLOW: u32 = 0x477ff000;
const HALF_INFINITE: u32 = 0x7c00;

// As `to_half`, for values of any magnitude.
fn to_any_half(value: vec4f) -> vec4u {
    let bits = bitcast<vec4u>(value);
    let large = (bits & vec4u(0x7fffffffu)) >= vec4u(HALF_OVERFLOW);
    let sign = (bits >> vec4u(16u)) & vec4u(0x8000u);
    let small = select(value, vec4f(0.0), large);
    return select(to_half(small), sign | vec4u(HALF_INFINITE), large);
}
