// Runs that neighbouring invocations evaluate together, and the arguments of one dispatch over them. Where the samples of
// a track are neighbours in the result, the lanes of a run take neighbouring samples in turn. Where tracks are neighbours,
// frame by frame, each lane takes all samples of a run of its track, and neighbouring lanes have neighbouring tracks.

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
    /// The lanes of a run, as a power of two.
    lanes_log2: u32,
    /// The lanes of a run less one, if they have neighbouring samples; 0 if they have neighbouring tracks.
    sample_mask: u32,
    /// The lanes of a run less one, if they have neighbouring tracks; else 0.
    track_mask: u32,
    /// From a sample of a lane to its next one.
    step: u32,
    /// The same as a power of two.
    step_log2: u32,
    /// The distance in the result between neighbouring samples of a track, in values.
    stride: u32,
    /// The invocations that store one line of memory, less one.
    line_mask: u32,
    /// How often the runs are evaluated, where tracks with the same times share them. A layer of workgroups, along z,
    /// evaluates one repetition, or one for each lane of a run.
    repetitions: u32,
    /// The repetitions of a layer of workgroups.
    layer_repetitions: u32,
    /// How many segments the runs of the next repetition are further on.
    segments: u32,
    /// How many constants they are further on.
    constants: u32,
    /// How many values they are further on in the result.
    outputs: u32,
}

/// Consecutive samples of one track that lie in one segment, or hold one constant.
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
    let all = dispatch;
    let steps = vec3u(all.segments, all.outputs, all.constants);
    let listed = vec3u(item.source, item.output + all.first_output, item.key);
    return listed + repetition * steps;
}

// A constant of a run, in a repetition.
fn constant_of_run(index: u32, repetition: u32) -> vec4f {
    return constant_at(index + repetition * dispatch.constants);
}

fn sample_count(item: SpreadRun) -> u32 {
    return item.count & ~(IS_CONSTANT | NEEDS_CARE);
}

// The value at a sample of a run that needs no care and has no key there. `at` is the run's `first` for this sample, and
// `constant` its segment's.
fn evaluate_near(item: SpreadRun, segment: Segment, constant: f32, at: i32) -> vec4f {
    let parameter = near_distance(at) * item.scale + item.offset;
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
