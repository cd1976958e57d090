// The arguments of one dispatch whose invocations take a sample each, and which sample that is.

/// The arguments of one dispatch over a grid of samples. Track by track (`stride` is 1), the
/// samples of all tracks are one row, and a sample's position is the place where it is stored.
/// Frame by frame each track is a row, and a position is a sample's number.
struct Grid {
    /// What the store needs beside the rotation: the order of a matrix, the axes of angles.
    detail: u32,
    /// Distance in the result between neighbouring samples of a track, in rotations.
    stride: u32,
    /// Number of positions of a row.
    samples: u32,
    /// How many rows.
    rows: u32,
    /// Where the first position of the first row is stored; track by track that is a multiple of
    /// `BLOCK_SAMPLES`.
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

// Eight rows of 32 samples, which read the same constants again and again.
const GRID_WORKGROUP: u32 = 256;

// Set in a `source` or a `count`: it is a constant that is stored as it is, not a segment.
const IS_CONSTANT: u32 = 0x80000000;

// Set in a `count`: a component of the segment may pass near 0.
const MAY_BE_TINY: u32 = 0x40000000;

// Positions of a block.
const BLOCK_SAMPLES: u32 = 32;

// Neighbours that store one line of 128 bytes, where a rotation has 16.
const LINE: u32 = 8;


var<immediate> dispatch: Grid;

struct Cell {
    place: u32,
    position: u32,
    block: u32,
    is_inside: bool,
}

// The sample of an invocation. Eight neighbours always store at eight neighbouring places, the
// first of which is a multiple of eight.
fn cell_of(group: vec3u, groups: vec3u, lane: u32) -> Cell {
    let tile = group.y * groups.x + group.x;
    if dispatch.stride == 1u {
        let index = tile * GRID_WORKGROUP + lane;
        let place = dispatch.first_output + index;
        let block = dispatch.first_block + index / BLOCK_SAMPLES;
        return Cell(place, place, block, index < dispatch.samples);
    }
    let sample = group.z * (GRID_WORKGROUP / LINE) + lane / LINE;
    let row = sample * dispatch.stride + dispatch.first_output;
    let place = (row & ~(LINE - 1u)) + tile * LINE + (lane & (LINE - 1u));
    // What lies before the row wraps to a large number.
    let track = place - row;
    let block = dispatch.first_block + (sample / BLOCK_SAMPLES) * dispatch.rows + track;
    return Cell(place, sample, block, (sample < dispatch.samples) & (track < dispatch.rows));
}
