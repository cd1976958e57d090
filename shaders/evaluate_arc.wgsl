// The arc form: constant angular velocity along a great circle, about the arc's
// middle, so that the angle stays within half of the arc.
// Twin: src/cpu/evaluate_arc.rs.

struct Segment {
    // The rotation half way along the arc.
    middle: vec4f,
    // Its derivative there: orthogonal to it in the plane of the arc, and as long as the
    // arc's angle in R4.
    tangent: vec4f,
}

// `parameter`: from -1/2 to 1/2.
fn evaluate(segment: Segment, parameter: f32) -> vec4f {
    let z = parameter * parameter * square(segment.tangent);
    let turn = short_sine_and_fall(parameter, z);
    return segment.middle + (segment.middle * turn.y + segment.tangent * turn.x);
}

fn square(q: vec4f) -> f32 {
    return q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
}
