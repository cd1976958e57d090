// Entry point of the kernels over evaluated poses. It is joined with a file of `poses/`,
// which has `pose`.

/// The arguments of one dispatch over poses.
struct PoseDispatch {
    /// The number of values, each of which has an invocation.
    count: u32,
    /// Another number that the kernel needs: that of the layers, or of the tracks.
    detail: u32,
}

const POSE_WORKGROUP: u32 = 64;

var<immediate> dispatch: PoseDispatch;

@compute @workgroup_size(POSE_WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = invocation.y * (groups.x * POSE_WORKGROUP) + invocation.x;
    if index < dispatch.count {
        pose(index);
    }
}
