// Runs that neighbouring invocations evaluate together, and the arguments of one dispatch over them.

/// The arguments of one dispatch over spread runs.
struct Spread {
    /// The option of the store: the order of a matrix, the axes of angles.
    detail: u32,
    /// The first run of this dispatch.
    first_item: u32,
    /// How many runs it evaluates.
    item_count: u32,
    /// The number that is added to their `output`.
    first_output: u32,
    /// The invocations of a run, as a power of two.
    lanes_log2: u32,
    /// The invocations that store one line of memory, less one.
    line_mask: u32,
    /// How many segments the runs of the next repetition are further on, where tracks with the same times share their
    /// runs. A repetition is a layer of workgroups.
    segments: u32,
    /// How many constants they are further on.
    constants: u32,
    /// How many values they are further on in the result.
    outputs: u32,
}

/// Consecutive samples of one track that lie in one segment, or hold one constant. Its invocations take
/// neighbouring samples in turn.
struct SpreadRun {
    /// The segment's index; the constant's, when `count` carries `IS_CONSTANT`.
    source: u32,
    /// Where the first sample is stored, counted from where the dispatch's first is.
    output: u32,
    /// Number of samples, with the bit `IS_CONSTANT` if they are a constant, and the bit `NEEDS_CARE` if a
    /// component may pass near 0 or a distance is not exact in f32.
    count: u32,
    /// For frames, the first sample's distance from the segment's middle; for explicit times, the
    /// index of its distance in the list of distances.
    first: i32,
    /// parameter = distance * scale + offset
    scale: f32,
    offset: f32,
    /// The constant that is stored instead of the first sample; `NO_KEY` if there is none.
    key: u32,
    /// The most iterations that a run of the same workgroup takes.
    iterations: u32,
}

const SPREAD_WORKGROUP: u32 = 128;

// Set in a `count`: the samples are a constant that is stored as it is, not a segment's.
const IS_CONSTANT: u32 = 0x80000000;

// Set in a `count`: the samples need the filter of tiny components, or distances converted in two halves.
const NEEDS_CARE: u32 = 0x40000000;

const NO_KEY: u32 = 0xffffffff;

// Neighbours that store one line of 128 bytes, where a rotation has 16.
const LINE: u32 = 8;

var<immediate> dispatch: Spread;

// Where a run of a repetition finds its segment (x) and its key (z), and stores its first sample (y).
fn location_of(item: SpreadRun, repetition: u32) -> vec3u {
    let steps = vec3u(dispatch.segments, dispatch.outputs, dispatch.constants);
    let listed = vec3u(item.source, item.output + dispatch.first_output, item.key);
    return listed + repetition * steps;
}

// A constant of a run, in a repetition.
fn constant_of_run(index: u32, repetition: u32) -> vec4f {
    return constant_at(index + repetition * dispatch.constants);
}

fn sample_count(item: SpreadRun) -> u32 {
    return item.count & ~(IS_CONSTANT | NEEDS_CARE);
}

// The value at the `j`th sample of a run that needs no care and has no key there. `constant` is its segment's.
fn evaluate_near(item: SpreadRun, segment: Segment, constant: f32, j: u32) -> vec4f {
    let parameter = near_distance(item.first, j) * item.scale + item.offset;
    return evaluate_with(segment, constant, parameter);
}

// The value of any run at its `j`th sample.
fn sample_of(item: SpreadRun, segment: Segment, j: u32, repetition: u32) -> vec4f {
    if ((item.count & IS_CONSTANT) != 0u) | ((j == 0u) & (item.key != NO_KEY)) {
        let index = select(item.key, item.source, (item.count & IS_CONSTANT) != 0u);
        return constant_of_run(index, repetition);
    }
    let distance = distance_from_middle(item.first, j);
    let rotation = evaluate(segment, distance * item.scale + item.offset);
    if (item.count & NEEDS_CARE) != 0u {
        return canonical(rotation);
    }
    return rotation;
}
