// The arguments of one dispatch over segments, and the index of an invocation in it.

/// The arguments of one dispatch over segments.
struct Dispatch {
    /// The first work item, or listed sample, of this dispatch.
    first_item: u32,
    /// How many of them it evaluates.
    item_count: u32,
    /// Distance in the result between neighbouring samples of a track, in rotations.
    stride: u32,
    /// The option of the store: the order of a matrix, the axes of angles.
    detail: u32,
    /// Where the first listed sample is stored; the others follow. For items, what is added to their
    /// `output`.
    first_output: u32,
    /// Invocations before the first listed sample, which do nothing: so neighbours begin to store
    /// where a line of memory begins. `first_item` and `first_output` count them too.
    idle: u32,
}

const WORKGROUP: u32 = 64;

// Set in a `source`: it is the index of a constant that is stored as it is, not of a segment.
const IS_CONSTANT: u32 = 0x80000000;

var<immediate> dispatch: Dispatch;

fn invocation_index(invocation: vec3u, groups: vec3u) -> u32 {
    return invocation.y * (groups.x * WORKGROUP) + invocation.x;
}
