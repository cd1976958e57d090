// Rotations by any angle.
// Twin: src/crowd/tree_walk.rs.

const QUARTERS_PER_RADIAN: f32 = 0.63661975;
// 1.5 * 2^23: the lowest bits of a sum with it are a whole number.
const WHOLE_SHIFT: f32 = 12582912.0;
// Pi/2 in three parts. The first has 8 bits and the second 11, so that products with whole numbers below 2^13 are exact.
const QUARTER_1: f32 = 1.5703125;
const QUARTER_2: f32 = 4.837512969970703e-4;
const QUARTER_3: f32 = 7.549789948768648e-8;

// The rotation by an angle, up to 8192 rad in magnitude, about a unit axis.
fn rotation_about(axis: vec3f, angle: f32) -> vec4f {
    let half = angle * 0.5;
    let shifted = half * QUARTERS_PER_RADIAN + WHOLE_SHIFT;
    let quarters = bitcast<u32>(shifted);
    let whole = shifted - WHOLE_SHIFT;
    let rest = half - whole * QUARTER_1 - whole * QUARTER_2 - whole * QUARTER_3;
    let sines = sine_cosine(rest);
    let is_odd = (quarters & 1u) == 1u;
    let sign = select(1.0, -1.0, (quarters & 2u) == 2u);
    let sine = select(sines.x, sines.y, is_odd) * sign;
    let cosine = select(sines.y, -sines.x, is_odd) * sign;
    return vec4f(axis * sine, cosine);
}
