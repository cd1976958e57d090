// Moves each value by a weighted sum of the steps about it: p' = p + Σ b_m (d_{i+m} - d_{i-1-m}).
// Rotations: q' = q exp(Σ b_m (d_{i+m} - d_{i-1-m})).
// Twin: src/twin/pose_smooth.rs.

@group(0) @binding(0) var<storage, read> values: array<vec4f>;
// The step before a value is at its place plus the number of weights, minus 1.
@group(0) @binding(1) var<storage, read> steps: array<vec4f>;
@group(0) @binding(2) var<storage, read> weights: array<f32>;
@group(0) @binding(3) var<storage, read_write> smoothed: array<vec4f>;

// (pi/2)²: the polynomials of sine and cosine hold up to there.
const LONGEST_TURN_SQUARE: f32 = 2.4674;

// A rotation turned on by a half-rotation vector; 0, which is no rotation, where that is too long.
// One Newton step takes back what rounding does to the length; without a turn every bit stays.
fn turned(q: vec4f, v: vec4f) -> vec4f {
    let half = flushed4(v);
    let square = half.x * half.x + half.y * half.y + half.z * half.z;
    let long = square > LONGEST_TURN_SQUARE;
    let z = select(square, 0.0, long);
    let turn = sine_cosm1(1.0, z);
    let more = product(q, vec4f(half.x * turn.x, half.y * turn.x, half.z * turn.x, turn.y));
    let sum = q + more;
    let unit = sum * (1.5 - 0.5 * dot4(sum, sum));
    return select(select(unit, q, square == 0.0), vec4f(0.0), long);
}

// `dispatch.detail` is twice the number of weights, and one more for rotations.
fn pose(place: u32) {
    let count = dispatch.detail >> 1u;
    var sum = vec4f(0.0);
    for (var m = 0u; m < count; m++) {
        let rise = steps[place + count + m] - steps[place + count - 1u - m];
        sum = sum + rise * weights[m];
    }
    let own = values[place];
    if (dispatch.detail & 1u) == 1u {
        smoothed[place] = canonical(turned(own, sum));
    } else {
        smoothed[place] = canonical(own + sum);
    }
}
