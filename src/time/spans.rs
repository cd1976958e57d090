//! The times of the segments of prepared tracks, and the runs of samples in them.

use std::collections::TryReserveError;
use std::ops::Range;

use bytemuck::Zeroable as _;

use crate::math::canonical::round_f32;
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::{CopyPosition, FrameClock, InSeconds, TrackCopy, in_seconds};
use crate::time::frames::{Ticks, Timeline};
use crate::time::moment::Moment;
use crate::time::runs::{
    Affine, Distance, Emit, IntervalBlock, IntervalBlocks, NONE, Parameter, Run, RunSource,
};
use crate::time::times::interval_at;

/// Spans of tracks' time, each from its start to the start of the next one. Each field is a separate list, because
/// many spans are compared with the samples at once, in vector lanes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spans {
    /// Seconds.
    pub(crate) starts: Vec<f64>,
    pub(crate) sources: Vec<StoredSource>,
    /// The constant to store at exactly the start, or [`NONE`].
    pub(crate) keys: Vec<u32>,
    /// Whether keys are held until the next one.
    pub(crate) steps: bool,
}

/// The source of the rotations of a span: an index in one of the lists of `Prepared`.
#[derive(Debug, Clone, Copy)]
pub(crate) enum SpanSource {
    Segment(u32),
    Constant(u32),
    Exact(u32),
}

/// A [`SpanSource`] in four bytes, as a span stores it: the kind in the two highest bits, and the index.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StoredSource(u32);

/// The bits of a [`StoredSource`] that are the index; a group has fewer segments, constants and curves.
pub(crate) const SOURCE_INDEX: u32 = (1 << 30) - 1;

impl StoredSource {
    const CONSTANT: u32 = 1 << 30;
    const EXACT: u32 = 2 << 30;
    const NO_CONSTANT: u32 = 3 << 30;

    #[inline(always)]
    pub(crate) fn source(self) -> SpanSource {
        let index = self.0 & SOURCE_INDEX;
        match self.0 & !SOURCE_INDEX {
            0 => SpanSource::Segment(index),
            Self::CONSTANT => SpanSource::Constant(index),
            Self::EXACT => SpanSource::Exact(index),
            _ => SpanSource::Constant(NONE),
        }
    }
}

impl From<SpanSource> for StoredSource {
    #[inline(always)]
    fn from(source: SpanSource) -> Self {
        let (kind, index) = match source {
            SpanSource::Constant(NONE) => return Self(Self::NO_CONSTANT),
            SpanSource::Segment(index) => (0, index),
            SpanSource::Constant(index) => (Self::CONSTANT, index),
            SpanSource::Exact(index) => (Self::EXACT, index),
        };
        debug_assert!(index <= SOURCE_INDEX, "{source:?}");
        Self(kind | index)
    }
}

/// Some consecutive key intervals of one track: all of them, unless the track is
/// so long that its segments are spread over several buffers.
#[derive(Debug, Clone)]
pub(crate) struct TrackPart {
    /// The track's index in the set.
    pub(crate) track: u32,
    /// The index of its first key in the track.
    pub(crate) first_key: u32,
    pub(crate) spans: Range<usize>,
    /// The end of the last span in seconds.
    pub(crate) end: f64,
    /// The constant held before the first key; [`NONE`] when another part has it.
    pub(crate) before: u32,
    /// The constant held from the last key on; [`NONE`] when another part has it.
    pub(crate) after: u32,
    /// Additional data for the ends of the track, which few tracks need. They are in a box, because a crowd has a
    /// million parts.
    pub(crate) extension: Option<Box<TrackExtension>>,
}

/// Data for a track's ends and the time outside its keys.
#[derive(Debug, Clone)]
pub(crate) struct TrackExtension {
    /// The constant at exactly the last key; [`NONE`] if it is the same as the constant that is held after the key.
    pub(crate) at_end: u32,
    /// The curves, evaluated in f64, that extrapolate before the first key and after the last.
    /// Their parameter is seconds from that key; [`NONE`] where constants are held.
    pub(crate) from_before: u32,
    pub(crate) from_after: u32,
    /// The start and the end of the whole track in seconds.
    pub(crate) span: (f64, f64),
}

impl TrackExtension {
    pub(crate) fn new(times: &[f64]) -> Self {
        Self {
            at_end: NONE,
            from_before: NONE,
            from_after: NONE,
            span: (times[0], times[times.len() - 1]),
        }
    }
}

impl TrackPart {
    /// The constant at exactly the last key, and the curves that extrapolate before the first key and after the last;
    /// [`NONE`] if there is none.
    #[inline]
    pub(crate) fn at_ends(&self) -> [u32; 3] {
        (self.extension.as_ref()).map_or([NONE; 3], |extension| {
            [
                extension.at_end,
                extension.from_before,
                extension.from_after,
            ]
        })
    }

    /// Whether the part is at the start of its track, and whether it is at the end; `begin` is the start of its first
    /// span. Both are true for a track without [`TrackExtension`], which has one part or is not repeated.
    pub(crate) fn is_at_ends(&self, begin: f64) -> [bool; 2] {
        let span = self.extension.as_ref().map(|extension| extension.span);
        span.map_or([true; 2], |(first, last)| {
            [begin <= first, self.end >= last]
        })
    }

    /// Its [`TrackExtension`], which is created if it has none. `times` are the start and the end of the whole track,
    /// seconds.
    pub(crate) fn extension_mut(&mut self, times: (f64, f64)) -> &mut TrackExtension {
        let new = || Box::new(TrackExtension::new(&[times.0, times.1]));
        self.extension.get_or_insert_with(new)
    }
}

impl Spans {
    pub(crate) fn len(&self) -> usize {
        self.starts.len()
    }

    /// The source of a span.
    #[inline(always)]
    pub(crate) fn source(&self, span: usize) -> SpanSource {
        self.sources[span].source()
    }

    pub(crate) fn reserve(&mut self, count: usize) {
        self.starts.reserve(count);
        self.sources.reserve(count);
        self.keys.reserve(count);
    }

    pub(crate) fn reserve_exact(&mut self, count: usize) {
        self.starts.reserve_exact(count);
        self.sources.reserve_exact(count);
        self.keys.reserve_exact(count);
    }

    pub(crate) fn try_reserve_exact(&mut self, count: usize) -> Result<(), TryReserveError> {
        self.starts.try_reserve_exact(count)?;
        self.sources.try_reserve_exact(count)?;
        self.keys.try_reserve_exact(count)
    }

    pub(crate) fn clear(&mut self) {
        self.starts.clear();
        self.sources.clear();
        self.keys.clear();
    }

    /// Adds a range of others.
    pub(crate) fn extend_from(&mut self, others: &Self, range: Range<usize>) {
        self.starts.extend_from_slice(&others.starts[range.clone()]);
        self.sources
            .extend_from_slice(&others.sources[range.clone()]);
        self.keys.extend_from_slice(&others.keys[range]);
    }

    /// The error for a part's span with too many frames to count, with the keys around it.
    #[cold]
    pub(crate) fn gap_too_long(
        &self,
        part: &TrackPart,
        span: usize,
        rate: f64,
    ) -> SampleTimesError {
        let (starts, keys) = (&self.starts, &self.keys);
        // An interval may be divided into several spans, and only the first one starts at a key. For curves that do not
        // pass through their keys, it is not known which spans start at a key, so each span counts as an interval.
        let meets_keys = keys[part.spans.clone()].iter().any(|&key| key != NONE);
        let is_at_key = |&span: &usize| {
            let stands = matches!(self.source(span), SpanSource::Constant(_));
            keys[span] != NONE || stands || !meets_keys
        };
        let until = part.spans.start..=span;
        let behind = until.clone().skip(1).filter(is_at_key).count();
        let from = until.rev().find(is_at_key).unwrap_or(span);
        let to = (span + 1..part.spans.end).find(is_at_key);
        SampleTimesError::GapTooLong {
            track: part.track as usize,
            key: part.first_key as usize + behind,
            frames: (to.map_or(part.end, |to| starts[to]) - starts[from]) * rate,
        }
    }

    /// Emits the runs of one part among the samples of a track copy, in order.
    #[inline(always)]
    pub(crate) fn runs(
        &self,
        part: &TrackPart,
        timeline: &Timeline,
        copy: &TrackCopy,
        emit: &mut impl Emit,
    ) -> Result<(), SampleTimesError> {
        match (&timeline.ticks, copy.position) {
            (_, CopyPosition::At(time)) => {
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
                let track_times = &times[part.track as usize * stride..];
                self.runs_of_times(part, track_times, copy.samples.clone(), emit);
                Ok(())
            }
        }
    }

    /// Emits the runs of one part among frames, in order.
    #[inline(always)]
    fn runs_of_frames(
        &self,
        part: &TrackPart,
        clock: FrameClock,
        copy: &TrackCopy,
        emit: &mut impl Emit,
    ) -> Result<(), SampleTimesError> {
        let (starts, samples) = (&self.starts[part.spans.clone()], &copy.samples);
        let [first, at_end, last] = if copy.is_track() {
            self.runs_outside(part, clock, samples)
        } else {
            self.runs_at_ends(part, clock, samples)
        };
        if let Some(run) = first {
            emit.run(run);
        }
        let mut intervals = IntervalBlocks::new(starts, part.end, clock, samples.clone());
        let mut block = IntervalBlock::zeroed();
        while let Some(filled) = intervals.fill(&mut block) {
            for j in block.occupied {
                let met = filled.start + j;
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
                match self.source(span) {
                    SpanSource::Segment(index) => {
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
                    SpanSource::Constant(constant) => {
                        emit.run(Run::new(first, count, RunSource::Constant(constant)));
                    }
                    SpanSource::Exact(index) => {
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

    /// When the first span of a part starts, in seconds.
    #[inline(always)]
    pub(crate) fn begin(&self, part: &TrackPart) -> f64 {
        let starts = &self.starts[part.spans.clone()];
        starts.first().copied().unwrap_or(part.end)
    }

    /// The runs outside a part's keys, for those of the requested samples that it has: before the first key, at
    /// exactly the last one, and after it.
    pub(crate) fn runs_outside(
        &self,
        part: &TrackPart,
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

    /// The runs of a copy's samples that are outside its ends because of rounding. Every sample of a copy belongs to
    /// its track's keys, even if the values outside are not constants.
    fn runs_at_ends(
        &self,
        part: &TrackPart,
        clock: FrameClock,
        samples: &Range<usize>,
    ) -> [Option<Run>; 3] {
        let begin = self.begin(part);
        let [is_first, is_last] = part.is_at_ends(begin);
        let at_start = is_first.then(|| self.at_start(part));
        let at_end = is_last.then(|| self.at_end(part));
        let (begin, end) = (clock.boundary(begin), clock.boundary(part.end));
        let [(first, from), (last, to)] = if clock.is_reversed() {
            [(at_end, end.first), (at_start, begin.first)]
        } else {
            [(at_start, begin.first), (at_end, end.first)]
        };
        [
            run_among(samples, 0..from as usize, first),
            None,
            run_among(samples, to as usize..usize::MAX, last),
        ]
    }

    /// The value of a part's curve where its first span starts.
    fn at_start(&self, part: &TrackPart) -> RunSource {
        let first = part.spans.start;
        let key = self.keys.get(first).filter(|_| !part.spans.is_empty());
        let constant = [part.before, key.copied().unwrap_or(NONE)];
        self.at_bound(constant, part.spans.clone().next(), -0.5, 0.0)
    }

    /// The value of a part's curve where its last span ends.
    fn at_end(&self, part: &TrackPart) -> RunSource {
        let [at_end, ..] = part.at_ends();
        self.at_bound([at_end, part.after], part.spans.clone().last(), 0.5, 1.0)
    }

    /// The first of two constants that is not [`NONE`], or else a span's value at this parameter; `t` is the
    /// parameter of a curve in f64.
    fn at_bound(
        &self,
        constants: [u32; 2],
        span: Option<usize>,
        parameter: f32,
        t: f64,
    ) -> RunSource {
        let constant = constants.into_iter().find(|&constant| constant != NONE);
        match (constant, span.map(|span| self.source(span))) {
            (Some(constant), _) | (None, Some(SpanSource::Constant(constant))) => {
                RunSource::Constant(constant)
            }
            (None, Some(SpanSource::Segment(index))) => RunSource::at(index, parameter),
            (None, Some(SpanSource::Exact(index))) => RunSource::exact_at(index, t),
            (None, None) => RunSource::Constant(0),
        }
    }

    /// The source of a part's rotation at one of its track's times; `None` if another part has it.
    fn source_within(&self, part: &TrackPart, time: Moment) -> Option<RunSource> {
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
        Some(match self.source(span) {
            SpanSource::Constant(constant) => RunSource::Constant(constant),
            SpanSource::Segment(index) => {
                let parameter = (from_start - length * 0.5) / length;
                RunSource::at(index, round_f32(parameter))
            }
            SpanSource::Exact(index) => RunSource::exact_at(index, from_start / length),
        })
    }

    /// Emits the runs of one part among samples with explicit times.
    #[inline(always)]
    pub(crate) fn runs_of_times(
        &self,
        part: &TrackPart,
        times: &[f64],
        samples: Range<usize>,
        emit: &mut impl Emit,
    ) {
        let starts = &self.starts[part.spans.clone()];
        let begin = starts.first().copied().unwrap_or(part.end);
        let (mut sample, mut i) = (samples.start, 0);
        while sample < samples.end {
            let time = times[sample];
            let (covered, source) = if begin <= time && time < part.end {
                i = interval_at(starts, time, i);
                let (start, span) = (starts[i], part.spans.start + i);
                let end = starts.get(i + 1).copied().unwrap_or(part.end);
                let key = self.keys[span];
                if time == start && key != NONE {
                    (start..time.next_up(), Some(RunSource::Constant(key)))
                } else {
                    let open = if key == NONE { start } else { start.next_up() };
                    (open..end, Some(self.time_source(span, end)))
                }
            } else {
                outside(part, begin, time)
            };
            let run = times[sample..samples.end].iter();
            let count = run.take_while(|time| covered.contains(time)).count();
            if let Some(source) = source {
                emit.run(Run::new(sample, count, source));
            }
            sample += count;
        }
    }

    /// The source of one part's rotation at a time; `None` outside its keys.
    #[inline(always)]
    pub(crate) fn source_at(&self, part: &TrackPart, time: f64) -> Option<RunSource> {
        let starts = &self.starts[part.spans.clone()];
        let i = interval_at(starts, time, 0);
        let end = starts.get(i + 1).copied().unwrap_or(part.end);
        // Written out without a closure, because closures are not always inlined.
        let is_within = !starts.is_empty() && starts[i] <= time && time < end;
        if !is_within {
            return None;
        }
        let span = part.spans.start + i;
        let key = self.keys[span];
        if time == starts[i] && key != NONE {
            return Some(RunSource::Constant(key));
        }
        Some(self.time_source(span, end))
    }

    #[inline(always)]
    fn time_source(&self, span: usize, end: f64) -> RunSource {
        let start = self.starts[span];
        let seconds = end - start;
        match self.source(span) {
            SpanSource::Constant(constant) => RunSource::Constant(constant),
            SpanSource::Exact(index) => {
                let length = seconds;
                let parameter = Parameter { start, length };
                RunSource::Exact { index, parameter }
            }
            SpanSource::Segment(index) => {
                let InSeconds { unit, half, scale } = in_seconds(seconds);
                let distance = Distance::Seconds { start, unit, half };
                let offset = 0.0;
                RunSource::Segment(index, distance, Affine { scale, offset })
            }
        }
    }
}

/// The run of those requested samples that are in a range, if there is a source for them.
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

/// The source of a sample outside a part's keys (`None` if another part has it), and the times with the same source.
/// Not inlined, so that the usual path stays small.
#[inline(never)]
pub(crate) fn outside(part: &TrackPart, begin: f64, time: f64) -> (Range<f64>, Option<RunSource>) {
    let [at_end, from_before, from_after] = part.at_ends();
    if time < begin {
        let source = RunSource::outside(part.before, from_before, begin, 1.0);
        (f64::NEG_INFINITY..begin, source)
    } else if time == part.end && at_end != NONE {
        (time..time.next_up(), RunSource::held(at_end))
    } else {
        let source = RunSource::outside(part.after, from_after, part.end, 1.0);
        (part.end..f64::INFINITY, source)
    }
}
