// The last step of every result: what is tiny becomes +0, because drivers may flush subnormals
// and need not say so.
// Twin: src/simd/lanes.rs.

// 2^-64.
const TINY_BITS: u32 = 0x1f800000;

// Components below 2^-64 in magnitude become +0.
fn canonical(q: vec4f) -> vec4f {
    let magnitude = bitcast<vec4u>(q) & vec4u(0x7fffffffu);
    return select(q, vec4f(0.0), magnitude < vec4u(TINY_BITS));
}
