// Stores rotations as 3 × 3 matrices, nine numbers each.
// Twin: src/twin/matrix.rs.
// Needs: math/matrix.

alias Stored = f32;

const PARTS: u32 = 9;

fn parts(rotation: vec4f) -> array<Stored, PARTS> {
    let rows = matrix_rows(rotation, dispatch.detail);
    let first = canonical(vec4f(rows.first, 0.0));
    let second = canonical(vec4f(rows.second, 0.0));
    let third = canonical(vec4f(rows.third, 0.0));
    return array<Stored, PARTS>(
        first.x, first.y, first.z, second.x, second.y, second.z, third.x, third.y, third.z,
    );
}

fn store(index: u32, rotation: vec4f) {
    var all = parts(rotation);
    for (var part = 0u; part < PARTS; part++) {
        rotations[index * PARTS + part] = all[part];
    }
}
