// The arc form: constant angular velocity along a great circle, about the arc's
// middle, so that the angle stays within half of the arc.
// Twin: src/cpu/evaluate_arc.rs.

struct Segment {
    // The rotation half way along the arc.
    middle: vec4f,
    // The unit quaternion orthogonal to it, in the plane of the arc.
    partner: vec4f,
}

// `angle`: half-angle from the middle of the arc.
fn evaluate(segment: Segment, angle: f32) -> vec4f {
    let turn = sine_cosine(angle);
    return segment.middle * turn.y + segment.partner * turn.x;
}
