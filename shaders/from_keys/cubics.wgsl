// From keys: cubics between four keys that turn through small angles.
// Twin: src/from_keys/cubics.rs.

struct CubicsHoisted {
    first: TangentWeights,
    last: TangentWeights,
    parameter: f32,
}

alias Hoisted = CubicsHoisted;

fn hoisted(first: u32, next: u32, parameter: f32) -> Hoisted {
    return Hoisted(weights_at(first), weights_at(next), parameter);
}

// 0, which is no rotation, where the curve turns too far for the small-angle series: the CPU
// prepares that interval and overwrites the sample.
fn rotation_between(key: u32, start: vec4f, next: u32, all_rows: Hoisted) -> vec4f {
    let first = all_rows.first;
    let last = all_rows.last;
    let before = continued_key_at(select(key, key - 1u, first.kind == KEY_INNER));
    let after = continued_key_at(select(next, next + 1u, last.kind == KEY_INNER));
    let curve = small_angle_cubic(before, start, continued_key_at(next), after, first, last);
    // As `polynomial`, whose powers above the sixth are 0.
    let c = curve.powers;
    let s = all_rows.parameter;
    let z = s * s;
    let third = c[3] * s + c[2];
    let high = c[6] * z + (c[5] * s + c[4]);
    let gain = high * (z * z) + (third * z + c[1] * s);
    return select(vec4f(0.0), c[0] + gain, curve.is_valid);
}
