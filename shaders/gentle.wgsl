// Cubics that turn little, straight from four keys, as the polynomial that
// `evaluate_polynomial` takes. With v1, v2, v3 the half-rotation vectors of the cumulative
// form, each brought behind what follows it, and b1, b2, b3 what their basis functions gain
// from the middle on, the curve is m exp(v1 b1) exp(v2 b2) exp(v3 b3). Where the vectors
// are short, its series to the third order is enough: sums and products of the vectors,
// times the powers of b1, b2, b3, which are the same for every curve.
// Twin: src/cpu/gentle.rs.

// What a key knows of the times of its two intervals.
struct Joint {
    // What the step before it counts by, and the step behind it.
    before: f32,
    after: f32,
    // The part of the tangent that is the handle behind it; the one before it gets what is
    // left of a third.
    outgoing: f32,
    // INNER, END or OUTSIDE.
    kind: f32,
}

// A key with one on each side.
const INNER: f32 = 0.0;
// The first or the last of a track, where the curve is a parabola.
const END: f32 = 1.0;
// Nothing that is known here.
const OUTSIDE: f32 = 2.0;

// Squares of chords between keys, and of what their steps become in a tangent, up to which
// the series here hold within 1e-9; and the sum of the squares of a curve's vectors up to
// which the third order is enough, within 3e-8.
const LONGEST_STEP: f32 = 0.0034;
const LONGEST_PART: f32 = 0.01;
const GENTLE: f32 = 0.001;

// sin(x)/x - 1 and cos(x) - 1 in powers of x², and asin(x)/x - 1.
const SINC_1: f32 = -0.16666667;
const SINC_2: f32 = 0.008333334;
const FALL_1: f32 = -0.5;
const FALL_2: f32 = 0.041666668;
const LOG_1: f32 = 0.16666667;
const LOG_2: f32 = 0.075;
const LOG_3: f32 = 0.04464286;
const LOG_4: f32 = 0.030381944;

const THIRD: f32 = 0.33333334;
const TWO_THIRDS: f32 = 0.6666667;

// The polynomials of degree 6 through b1 b2 b3, -b1³/6, -b1 b2²/2, -b1 b3²/2, -b2³/6 and
// -b2 b1²/2 at the nodes of a Chebyshev polynomial, one of which is the middle; power by
// power. Those that are missing are 0.
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

// A rotation as what it is more than none: [vector, cosine - 1].
struct Turn {
    vector: vec3f,
    fall: f32,
}

struct Gentle {
    // The coefficients of 1, s, s², … s⁶.
    powers: array<vec4f, 7>,
    // Whether they are those of the curve.
    holds: bool,
}

fn across(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(
        a.y * b.z - a.z * b.y,
        a.z * b.x - a.x * b.z,
        a.x * b.y - a.y * b.x,
    );
}

fn along(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

// The vector of a⁻¹ (a + chord).
fn step_vector(a: vec4f, chord: vec4f) -> vec3f {
    return vec3f(
        a.w * chord.x - chord.w * a.x - (a.y * chord.z - a.z * chord.y),
        a.w * chord.y - chord.w * a.y - (a.z * chord.x - a.x * chord.z),
        a.w * chord.z - chord.w * a.z - (a.x * chord.y - a.y * chord.x),
    );
}

// A half-rotation vector from its sine.
fn short_log(v: vec3f) -> vec3f {
    let x = along(v, v);
    let tail = ((LOG_4 * x + LOG_3) * x + LOG_2) * x + LOG_1;
    return v * (tail * x) + v;
}

fn short_exp(v: vec3f) -> Turn {
    let x = along(v, v);
    let sinc = (SINC_2 * x + SINC_1) * x;
    return Turn(v * sinc + v, (FALL_2 * x + FALL_1) * x);
}

fn both(a: Turn, b: Turn) -> Turn {
    return Turn(
        (a.vector + b.vector) + (a.vector * b.fall + b.vector * a.fall) + across(a.vector, b.vector),
        (a.fall + b.fall) + a.fall * b.fall - along(a.vector, b.vector),
    );
}

// r⁻¹ v r.
fn brought_behind(v: vec3f, r: Turn) -> vec3f {
    let once = across(r.vector, v);
    let twice = once + once;
    return v - (twice * r.fall + twice) + across(r.vector, twice);
}

// The Hamilton product of a rotation with a vector and a scalar.
fn carried(m: vec4f, v: vec3f, w: f32) -> vec4f {
    return canonical(vec4f(
        m.w * v.x + m.x * w + m.y * v.z - m.z * v.y,
        m.w * v.y - m.x * v.z + m.y * w + m.z * v.x,
        m.w * v.z + m.x * v.y - m.y * v.x + m.z * w,
        m.w * w - m.x * v.x - m.y * v.y - m.z * v.z,
    ));
}

// Between `start` and `end`, four keys each in the sign nearer to its predecessor's.
fn gentle(
    before: vec4f,
    start: vec4f,
    end: vec4f,
    after: vec4f,
    first: Joint,
    last: Joint,
) -> Gentle {
    // Steps between the keys, and their logarithms.
    let chord_before = start - before;
    let chord = end - start;
    let chord_after = after - end;
    let step = step_vector(start, chord);
    let log_before = short_log(step_vector(before, chord_before));
    let log = short_log(step);
    let log_after = short_log(step_vector(end, chord_after));

    // The handles.
    let first_left = log_before * first.before;
    let first_right = log * first.after;
    let last_left = log * last.before;
    let last_right = log_after * last.after;
    let first_tangent = short_log(both(short_exp(first_left), short_exp(first_right)).vector);
    let last_tangent = short_log(both(short_exp(last_left), short_exp(last_right)).vector);
    let outgoing = first_tangent * first.outgoing;
    let incoming = last_tangent * (THIRD - last.outgoing);
    let parabola = log * TWO_THIRDS;
    let w1 = select(outgoing, parabola - incoming, first.kind == END);
    let w3 = select(incoming, parabola - outgoing, last.kind == END);
    let whole = Turn(step, square(chord) * -0.5);
    let without_first = both(short_exp(-w1), whole);
    let w2 = short_log(both(without_first, short_exp(-w3)).vector);

    let energy = along(w1, w1) + along(w2, w2) + along(w3, w3);
    let holds = (energy <= GENTLE)
        & (square(chord_before) <= LONGEST_STEP)
        & (square(chord) <= LONGEST_STEP)
        & (square(chord_after) <= LONGEST_STEP)
        & (along(first_left, first_left) <= LONGEST_PART)
        & (along(first_right, first_right) <= LONGEST_PART)
        & (along(last_left, last_left) <= LONGEST_PART)
        & (along(last_right, last_right) <= LONGEST_PART)
        & (first.kind != OUTSIDE)
        & (last.kind != OUTSIDE);

    // The middle, and the vectors there.
    let third_turn = short_exp(w3 * 0.125);
    let second_turn = both(short_exp(w2 * 0.5), third_turn);
    let turn = both(short_exp(w1 * 0.875), second_turn);
    let m = carried(start, turn.vector, turn.fall) + start;
    let v1 = brought_behind(w1, second_turn);
    let v2 = brought_behind(w2, third_turn);
    let v3 = w3;

    // The first order, a s + b s² + c s³, and products of the vectors.
    let outer = v1 + v3;
    let a = outer * 0.75 + v2 * 1.5;
    let b = (v3 - v1) * 1.5;
    let c = outer - (v2 + v2);
    let x12 = across(v1, v2);
    let x23 = across(v2, v3);
    let x13 = across(v1, v3);
    let even = x12 + x23;
    let odd = x12 - x23;
    let n1 = along(v1, v1);
    let n2 = along(v2, v2);
    let n3 = along(v3, v3);
    let d12 = along(v1, v2);
    let d13 = along(v1, v3);
    let d23 = along(v2, v3);
    let outward = n1 + n3;
    let difference = n1 - n3;
    let volume = along(v1, x23);

    // The third order of each vector, power by power.
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

    return Gentle(
        array(
            canonical(m),
            carried(m, a + f1, -(volume * B_123_1)),
            carried(m, b + (even * 1.125 + x13 * 0.5625 + f2), along(a, a) * -0.5),
            carried(m, c + (odd * -2.25 + f3), -along(a, b) - volume * B_123_3),
            carried(m, x13 * -0.75 + f4, along(b, b) * -0.5 - along(a, c)),
            carried(m, odd * 3.0 + f5, -along(b, c) - volume * B_123_5),
            carried(m, (x13 - (even + even)) + f6, along(c, c) * -0.5),
        ),
        holds,
    );
}

fn square(q: vec4f) -> f32 {
    return q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
}
