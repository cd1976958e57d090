// Entry point: an invocation evaluates one listed sample; no two need lie in the same segment.
// The build joins it with a form (`Segment`, `evaluate`), with the functions that read
// (`segment_at`, `constant_at`, `sample_at`) and a `store`.

/// One sample.
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
    if index >= dispatch.item_count {
        return;
    }
    let sample = sample_at(dispatch.first_item + index);
    let is_constant = (sample.source & IS_CONSTANT) != 0u;
    let source = sample.source & ~IS_CONSTANT;
    // Both are read, and the one that is not meant is the first of its list: a branch would be
    // taken both ways in most groups, and each way would store.
    let constant = constant_at(select(0u, source, is_constant));
    let segment = segment_at(select(source, 0u, is_constant));
    let own = canonical(evaluate(segment, sample.parameter));
    store(dispatch.first_output + index, select(own, constant, is_constant));
}
