//! Which segment gives which samples: a track's spans met with the samples asked
//! for. What comes out are runs, the unit of work of every device. Only here, and where its
//! spans' blocks are filled, do seconds turn into frames, in f64; a run's numbers do not
//! depend on where a window of work starts, so results are the same for every way of cutting
//! it.

use std::ops::Range;

use crate::math::canonical::round_quat;
use crate::prepare::{NONE, Part, Prepared, Source};
use crate::time::frame_clock::{Clock, CopyClock, FrameClock};
use crate::time::frames::{FramesError, Ticks, Timeline};
use crate::time::interval_block::{SpanBlock, SpanBlocks};
use crate::time::wrap::Cycle;
use crate::tracks::check::LATEST;

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
        let samples = cycle.samples.clone();
        match &timeline.ticks {
            Ticks::Frames { rate, start } => {
                let clock = FrameClock::new(*rate, *start, part.end);
                if cycle.is_own() {
                    self.frame_runs(part, clock, samples, emit)
                } else {
                    self.copy_runs(part, CopyClock::new(clock, cycle), cycle, emit)
                }
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
        runs_before(self, part, clock, &samples, emit);
        let mut spans = SpanBlocks::new(self, part, clock, samples.clone());
        let mut block = SpanBlock::new();
        while let Some(own) = spans.fill(&mut block) {
            for j in block.occupied {
                let span = own.start + j;
                let (mut first, last) = (block.first[j], block.first[j + 1]);
                let key = self.spans.keys[span];
                if key != NONE && block.is_held[j] == 1 {
                    emit.run(Run {
                        sample: first,
                        count: 1,
                        source: RunSource::Constant(key),
                    });
                    first += 1;
                }
                if first >= last {
                    continue;
                }
                let source = match self.spans.sources[span] {
                    Source::Segment(index) => {
                        let distance = |sample: usize| sample as f64 - block.whole[j];
                        // Distances fit 32 bits if that of the last sample does.
                        if distance(first).abs() >= COUNTABLE || distance(last).abs() >= COUNTABLE {
                            return Err(self.gap_too_long(part, span, clock.rate()));
                        }
                        RunSource::Segment {
                            index,
                            distance: Distance::Frames {
                                first: distance(first) as i32,
                            },
                            scale: block.scale[j],
                            offset: block.offset[j],
                        }
                    }
                    Source::Constant(constant) => RunSource::Constant(constant),
                    Source::Exact(index) => RunSource::Exact {
                        index,
                        parameter: block.parameter(j),
                    },
                };
                emit.run(Run {
                    sample: first,
                    count: last - first,
                    source,
                });
            }
        }
        runs_after(part, clock, &samples, emit);
        Ok(())
    }
}

/// The runs before the first key.
pub(crate) fn runs_before(
    prepared: &Prepared,
    part: &Part,
    clock: impl Clock,
    samples: &Range<usize>,
    emit: &mut impl Emit,
) {
    let starts = &prepared.spans.starts[part.spans.clone()];
    if part.before != NONE {
        let begin = clock.boundary(starts.first().copied().unwrap_or(part.end));
        clip(0, begin.first as usize, samples, part.before, emit);
    }
    if let Some(from) = part.beyond.as_ref().map(|beyond| beyond.from_before)
        && from != NONE
    {
        let begin = clock.boundary(starts.first().copied().unwrap_or(part.end));
        let before = 0..begin.first as usize;
        extrapolate(before, samples, from, clock, begin.frame, emit);
    }
}

/// The runs from the last key on.
pub(crate) fn runs_after(
    part: &Part,
    clock: impl Clock,
    samples: &Range<usize>,
    emit: &mut impl Emit,
) {
    let Some(beyond) = &part.beyond else {
        if part.after != NONE {
            let end = clock.boundary(part.end);
            clip(end.first as usize, usize::MAX, samples, part.after, emit);
        }
        return;
    };
    let end = clock.boundary(part.end);
    let mut first = end.first as usize;
    if beyond.at_end != NONE && first as f64 == end.frame {
        clip(first, first + 1, samples, beyond.at_end, emit);
        first += 1;
    }
    if part.after != NONE {
        clip(first, usize::MAX, samples, part.after, emit);
    }
    if beyond.from_after != NONE {
        let after = first..usize::MAX;
        extrapolate(after, samples, beyond.from_after, clock, end.frame, emit);
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
pub(crate) const COUNTABLE: f64 = (1u64 << 31) as f64;
