// A rotation where all rotations are arcs. Some devices take both ways of a branch; here is none.
// Twin: src/twin/crowd_layers.rs.

// An arc where its time base stands. The first cell is 0: a constant or a key is an arc without a tangent, whose
// middle stays as it is.
fn arc_value(channel: CrowdChannel, at: CrowdPosition) -> vec4f {
    let is_key = (at.span & ON_KEY) != 0u;
    let along = (at.span & TICKS) * channel.count;
    let middle = channel.first + along * 2u;
    let key_or_first = cell_at(select(middle, channel.keys + along, is_key));
    let tangent = cell_at(select(middle + channel.count, 0u, is_key | (channel.count == 0u)));
    return canonical(evaluate(Segment(key_or_first, tangent), at.parameter));
}
