// Rotations in half precision, rounded to nearest, ties to even.
// Twin: src/cpu/store_f16.rs.

@group(0) @binding(4) var<storage, read_write> rotations: array<vec2u>;

// 2^-14, the smallest half with all of its bits.
const LEAST_NORMAL: u32 = 0x38800000;

// |value| < 2.
fn to_half(value: vec4f) -> vec4u {
    let bits = bitcast<vec4u>(value);
    let sign = (bits >> vec4u(16u)) & vec4u(0x8000u);
    let magnitude = bits & vec4u(0x7fffffffu);
    // 13 bits go; what is added carries into the rest where it is more than half of
    // them, or half and the rest odd.
    let odd = (magnitude >> vec4u(13u)) & vec4u(1u);
    let normal = (magnitude + vec4u(0x0fffu) + odd - vec4u(0x38000000u)) >> vec4u(13u);
    // Small ones count 2^-24, as f32 between 1/2 and 1 does.
    let small = bitcast<vec4u>(bitcast<vec4f>(magnitude) + vec4f(0.5)) - vec4u(0x3f000000u);
    return sign | select(normal, small, magnitude < vec4u(LEAST_NORMAL));
}

fn store(place: u32, rotation: vec4f) {
    let half = to_half(rotation);
    rotations[place] = vec2u(half.x | (half.y << 16u), half.z | (half.w << 16u));
}
