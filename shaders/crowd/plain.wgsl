// The channels of a joint where instances have one layer and the rotations of all clips are arcs.
// Twin: src/twin/crowd_layers.rs.

const ROTATION: u32 = 0;
const TRANSLATION: u32 = 1;
const SCALE: u32 = 2;

// The `kind`th channel of a joint; `instance` counts within the window.
fn layered(instance: u32, joint: u32, kind: u32) -> vec4f {
    let clip = entry_at(dispatch.first_instance + instance).clip_and_weight & 0xffffu;
    let channel = channel_at((clip * dispatch.joints + joint) * CHANNELS + kind);
    let at = position_at(instance * dispatch.bases + (channel.form_and_base & 0xffffffu));
    if kind == ROTATION {
        return arc_value(channel, at);
    }
    return cubic_value(channel, at);
}
