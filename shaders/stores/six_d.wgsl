// Stores rotations as the first two columns of their matrices, six numbers each. `detail` is 1, for columns.
// Twin: src/twin/matrix.rs.
// Needs: math/matrix.

alias Stored = f32;

const PARTS: u32 = 6;

fn parts(rotation: vec4f) -> array<Stored, PARTS> {
    let columns = matrix_rows(rotation, dispatch.detail);
    let first = canonical(vec4f(columns.first, 0.0));
    let second = canonical(vec4f(columns.second, 0.0));
    return array<Stored, PARTS>(first.x, first.y, first.z, second.x, second.y, second.z);
}

fn store(index: u32, rotation: vec4f) {
    var all = parts(rotation);
    for (var part = 0u; part < PARTS; part++) {
        rotations[index * PARTS + part] = all[part];
    }
}
