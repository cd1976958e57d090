// Stores rotations as 3 × 4 matrices whose translation is 0, twelve numbers each.
// Twin: src/twin/matrix.rs.
// Needs: math/matrix.

alias Stored = vec4f;

const PARTS: u32 = 3;

fn parts(rotation: vec4f) -> array<Stored, PARTS> {
    let detail = dispatch.detail;
    let rows = matrix_rows(rotation, detail);
    let first = canonical(vec4f(rows.first, 0.0));
    let second = canonical(vec4f(rows.second, 0.0));
    let third = canonical(vec4f(rows.third, 0.0));
    // Row by row each row ends in a 0; column by column the fourth column is 0.
    let by_columns = detail == 1u;
    return array<Stored, PARTS>(
        select(first, vec4f(first.xyz, second.x), by_columns),
        select(second, vec4f(second.yz, third.xy), by_columns),
        select(third, vec4f(third.z, 0.0, 0.0, 0.0), by_columns),
    );
}

fn store(index: u32, rotation: vec4f) {
    var all = parts(rotation);
    for (var part = 0u; part < PARTS; part++) {
        rotations[index * PARTS + part] = all[part];
    }
}
