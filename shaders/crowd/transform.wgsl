// The rows of the affine matrix T R S.
// Twin: src/twin/crowd_matrices.rs.

// A row of R with the columns scaled, and the translation behind it.
fn transform_row(axis: vec3f, scale: vec4f, moved: f32) -> vec4f {
    let row = canonical(vec4f(axis, 0.0));
    return canonical(vec4f(row.x * scale.x, row.y * scale.y, row.z * scale.z, moved));
}
