//! Trials of the kernels that evaluate segments: each form with each list, in every encoding of its store.

use crate::fit::constant_velocity::arc_polynomial;
use crate::math::canonical::canonical;
use crate::output::encoding::Encoding;
use crate::shader::{
    ArcSegment, BLOCK_SAMPLES, Block, Dispatch, Form, Grid, IS_CONSTANT, ITEM_SAMPLES, Item,
    Kernel, LINE, List, ListedSample, MAY_BE_TINY, NEEDS_CARE, PolynomialSegment, SAMPLES_EACH,
    SpreadRun, Store, WORKGROUP,
};
use crate::twin::Evaluate;
use crate::twin::arc_between::arc_between;
use crate::work::lists::WorkChunk;
use crate::work::lists::spread::{LaneAxis, NO_RUN, RunRepetitions, SpreadLanes};

use super::random::Random;
use super::{Trial, bytes, groups};

const SEGMENTS: usize = 24;
const CONSTANTS: usize = 6;
/// Tracks of runs that lanes evaluate track by track: those of eight lanes, and some more.
const TRACKS: u32 = 11;

/// A form of segments.
trait Segment: Evaluate {
    /// A segment of numbers that need not be a rotation's.
    fn any(random: &mut Random) -> Self;
    /// The arc between two keys.
    fn between(keys: [[f32; 4]; 2]) -> Self;
}

/// The first block of a grid, which another dispatch has.
const OTHER: Block = Block {
    first: 0,
    starts: 0,
};

fn any_vector(random: &mut Random) -> [f32; 4] {
    random.vector().map(canonical)
}

impl Segment for ArcSegment {
    fn any(random: &mut Random) -> Self {
        let (middle, tangent) = (any_vector(random), any_vector(random));
        Self { middle, tangent }
    }

    fn between([from, to]: [[f32; 4]; 2]) -> Self {
        let (middle, tangent) = arc_between(from, to);
        Self { middle, tangent }
    }
}

impl Segment for PolynomialSegment {
    fn any(random: &mut Random) -> Self {
        let coefficients = std::array::from_fn(|_| any_vector(random));
        Self { coefficients }
    }

    fn between(keys: [[f32; 4]; 2]) -> Self {
        arc_polynomial(keys)
    }
}

pub(super) fn trials(kernel: Kernel, random: &mut Random) -> Vec<Trial> {
    let Some((form, list, store)) = kernel.compiled().segments else {
        return Vec::new();
    };
    match form {
        Form::Arc => of_form::<ArcSegment>(list, store, random),
        Form::Polynomial => of_form::<PolynomialSegment>(list, store, random),
    }
}

fn of_form<S: Segment>(list: List, store: Store, random: &mut Random) -> Vec<Trial> {
    let encodings = Encoding::of_store(store);
    // Each shape of a dispatch, and every encoding at least once.
    let is_spread = matches!(list, List::FramesSpread | List::TimesSpread);
    let shapes = if is_spread { 3 } else { 2 };
    (0..encodings.len().max(shapes))
        .map(|i| {
            let scene = SegmentInputs::<S>::new(random, encodings[i % encodings.len()]);
            let first = i % 2 == 0;
            match list {
                List::Frames => scene.runs(random, false, first),
                List::Times => scene.runs(random, true, first),
                List::Samples => scene.samples(random, first),
                List::FramesCoalesced => scene.frame_by_frame(random, false),
                List::TimesCoalesced => scene.frame_by_frame(random, true),
                List::FramesSpread | List::TimesSpread => {
                    let (lanes, repetitions) = match i % 3 {
                        0 => (SpreadLanes::new(2 + random.below(2)), 1),
                        1 => (SpreadLanes::new(4 + random.below(2)), 3),
                        _ => (SpreadLanes::of_tracks(TRACKS, 0, TRACKS + 2), TRACKS),
                    };
                    let is_listed = matches!(list, List::TimesSpread);
                    scene.spread(random, is_listed, lanes, repetitions)
                }
            }
        })
        .collect()
}

/// A trial of the kernel over spread runs of frames in an encoding, repeated `repetitions` times. The samples are the
/// same for any number of lanes and of workgroups.
#[cfg(feature = "lab")]
pub(crate) fn spread_trial(
    (form, encoding): (Form, Encoding),
    lanes: SpreadLanes,
    repetitions: u32,
) -> Trial {
    let random = &mut Random::canonical();
    match form {
        Form::Arc => SegmentInputs::<ArcSegment>::new(random, encoding).spread(
            random,
            false,
            lanes,
            repetitions,
        ),
        Form::Polynomial => SegmentInputs::<PolynomialSegment>::new(random, encoding).spread(
            random,
            false,
            lanes,
            repetitions,
        ),
    }
}

/// The bytes of segments between rotations.
#[cfg(feature = "lab")]
pub(crate) fn rotations(form: Form, count: usize) -> Vec<u8> {
    let random = &mut Random::canonical();
    match form {
        Form::Arc => bytes(&Vec::from_iter(
            (0..count).map(|_| ArcSegment::between(random.pair())),
        )),
        Form::Polynomial => bytes(&Vec::from_iter(
            (0..count).map(|_| PolynomialSegment::between(random.pair())),
        )),
    }
}

/// The inputs that all work of a dispatch shares.
struct SegmentInputs<S> {
    encoding: Encoding,
    segments: Vec<S>,
    constants: Vec<[f32; 4]>,
    distances: Vec<f32>,
    items: Vec<Item>,
}

impl<S: Segment> SegmentInputs<S> {
    fn new(random: &mut Random, encoding: Encoding) -> Self {
        // Some stores take any vectors. All others accept only rotations, and get no other segments here.
        let takes_any = encoding.row().takes_vectors;
        let segment = |random: &mut Random| match takes_any && random.once_in(3) {
            true => S::any(random),
            false => S::between(random.pair()),
        };
        Self {
            encoding,
            segments: (0..SEGMENTS).map(|_| segment(random)).collect(),
            constants: (0..CONSTANTS).map(|_| random.rotation()).collect(),
            distances: Vec::new(),
            items: Vec::new(),
        }
    }

    /// Makes an item, whose first sample has an offset.
    fn item(&mut self, random: &mut Random, is_listed: bool, output: u32, count: u32) {
        let (source, bit) = Self::source(random);
        // Frames near the middle of a short run, or frames at one end of a very long one.
        let (frame, scale) = match random.once_in(6) {
            true => (random.word() as i32 >> 9, 0.25 / (1 << 23) as f32),
            false => (
                random.below(ITEM_SAMPLES) as i32 - 8,
                random.number() / 16.0,
            ),
        };
        let offset = random.parameter();
        let first = match is_listed {
            true => self.distances.len() as i32,
            false => frame,
        };
        if is_listed {
            let distance = |_| random.number() * 4.0;
            self.distances.extend((0..count).map(distance));
        }
        self.items.push(Item {
            source,
            output,
            count: count | bit,
            first,
            scale,
            offset,
        });
    }

    /// The index of a segment, or the index of a constant with the bit that marks constants.
    fn source(random: &mut Random) -> (u32, u32) {
        match random.once_in(8) {
            true => (random.below(CONSTANTS as u32), IS_CONSTANT),
            false => (random.below(SEGMENTS as u32), 0),
        }
    }

    fn finish(
        self,
        listed: Vec<Vec<u8>>,
        arguments: &impl bytemuck::NoUninit,
        groups: [u32; 3],
    ) -> Trial {
        let inputs = vec![bytes(&self.segments), bytes(&self.constants)];
        Trial::new([inputs, listed].concat(), arguments, groups)
    }

    fn detail(&self) -> u32 {
        self.encoding.row().detail
    }

    /// Items of up to 16 samples, one for each invocation: of one track, or of three tracks with interleaved samples.
    fn runs(mut self, random: &mut Random, is_listed: bool, is_one: bool) -> Trial {
        const ITEMS: usize = 101;
        const BEFORE: usize = 2;
        /// The offset of the first value of the result.
        const FIRST: usize = 5;
        let stride = if is_one { 1 } else { 3 };
        let mut next = vec![0; stride];
        for i in 0..ITEMS + BEFORE {
            let track = i % stride;
            let count = 1 + random.below(ITEM_SAMPLES) as usize;
            let output = next[track] * stride + track;
            self.item(random, is_listed, output as u32, count as u32);
            next[track] += count;
        }
        // The first items belong to another dispatch, so this one must not evaluate them.
        let dispatch = Dispatch {
            first_item: BEFORE as u32,
            item_count: ITEMS as u32,
            stride: stride as u32,
            detail: self.detail(),
            first_output: FIRST as u32,
            idle: 0,
        };
        let mut listed = vec![bytes(&self.items)];
        listed.extend(is_listed.then(|| bytes(&self.distances)));
        self.finish(listed, &dispatch, groups(ITEMS, is_one))
    }

    /// Samples in any segments, one for each invocation; some invocations do nothing.
    fn samples(self, random: &mut Random, in_row: bool) -> Trial {
        const SAMPLES: usize = 203;
        const BEFORE: usize = 5;
        let mut samples = Vec::new();
        let first_output = 4;
        for _ in 0..SAMPLES + BEFORE {
            let ((source, bit), parameter) = (Self::source(random), random.parameter());
            let source = source | bit;
            samples.push(ListedSample { source, parameter });
        }
        let idle = if in_row { 3 } else { 0 };
        let dispatch = Dispatch {
            first_item: BEFORE as u32 - idle,
            item_count: SAMPLES as u32,
            stride: 0,
            detail: self.detail(),
            first_output: first_output as u32 - idle,
            idle,
        };
        let groups = groups(SAMPLES + idle as usize, in_row);
        self.finish(vec![bytes(&samples)], &dispatch, groups)
    }

    /// One row of items for a grid, from position `first` to `end`; between some of them there are samples of no
    /// item.
    fn row(&mut self, random: &mut Random, is_listed: bool, [first, end]: [u32; 2]) {
        let mut position = first;
        while position < end {
            let length = (1 + random.below(40)).min(end - position);
            let count = length - random.below(3).min(length - 1);
            self.item(random, is_listed, position, count);
            // As on the CPU, every segment that may have a tiny component is marked; others may be marked too.
            let Some(item) = self.items.last_mut() else {
                unreachable!("it was just added");
            };
            let is_constant = item.count & IS_CONSTANT != 0;
            if !is_constant {
                let may_be_tiny = !self.segments[item.source as usize].is_canonical();
                item.count |= if may_be_tiny || random.once_in(4) {
                    MAY_BE_TINY
                } else {
                    0
                };
            }
            position += length;
        }
    }

    /// The blocks of a row whose items are the last ones, from `first_item` on.
    fn blocks(&self, first_item: usize, [first, end]: [u32; 2]) -> Vec<Block> {
        let items = &self.items[first_item..];
        let starts = (first..end).step_by(BLOCK_SAMPLES as usize);
        let block = |start: u32| {
            let before = items.iter().filter(|item| item.output <= start).count();
            let begins = |position| items.iter().any(|item| item.output == position);
            let bits = (1..BLOCK_SAMPLES).filter(|bit| begins(start + bit));
            Block {
                first: (first_item + before - 1) as u32,
                starts: bits.map(|bit| 1 << bit).sum(),
            }
        };
        starts.map(block).collect()
    }

    fn grid(self, blocks: &[Block], grid: Grid, groups: [u32; 3], is_listed: bool) -> Trial {
        let mut listed = vec![bytes(&self.items), bytes(blocks)];
        listed.extend(is_listed.then(|| bytes(&self.distances)));
        self.finish(listed, &grid, groups)
    }

    /// Runs of consecutive samples; between some runs there are samples of no run. Several lanes evaluate each run.
    /// Each repetition uses the segments and the constants after those of the repetition before it. Frame by frame,
    /// each repetition is a track.
    fn spread(
        mut self,
        random: &mut Random,
        is_listed: bool,
        lanes: SpreadLanes,
        count: u32,
    ) -> Trial {
        const FIRST: u32 = 3;
        let (runs, stride) = match lanes.axis() {
            LaneAxis::Samples => (60, 1),
            LaneAxis::Tracks { stride } => (10, stride),
        };
        let mut repetitions = RunRepetitions {
            count,
            segments: 2,
            constants: 1,
            outputs: 0,
        };
        for _ in 1..count {
            let more = (0..repetitions.segments).map(|_| S::between(random.pair()));
            self.segments.extend(more);
            self.constants.push(random.rotation());
        }
        let mut chunk = WorkChunk::default();
        let mut output = 0;
        for _ in 0..runs {
            let max = if random.once_in(8) { 150 } else { 40 };
            let length = 1 + random.below(max);
            let count = length - random.below(3).min(length - 1);
            self.item(random, is_listed, output * stride, count);
            chunk.runs.extend(
                self.items
                    .pop()
                    .map(|item| self.run(random, is_listed, item, repetitions)),
            );
            output += length;
        }
        repetitions.outputs = if stride == 1 { output + 1 } else { 1 };
        let mut list = vec![NO_RUN; lanes.entries(&chunk)];
        lanes.write_chunk(&chunk, 0, &mut list);
        // The first entry belongs to another dispatch, so this one must not evaluate it.
        let entries = list.len() as u32;
        list.insert(0, SpreadRun { count: 9, ..NO_RUN });
        let dispatch = lanes.dispatch_repeated([1, entries], repetitions, self.detail(), FIRST);
        let groups = lanes.workgroups(entries, count);
        let mut listed = vec![bytes(&list)];
        listed.extend(is_listed.then(|| bytes(&self.distances)));
        self.finish(listed, &dispatch, groups)
    }

    /// The run of an item, which may begin with a key. A run whose frames are far from the middle has the mark for
    /// this.
    fn run(
        &self,
        random: &mut Random,
        is_listed: bool,
        item: Item,
        repetitions: RunRepetitions,
    ) -> SpreadRun {
        let mut run = SpreadRun {
            source: item.source,
            output: item.output,
            count: item.count,
            first: item.first,
            scale: item.scale,
            offset: item.offset,
            ..NO_RUN
        };
        if run.count & IS_CONSTANT != 0 {
            return run;
        }
        if random.once_in(3) {
            run.key = random.below(CONSTANTS as u32);
        }
        let segments = self.segments[run.source as usize..].iter();
        let mut repeated = segments
            .step_by(repetitions.segments as usize)
            .take(repetitions.count as usize);
        let mut needs_care = repeated.any(|segment| !segment.is_canonical());
        if !is_listed && random.once_in(6) {
            (run.first, run.scale) = (random.word() as i32 >> 2, 0.25 / (1 << 30) as f32);
            needs_care = true;
        }
        if needs_care || random.once_in(8) {
            run.count |= NEEDS_CARE;
        }
        run
    }

    /// A grid with contiguous tracks, with a row for each track.
    fn frame_by_frame(mut self, random: &mut Random, is_listed: bool) -> Trial {
        const SAMPLES: u32 = 43;
        const ROWS: u32 = 11;
        const STRIDE: u32 = 13;
        const FIRST: u32 = 5;
        let mut of_rows = Vec::new();
        for _ in 0..ROWS {
            let first_item = self.items.len();
            self.row(random, is_listed, [0, SAMPLES]);
            of_rows.push(self.blocks(first_item, [0, SAMPLES]));
        }
        // The blocks are indexed [block of samples][row].
        let of_samples = SAMPLES.div_ceil(BLOCK_SAMPLES) as usize;
        let blocks = (0..of_samples).flat_map(|i| of_rows.iter().map(move |row| row[i]));
        let blocks: Vec<_> = [OTHER].into_iter().chain(blocks).collect();
        let grid = Grid {
            detail: self.detail(),
            stride: STRIDE,
            samples: SAMPLES,
            rows: ROWS,
            first_output: FIRST,
            first_block: 1,
        };
        // A row may begin anywhere within a line, so one more line may be needed.
        let tiles = (LINE - 1 + ROWS).div_ceil(LINE);
        let layers = SAMPLES.div_ceil(WORKGROUP / LINE * SAMPLES_EACH);
        self.grid(&blocks, grid, [2, tiles.div_ceil(2), layers], is_listed)
    }
}
