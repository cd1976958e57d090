// The channels of a joint where instances have one layer and the rotations of all clips are arcs. Some
// devices take both ways of a branch; here is none.
// Twin: src/twin/crowd_layers.rs.

const ROTATION: u32 = 0;
const TRANSLATION: u32 = 1;
const SCALE: u32 = 2;

// A cubic likewise.
fn cubic_value(channel: CrowdChannel, at: CrowdPosition) -> vec4f {
    let is_key = (at.span & ON_KEY) != 0u;
    let is_constant = channel.count == 0u;
    let along = (at.span & TICKS) * channel.count;
    let first = channel.first + along * 4u;
    let second = first + channel.count;
    let third = second + channel.count;
    let key_or_first = cell_at(select(first, channel.keys + along, is_key));
    let value = cubic(
        key_or_first,
        cell_at(select(second, 0u, is_constant)),
        cell_at(select(third, 0u, is_constant)),
        cell_at(select(third + channel.count, 0u, is_constant)),
        at.parameter,
    );
    return select(canonical(value), key_or_first, is_key);
}

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
