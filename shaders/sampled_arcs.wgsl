// Arcs for `sampled`. Joined with `arc`, `evaluate_arc`, `sine_cosine` and `canonical`.
// Twin: src/cpu/sample_lanes.rs.

// What is the same for all rows.
struct Known {
    parameter: f32,
}

fn known_of(sample: Sample) -> Known {
    return Known(sample.parameter);
}

fn between(key: u32, known: Known) -> vec4f {
    return evaluate(arc(signed(key), signed(key + 1u)), known.parameter);
}
