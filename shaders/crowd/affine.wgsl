// The product of affine matrices, each of three rows.
// Twin: src/twin/crowd_matrices.rs.

// A row of the product: this row times the rows of the other matrix.
fn row_product(row: vec4f, first: vec4f, second: vec4f, third: vec4f) -> vec4f {
    let sum = (first * row.x + second * row.y) + third * row.z;
    return canonical(vec4f(sum.x, sum.y, sum.z, sum.w + row.w));
}
