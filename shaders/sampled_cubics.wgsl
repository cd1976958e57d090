// Cubics for `sampled`. Joined with `gentle`, `canonical`, and what reads (`joint_at`).
// Twin: src/cpu/cubic_lanes.rs.

// What is the same for all rows.
struct Known {
    first: Joint,
    last: Joint,
    parameter: f32,
}

fn known_of(first: u32, next: u32, parameter: f32) -> Known {
    return Known(joint_at(first), joint_at(next), parameter);
}

// No rotation, 0, where the curve turns too much for `gentle`.
fn between(key: u32, start: vec4f, next: u32, known: Known) -> vec4f {
    let first = known.first;
    let last = known.last;
    let before = signed_at(select(key, key - 1u, first.kind == INNER));
    let after = signed_at(select(next, next + 1u, last.kind == INNER));
    let curve = gentle(before, start, signed_at(next), after, first, last);
    // As `polynomial`, whose other powers are 0.
    let c = curve.powers;
    let s = known.parameter;
    let z = s * s;
    let third = c[3] * s + c[2];
    let high = c[6] * z + (c[5] * s + c[4]);
    let gain = high * (z * z) + (third * z + c[1] * s);
    return select(vec4f(0.0), c[0] + gain, curve.holds);
}
