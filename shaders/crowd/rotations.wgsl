// Stores the rotation of every joint of every instance.
// Twin: src/twin/crowd_layers.rs.

// `index` is a joint of an instance.
fn crowd_work(index: u32) {
    let instance = index / dispatch.joints;
    store(index, layered(instance, index - instance * dispatch.joints, ROTATION));
}
