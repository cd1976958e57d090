// Packed keys of rotations: three components in 20 bits each, which of the four is left out, and the sign.
// Twin: src/crowd/clip_keys.rs.

// One unit of a packed component.
const PACKED_STEP: f32 = 1.34870174e-6;

fn unpacked(words: vec2u) -> vec4f {
    let a = packed_component(words.x);
    let b = packed_component((words.x >> 20u) | (words.y << 12u));
    let c = packed_component(words.y >> 8u);
    let square = a * a + b * b + c * c;
    let rest = 1.0 - square;
    let d = exact_root(select(rest, 0.0, rest < 0.0));
    let largest = (words.y >> 28u) & 3u;
    let value = select(
        select(vec4f(d, a, b, c), vec4f(c, d, a, b), largest == 1u),
        select(vec4f(b, c, d, a), vec4f(a, b, c, d), largest == 3u),
        largest >= 2u,
    );
    let is_negative = ((words.y >> 30u) & 1u) == 1u;
    return canonical(select(value, -value, is_negative));
}

// The lowest 20 bits as a signed number of units.
fn packed_component(word: u32) -> f32 {
    return f32(bitcast<i32>(word << 12u) >> 12u) * PACKED_STEP;
}

// √x, rounded to nearest, for x from 2^-30 to 1, and for 0.
fn exact_root(x: f32) -> f32 {
    if x == 0.0 {
        return 0.0;
    }
    // Within a unit of the last place.
    let near = root(x);
    let next = bitcast<f32>(bitcast<u32>(near) + 1u);
    let before = bitcast<f32>(bitcast<u32>(near) - 1u);
    let is_more = rest_of_square(x, near, (next - near) * 0.5) > 0.0;
    let is_less = rest_of_square(x, near, (before - near) * 0.5) < 0.0;
    return select(select(near, before, is_less), next, is_more);
}

// x - (r + h)² for |h| of half a unit of the last place of r: its sign is exact.
fn rest_of_square(x: f32, r: f32, h: f32) -> f32 {
    let high = bitcast<f32>(bitcast<u32>(r) & 0xfffff000u);
    let low = r - high;
    // Each difference is near 0 where the sign is in question, and therefore exact.
    let rest = ((x - high * high) - 2.0 * high * low) - 2.0 * r * h;
    return (rest - low * low) - h * h;
}
