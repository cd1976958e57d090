// The cumulative form (Kim, Kim, Shin 1995): three rotations about fixed axes, one
// after another, each by an angle that is a cubic in the segment's parameter.
// The product is expanded: with base rotations and axes folded into eight constant
// quaternions, only cosines and sines remain.
// Twin: src/cpu/evaluate_cumulative.rs.

struct Segment {
    // terms[4a + 2b + c] goes with (a ? sine : cosine) of the first angle, (b ? …)
    // of the second, (c ? …) of the third.
    terms: array<vec4f, 8>,
    // For each power of s (1, 2, 3), the coefficients of the three half-angles.
    linear: vec3f,
    quadratic: vec3f,
    cubic: vec3f,
}

// `s`: the parameter, -1/2 to 1/2 over the segment; the three half-angles are
// zero at its middle.
fn evaluate(segment: Segment, s: f32) -> vec4f {
    let angles = ((segment.cubic * s + segment.quadratic) * s + segment.linear) * s;
    let first = sine_cosine(angles.x);
    let second = sine_cosine(angles.y);
    let third = sine_cosine(angles.z);
    let cc = second.y * third.y;
    let cs = second.y * third.x;
    let sc = second.x * third.y;
    let ss = second.x * third.x;
    let even = segment.terms[0] * cc + segment.terms[1] * cs + segment.terms[2] * sc + segment.terms[3] * ss;
    let odd = segment.terms[4] * cc + segment.terms[5] * cs + segment.terms[6] * sc + segment.terms[7] * ss;
    return even * first.y + odd * first.x;
}
