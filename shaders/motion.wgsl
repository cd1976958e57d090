// Entry point of the kernels over the states of a library's clips. It is joined with a file of `motion/`, which has
// `motion_work`.

/// The arguments of one dispatch over the states of a library's clips.
struct MotionDispatch {
    /// The number of invocations with work.
    count: u32,
    /// The first sample of the window.
    first_sample: u32,
    /// Joints of the skeleton.
    joints: u32,
    /// Joints that have a parent.
    links: u32,
    /// 1 where velocities are derivatives of the curves, else 0.
    moves: u32,
    /// Ticks in a second.
    ticks_per_second: f32,
    /// The vector of each joint's state that is stored.
    vector: u32,
    /// How many numbers of it, or of its matrix, are stored.
    numbers: u32,
    /// 1 where matrices are stored column by column, 0 where row by row.
    detail: u32,
}

const MOTION_WORKGROUP: u32 = 64;

// The vectors of a joint's state. Positions and velocities have three numbers and a 0.
const LOCAL_ROTATION: u32 = 0;
const WORLD_ROTATION: u32 = 1;
const POSITION: u32 = 2;
const VELOCITY: u32 = 3;
const ANGULAR_VELOCITY: u32 = 4;
const STATE_VECTORS: u32 = 5;

var<immediate> dispatch: MotionDispatch;

@compute @workgroup_size(MOTION_WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = invocation.y * (groups.x * MOTION_WORKGROUP) + invocation.x;
    if index < dispatch.count {
        motion_work(index);
    }
}

fn canonical3(v: vec3f) -> vec4f {
    return canonical(vec4f(v, 0.0));
}
