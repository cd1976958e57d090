// Arcs for `sampled`. Joined with `arc`, `evaluate_arc`, `sine_cosine` and `canonical`.
// Twin: src/cpu/sample_lanes.rs.

fn between(key: u32, sample: Sample) -> vec4f {
    return evaluate(arc(signed(key), signed(key + 1u)), sample.parameter);
}
