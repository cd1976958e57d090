// The polynomial form: each component of the rotation is a polynomial of degree 10 in the
// segment's parameter, fitted to the method's curve about its middle.
// Twin: src/twin/evaluate_polynomial.rs.

/// A curve as one polynomial for each component.
struct PolynomialSegment {
    /// The coefficients of 1, s, s², … s¹⁰.
    coefficients: array<vec4f, 11>,
}

alias Segment = PolynomialSegment;

// `s` runs from -1/2 to 1/2 over the segment.
fn evaluate(segment: Segment, s: f32) -> vec4f {
    return polynomial(segment.coefficients, s);
}
