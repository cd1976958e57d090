// A translation or a scale. Some devices take both ways of a branch; here is none.
// Twin: src/twin/crowd_layers.rs.

// A cubic where its time base stands, as `crowd/plain_arc` has arcs: a constant or a key is one without other
// coefficients.
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
