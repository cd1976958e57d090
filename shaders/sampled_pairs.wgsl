// Two keys alone by smooth methods, for `sampled`. Joined with `steady`, `polynomial`, `arc`,
// `evaluate_arc`, `sine_cosine` and `canonical`.
// Twin: src/cpu/sample_lanes.rs.

// What is the same for all rows.
struct Known {
    parameter: f32,
}

fn known_of(first: u32, next: u32, parameter: f32) -> Known {
    return Known(parameter);
}

fn between(key: u32, start: vec4f, next: u32, known: Known) -> vec4f {
    let coefficients = steady(arc(start, signed_at(next)));
    return polynomial(coefficients, known.parameter);
}
