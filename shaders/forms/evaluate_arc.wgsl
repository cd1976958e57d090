// The arc form: constant angular velocity along a great circle, written about the middle of the
// arc, so that the angle never passes half of the arc.
// Twin: src/twin/evaluate_arc.rs.

/// A great-circle arc about its middle.
struct ArcSegment {
    /// The rotation half way along the arc.
    middle: vec4f,
    /// Its derivative there: orthogonal to it in the plane of the arc, and as long as the arc's
    /// angle in R⁴.
    tangent: vec4f,
}

alias Segment = ArcSegment;

// `parameter` runs from -1/2 to 1/2 over the segment.
fn evaluate(segment: Segment, parameter: f32) -> vec4f {
    return evaluate_with(segment, constant_of(segment), parameter);
}

// A number that is the same for all samples of a segment.
fn constant_of(segment: Segment) -> f32 {
    return norm_squared(segment.tangent);
}

fn evaluate_with(segment: Segment, square: f32, parameter: f32) -> vec4f {
    let z = parameter * parameter * square;
    let sines = sine_cosm1_quarter(parameter, z);
    return segment.middle + (segment.middle * sines.y + segment.tangent * sines.x);
}

fn norm_squared(q: vec4f) -> f32 {
    return q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
}
