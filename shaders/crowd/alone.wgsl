// Instances of one layer: nothing is laid over it.
// Twin: src/twin/crowd_layers.rs.

// The `kind`th channel of a joint; `instance` counts within the window.
fn layered(instance: u32, joint: u32, kind: u32) -> vec4f {
    return layer_value(instance, entries[dispatch.first_instance + instance], joint, kind);
}
