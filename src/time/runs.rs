//! Cuts the requested samples of a track into runs, consecutive samples with one source: the unit
//! of work of every device. A run's numbers do not depend on where a window of work starts, so
//! results are the same however work is cut.

use std::ops::Range;

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

    /// Takes samples with a constant. Most places that emit know that they have one; what evaluates
    /// segments is not compiled for them.
    #[inline(always)]
    fn constant(&mut self, sample: usize, count: usize, constant: u32) {
        self.run(Run::new(sample, count, RunSource::Constant(constant)));
    }

    /// Takes samples of a curve that is evaluated in f64, likewise.
    #[inline(always)]
    fn exact(&mut self, sample: usize, count: usize, index: u32, parameter: Parameter) {
        let source = RunSource::Exact { index, parameter };
        self.run(Run::new(sample, count, source));
    }
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
        if clock.is_reversed() {
            // Frames meet the last key first. Nothing is extrapolated: only the track itself is,
            // never a copy.
            let end = clock.boundary(part.end);
            emit_constant(0, end.first as usize, samples, part.after, emit);
        } else {
            runs_before(part, begin, clock, samples, emit);
        }
        let mut intervals = IntervalBlocks::new(starts, part.end, clock, samples.clone());
        let mut block = IntervalBlock::new();
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
                    emit.constant(first, 1, key);
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
                    Source::Constant(constant) => emit.constant(first, count, constant),
                    Source::Exact(index) => {
                        emit.exact(first, count, index, block.parameter(j, clock));
                    }
                }
            }
        }
        if clock.is_reversed() {
            let end = clock.boundary(begin);
            emit_constant(end.first as usize, usize::MAX, samples, part.before, emit);
        } else {
            runs_after(part, clock, samples, emit);
        }
        Ok(())
    }
}

/// Emits the runs before the first key, if the part is the track's first.
#[inline(always)]
pub(crate) fn runs_before(
    part: &Part,
    begin: f64,
    clock: FrameClock,
    samples: &Range<usize>,
    emit: &mut impl Emit,
) {
    let [_, from_before, _] = part.at_ends();
    if [part.before, from_before] == [NONE; 2] {
        return;
    }
    let begin = clock.boundary(begin);
    let first = begin.first as usize;
    emit_constant(0, first, samples, part.before, emit);
    if from_before != NONE {
        extrapolate(0..first, samples, from_before, clock, begin.frame, emit);
    }
}

/// Emits the runs from the last key on, if the part is the track's last.
#[inline(always)]
pub(crate) fn runs_after(
    part: &Part,
    clock: FrameClock,
    samples: &Range<usize>,
    emit: &mut impl Emit,
) {
    let [at_end, _, from_after] = part.at_ends();
    if [part.after, at_end, from_after] == [NONE; 3] {
        return;
    }
    let end = clock.boundary(part.end);
    let mut first = end.first as usize;
    if at_end != NONE && first as f64 == end.frame {
        emit_constant(first, first + 1, samples, at_end, emit);
        first += 1;
    }
    emit_constant(first, usize::MAX, samples, part.after, emit);
    if from_after != NONE {
        let after = first..usize::MAX;
        extrapolate(after, samples, from_after, clock, end.frame, emit);
    }
}

/// Emits the requested samples among `outside`, on the extrapolating curve `index`, whose parameter
/// is seconds from the frame coordinate `end`.
#[inline(never)]
fn extrapolate(
    outside: Range<usize>,
    samples: &Range<usize>,
    index: u32,
    clock: FrameClock,
    end: f64,
    emit: &mut impl Emit,
) {
    let (first, last) = (
        outside.start.max(samples.start),
        outside.end.min(samples.end),
    );
    if first < last {
        let (start, length) = (end, clock.rate());
        let parameter = Parameter { start, length };
        emit.exact(first, last - first, index, parameter);
    }
}

/// Emits the requested samples from `from` to `to` with a constant; nothing if it is [`NONE`].
#[inline(always)]
fn emit_constant(
    from: usize,
    to: usize,
    samples: &Range<usize>,
    constant: u32,
    emit: &mut impl Emit,
) {
    let (sample, to) = (from.max(samples.start), to.min(samples.end));
    if sample < to && constant != NONE {
        emit.constant(sample, to - sample, constant);
    }
}

/// Distances in frames must be below this: they are kept in 32 bits.
pub(crate) const COUNTABLE: f64 = (1u64 << 31) as f64;
