//! Cuts the requested samples of a track into runs, consecutive samples with one source: the unit
//! of work of every device. A run's numbers do not depend on where a window of work starts, so
//! results are the same however work is cut.

use std::ops::Range;

use bytemuck::Zeroable as _;

use crate::math::canonical::round_f32;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{FramesError, Ticks, Timeline};
use crate::time::interval_blocks::{IntervalBlock, IntervalBlocks};
use crate::time::moment::Moment;
use crate::time::spans::{NONE, Part, Source, Spans};
use crate::time::wrap::{CopyPlace, TrackCopy};

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

    /// A segment at one parameter, whatever the sample.
    fn at(index: u32, parameter: f32) -> Self {
        let (scale, offset) = (0.0, parameter);
        Self::Segment(
            index,
            Distance::Near { first: 0.0 },
            Affine { scale, offset },
        )
    }

    /// A curve in f64 at one parameter, whatever the sample.
    fn exact_at(index: u32, t: f64) -> Self {
        let (start, length) = (t, f64::INFINITY);
        let parameter = Parameter { start, length };
        Self::Exact { index, parameter }
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
    /// Seconds from the middle, which is `half` a length after `start`, to a sample's explicit time.
    Seconds { start: f64, half: f64 },
}

impl Distance {
    /// The distance of a run's `j`th sample, in frames or seconds; `time` gives that sample's time.
    #[inline(always)]
    pub(crate) fn of(self, j: usize, time: impl FnOnce() -> f64) -> f32 {
        match self {
            Self::Near { first } => first + j as f32,
            // An integer converts with one rounding, like the shader's sum of two exact halves.
            Self::Frames { first } => first.wrapping_add(j as i32) as f32,
            Self::Seconds { start, half } => round_f32((time() - start) - half),
        }
    }
}

/// Where the interval of a curve that is evaluated in f64 starts, and its length: in frames, or in
/// seconds if samples have explicit times. If `length` is infinite, the curve is evaluated at the
/// parameter `start` for all samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parameter {
    pub(crate) start: f64,
    pub(crate) length: f64,
}

impl Parameter {
    /// The curve's parameter at a frame or a time.
    #[inline]
    pub(crate) fn at(self, place: f64) -> f64 {
        match self.length {
            f64::INFINITY => self.start,
            length => (place - self.start) / length,
        }
    }
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
        match (&timeline.ticks, copy.place) {
            (_, CopyPlace::At(time)) => {
                let run = |source| Run::new(copy.samples.start, copy.samples.len(), source);
                if let Some(source) = self.source_within(part, time) {
                    emit.run(run(source));
                }
                Ok(())
            }
            (Ticks::Frames { rate, start }, _) => {
                let clock = FrameClock::new(*rate, *start, self.steps).in_copy(copy);
                self.runs_of_frames(part, clock, copy, emit)
            }
            (Ticks::Times { times, stride }, _) => {
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
        copy: &TrackCopy,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        let (starts, samples) = (&self.starts[part.spans.clone()], &copy.samples);
        let [first, at_end, last] = match copy.is_track() {
            true => self.runs_outside(part, clock, samples),
            false => self.runs_at_ends(part, clock, samples),
        };
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

impl Spans {
    /// When the first span of a part starts, in seconds.
    #[inline(always)]
    pub(crate) fn begin(&self, part: &Part) -> f64 {
        let starts = &self.starts[part.spans.clone()];
        starts.first().copied().unwrap_or(part.end)
    }

    /// The runs outside a part's keys, those of the requested samples that it has: before the first key,
    /// at exactly the last one, and from there on.
    pub(crate) fn runs_outside(
        &self,
        part: &Part,
        clock: FrameClock,
        samples: &Range<usize>,
    ) -> [Option<Run>; 3] {
        let [at_end, from_before, from_after] = part.at_ends();
        let (begin, end) = (clock.boundary(self.begin(part)), clock.boundary(part.end));
        let (from, to) = (begin.first as usize, end.first as usize);
        let is_key = at_end != NONE && to as f64 == end.frame;
        let after = to.saturating_add(usize::from(is_key));
        let second = clock.rate();
        let first = RunSource::outside(part.before, from_before, begin.frame, second);
        let last = RunSource::outside(part.after, from_after, end.frame, second);
        [
            run_among(samples, 0..from, first),
            run_among(samples, to..after, RunSource::held(at_end)),
            run_among(samples, after..usize::MAX, last),
        ]
    }

    /// The runs of a copy's samples that rounding put beyond its ends. Every sample of a copy is of its
    /// track's keys, also where the values outside are not constants.
    fn runs_at_ends(
        &self,
        part: &Part,
        clock: FrameClock,
        samples: &Range<usize>,
    ) -> [Option<Run>; 3] {
        let begin = self.begin(part);
        let [is_first, is_last] = part.is_at_ends(begin);
        let at_start = is_first.then(|| self.at_start(part));
        let at_end = is_last.then(|| self.at_end(part));
        let (begin, end) = (clock.boundary(begin), clock.boundary(part.end));
        let [(first, from), (last, to)] = match clock.is_reversed() {
            true => [(at_end, end.first), (at_start, begin.first)],
            false => [(at_start, begin.first), (at_end, end.first)],
        };
        [
            run_among(samples, 0..from as usize, first),
            None,
            run_among(samples, to as usize..usize::MAX, last),
        ]
    }

    /// The value of a part's curve where its first span starts.
    fn at_start(&self, part: &Part) -> RunSource {
        let first = part.spans.start;
        let key = self.keys.get(first).filter(|_| !part.spans.is_empty());
        let constant = [part.before, key.copied().unwrap_or(NONE)];
        self.at_bound(constant, part.spans.clone().next(), -0.5, 0.0)
    }

    /// The value of a part's curve where its last span ends.
    fn at_end(&self, part: &Part) -> RunSource {
        let [at_end, ..] = part.at_ends();
        self.at_bound([at_end, part.after], part.spans.clone().last(), 0.5, 1.0)
    }

    /// The first of two constants that there is, or else a span's value at this parameter; `t` is that of
    /// a curve in f64.
    fn at_bound(
        &self,
        constants: [u32; 2],
        span: Option<usize>,
        parameter: f32,
        t: f64,
    ) -> RunSource {
        let constant = constants.into_iter().find(|&constant| constant != NONE);
        match (constant, span.map(|span| self.sources[span])) {
            (Some(constant), _) | (None, Some(Source::Constant(constant))) => {
                RunSource::Constant(constant)
            }
            (None, Some(Source::Segment(index))) => RunSource::at(index, parameter),
            (None, Some(Source::Exact(index))) => RunSource::exact_at(index, t),
            (None, None) => RunSource::Constant(0),
        }
    }

    /// What gives a part's rotation at one of its track's times; `None` if another part has it.
    fn source_within(&self, part: &Part, time: Moment) -> Option<RunSource> {
        let (begin, starts) = (self.begin(part), &self.starts[part.spans.clone()]);
        let [is_first, is_last] = part.is_at_ends(begin);
        if time.since(begin) < 0.0 {
            return is_first.then(|| self.at_start(part));
        }
        if time.since(part.end) >= 0.0 {
            return is_last.then(|| self.at_end(part));
        }
        let i = starts.partition_point(|&start| time.since(start) >= 0.0) - 1;
        let span = part.spans.start + i;
        let end = starts.get(i + 1).copied().unwrap_or(part.end);
        let (from_start, length) = (time.since(starts[i]), end - starts[i]);
        let key = self.keys[span];
        if from_start == 0.0 && key != NONE {
            return Some(RunSource::Constant(key));
        }
        Some(match self.sources[span] {
            Source::Constant(constant) => RunSource::Constant(constant),
            Source::Segment(index) => {
                let parameter = (from_start - length * 0.5) / length;
                RunSource::at(index, round_f32(parameter))
            }
            Source::Exact(index) => RunSource::exact_at(index, from_start / length),
        })
    }
}

/// The run of those requested samples that lie in a range, if anything gives them.
fn run_among(
    samples: &Range<usize>,
    outside: Range<usize>,
    source: Option<RunSource>,
) -> Option<Run> {
    let first = outside.start.max(samples.start);
    let last = outside.end.min(samples.end);
    let source = source.filter(|_| first < last);
    source.map(|source| Run::new(first, last - first, source))
}

/// Distances in frames must be below this: they are kept in 32 bits.
pub(crate) const COUNTABLE: f64 = (1u64 << 31) as f64;
