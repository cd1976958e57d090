// Moves each value by a weighted sum of the steps about it: p' = p + Σ b_m (d_{i+m} - d_{i-1-m}).
// Rotations: q' = q exp(Σ b_m (d_{i+m} - d_{i-1-m})).
// Twin: src/twin/pose_smooth.rs.

@group(0) @binding(0) var<storage, read> values: array<vec4f>;
// The step before a value is at its index plus the number of weights, minus 1.
@group(0) @binding(1) var<storage, read> steps: array<vec4f>;
@group(0) @binding(2) var<storage, read> weights: array<f32>;
@group(0) @binding(3) var<storage, read_write> smoothed: array<vec4f>;

// (pi/2)²: the polynomials of sine and cosine hold up to there.
const LONGEST_ANGLE_SQUARE: f32 = 2.4674;

// A rotation, and then that of half a rotation vector; 0, which is no rotation, where that is too long.
// One Newton step takes back what rounding does to the length; without a rotation every bit stays.
fn rotated_by(q: vec4f, v: vec4f) -> vec4f {
    let half = flushed4(v);
    let square = half.x * half.x + half.y * half.y + half.z * half.z;
    let long = square > LONGEST_ANGLE_SQUARE;
    let z = select(square, 0.0, long);
    let sines = sine_cosm1(1.0, z);
    let more = product(q, vec4f(half.x * sines.x, half.y * sines.x, half.z * sines.x, sines.y));
    let sum = q + more;
    let unit = sum * (1.5 - 0.5 * dot4(sum, sum));
    return select(select(unit, q, square == 0.0), vec4f(0.0), long);
}

// `dispatch.detail` is twice the number of weights, and one more for rotations.
fn pose(index: u32) {
    let count = dispatch.detail >> 1u;
    var sum = vec4f(0.0);
    for (var m = 0u; m < count; m++) {
        let rise = steps[index + count + m] - steps[index + count - 1u - m];
        sum = sum + rise * weights[m];
    }
    let value = values[index];
    if (dispatch.detail & 1u) == 1u {
        smoothed[index] = canonical(rotated_by(value, sum));
    } else {
        smoothed[index] = canonical(value + sum);
    }
}
