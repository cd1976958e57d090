// Entry point of the kernels over a crowd. It is joined with `crowd/dispatch` and a file of `crowd/`, which has
// `crowd_work`.

@compute @workgroup_size(CROWD_WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = invocation.y * (groups.x * CROWD_WORKGROUP) + invocation.x;
    if index < dispatch.count {
        crowd_work(index);
    }
}
