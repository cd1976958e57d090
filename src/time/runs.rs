//! Cuts the requested samples of a track into runs, consecutive samples with one source: the unit
//! of work of every device. A run's numbers do not depend on where a window of work starts, so
//! results are the same however work is cut.

use std::ops::Range;

use bytemuck::Zeroable as _;

use crate::math::canonical::round_f32;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{FramesError, Ticks, Timeline};
use crate::time::interval_blocks::{IntervalBlock, IntervalBlocks};
use crate::time::spans::{NONE, Part, Source, Spans};
use crate::time::wrap::TrackCopy;

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

    /// What gives samples outside the keys: a constant, or a curve whose parameter is seconds from
    /// the outermost key; `None` if another part has them. In the unit of the timeline that key lies
    /// at `start`, and a second is `length` long.
    #[inline]
    pub(crate) fn outside(constant: u32, index: u32, start: f64, length: f64) -> Option<Self> {
        let parameter = Parameter { start, length };
        let curve = (index != NONE).then_some(Self::Exact { index, parameter });
        Self::held(constant).or(curve)
    }
}

/// How a run's parameter follows from the distance to the segment's middle:
/// `distance × scale + offset`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Affine {
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

/// A sample's distance from the middle of its segment.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Distance {
    /// Frames from the whole frame nearest to the middle, for the run's first sample; one more for
    /// each sample after it. f32 holds all of them exactly, also those that fill the run's last
    /// vector.
    Near { first: f32 },
    /// The same where f32 may not hold them exactly.
    Frames { first: i32 },
    /// Seconds from the middle: a sample's explicit time minus `middle`.
    Seconds { middle: f64 },
}

impl Distance {
    /// The distance of a run's `j`th sample, in frames or seconds; `time` gives that sample's time.
    #[inline(always)]
    pub(crate) fn of(self, j: usize, time: impl FnOnce() -> f64) -> f32 {
        match self {
            Self::Near { first } => first + j as f32,
            // An integer converts with one rounding, like the shader's sum of two exact halves.
            Self::Frames { first } => first.wrapping_add(j as i32) as f32,
            Self::Seconds { middle } => round_f32(time() - middle),
        }
    }
}

/// Where the interval of a curve that is evaluated in f64 starts, and its length: in frames, or in
/// seconds if samples have explicit times.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parameter {
    pub(crate) start: f64,
    pub(crate) length: f64,
}

/// Takes runs. A trait rather than a closure: a closure's body is not compiled for
/// the vector width of the function that it is inlined into.
pub(crate) trait Emit {
    fn run(&mut self, run: Run);
}

impl Emit for Vec<Run> {
    fn run(&mut self, run: Run) {
        self.push(run);
    }
}

impl Spans {
    /// Emits the runs of one part among the samples of a track copy, in order.
    #[inline(always)]
    pub(crate) fn runs(
        &self,
        part: &Part,
        timeline: &Timeline,
        copy: &TrackCopy,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        match &timeline.ticks {
            Ticks::Frames { rate, start } => {
                let clock = FrameClock::new(*rate, *start, part.end).in_copy(copy);
                self.runs_of_frames(part, clock, &copy.samples, emit)
            }
            Ticks::Times { times, stride } => {
                let own = &times[part.track as usize * stride..];
                self.runs_of_times(part, own, copy.samples.clone(), emit);
                Ok(())
            }
        }
    }

    /// Emits the runs of one part among frames, in order.
    #[inline(always)]
    fn runs_of_frames(
        &self,
        part: &Part,
        clock: FrameClock,
        samples: &Range<usize>,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        let starts = &self.starts[part.spans.clone()];
        let begin = starts.first().copied().unwrap_or(part.end);
        let [first, at_end, last] = part.runs_outside(begin, clock, samples);
        if let Some(run) = first {
            emit.run(run);
        }
        let mut intervals = IntervalBlocks::new(starts, part.end, clock, samples.clone());
        let mut block = IntervalBlock::zeroed();
        while let Some(own) = intervals.fill(&mut block) {
            for j in block.occupied {
                let met = own.start + j;
                let (span, key) = match (clock.is_reversed(), met) {
                    (false, _) => (part.spans.start + met, self.keys[part.spans.start + met]),
                    (true, 0) => (part.spans.end - 1, part.after),
                    (true, _) => (part.spans.end - 1 - met, self.keys[part.spans.end - met]),
                };
                let (mut first, last) = (block.first[j], block.first[j + 1]);
                if key != NONE && block.is_held[j] == 1 {
                    emit.run(Run::new(first, 1, RunSource::Constant(key)));
                    first += 1;
                    if first == last {
                        continue;
                    }
                }
                let count = last - first;
                match self.sources[span] {
                    Source::Segment(index) => {
                        let distance = if block.are_near {
                            let held = first - block.first[j];
                            Distance::Near {
                                first: block.distance[j] + held as f32,
                            }
                        } else if block.is_countable(j) {
                            Distance::Frames {
                                first: (first as f64 - block.whole[j]) as i32,
                            }
                        } else {
                            return Err(self.gap_too_long(part, span, clock.rate()));
                        };
                        let source = RunSource::Segment(index, distance, block.affine(j));
                        emit.run(Run::new(first, count, source));
                    }
                    Source::Constant(constant) => {
                        emit.run(Run::new(first, count, RunSource::Constant(constant)));
                    }
                    Source::Exact(index) => {
                        let parameter = block.parameter(j, clock);
                        let source = RunSource::Exact { index, parameter };
                        emit.run(Run::new(first, count, source));
                    }
                }
            }
        }
        for run in [at_end, last].into_iter().flatten() {
            emit.run(run);
        }
        Ok(())
    }
}

impl Part {
    /// The runs outside its keys, those of the requested samples that it has: before the first key,
    /// at exactly the last one, and from there on. `begin` is when its first span starts, in seconds.
    pub(crate) fn runs_outside(
        &self,
        begin: f64,
        clock: FrameClock,
        samples: &Range<usize>,
    ) -> [Option<Run>; 3] {
        let [at_end, from_before, from_after] = self.at_ends();
        let (begin, end) = (clock.boundary(begin), clock.boundary(self.end));
        let (from, to) = (begin.first as usize, end.first as usize);
        let run = |outside: Range<usize>, source: Option<RunSource>| {
            let first = outside.start.max(samples.start);
            let last = outside.end.min(samples.end);
            let source = source.filter(|_| first < last);
            source.map(|source| Run::new(first, last - first, source))
        };
        if clock.is_reversed() {
            // Frames meet the last key first. Nothing is extrapolated: only the track itself is,
            // never a copy.
            let (first, last) = (RunSource::held(self.after), RunSource::held(self.before));
            return [run(0..to, first), None, run(from..usize::MAX, last)];
        }
        let is_key = at_end != NONE && to as f64 == end.frame;
        let after = to.saturating_add(usize::from(is_key));
        let second = clock.rate();
        let first = RunSource::outside(self.before, from_before, begin.frame, second);
        let last = RunSource::outside(self.after, from_after, end.frame, second);
        [
            run(0..from, first),
            run(to..after, RunSource::held(at_end)),
            run(after..usize::MAX, last),
        ]
    }
}

/// Distances in frames must be below this: they are kept in 32 bits.
pub(crate) const COUNTABLE: f64 = (1u64 << 31) as f64;
