//! Finds the span of a prepared track, or the interval between keys, that holds an explicit time.
//! Explicit times come in any order.

use std::ops::Range;

use crate::math::canonical::round_f32;
use crate::shader::{IS_KEY, KeySample};
use crate::time::frame_clock::finite_scale;
use crate::time::runs::{Affine, Distance, Emit, Parameter, Run, RunSource};
use crate::time::spans::{NONE, Part, Source, Spans};

impl Spans {
    /// Emits the runs of one part among samples with explicit times.
    #[inline(always)]
    pub(crate) fn runs_of_times(
        &self,
        part: &Part,
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
    pub(crate) fn source_at(&self, part: &Part, time: f64) -> Option<RunSource> {
        let starts = &self.starts[part.spans.clone()];
        let i = interval_at(starts, time, 0);
        let end = starts.get(i + 1).copied().unwrap_or(part.end);
        // Written out: closures are not always inlined.
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
        match self.sources[span] {
            Source::Constant(constant) => RunSource::Constant(constant),
            Source::Exact(index) => {
                let length = seconds;
                let parameter = Parameter { start, length };
                RunSource::Exact { index, parameter }
            }
            Source::Segment(index) => {
                let half = seconds * 0.5;
                let (scale, offset) = (finite_scale(1.0 / seconds), 0.0);
                let distance = Distance::Seconds { start, half };
                RunSource::Segment(index, distance, Affine { scale, offset })
            }
        }
    }
}

/// The source of a sample outside a part's keys, `None` if another part has it, and the times that
/// have the same source. Not inlined, so that the usual path stays small.
#[inline(never)]
fn outside(part: &Part, begin: f64, time: f64) -> (Range<f64>, Option<RunSource>) {
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

/// The key before a time and the time's parameter after it; `near` is the key to look at first.
#[inline(always)]
pub(crate) fn key_sample(times: &[f64], time: f64, near: usize) -> KeySample {
    let key = key_before(times, time, near);
    let parameter = match key & IS_KEY {
        0 => parameter(times[key as usize], times[key as usize + 1], time),
        _ => 0.0,
    };
    KeySample { key, parameter }
}

/// The parameter of a time in the interval from `start` to `end`.
#[inline(always)]
fn parameter(start: f64, end: f64, time: f64) -> f32 {
    let seconds = end - start;
    let from_middle = (time - start) - seconds * 0.5;
    round_f32(from_middle) * finite_scale(1.0 / seconds) + 0.0
}

/// The last key that is not after a time, or the first one for earlier times. The bit `IS_KEY` is
/// set if the rotation is that key itself. `near` is the key to look at first.
#[inline(always)]
pub(crate) fn key_before(times: &[f64], time: f64, near: usize) -> u32 {
    let last = times.len() - 1;
    if time >= times[last] {
        return IS_KEY | last as u32;
    } else if time < times[0] {
        return IS_KEY;
    }
    let key = interval_at(times, time, near);
    key as u32 | if time == times[key] { IS_KEY } else { 0 }
}

/// The interval that holds a time, given when each interval starts; the first one for earlier
/// times. `near` is the interval to look at first.
#[inline(always)]
pub(crate) fn interval_at(starts: &[f64], time: f64, near: usize) -> usize {
    let holds = |i: usize| {
        starts.get(i).is_some_and(|&start| start <= time)
            && starts.get(i + 1).is_none_or(|&next| time < next)
    };
    // Times mostly increase: the same interval and the next one are tried before a search.
    if holds(near) {
        near
    } else if holds(near + 1) {
        near + 1
    } else {
        let behind = starts.partition_point(|&start| start <= time);
        behind.saturating_sub(1)
    }
}
