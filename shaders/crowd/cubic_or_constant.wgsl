// A translation or a scale, for cards: most are constant, and neighbours are so together.
// Twin: src/twin/crowd_layers.rs.

// A cubic where its time base stands, or a constant.
fn cubic_value(channel: CrowdChannel, at: CrowdPosition) -> vec4f {
    if channel.count == 0u {
        return cell_at(channel.first);
    }
    let is_key = (at.span & ON_KEY) != 0u;
    let along = (at.span & TICKS) * channel.count;
    let first = channel.first + along * 4u;
    let second = first + channel.count;
    let third = second + channel.count;
    let key_or_first = cell_at(select(first, channel.keys + along, is_key));
    let value = cubic(
        key_or_first,
        cell_at(second),
        cell_at(third),
        cell_at(third + channel.count),
        at.parameter,
    );
    return select(canonical(value), key_or_first, is_key);
}
