//! Runs: consecutive samples of a track with one source, the unit of work of every device. The numbers of a run do
//! not depend on the start of a window of work, so results are the same for any division of the work.
//! [`Spans`](crate::time::spans::Spans) divides the samples of a track into runs, by blocks of up to 32 intervals,
//! for which vector lanes find the samples in each. The intervals are the spans of a prepared track, or those between
//! keys.

use std::ops::Range;

use bytemuck::Zeroable;

use crate::math::canonical::{round_f32, whole_number};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::frame_clock::{FrameClock, in_frames};

/// The index that means none.
pub(crate) const NONE: u32 = u32::MAX;

/// Consecutive samples of one track with one source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// The first sample.
    pub(crate) sample: usize,
    /// Number of samples.
    pub(crate) count: usize,
    pub(crate) source: RunSource,
}

impl Run {
    #[inline(always)]
    pub(crate) fn new(sample: usize, count: usize, source: RunSource) -> Self {
        Self {
            sample,
            count,
            source,
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum RunSource {
    /// Store a constant.
    Constant(u32),
    /// Evaluate a segment.
    Segment(u32, Distance, Affine),
    /// Evaluate a curve in f64 on the host.
    Exact { index: u32, parameter: Parameter },
}

impl RunSource {
    /// A constant, if it is not [`NONE`].
    #[inline]
    pub(crate) fn held(constant: u32) -> Option<Self> {
        (constant != NONE).then_some(Self::Constant(constant))
    }

    /// The source of samples outside the keys: a constant, or a curve whose parameter is the seconds from the first
    /// or last key; `None` if another part has them. In the unit of the timeline, that key is at `start`, and a
    /// second is `length` long.
    #[inline]
    pub(crate) fn outside(constant: u32, index: u32, start: f64, length: f64) -> Option<Self> {
        let parameter = Parameter { start, length };
        let curve = (index != NONE).then_some(Self::Exact { index, parameter });
        Self::held(constant).or(curve)
    }

    /// A segment at one parameter, for every sample.
    pub(crate) fn at(index: u32, parameter: f32) -> Self {
        let (scale, offset) = (0.0, parameter);
        Self::Segment(
            index,
            Distance::Near { first: 0.0 },
            Affine { scale, offset },
        )
    }

    /// A curve in f64 at one parameter, for every sample.
    pub(crate) fn exact_at(index: u32, t: f64) -> Self {
        let (start, length) = (t, f64::INFINITY);
        let parameter = Parameter { start, length };
        Self::Exact { index, parameter }
    }
}

/// The parameter of a run's samples as a function of the distance from the segment's middle: `distance × scale +
/// offset`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Affine {
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

/// A sample's distance from the middle of its segment.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Distance {
    /// Frames from the whole frame nearest to the middle, for the run's first sample; one more for each sample after
    /// it. All of them are exact in f32, including those that fill the run's last vector.
    Near { first: f32 },
    /// As `Near`, for numbers of frames that may be inexact in f32.
    Frames { first: i32 },
    /// From the middle to a sample's explicit time, in seconds times `unit`; the middle is `half` after `start`, in
    /// seconds times `unit` ([`InSeconds`](crate::time::frame_clock::InSeconds)).
    Seconds { start: f64, unit: f64, half: f64 },
}

impl Distance {
    /// The distance of a run's `j`th sample, in frames or seconds; `time` gives that sample's time.
    #[inline(always)]
    pub(crate) fn at_sample(self, j: usize, time: impl FnOnce() -> f64) -> f32 {
        match self {
            Self::Near { first } => first + j as f32,
            // An integer converts with one rounding, like the shader's sum of two exact halves.
            Self::Frames { first } => first.wrapping_add(j as i32) as f32,
            Self::Seconds { start, unit, half } => round_f32((time() - start) * unit - half),
        }
    }
}

/// The start of the interval of a curve that is evaluated in f64, and its length: in frames, or in seconds if samples
/// have explicit times. If `length` is infinite, the curve is evaluated at the parameter `start` for all samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parameter {
    pub(crate) start: f64,
    pub(crate) length: f64,
}

impl Parameter {
    /// The curve's parameter at a frame or a time.
    #[inline]
    pub(crate) fn at(self, coordinate: f64) -> f64 {
        match self.length {
            f64::INFINITY => self.start,
            length => (coordinate - self.start) / length,
        }
    }
}

/// Receives runs. This is a trait rather than a closure, because a closure's body is not compiled for the vector
/// width of the function into which it is inlined.
pub(crate) trait Emit {
    fn run(&mut self, run: Run);
}

impl Emit for Vec<Run> {
    fn run(&mut self, run: Run) {
        self.push(run);
    }
}

/// The limit of distances in frames, which are stored in 32 bits.
pub(crate) const COUNTABLE: f64 = (1u64 << 31) as f64;

/// Intervals of a block.
const LEN: usize = 32;

/// The frame coordinates of consecutive intervals, and the constants from which the parameters of
/// their samples follow.
#[derive(Zeroable)]
pub(crate) struct IntervalBlock {
    /// The start of each interval and, as the last entry, the end of the last one, in frames.
    pub(crate) frame: [f64; LEN + 1],
    /// The first requested sample that is not before `frame`, or the end of the requested samples.
    pub(crate) first: [usize; LEN + 1],
    /// 1 if that sample lies exactly at `frame`, else 0.
    pub(crate) is_held: [u64; LEN],
    /// The whole frame nearest to the middle of each.
    pub(crate) whole: [f64; LEN],
    /// From `whole` to `first`, in frames.
    pub(crate) distance: [f32; LEN],
    pub(crate) scale: [f32; LEN],
    pub(crate) offset: [f32; LEN],
    /// Whether the distances of all samples from `whole` are exact in f32.
    pub(crate) are_near: bool,
    /// The indices in the block of the intervals with samples.
    pub(crate) occupied: Occupied,
}

impl IntervalBlock {
    /// The start and the length of the `j`th interval, for a curve that is evaluated in f64. The length is negative
    /// if frames run backwards.
    pub(crate) fn parameter(&self, j: usize, clock: FrameClock) -> Parameter {
        let (mut start, mut end) = (self.frame[j], self.frame[j + 1]);
        if clock.is_reversed() {
            (start, end) = (end, start);
        }
        let length = end - start;
        Parameter { start, length }
    }

    /// How the parameters in the `j`th interval follow from distances.
    #[inline(always)]
    pub(crate) fn affine(&self, j: usize) -> Affine {
        Affine {
            scale: self.scale[j],
            offset: self.offset[j],
        }
    }

    /// Whether the distances of the samples in the `j`th interval fit 32 bits.
    #[inline(always)]
    pub(crate) fn is_countable(&self, j: usize) -> bool {
        let distance = |sample: usize| (sample as f64 - self.whole[j]).abs();
        // Checking the first sample and the one after the last is enough, because the others are between them.
        distance(self.first[j]) < COUNTABLE && distance(self.first[j + 1]) < COUNTABLE
    }
}

/// A bit for each interval with samples; iterates over their indices in order. If keys are denser than samples, a
/// branch for each interval would often be mispredicted.
#[derive(Clone, Copy, Zeroable)]
pub(crate) struct Occupied(u64);

impl Iterator for Occupied {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let index = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (index < u64::BITS).then_some(index as usize)
    }
}

/// Consecutive intervals, a block at a time.
pub(crate) struct IntervalBlocks<'a> {
    clock: FrameClock,
    starts: &'a [f64],
    /// The end of the last interval.
    end: f64,
    /// The requested samples.
    samples: Range<usize>,
    /// How many intervals are done.
    done: usize,
}

impl<'a> IntervalBlocks<'a> {
    #[inline]
    pub(crate) fn new(
        starts: &'a [f64],
        end: f64,
        clock: FrameClock,
        samples: Range<usize>,
    ) -> Self {
        // Intervals before that of the first sample are skipped. The two before it are kept, because
        // rounding may put the sample there.
        let mut done = 0;
        if samples.start > 0
            && let Some(first_time) = clock.time_of_track(samples.start)
        {
            // Most parts of a long track have no requested sample. Comparing with the last start avoids a search in
            // memory that is not cached.
            let found = match starts.last() {
                Some(&last) if last <= first_time => starts.len(),
                _ => starts.partition_point(|&start| start <= first_time),
            };
            done = found.saturating_sub(3);
        }
        Self {
            clock,
            starts,
            end,
            samples,
            done,
        }
    }

    /// Fills a block with the next intervals, in the order of frames. Returns their numbers in that order, or `None`
    /// if no interval with samples is left.
    pub(crate) fn fill(&mut self, block: &mut IntervalBlock) -> Option<Range<usize>> {
        let (from, count) = (self.done, self.starts.len());
        if from == count {
            return None;
        }
        let to = (from + LEN).min(count);
        self.done = to;
        let mut reversed = [0.0; LEN];
        let (starts, next) = if self.clock.is_reversed() {
            let times = (self.starts[count - to..].iter().copied().chain([self.end])).rev();
            let times = times.skip(from);
            for (start, time) in reversed[..to - from].iter_mut().zip(times) {
                *start = time;
            }
            (&reversed[..to - from], self.starts[count - to])
        } else {
            let next = self.starts.get(to).copied().unwrap_or(self.end);
            (&self.starts[from..to], next)
        };
        in_lanes(&mut FillBlock {
            clock: self.clock,
            starts,
            next,
            samples: [self.samples.start as f64, self.samples.end as f64],
            block,
        });
        (block.first[0] < self.samples.end).then_some(from..to)
    }
}

struct FillBlock<'a> {
    clock: FrameClock,
    /// At most [`LEN`].
    starts: &'a [f64],
    /// The end of the last of these intervals.
    next: f64,
    samples: [f64; 2],
    block: &'a mut IntervalBlock,
}

impl InLanes for FillBlock<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (clock, samples, starts) = (self.clock, self.samples, self.starts);
        let count = starts.len();
        // Local arrays, because the compiler must know that no other reference overlaps them.
        let mut frames = [0.0; LEN + 1];
        let mut firsts = [0.0; LEN + 1];
        let (frame, first) = (&mut frames[..count], &mut firsts[..count]);
        for j in 0..count {
            let boundary = clock.boundary(starts[j]);
            frame[j] = boundary.frame;
            first[j] = within(boundary.first, samples);
        }
        let end = clock.boundary(self.next);
        (frames[count], firsts[count]) = (end.frame, within(end.first, samples));
        let block = &mut *self.block;
        block.frame = frames;
        for (number, &first) in block.first.iter_mut().zip(&firsts) {
            *number = whole_number(first) as usize;
        }
        let (frame, next_frame) = (&frames[..count], &frames[1..=count]);
        let (first, next_first) = (&firsts[..count], &firsts[1..=count]);
        let is_held = &mut block.is_held[..count];
        let whole = &mut block.whole[..count];
        let distance = &mut block.distance[..count];
        let scale = &mut block.scale[..count];
        let offset = &mut block.offset[..count];
        let extent = if clock.is_reversed() { -1.0 } else { 1.0 };
        let (mut distant, mut occupied) = (0, 0);
        for j in 0..count {
            let span = in_frames(frame[j], next_frame[j], extent);
            let (before, after) = (first[j] - span.whole, next_first[j] - span.whole);
            let is_distant = (before.abs() >= NEAR_LIMIT) | (after.abs() >= NEAR_LIMIT);
            let bit = u64::from(first[j] < next_first[j]) << j;
            occupied |= bit;
            distant |= if is_distant { bit } else { 0 };
            is_held[j] = u64::from(first[j] == frame[j]);
            whole[j] = span.whole;
            distance[j] = before as f32;
            scale[j] = span.scale;
            offset[j] = span.offset;
        }
        block.are_near = distant == 0;
        block.occupied = Occupied(occupied);
    }
}

/// Whole numbers below 2^24 are exact in f32. If distances are below this limit, so are those of the samples that
/// fill a run's last vector.
const NEAR_LIMIT: f64 = (1u64 << 23) as f64;

/// Clamps a sample to the requested range.
#[inline(always)]
fn within(sample: f64, [start, end]: [f64; 2]) -> f64 {
    let from = if sample > start { sample } else { start };
    if from < end { from } else { end }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::frame_clock::FrameStart;
    use crate::time::frame_rate::FrameRate;

    /// Steps of one frame add up without rounding only while f32 exactly holds every distance, also
    /// those that fill the last vector.
    #[test]
    fn distances_are_stepped_only_where_they_are_whole_numbers_of_f32() {
        let rate = FrameRate::new(1, 1).unwrap();
        for (frames, are_near) in [((1u64 << 24) - 2, true), ((1 << 24) + 2, false)] {
            let (starts, end) = ([0.0], frames as f64);
            let start = FrameStart::new(0.0);
            let clock = FrameClock::new(rate, start, false);
            let mut intervals = IntervalBlocks::new(&starts, end, clock, 0..frames as usize);
            let mut block = IntervalBlock::zeroed();
            assert_eq!(intervals.fill(&mut block), Some(0..1));
            assert_eq!(block.are_near, are_near, "{frames} frames");
            assert!(block.is_countable(0));
            let last = f64::from(block.distance[0]) + (frames - 1) as f64;
            assert!(!are_near || last + 16.0 <= f64::from(1 << 24));
        }
    }
}
