//! Which segment gives which samples: a track's spans met with the samples asked
//! for. What comes out are runs, the unit of work of every device. Only here do
//! seconds turn into frames, in f64; a run's numbers do not depend on where a
//! window of work starts, so results are the same for every way of cutting it.

use std::ops::Range;

use crate::clock::{FramesError, Ticks, Timeline};
use crate::cycle::Cycle;
use crate::frame_clock::{Clock, CopyClock, FrameClock, in_frames};
use crate::numeric::{frame_number, round_quat};
use crate::prepare::{NONE, Part, Prepared, Source};
use crate::tracks::LATEST;

/// Consecutive samples of one track with one source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// The first sample.
    pub(crate) sample: usize,
    /// Number of samples.
    pub(crate) count: usize,
    pub(crate) source: RunSource,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum RunSource {
    /// Store a constant.
    Constant(u32),
    /// Evaluate a segment at `distance × scale + offset`.
    Segment {
        index: u32,
        distance: Distance,
        scale: f32,
        offset: f32,
    },
    /// Evaluate a cubic in f64 on the host.
    Exact { index: u32, parameter: Parameter },
}

/// A sample's distance from the middle of its segment.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Distance {
    /// Frames from the whole frame nearest to the middle, for the run's first
    /// sample; one more for each sample after it.
    Frames { first: i32 },
    /// Seconds from the middle; the samples' times tell.
    Seconds { middle: f64 },
}

/// Where the interval of a cubic that is evaluated in f64 starts, and its length.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Parameter {
    Frames { start: f64, frames: f64 },
    Seconds { start: f64, seconds: f64 },
}

/// Takes runs. A trait rather than a closure: a closure's body is not compiled for
/// the vector width of the function that it is inlined into.
pub(crate) trait Emit {
    fn run(&mut self, run: Run);
}

impl<F: FnMut(Run)> Emit for F {
    #[inline(always)]
    fn run(&mut self, run: Run) {
        self(run);
    }
}

impl Prepared {
    /// The runs of one part within the samples of a cycle, in order.
    pub(crate) fn runs(
        &self,
        part: &Part,
        timeline: &Timeline,
        cycle: &Cycle,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        match &timeline.ticks {
            Ticks::Frames { rate, start } if !cycle.is_own() => {
                let clock = FrameClock::new(*rate, *start, part.end);
                self.copy_runs(part, CopyClock::new(clock, cycle), cycle, emit)
            }
            _ => self.own_runs(part, timeline, cycle.samples.clone(), emit),
        }
    }

    /// As [`Prepared::runs`], of the track itself and not of a copy.
    #[inline(always)]
    pub(crate) fn own_runs(
        &self,
        part: &Part,
        timeline: &Timeline,
        samples: Range<usize>,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        match &timeline.ticks {
            Ticks::Frames { rate, start } => {
                let clock = FrameClock::new(*rate, *start, part.end);
                self.frame_runs(part, clock, samples, emit)
            }
            Ticks::Times { times, stride } => {
                let own = &times[part.track as usize * stride..];
                self.time_runs(part, own, samples, emit);
                Ok(())
            }
        }
    }

    /// The rotation of sample `sample` in a run of a cubic that the kernels do not
    /// take.
    pub(crate) fn exact(
        &self,
        index: u32,
        parameter: Parameter,
        timeline: &Timeline,
        track: usize,
        sample: usize,
    ) -> [f32; 4] {
        let t = match parameter {
            Parameter::Frames { start, frames } => (sample as f64 - start) / frames,
            Parameter::Seconds { start, seconds } => {
                // Further away than keys may be, a curve's powers overflow.
                let time = timeline.time(track, sample).clamp(-LATEST, LATEST);
                (time - start) / seconds
            }
        };
        round_quat(self.exact[index as usize].value(t))
    }

    /// Apart from the rest, which stays small.
    #[inline(never)]
    fn copy_runs(
        &self,
        part: &Part,
        clock: CopyClock,
        cycle: &Cycle,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        let samples = cycle.samples.clone();
        if cycle.sign < 0.0 {
            return self.backward_runs(part, clock, samples, emit);
        }
        self.frame_runs(part, clock, samples, emit)
    }

    #[inline(always)]
    fn frame_runs(
        &self,
        part: &Part,
        clock: impl Clock,
        samples: Range<usize>,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        let starts = &self.spans.starts[part.spans.clone()];
        let sources = &self.spans.sources[part.spans.clone()];
        let keys = &self.spans.keys[part.spans.clone()];
        if part.before != NONE {
            let begin = clock.boundary(starts.first().copied().unwrap_or(part.end));
            clip(0, begin.first as usize, &samples, part.before, emit);
        }
        if let Some(from) = part.beyond.as_ref().map(|beyond| beyond.from_before)
            && from != NONE
        {
            let begin = clock.boundary(starts.first().copied().unwrap_or(part.end));
            let before = 0..begin.first as usize;
            extrapolate(before, &samples, from, clock, begin.frame, emit);
        }
        // The span that holds the first sample; a time's own rounding may put it one
        // further.
        let mut skipped = 0;
        if samples.start > 0
            && let Some(first_time) = clock.own_time(samples.start)
        {
            let found = starts.partition_point(|&start| start <= first_time);
            skipped = found.saturating_sub(2);
        }
        let (first_frame, last_frame) = (samples.start as i64, samples.end as i64);
        // Its own, and not borrowed: the compiler must see that nothing else is in it.
        let mut spans = SpanBlock::new();
        'blocks: for block in (skipped..starts.len()).step_by(SpanBlock::LEN) {
            let end = (block + SpanBlock::LEN).min(starts.len());
            let next = starts.get(end).copied().unwrap_or(part.end);
            spans.fill(clock, &starts[block..end], next);
            let (sources, keys) = (&sources[block..end], &keys[block..end]);
            for (j, (&source, &key)) in sources.iter().zip(keys).enumerate() {
                let (mut first, to) = (spans.first[j], spans.first[j + 1]);
                if first >= last_frame {
                    break 'blocks;
                }
                if first == to || to <= first_frame {
                    continue;
                }
                if key != NONE && spans.on_frame[j] == 1 && first >= 0 {
                    clip(first as usize, first as usize + 1, &samples, key, emit);
                    first += 1;
                }
                let (first, last) = (first.max(first_frame), to.min(last_frame));
                if first >= last {
                    continue;
                }
                let source = match source {
                    Source::Segment(index) => {
                        let whole = spans.whole[j];
                        // Distances fit 32 bits if that of the last sample does.
                        if (last - whole).abs() >= DISTANCES || (first - whole).abs() >= DISTANCES {
                            let span = part.spans.start + block + j;
                            return Err(self.gap_too_long(part, span, clock.rate()));
                        }
                        RunSource::Segment {
                            index,
                            distance: Distance::Frames {
                                first: (first - whole) as i32,
                            },
                            scale: spans.scale[j],
                            offset: spans.offset[j],
                        }
                    }
                    Source::Constant(constant) => RunSource::Constant(constant),
                    Source::Exact(index) => RunSource::Exact {
                        index,
                        parameter: Parameter::Frames {
                            start: spans.frame[j],
                            frames: spans.frame[j + 1] - spans.frame[j],
                        },
                    },
                };
                emit.run(Run {
                    sample: first as usize,
                    count: (last - first) as usize,
                    source,
                });
            }
        }
        let Some(beyond) = &part.beyond else {
            if part.after != NONE {
                let end = clock.boundary(part.end);
                clip(end.first as usize, usize::MAX, &samples, part.after, emit);
            }
            return Ok(());
        };
        let end = clock.boundary(part.end);
        let mut first = end.first as usize;
        if beyond.at_end != NONE && first as f64 == end.frame {
            clip(first, first + 1, &samples, beyond.at_end, emit);
            first += 1;
        }
        if part.after != NONE {
            clip(first, usize::MAX, &samples, part.after, emit);
        }
        if beyond.from_after != NONE {
            let after = first..usize::MAX;
            extrapolate(after, &samples, beyond.from_after, clock, end.frame, emit);
        }
        Ok(())
    }
}

/// Emits those of the samples `outside` the keys that are asked for, on a curve whose
/// parameter is seconds from the frame coordinate `end`.
#[inline(never)]
fn extrapolate(
    outside: Range<usize>,
    samples: &Range<usize>,
    index: u32,
    clock: impl Clock,
    end: f64,
    emit: &mut impl Emit,
) {
    let (first, last) = (
        outside.start.max(samples.start),
        outside.end.min(samples.end),
    );
    if first < last {
        emit.run(Run {
            sample: first,
            count: last - first,
            source: RunSource::Exact {
                index,
                parameter: Parameter::Frames {
                    start: end,
                    frames: clock.rate(),
                },
            },
        });
    }
}

/// Emits the part of a constant's samples that lies within `samples`.
#[inline(always)]
pub(crate) fn clip(
    from: usize,
    to: usize,
    samples: &Range<usize>,
    constant: u32,
    emit: &mut impl Emit,
) {
    let (sample, to) = (from.max(samples.start), to.min(samples.end));
    if sample < to {
        emit.run(Run {
            sample,
            count: to - sample,
            source: RunSource::Constant(constant),
        });
    }
}

/// Distances in frames are whole numbers of 32 bits.
pub(crate) const COUNTABLE: f64 = DISTANCES as f64;

const DISTANCES: i64 = 1 << 31;

/// The frame coordinates of consecutive spans, and what their samples' parameters
/// follow from. Worked out in vector lanes: plain loops over arrays, no calls.
struct SpanBlock {
    /// Where each span starts, and at the end where the last one ends, in frames.
    frame: [f64; Self::LEN + 1],
    /// The first whole frame not before `frame`.
    first: [i64; Self::LEN + 1],
    /// Whether that is `frame` itself: 1 or 0.
    on_frame: [i64; Self::LEN],
    /// The whole frame nearest to each span's middle.
    whole: [i64; Self::LEN],
    scale: [f32; Self::LEN],
    offset: [f32; Self::LEN],
}

impl SpanBlock {
    const LEN: usize = 32;

    #[inline(always)]
    fn new() -> Self {
        Self {
            frame: [0.0; Self::LEN + 1],
            first: [0; Self::LEN + 1],
            on_frame: [0; Self::LEN],
            whole: [0; Self::LEN],
            scale: [0.0; Self::LEN],
            offset: [0.0; Self::LEN],
        }
    }

    /// At most [`Self::LEN`] spans; `next` is where the last of them ends.
    #[inline(always)]
    fn fill(&mut self, clock: impl Clock, starts: &[f64], next: f64) {
        let count = starts.len();
        let frame = &mut self.frame[..count];
        let first = &mut self.first[..count];
        let on_frame = &mut self.on_frame[..count];
        for j in 0..count {
            let boundary = clock.boundary(starts[j]);
            frame[j] = boundary.frame;
            first[j] = frame_number(boundary.first);
            on_frame[j] = i64::from(boundary.first == boundary.frame);
        }
        let end = clock.boundary(next);
        (self.frame[count], self.first[count]) = (end.frame, frame_number(end.first));
        let from = &self.frame[..count];
        let to = &self.frame[1..=count];
        let whole = &mut self.whole[..count];
        let scales = &mut self.scale[..count];
        let offsets = &mut self.offset[..count];
        for j in 0..count {
            let span = in_frames(from[j], to[j], 1.0);
            whole[j] = frame_number(span.whole);
            scales[j] = span.scale;
            offsets[j] = span.offset;
        }
    }
}
