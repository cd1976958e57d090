// Stores rotations as 3 × 4 matrices whose translation is 0, twelve numbers each.
// Twin: src/twin/matrix.rs.
// Needs: math/matrix.

alias Stored = vec4f;

fn store(place: u32, rotation: vec4f) {
    let detail = dispatch.detail;
    let rows = matrix_rows(rotation, detail);
    let first = canonical(vec4f(rows.first, 0.0));
    let second = canonical(vec4f(rows.second, 0.0));
    let third = canonical(vec4f(rows.third, 0.0));
    // Row by row each row ends in a 0; column by column the fourth column is 0.
    let by_columns = detail == 1u;
    let at = place * 3u;
    rotations[at] = select(first, vec4f(first.xyz, second.x), by_columns);
    rotations[at + 1u] = select(second, vec4f(second.yz, third.xy), by_columns);
    rotations[at + 2u] = select(third, vec4f(third.z, 0.0, 0.0, 0.0), by_columns);
}
