// The entry point of kernels over values that are already there; joined with a `pose`.

struct Pass {
    // Values, and an invocation for each.
    count: u32,
    detail: u32,
}

const PASS_WORKGROUP: u32 = 64;

var<immediate> launch: Pass;

@compute @workgroup_size(PASS_WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let place = invocation.y * (groups.x * PASS_WORKGROUP) + invocation.x;
    if place < launch.count {
        pose(place);
    }
}
