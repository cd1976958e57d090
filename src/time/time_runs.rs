//! Runs of explicit times, which come in any order.

use std::ops::Range;

use crate::prepare::{Beyond, NONE, Part, Prepared, Source};
use crate::time::frame_clock::finite_scale;
use crate::time::runs::{Distance, Emit, Parameter, Run, RunSource};

impl Prepared {
    /// The runs of one part among some samples, whose times are given.
    #[inline(always)]
    pub(crate) fn time_runs(
        &self,
        part: &Part,
        times: &[f64],
        samples: Range<usize>,
        emit: &mut impl Emit,
    ) {
        let starts = &self.spans.starts[part.spans.clone()];
        let mut sample = samples.start;
        let mut i = 0;
        while sample < samples.end {
            let time = times[sample];
            let end_of = |i: usize| starts.get(i + 1).copied().unwrap_or(part.end);
            // Times mostly increase: look here and next before searching.
            let holds =
                |i: usize| starts.get(i).is_some_and(|&start| start <= time) && time < end_of(i);
            if !holds(i) {
                i = if holds(i + 1) {
                    i + 1
                } else {
                    starts
                        .partition_point(|&start| start <= time)
                        .saturating_sub(1)
                };
            }
            let (covered, source) = if holds(i) {
                let (start, end) = (starts[i], end_of(i));
                let key = self.spans.keys[part.spans.start + i];
                if time == start && key != NONE {
                    (start..time.next_up(), Some(RunSource::Constant(key)))
                } else {
                    let open = if key == NONE { start } else { start.next_up() };
                    let source = self.time_source(part.spans.start + i, end);
                    (open..end, Some(source))
                }
            } else if let Some(beyond) = &part.beyond {
                sample += outside(
                    self,
                    part,
                    beyond,
                    &times[sample..samples.end],
                    sample,
                    emit,
                );
                continue;
            } else if time >= part.end {
                (part.end..f64::INFINITY, constant_source(part.after))
            } else {
                let begin = starts.first().copied().unwrap_or(part.end);
                (f64::NEG_INFINITY..begin, constant_source(part.before))
            };
            let run = times[sample..samples.end].iter();
            let count = run.take_while(|time| covered.contains(time)).count();
            if let Some(source) = source {
                emit.run(Run {
                    sample,
                    count,
                    source,
                });
            }
            sample += count;
        }
    }

    /// What gives the rotation of one part at a time; nothing outside its keys.
    #[inline(always)]
    pub(crate) fn source_at(&self, part: &Part, time: f64) -> Option<RunSource> {
        let (span, end) = self.span_at(part, time)?;
        let key = self.spans.keys[span];
        if time == self.spans.starts[span] && key != NONE {
            return Some(RunSource::Constant(key));
        }
        Some(self.time_source(span, end))
    }

    /// The span of one part that holds a time, and where it ends; nothing outside its keys.
    #[inline(always)]
    pub(crate) fn span_at(&self, part: &Part, time: f64) -> Option<(usize, f64)> {
        let starts = &self.spans.starts[part.spans.clone()];
        let i = match starts.len() {
            0 => return None,
            1 => 0,
            _ => starts
                .partition_point(|&start| start <= time)
                .saturating_sub(1),
        };
        let end = starts.get(i + 1).copied().unwrap_or(part.end);
        // Written out: closures are not always inlined.
        (starts[i] <= time && time < end).then_some((part.spans.start + i, end))
    }

    #[inline(always)]
    fn time_source(&self, span: usize, end: f64) -> RunSource {
        let start = self.spans.starts[span];
        let seconds = end - start;
        match self.spans.sources[span] {
            Source::Constant(constant) => RunSource::Constant(constant),
            Source::Exact(index) => RunSource::Exact {
                index,
                parameter: Parameter::Seconds { start, seconds },
            },
            Source::Segment(index) => RunSource::Segment {
                index,
                distance: Distance::Seconds {
                    middle: start + seconds * 0.5,
                },
                scale: finite_scale(1.0 / seconds),
                offset: 0.0,
            },
        }
    }
}

/// Emits the run that the first of some times, outside a part's keys, is in; how many of
/// them that takes. Apart, so that what is usual stays small.
#[inline(never)]
fn outside(
    prepared: &Prepared,
    part: &Part,
    beyond: &Beyond,
    times: &[f64],
    sample: usize,
    emit: &mut impl Emit,
) -> usize {
    let time = times[0];
    let starts = &prepared.spans.starts[part.spans.clone()];
    let begin = starts.first().copied().unwrap_or(part.end);
    let (covered, source) = if time < begin {
        let source = source_beyond(part.before, beyond.from_before, begin);
        (f64::NEG_INFINITY..begin, source)
    } else if time == part.end && beyond.at_end != NONE {
        (time..time.next_up(), constant_source(beyond.at_end))
    } else {
        let source = source_beyond(part.after, beyond.from_after, part.end);
        (part.end..f64::INFINITY, source)
    };
    let count = times
        .iter()
        .take_while(|time| covered.contains(time))
        .count();
    if let Some(source) = source {
        emit.run(Run {
            sample,
            count,
            source,
        });
    }
    count
}

/// What gives the samples outside the keys: a constant, or a curve from the end on, or
/// another part.
fn source_beyond(constant: u32, curve: u32, end: f64) -> Option<RunSource> {
    match (constant_source(constant), curve) {
        (None, NONE) => None,
        (None, index) => Some(RunSource::Exact {
            index,
            parameter: Parameter::Seconds {
                start: end,
                seconds: 1.0,
            },
        }),
        (held, _) => held,
    }
}

fn constant_source(constant: u32) -> Option<RunSource> {
    (constant != NONE).then_some(RunSource::Constant(constant))
}
