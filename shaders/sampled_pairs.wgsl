// Two keys alone by smooth methods, for `sampled`. Joined with `steady`, `arc`,
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
    let c = steady(arc(start, signed_at(next)));
    // As `evaluate_polynomial`.
    let s = known.parameter;
    let z = s * s;
    let zz = z * z;
    let even = (c[10] * zz + (c[8] * z + c[6])) * zz + (c[4] * z + c[2]);
    let odd = (c[9] * zz + (c[7] * z + c[5])) * zz + (c[3] * z + c[1]);
    return c[0] + (odd * s + even * z);
}
