// Entry point of the kernels over poses that are there already. The build joins it with a file
// of `poses/`, which has `pose`.

/// What the host says of one dispatch over poses.
struct PoseDispatch {
    /// Values, and an invocation for each.
    count: u32,
    /// What the kernel has to know beside: the number of layers, or of tracks.
    detail: u32,
}

const POSE_WORKGROUP: u32 = 64;

var<immediate> dispatch: PoseDispatch;

@compute @workgroup_size(POSE_WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let place = invocation.y * (groups.x * POSE_WORKGROUP) + invocation.x;
    if place < dispatch.count {
        pose(place);
    }
}
