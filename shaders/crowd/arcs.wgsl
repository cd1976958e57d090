// Stores the rotation of every joint of every instance, where instances have one layer and clips only
// arcs. Some devices take both ways of a branch; here is none.
// Twin: src/twin/crowd_layers.rs.

@group(0) @binding(0) var<storage, read> entries: array<CrowdEntry>;
@group(0) @binding(1) var<storage, read> channels: array<CrowdChannel>;
@group(0) @binding(2) var<storage, read> cells: array<vec4f>;
@group(0) @binding(3) var<storage, read> places: array<CrowdPlace>;
@group(0) @binding(4) var<storage, read_write> turned: array<vec4f>;

// An arc where its time base stands. The first cell is 0: a constant is an arc without a tangent.
fn arc_value(channel: CrowdChannel, place: CrowdPlace) -> vec4f {
    let is_key = (place.span & ON_KEY) != 0u;
    let along = (place.span & TICKS) * channel.count;
    let middle = channel.first + along * 2u;
    let own = cells[select(middle, channel.keys + along, is_key)];
    let tangent = cells[select(middle + channel.count, 0u, channel.count == 0u)];
    return select(canonical(evaluate(Segment(own, tangent), place.parameter)), own, is_key);
}

// `place` is a joint of an instance.
fn crowd_work(place: u32) {
    let instance = place / dispatch.joints;
    let joint = place - instance * dispatch.joints;
    let clip = entries[dispatch.first_instance + instance].clip_and_weight & 0xffffu;
    let channel = channels[(clip * dispatch.joints + joint) * CHANNELS];
    let base = channel.form_and_base & 0xffffffu;
    turned[place] = arc_value(channel, places[instance * dispatch.bases + base]);
}
