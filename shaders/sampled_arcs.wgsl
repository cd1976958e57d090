// Arcs for `sampled`. Joined with `arc`, `evaluate_arc`, `sine_cosine` and `canonical`.
// Twin: src/cpu/sample_lanes.rs.

// What is the same for all rows.
struct Known {
    parameter: f32,
}

fn known_of(first: u32, next: u32, parameter: f32) -> Known {
    return Known(parameter);
}

fn between(key: u32, start: vec4f, next: u32, known: Known) -> vec4f {
    return evaluate(arc(start, signed_at(next)), known.parameter);
}
