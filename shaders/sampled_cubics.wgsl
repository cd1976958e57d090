// Cubics for `sampled`. Joined with `gentle`, `canonical`, and what reads (`joint_at`).
// Twin: src/cpu/cubic_lanes.rs.

// What is the same for all rows.
struct Known {
    first: Joint,
    last: Joint,
    parameter: f32,
}

fn known_of(sample: Sample) -> Known {
    let key = sample.key & ~HELD;
    return Known(joint_at(key), joint_at(key + 1u), sample.parameter);
}

// No rotation, 0, where the curve turns too much for `gentle`.
fn between(key: u32, known: Known) -> vec4f {
    let first = known.first;
    let last = known.last;
    let before = select(key, key - 1u, first.kind == INNER);
    let after = select(key + 1u, key + 2u, last.kind == INNER);
    let curve = gentle(signed(before), signed(key), signed(key + 1u), signed(after), first, last);
    // As `evaluate_polynomial`, whose other powers are 0.
    let s = known.parameter;
    let z = s * s;
    let even = ((curve.powers[6] * z + curve.powers[4]) * z + curve.powers[2]) * z
        + curve.powers[0];
    let odd = (curve.powers[5] * z + curve.powers[3]) * z + curve.powers[1];
    return select(vec4f(0.0), odd * s + even, curve.holds);
}
