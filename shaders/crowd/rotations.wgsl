// Stores the rotation of every joint of every instance.
// Twin: src/twin/crowd_layers.rs.

@group(0) @binding(4) var<storage, read_write> turned: array<vec4f>;

// `place` is a joint of an instance.
fn crowd_work(place: u32) {
    let instance = place / dispatch.joints;
    turned[place] = layered(instance, place - instance * dispatch.joints, ROTATION);
}
