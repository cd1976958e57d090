// Entry point: an invocation evaluates one sample of a sample list; each may lie in another
// segment. It is joined with a form (`Segment`, `evaluate`), with the functions that read
// buffers (`segment_at`, `constant_at`, `sample_at`) and a `store`.

/// One sample of the list.
struct ListedSample {
    /// The segment's index; the constant's, with `IS_CONSTANT`.
    source: u32,
    /// As the form's `evaluate` takes it.
    parameter: f32,
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = invocation_index(invocation, groups);
    if index - dispatch.idle >= dispatch.item_count {
        return;
    }
    let sample = sample_at(dispatch.first_item + index);
    let is_constant = (sample.source & IS_CONSTANT) != 0u;
    let source = sample.source & ~IS_CONSTANT;
    // Both sources are read, the unused one at index 0: in most workgroups a branch would be taken
    // both ways, and each way would need a store of its own.
    let constant = constant_at(select(0u, source, is_constant));
    let segment = segment_at(select(source, 0u, is_constant));
    let value = canonical(evaluate(segment, sample.parameter));
    store(dispatch.first_output + index, select(value, constant, is_constant));
}
