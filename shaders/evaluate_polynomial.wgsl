// The polynomial form: each component of the rotation is a polynomial of degree 10
// in the segment's parameter, fitted to the method's curve about its middle. Even
// and odd powers apart: two short chains of operations instead of a long one.
// Twin: src/cpu/evaluate_polynomial.rs.

struct Segment {
    // The coefficients of 1, s, s², … s¹⁰.
    coefficients: array<vec4f, 11>,
}

// `s`: the parameter, -1/2 to 1/2 over the segment.
fn evaluate(segment: Segment, s: f32) -> vec4f {
    let z = s * s;
    var even = segment.coefficients[10];
    var odd = segment.coefficients[9];
    even = even * z + segment.coefficients[8];
    odd = odd * z + segment.coefficients[7];
    even = even * z + segment.coefficients[6];
    odd = odd * z + segment.coefficients[5];
    even = even * z + segment.coefficients[4];
    odd = odd * z + segment.coefficients[3];
    even = even * z + segment.coefficients[2];
    odd = odd * z + segment.coefficients[1];
    even = even * z + segment.coefficients[0];
    return odd * s + even;
}
