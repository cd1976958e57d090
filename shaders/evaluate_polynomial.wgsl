// The polynomial form: each component of the rotation is a polynomial of degree 10
// in the segment's parameter, fitted to the method's curve about its middle. Even
// and odd powers apart, and low and high ones: short chains of operations instead of a long
// one. The middle comes last: what is added to it is small, and so are its roundings.
// Twin: src/cpu/evaluate_polynomial.rs.

struct Segment {
    // The coefficients of 1, s, s², … s¹⁰.
    coefficients: array<vec4f, 11>,
}

// `s`: the parameter, -1/2 to 1/2 over the segment.
fn evaluate(segment: Segment, s: f32) -> vec4f {
    return polynomial(segment.coefficients, s);
}

fn polynomial(c: array<vec4f, 11>, s: f32) -> vec4f {
    let z = s * s;
    let zz = z * z;
    let even_low = c[4] * z + c[2];
    let even_high = c[8] * z + c[6];
    let even = (c[10] * zz + even_high) * zz + even_low;
    let odd_low = c[3] * z + c[1];
    let odd_high = c[7] * z + c[5];
    let odd = (c[9] * zz + odd_high) * zz + odd_low;
    return c[0] + (odd * s + even * z);
}
