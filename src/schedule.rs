//! Which segment gives which samples: a track's spans met with the samples asked
//! for. What comes out are runs, the unit of work of every device. Only here do
//! seconds turn into frames, in f64; a run's numbers do not depend on where a
//! window of work starts, so results are the same for every way of cutting it.

use std::ops::Range;

use crate::clock::{FramesError, Ticks, Timeline};
use crate::frame_rate::FrameRate;
use crate::numeric::{round_f32, round_quat, unit};
use crate::prepare::{NONE, Part, Prepared, Source, Span};

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

impl Prepared {
    /// The runs of one part within a range of samples, in order.
    pub(crate) fn runs(
        &self,
        part: &Part,
        timeline: &Timeline,
        samples: Range<usize>,
        emit: impl FnMut(Run),
    ) -> Result<(), FramesError> {
        match &timeline.ticks {
            Ticks::Frames { rate, start } => {
                let clock = FrameClock::new(*rate, *start, part.end);
                self.frame_runs(part, clock, samples, emit)
            }
            Ticks::Times { times, stride } => {
                let own = &times[part.track * stride..];
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
                (timeline.time(track, sample) - start) / seconds
            }
        };
        round_quat(unit(self.exact[index as usize].rotation(t)))
    }

    fn frame_runs(
        &self,
        part: &Part,
        clock: FrameClock,
        samples: Range<usize>,
        mut emit: impl FnMut(Run),
    ) -> Result<(), FramesError> {
        let spans = &self.spans[part.spans.clone()];
        let begin = clock.boundary(spans.first().map_or(part.end, |span| span.start));
        let end = clock.boundary(part.end);
        let mut emit = |from: usize, to: usize, source| {
            let (sample, to) = (from.max(samples.start), to.min(samples.end));
            if sample < to {
                emit(Run {
                    sample,
                    count: to - sample,
                    source,
                });
            }
        };
        if part.before != NONE {
            emit(0, begin.first, RunSource::Constant(part.before));
        }
        // The span that holds the first sample; a time's own rounding may put it one
        // further.
        let first_time = clock.time(samples.start);
        let skipped = spans
            .partition_point(|span| span.start <= first_time)
            .saturating_sub(2);
        let mut to = spans
            .get(skipped)
            .map_or(end, |span| clock.boundary(span.start));
        for (i, span) in spans.iter().enumerate().skip(skipped) {
            let from = to;
            to = spans
                .get(i + 1)
                .map_or(end, |next| clock.boundary(next.start));
            if from.first >= samples.end {
                break;
            }
            let mut first = from.first;
            if first == to.first {
                continue;
            }
            if span.key != NONE && first as f64 == from.frame {
                emit(first, first + 1, RunSource::Constant(span.key));
                first += 1;
            }
            let (first, last) = (first.max(samples.start), to.first.min(samples.end));
            if first < last {
                let frames = to.frame - from.frame;
                let source = frame_source(span, from.frame, to.frame, first, last).ok_or(
                    FramesError::GapTooLong {
                        track: part.track,
                        key: i,
                        frames,
                    },
                )?;
                emit(first, last, source);
            }
        }
        if part.after != NONE {
            emit(end.first, usize::MAX, RunSource::Constant(part.after));
        }
        Ok(())
    }

    fn time_runs(
        &self,
        part: &Part,
        times: &[f64],
        samples: Range<usize>,
        mut emit: impl FnMut(Run),
    ) {
        let spans = &self.spans[part.spans.clone()];
        let mut sample = samples.start;
        let mut i = 0;
        while sample < samples.end {
            let time = times[sample];
            // Times mostly increase: look here and next before searching.
            let holds = |i: usize| {
                spans.get(i).is_some_and(|span| span.start <= time)
                    && time < spans.get(i + 1).map_or(part.end, |next| next.start)
            };
            if !holds(i) {
                let found = spans.partition_point(|span| span.start <= time);
                i = if holds(i + 1) {
                    i + 1
                } else {
                    found.saturating_sub(1)
                };
            }
            let (covered, source) = if holds(i) {
                let span = &spans[i];
                let end = spans.get(i + 1).map_or(part.end, |next| next.start);
                if time == span.start && span.key != NONE {
                    (
                        span.start..time.next_up(),
                        Some(RunSource::Constant(span.key)),
                    )
                } else {
                    let open = if span.key == NONE {
                        span.start
                    } else {
                        span.start.next_up()
                    };
                    (open..end, Some(time_source(span, end)))
                }
            } else if time >= part.end {
                (part.end..f64::INFINITY, constant_source(part.after))
            } else {
                let begin = spans.first().map_or(part.end, |span| span.start);
                (f64::NEG_INFINITY..begin, constant_source(part.before))
            };
            let run = times[sample..samples.end].iter();
            let count = run.take_while(|time| covered.contains(time)).count();
            if let Some(source) = source {
                emit(Run {
                    sample,
                    count,
                    source,
                });
            }
            sample += count;
        }
    }
}

/// Key times as frames: exact ratios in f64.
#[derive(Clone, Copy)]
struct FrameClock {
    rate: FrameRate,
    start: f64,
    /// Frames by which the rounding of a key's time may move it.
    rounding: f64,
}

/// Where one span ends and the next starts.
#[derive(Clone, Copy)]
struct Boundary {
    /// Its frame coordinate.
    frame: f64,
    /// The first whole frame not before it, and not before 0.
    first: usize,
}

impl FrameClock {
    /// `latest`: the largest time that will be asked for.
    fn new(rate: FrameRate, start: f64, latest: f64) -> Self {
        let rounding = 4.0 * f64::EPSILON * rate.frames_in(latest.abs().max(start.abs()));
        Self {
            rate,
            start,
            rounding,
        }
    }

    /// A time within its own rounding of a whole frame is that frame, so a sample on
    /// a key returns the key at hour 24 too.
    fn boundary(self, time: f64) -> Boundary {
        let exact = self.rate.frames_in(time - self.start);
        let whole = nearest_whole(exact);
        let frame = if (exact - whole).abs() <= self.rounding {
            whole
        } else {
            exact
        };
        let first = if whole < frame { whole + 1.0 } else { whole };
        Boundary {
            frame,
            first: first as usize,
        } // the cast saturates at 0
    }

    fn time(self, frame: usize) -> f64 {
        self.start + self.rate.time_of(frame as u64)
    }
}

/// The whole number nearest to `x`, for |x| < 2^51: what lies behind the point is
/// rounded away in the sum. A call to `round` costs more than all else here.
fn nearest_whole(x: f64) -> f64 {
    const SHIFT: f64 = 1.5 * (1u64 << 52) as f64;
    (x + SHIFT) - SHIFT
}

/// The source of the frames `first` to `last` (not included) of a span that covers
/// the frame coordinates `from` to `to`; `None` when they cannot be counted in 32
/// bits.
fn frame_source(span: &Span, from: f64, to: f64, first: usize, last: usize) -> Option<RunSource> {
    match span.source {
        Source::Constant(constant) => Some(RunSource::Constant(constant)),
        Source::Exact(index) => {
            let parameter = Parameter::Frames {
                start: from,
                frames: to - from,
            };
            Some(RunSource::Exact { index, parameter })
        }
        Source::Segment(index) => {
            let middle = (from + to) * 0.5;
            let whole = nearest_whole(middle);
            let scale = span.extent / (to - from);
            let count =
                |frame: usize| -> Option<i32> { i32::try_from(frame as i64 - whole as i64).ok() };
            count(last)?;
            Some(RunSource::Segment {
                index,
                distance: Distance::Frames {
                    first: count(first)?,
                },
                // Finite: a segment far shorter than a frame holds at most the
                // frame at distance 0.
                scale: round_f32(scale.min(f64::from(f32::MAX))),
                offset: round_f32((whole - middle) * scale),
            })
        }
    }
}

fn time_source(span: &Span, end: f64) -> RunSource {
    let seconds = end - span.start;
    match span.source {
        Source::Constant(constant) => RunSource::Constant(constant),
        Source::Exact(index) => RunSource::Exact {
            index,
            parameter: Parameter::Seconds {
                start: span.start,
                seconds,
            },
        },
        Source::Segment(index) => RunSource::Segment {
            index,
            distance: Distance::Seconds {
                middle: span.start + seconds * 0.5,
            },
            scale: round_f32((span.extent / seconds).min(f64::from(f32::MAX))),
            offset: 0.0,
        },
    }
}

fn constant_source(constant: u32) -> Option<RunSource> {
    (constant != NONE).then_some(RunSource::Constant(constant))
}
