// From keys: tracks of two keys, which smooth methods join at constant velocity. The arc is
// evaluated as a polynomial, as the segments of such methods are.
// Twin: src/from_keys/arcs.rs.

struct TwoKeysHoisted {
    parameter: f32,
}

alias Hoisted = TwoKeysHoisted;

fn hoisted(first: u32, next: u32, parameter: f32) -> Hoisted {
    return Hoisted(parameter);
}

fn rotation_between(key: u32, start: vec4f, next: u32, all_rows: Hoisted) -> vec4f {
    let coefficients = constant_velocity(arc_between(start, continued_key_at(next)));
    return polynomial(coefficients, all_rows.parameter);
}
