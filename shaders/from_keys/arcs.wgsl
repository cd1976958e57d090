// From keys: arcs between two keys (slerp).
// Twin: src/from_keys/arcs.rs.

struct ArcsHoisted {
    parameter: f32,
}

alias Hoisted = ArcsHoisted;

fn hoisted(first: u32, next: u32, parameter: f32) -> Hoisted {
    return Hoisted(parameter);
}

fn rotation_between(key: u32, start: vec4f, next: u32, all_rows: Hoisted) -> vec4f {
    return evaluate(arc_between(start, continued_key_at(next)), all_rows.parameter);
}
