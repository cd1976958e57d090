// Walks a level of the skeleton: matrices in their parents' frames become matrices in the model.
// Twin: src/twin/crowd_matrices.rs.

// `place` is a joint of the level, of an instance; `dispatch.layers` is the number of joints of the
// skeleton.
fn crowd_work(place: u32) {
    let instance = place / dispatch.joints;
    let link = links[dispatch.first_link + (place - instance * dispatch.joints)];
    let above = (instance * dispatch.layers + link.parent) * 3u;
    let own = (instance * dispatch.layers + link.joint) * 3u;
    let first = matrices[own];
    let second = matrices[own + 1u];
    let third = matrices[own + 2u];
    matrices[own] = row_product(matrices[above], first, second, third);
    matrices[own + 1u] = row_product(matrices[above + 1u], first, second, third);
    matrices[own + 2u] = row_product(matrices[above + 2u], first, second, third);
}
