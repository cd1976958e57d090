// Magnitudes below 2^-64 become +0: drivers may or may not flush subnormals.
// Twin: src/cpu/evaluate.rs.

const TINY_BITS: u32 = 0x1f800000;

fn canonical(q: vec4f) -> vec4f {
    let magnitude = bitcast<vec4u>(q) & vec4u(0x7fffffffu);
    return select(q, vec4f(0.0), magnitude < vec4u(TINY_BITS));
}
