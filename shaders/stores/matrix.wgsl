// What both matrix stores share.
// Twin: src/twin/matrix.rs.

alias Stored = f32;

fn store_row(place: u32, row: vec3f) {
    let settled = canonical(vec4f(row, 0.0));
    rotations[place] = settled.x;
    rotations[place + 1u] = settled.y;
    rotations[place + 2u] = settled.z;
}
