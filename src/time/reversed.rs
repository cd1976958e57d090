//! A part of a track that runs backwards: its spans from the last to the first, the
//! parameter falling.

use std::ops::Range;

use crate::prepare::{NONE, Part, Prepared, Source};
use crate::time::frame_clock::{Clock, CopyClock, in_frames};
use crate::time::frames::FramesError;
use crate::time::runs::{COUNTABLE, Distance, Emit, Parameter, Run, RunSource, clip};

impl Prepared {
    /// The runs of one part in a copy that runs backwards, in order.
    pub(crate) fn backward_runs(
        &self,
        part: &Part,
        clock: CopyClock,
        samples: Range<usize>,
        emit: &mut impl Emit,
    ) -> Result<(), FramesError> {
        let starts = &self.spans.starts[part.spans.clone()];
        let end = clock.boundary(part.end);
        if part.after != NONE {
            clip(0, end.first as usize, &samples, part.after, emit);
        }
        let mut from = end;
        let mut key = if part.after == NONE { NONE } else { part.after };
        for (j, &start) in starts.iter().enumerate().rev() {
            let span = part.spans.start + j;
            let to = clock.boundary(start);
            let mut first = from.first as usize; // saturates at 0
            if key != NONE && first as f64 == from.frame && first < to.first as usize {
                clip(first, first + 1, &samples, key, emit);
                first += 1;
            }
            let first = first.max(samples.start);
            let last = (to.first as usize).min(samples.end);
            if first < last {
                let source = match self.spans.sources[span] {
                    Source::Constant(constant) => RunSource::Constant(constant),
                    Source::Exact(index) => RunSource::Exact {
                        index,
                        parameter: Parameter::Frames {
                            start: to.frame,
                            frames: from.frame - to.frame,
                        },
                    },
                    Source::Segment(index) => {
                        let run = in_frames(from.frame, to.frame, -1.0);
                        let distance = |sample: usize| sample as f64 - run.whole;
                        if distance(first).abs() >= COUNTABLE || distance(last).abs() >= COUNTABLE {
                            return Err(self.gap_too_long(part, span, clock.rate()));
                        }
                        RunSource::Segment {
                            index,
                            distance: Distance::Frames {
                                first: distance(first) as i32,
                            },
                            scale: run.scale,
                            offset: run.offset,
                        }
                    }
                };
                emit.run(Run {
                    sample: first,
                    count: last - first,
                    source,
                });
            }
            (from, key) = (to, self.spans.keys[span]);
        }
        if part.before != NONE {
            clip(from.first as usize, usize::MAX, &samples, part.before, emit);
        }
        Ok(())
    }
}
