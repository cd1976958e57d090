// Evaluates one channel of a joint in one layer of an instance.
// Twin: src/twin/crowd_layers.rs.

// The `kind`th channel of a joint in one layer; `layer` counts within the window.
fn layer_value(layer: u32, entry: CrowdEntry, joint: u32, kind: u32) -> vec4f {
    let clip = entry.clip_and_weight & 0xffffu;
    let channel = channel_at((clip * dispatch.joints + joint) * CHANNELS + kind);
    let at = position_at(layer * dispatch.bases + (channel.form_and_base & 0xffffffu));
    return sampled(channel, at);
}
