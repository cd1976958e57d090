// Stores the transform of every joint of every instance in its parent's frame, as the three rows of an
// affine matrix: T R S.
// Twin: src/twin/crowd_matrices.rs.

// `index` is a joint of an instance.
fn crowd_work(index: u32) {
    let instance = index / dispatch.joints;
    let joint = index - instance * dispatch.joints;
    let rows = matrix_rows(layered(instance, joint, ROTATION), 0u);
    let moved = layered(instance, joint, TRANSLATION);
    let scale = layered(instance, joint, SCALE);
    let first = index * 3u;
    store(first, transform_row(rows.first, scale, moved.x));
    store(first + 1u, transform_row(rows.second, scale, moved.y));
    store(first + 2u, transform_row(rows.third, scale, moved.z));
}
