// Walks a level of the skeleton: matrices in their parents' frames become matrices in the model.
// Twin: src/twin/crowd_matrices.rs.

// `index` is a joint of the level, of an instance; `dispatch.layers` is the number of joints of the
// skeleton.
fn crowd_work(index: u32) {
    let instance = index / dispatch.joints;
    let link = links[dispatch.first_link + (index - instance * dispatch.joints)];
    let above = (instance * dispatch.layers + link.parent) * 3u;
    let row = (instance * dispatch.layers + link.joint) * 3u;
    let first = matrices[row];
    let second = matrices[row + 1u];
    let third = matrices[row + 2u];
    matrices[row] = row_product(matrices[above], first, second, third);
    matrices[row + 1u] = row_product(matrices[above + 1u], first, second, third);
    matrices[row + 2u] = row_product(matrices[above + 2u], first, second, third);
}
