// Entry point: an invocation evaluates a work item, some consecutive samples of one segment.
// It is joined with a form (`Segment`, `evaluate`), with the functions that read buffers
// (`segment_at`, `constant_at`, `item_at`), a `distance_from_middle` and a `store`.

const ITEM_SAMPLES: u32 = 16;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = invocation_index(invocation, groups);
    if index >= dispatch.item_count {
        return;
    }
    let item = item_at(dispatch.first_item + index);
    let stride = dispatch.stride;
    var output = item.output + dispatch.first_output;
    if (item.count & IS_CONSTANT) != 0u {
        let constant = constant_at(item.source);
        let count = item.count & ~IS_CONSTANT;
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
