// Entry point of the kernels over a crowd. It is joined with a file of `crowd/`, which has
// `crowd_work`.

/// The arguments of one dispatch over a crowd.
struct CrowdDispatch {
    /// The number of invocations with work.
    count: u32,
    /// The first instance of the window that is evaluated.
    first_instance: u32,
    /// Joints of the skeleton; when it is walked, joints of the level.
    joints: u32,
    /// Layers of an instance.
    layers: u32,
    /// The most time bases of a clip.
    bases: u32,
    /// The first link of the level.
    first_link: u32,
    /// The clock, ticks: the lower 32 bits.
    clock_low: u32,
    /// The clock's upper bits.
    clock_high: u32,
    /// The cell of the first mask.
    masks: u32,
    /// The cell of the first reference pose.
    references: u32,
}

const CROWD_WORKGROUP: u32 = 64;

var<immediate> dispatch: CrowdDispatch;

@compute @workgroup_size(CROWD_WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let place = invocation.y * (groups.x * CROWD_WORKGROUP) + invocation.x;
    if place < dispatch.count {
        crowd_work(place);
    }
}
