// The arguments of one dispatch whose neighbouring invocations take neighbouring tracks, and which
// samples those are.

/// The arguments of one dispatch over a grid of samples, frame by frame: each track is a row, and a
/// position is a sample's number.
struct Grid {
    /// The option of the store: the order of a matrix, the axes of angles.
    detail: u32,
    /// Distance in the result between neighbouring samples of a track, in rotations.
    stride: u32,
    /// Number of positions of a row.
    samples: u32,
    /// How many rows.
    rows: u32,
    /// Where the first position of the first row is stored.
    first_output: u32,
    /// The block of the first positions of the first row.
    first_block: u32,
}

/// Which items the samples of 32 neighbouring positions belong to.
struct Block {
    /// The item of the first position.
    first: u32,
    /// A bit for each position at which the next item begins, the lowest for the first.
    starts: u32,
}

const WORKGROUP: u32 = 64;

// Samples of an invocation.
const SAMPLES_EACH: u32 = 8;

// Set in a `source` or a `count`: it is a constant that is stored as it is, not a segment.
const IS_CONSTANT: u32 = 0x80000000;

// Set in a `count`: a component of the segment may pass near 0.
const MAY_BE_TINY: u32 = 0x40000000;

// Positions of a block.
const BLOCK_SAMPLES: u32 = 32;

// Neighbours that store one line of 128 bytes, where a rotation has 16.
const LINE: u32 = 8;

var<immediate> dispatch: Grid;

// Where the samples of an invocation begin.
struct Corner {
    // The position.
    first: u32,
    // The distance from the beginning of the first row's line.
    column: u32,
    // The block of all of them, in the row in which `column` would be 0.
    block: u32,
}

struct Cell {
    output: u32,
    // The row, and the position in it.
    row: u32,
    position: u32,
    block: u32,
    is_inside: bool,
}

fn corner_of(group: vec3u, groups: vec3u, lane: u32) -> Corner {
    let tile = group.y * groups.x + group.x;
    let line = lane / LINE;
    let within = lane & (LINE - 1u);
    let first = (group.z * (WORKGROUP / LINE) + line) * SAMPLES_EACH;
    let block = dispatch.first_block + (first / BLOCK_SAMPLES) * dispatch.rows;
    return Corner(first, tile * LINE + within, block);
}

// The sample that an invocation takes in its `iteration`. Eight neighbours always store at eight
// neighbouring cells, the first of which is a multiple of eight. An invocation's own samples are
// those of consecutive frames.
fn cell_of(corner: Corner, iteration: u32) -> Cell {
    let sample = corner.first + iteration;
    let row = sample * dispatch.stride + dispatch.first_output;
    let output = (row & ~(LINE - 1u)) + corner.column;
    // A position before the row wraps to a large number.
    let track = output - row;
    let is_inside = (sample < dispatch.samples) & (track < dispatch.rows);
    return Cell(output, track, sample, corner.block + track, is_inside);
}
