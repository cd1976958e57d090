// What a dispatch is told, for `kernel` and `kernel_singles`.

struct Launch {
    // The items, or samples, of this dispatch: their place in what is listed, and how many.
    first_item: u32,
    item_count: u32,
    // Distance in the result between neighbouring samples of a track.
    stride: u32,
    // What the store has to know: the order of a matrix, the axes of angles.
    detail: u32,
    // Where the first of single samples is stored; the others follow.
    first_output: u32,
}

const WORKGROUP: u32 = 64;
const HOLD: u32 = 0x80000000;

var<immediate> launch: Launch;

// The place of an invocation among those of a dispatch.
fn place_of(invocation: vec3u, groups: vec3u) -> u32 {
    return invocation.y * (groups.x * WORKGROUP) + invocation.x;
}
