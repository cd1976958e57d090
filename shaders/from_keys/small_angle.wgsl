// Cubics that turn through small angles, straight from four keys, as the polynomial that
// `polynomial` evaluates.
//
// The curve in cumulative form is q0 exp(w1 B1) exp(w2 B2) exp(w3 B3) with half-rotation vectors
// w1, w2, w3. About its middle m it is m exp(v1 b1) exp(v2 b2) exp(v3 b3): b1, b2, b3 are the
// basis functions minus their values at the middle, and v1, v2, v3 are w1, w2, w3, each rotated
// back by the factors that follow it there. For short vectors the series of this product to the
// third order is enough: sums and products of the vectors, times powers of b1, b2, b3, which are
// the same for every curve.
// Twin: src/twin/small_angle.rs.

/// How the tangent at a key weighs the steps to its neighbours; this depends on key times alone.
struct TangentWeights {
    /// The weight of the step before the key, and of the step after it.
    before: f32,
    after: f32,
    /// The handle after the key is the tangent times this; the handle before it is the tangent
    /// times 1/3 minus this.
    outgoing: f32,
    /// `KEY_INNER`, `KEY_AT_END` or `KEY_UNKNOWN`.
    kind: f32,
}

// A key with a neighbour on each side.
const KEY_INNER: f32 = 0.0;
// The first or the last key of a track, where the curve is a parabola.
const KEY_AT_END: f32 = 1.0;
// A key whose tangent these weights do not give.
const KEY_UNKNOWN: f32 = 2.0;

// The squared chord between two keys, and the squared length of a weighted step in a tangent, up
// to which the series of logarithm and exponential here hold within 1e-9; and the squared extent
// of a curve, the sum of its vectors' squares, up to which the third order is within 3e-8.
const LONGEST_STEP: f32 = 0.0034;
const LONGEST_TANGENT_PART: f32 = 0.01;
const SMALL_SQUARED_EXTENT: f32 = 0.001;

// sin(x)/x - 1 and cos(x) - 1 in powers of x², and asin(x)/x - 1.
const SINC_1: f32 = -0.16666667;
const SINC_2: f32 = 0.008333334;
const COSM1_1: f32 = -0.5;
const COSM1_2: f32 = 0.041666668;
const LOG_1: f32 = 0.16666667;
const LOG_2: f32 = 0.075;
const LOG_3: f32 = 0.04464286;
const LOG_4: f32 = 0.030381944;

const THIRD: f32 = 0.33333334;
const TWO_THIRDS: f32 = 0.6666667;

// Coefficients of the polynomials of degree 6 through b1 b2 b3, -b1³/6, -b1 b2²/2, -b1 b3²/2,
// -b2³/6 and -b2 b1²/2 at Chebyshev nodes, one of which is the middle: B_ijk_n is that of sⁿ.
// Coefficients that are not listed are 0.
const B_123_1: f32 = 0.003631591796875;
const B_123_3: f32 = 0.72412109375;
const B_123_5: f32 = -1.2109375;
const B_111_1: f32 = -0.0026880900841206312;
const B_111_2: f32 = 0.00128173828125;
const B_111_3: f32 = 0.015421549789607525;
const B_111_4: f32 = 0.380859375;
const B_111_5: f32 = -1.8040364980697632;
const B_111_6: f32 = 2.015625;
const B_122_1: f32 = 0.001068115234375;
const B_122_2: f32 = 0.005126953125;
const B_122_3: f32 = -0.88134765625;
const B_122_4: f32 = 1.5234375;
const B_122_5: f32 = 1.5078125;
const B_122_6: f32 = -3.1875;
const B_133_1: f32 = -0.00037384033203125;
const B_133_2: f32 = -0.00128173828125;
const B_133_3: f32 = -0.1998291015625;
const B_133_4: f32 = -0.380859375;
const B_133_5: f32 = -0.068359375;
const B_133_6: f32 = 0.234375;
const B_222_1: f32 = -0.0041300454176962376;
const B_222_3: f32 = -0.4280599057674408;
const B_222_5: f32 = 1.1197916269302368;
const B_211_1: f32 = 0.0058746337890625;
const B_211_2: f32 = -0.005126953125;
const B_211_3: f32 = -0.608154296875;
const B_211_4: f32 = 1.8515625;
const B_211_5: f32 = -0.80078125;
const B_211_6: f32 = -1.3125;

// A rotation minus the identity, [vector, cosine - 1]: for a small angle f32 holds the cosine
// minus one far more precisely than the cosine.
struct FromIdentity {
    vector: vec3f,
    cosm1: f32,
}

struct SmallAngleCubic {
    // The coefficients of 1, s, s², … s⁶.
    powers: array<vec4f, 7>,
    // Whether the curve turns little enough for the series.
    is_valid: bool,
}

// The vector part of a⁻¹ (a + chord), the step from a to its next key.
fn step_vector(a: vec4f, chord: vec4f) -> vec3f {
    return vec3f(
        a.w * chord.x - chord.w * a.x - (a.y * chord.z - a.z * chord.y),
        a.w * chord.y - chord.w * a.y - (a.z * chord.x - a.x * chord.z),
        a.w * chord.z - chord.w * a.z - (a.x * chord.y - a.y * chord.x),
    );
}

// The logarithm of a small rotation by its vector part, whose length is the sine.
fn small_log(v: vec3f) -> vec3f {
    let x = dot3(v, v);
    let tail = ((LOG_4 * x + LOG_3) * x + LOG_2) * x + LOG_1;
    return v * (tail * x) + v;
}

// The exponential of a small half-rotation vector.
fn small_exp(v: vec3f) -> FromIdentity {
    let x = dot3(v, v);
    let sinc = (SINC_2 * x + SINC_1) * x;
    return FromIdentity(v * sinc + v, (COSM1_2 * x + COSM1_1) * x);
}

// The Hamilton product a b.
fn composed(a: FromIdentity, b: FromIdentity) -> FromIdentity {
    return FromIdentity(
        (a.vector + b.vector) + (a.vector * b.cosm1 + b.vector * a.cosm1) + cross3(a.vector, b.vector),
        (a.cosm1 + b.cosm1) + a.cosm1 * b.cosm1 - dot3(a.vector, b.vector),
    );
}

// r⁻¹ v r.
fn inverse_rotated(v: vec3f, r: FromIdentity) -> vec3f {
    let once = cross3(r.vector, v);
    let twice = once + once;
    return v - (twice * r.cosm1 + twice) + cross3(r.vector, twice);
}

// The Hamilton product of m and [v, w].
fn canonical_product(m: vec4f, v: vec3f, w: f32) -> vec4f {
    return canonical(vec4f(
        m.w * v.x + m.x * w + m.y * v.z - m.z * v.y,
        m.w * v.y - m.x * v.z + m.y * w + m.z * v.x,
        m.w * v.z + m.x * v.y - m.y * v.x + m.z * w,
        m.w * w - m.x * v.x - m.y * v.y - m.z * v.z,
    ));
}

// The curve between `start` and `end`. Each of the four keys has the sign that is nearer to the
// key before it.
fn small_angle_cubic(
    before: vec4f,
    start: vec4f,
    end: vec4f,
    after: vec4f,
    first: TangentWeights,
    last: TangentWeights,
) -> SmallAngleCubic {
    // The steps between the keys, and their logarithms.
    let chord_before = start - before;
    let chord = end - start;
    let chord_after = after - end;
    let step = step_vector(start, chord);
    let log_before = small_log(step_vector(before, chord_before));
    let log = small_log(step);
    let log_after = small_log(step_vector(end, chord_after));

    // The handles w1 and w3, and the vector w2 between them.
    let first_left = log_before * first.before;
    let first_right = log * first.after;
    let last_left = log * last.before;
    let last_right = log_after * last.after;
    let first_tangent = small_log(composed(small_exp(first_left), small_exp(first_right)).vector);
    let last_tangent = small_log(composed(small_exp(last_left), small_exp(last_right)).vector);
    let outgoing = first_tangent * first.outgoing;
    let incoming = last_tangent * (THIRD - last.outgoing);
    let parabola = log * TWO_THIRDS;
    let w1 = select(outgoing, parabola - incoming, first.kind == KEY_AT_END);
    let w3 = select(incoming, parabola - outgoing, last.kind == KEY_AT_END);
    let whole = FromIdentity(step, norm_squared(chord) * -0.5);
    let without_first = composed(small_exp(-w1), whole);
    let w2 = small_log(composed(without_first, small_exp(-w3)).vector);

    let squared_extent = dot3(w1, w1) + dot3(w2, w2) + dot3(w3, w3);
    let is_valid = (squared_extent <= SMALL_SQUARED_EXTENT)
        & (norm_squared(chord_before) <= LONGEST_STEP)
        & (norm_squared(chord) <= LONGEST_STEP)
        & (norm_squared(chord_after) <= LONGEST_STEP)
        & (dot3(first_left, first_left) <= LONGEST_TANGENT_PART)
        & (dot3(first_right, first_right) <= LONGEST_TANGENT_PART)
        & (dot3(last_left, last_left) <= LONGEST_TANGENT_PART)
        & (dot3(last_right, last_right) <= LONGEST_TANGENT_PART)
        & (first.kind != KEY_UNKNOWN)
        & (last.kind != KEY_UNKNOWN);

    // The middle, and the vectors rotated back to it.
    let third_step = small_exp(w3 * 0.125);
    let second_step = composed(small_exp(w2 * 0.5), third_step);
    let all_steps = composed(small_exp(w1 * 0.875), second_step);
    let m = canonical_product(start, all_steps.vector, all_steps.cosm1) + start;
    let v1 = inverse_rotated(w1, second_step);
    let v2 = inverse_rotated(w2, third_step);
    let v3 = w3;

    // The first order is a s + b s² + c s³; then the products of the vectors.
    let outer = v1 + v3;
    let a = outer * 0.75 + v2 * 1.5;
    let b = (v3 - v1) * 1.5;
    let c = outer - (v2 + v2);
    let x12 = cross3(v1, v2);
    let x23 = cross3(v2, v3);
    let x13 = cross3(v1, v3);
    let even = x12 + x23;
    let odd = x12 - x23;
    let n1 = dot3(v1, v1);
    let n2 = dot3(v2, v2);
    let n3 = dot3(v3, v3);
    let d12 = dot3(v1, v2);
    let d13 = dot3(v1, v3);
    let d23 = dot3(v2, v3);
    let outward = n1 + n3;
    let difference = n1 - n3;
    let volume = dot3(v1, x23);

    // The third order, power by power.
    let f1 = v1 * (n1 * B_111_1 + n2 * B_122_1 + n3 * B_133_1 - d23 * B_123_1)
        + v3 * (n3 * B_111_1 + n2 * B_122_1 + n1 * B_133_1 - d12 * B_123_1)
        + v2 * (outward * B_211_1 + n2 * B_222_1 + d13 * B_123_1);
    let f2 = v1 * (n1 * B_111_2 + n2 * B_122_2 + n3 * B_133_2)
        - v3 * (n3 * B_111_2 + n2 * B_122_2 + n1 * B_133_2)
        + v2 * (difference * B_211_2);
    let f3 = v1 * (n1 * B_111_3 + n2 * B_122_3 + n3 * B_133_3 - d23 * B_123_3)
        + v3 * (n3 * B_111_3 + n2 * B_122_3 + n1 * B_133_3 - d12 * B_123_3)
        + v2 * (outward * B_211_3 + n2 * B_222_3 + d13 * B_123_3);
    let f4 = v1 * (n1 * B_111_4 + n2 * B_122_4 + n3 * B_133_4)
        - v3 * (n3 * B_111_4 + n2 * B_122_4 + n1 * B_133_4)
        + v2 * (difference * B_211_4);
    let f5 = v1 * (n1 * B_111_5 + n2 * B_122_5 + n3 * B_133_5 - d23 * B_123_5)
        + v3 * (n3 * B_111_5 + n2 * B_122_5 + n1 * B_133_5 - d12 * B_123_5)
        + v2 * (outward * B_211_5 + n2 * B_222_5 + d13 * B_123_5);
    let f6 = v1 * (n1 * B_111_6 + n2 * B_122_6 + n3 * B_133_6)
        - v3 * (n3 * B_111_6 + n2 * B_122_6 + n1 * B_133_6)
        + v2 * (difference * B_211_6);

    return SmallAngleCubic(
        array(
            canonical(m),
            canonical_product(m, a + f1, -(volume * B_123_1)),
            canonical_product(m, b + (even * 1.125 + x13 * 0.5625 + f2), dot3(a, a) * -0.5),
            canonical_product(m, c + (odd * -2.25 + f3), -dot3(a, b) - volume * B_123_3),
            canonical_product(m, x13 * -0.75 + f4, dot3(b, b) * -0.5 - dot3(a, c)),
            canonical_product(m, odd * 3.0 + f5, -dot3(b, c) - volume * B_123_5),
            canonical_product(m, (x13 - (even + even)) + f6, dot3(c, c) * -0.5),
        ),
        is_valid,
    );
}
