// Makes skinning matrices of matrices in the model: each times the inverse bind matrix of its joint.
// Twin: src/twin/crowd_matrices.rs.

@group(0) @binding(0) var<storage, read> bind: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> matrices: array<vec4f>;

// `index` is a row of a matrix of a joint of an instance; `dispatch.joints` counts the skeleton's.
fn crowd_work(index: u32) {
    let matrix = index / 3u;
    let instance = matrix / dispatch.joints;
    let first = (matrix - instance * dispatch.joints) * 3u;
    matrices[index] = row_product(matrices[index], bind[first], bind[first + 1u], bind[first + 2u]);
}
