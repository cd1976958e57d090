// The entry point for runs of samples. Joined with `launch`, with a form (`Segment`,
// `evaluate`), with what reads (`segment_at`, `constant_at`, `item_at`, `distance_at`), a
// `distance_from_middle`, a `store` and `sine_cosine` by the build.

// A run of samples of one track that lie in one segment, or hold one constant.
struct Item {
    // Which segment; or which constant, when `count` carries HOLD.
    source: u32,
    // Where the first sample is stored.
    output: u32,
    // Number of samples, at most ITEM_SAMPLES; with HOLD for a constant.
    count: u32,
    // The first sample's distance from the segment's middle: frames, or the place
    // of its entry in `distances`.
    first: i32,
    // parameter = distance * scale + offset
    scale: f32,
    offset: f32,
}

const ITEM_SAMPLES: u32 = 16;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = place_of(invocation, groups);
    if index >= launch.item_count {
        return;
    }
    let item = item_at(launch.first_item + index);
    let stride = launch.stride;
    var output = item.output;
    if (item.count & HOLD) != 0u {
        let constant = constant_at(item.source);
        let count = item.count & ~HOLD;
        for (var j = 0u; j < count; j++) {
            store(output, constant);
            output += stride;
        }
        return;
    }
    let segment = segment_at(item.source);
    for (var j = 0u; j < item.count; j++) {
        let parameter = distance_from_middle(item.first, j) * item.scale + item.offset;
        store(output, canonical(evaluate(segment, parameter)));
        output += stride;
    }
}
