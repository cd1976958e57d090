// The entry point for samples that are told one by one, of which no two need lie in the same
// segment. Joined with `launch`, with a form (`Segment`, `evaluate`), with what reads
// (`segment_at`, `constant_at`, `single_at`), a `store` and `sine_cosine` by the build.

struct Single {
    // Which segment; or which constant, with HOLD.
    source: u32,
    parameter: f32,
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = place_of(invocation, groups);
    if index >= launch.item_count {
        return;
    }
    let single = single_at(launch.first_item + index);
    let is_held = (single.source & HOLD) != 0u;
    let source = single.source & ~HOLD;
    // Both, from the first place where it is the other: branches take both ways in most
    // groups, and every way would store.
    let constant = constant_at(select(0u, source, is_held));
    let segment = segment_at(select(source, 0u, is_held));
    let own = canonical(evaluate(segment, single.parameter));
    store(launch.first_output + index, select(own, constant, is_held));
}
