// The form of polynomials, as kernels over spread runs call it: no number is the same for all samples.
// Twin: src/twin/evaluate_polynomial.rs.

fn constant_of(segment: Segment) -> f32 {
    return 0.0;
}

fn evaluate_with(segment: Segment, constant: f32, parameter: f32) -> vec4f {
    return evaluate(segment, parameter);
}
