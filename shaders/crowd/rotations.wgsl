// Stores the rotation of every joint of every instance.
// Twin: src/twin/crowd_layers.rs.

// `place` is a joint of an instance.
fn crowd_work(place: u32) {
    let instance = place / dispatch.joints;
    store(place, layered(instance, place - instance * dispatch.joints, ROTATION));
}
