//! The fallback of evaluation from keys. A sample whose curve turns too far for the small-angle
//! series is `UNRESOLVED`; here the intervals of such samples alone are prepared, and the samples
//! are overwritten.

use std::ops::Range;

use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::cpu::streaming::Output;
use crate::from_keys::UNRESOLVED;
use crate::prepare::batch::PART_INTERVALS;
use crate::prepare::error::SetError;
use crate::prepare::request::Request;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::Ticks;
use crate::time::wrap::TrackCopy;

/// Two unresolved intervals with at most this many others between them are prepared together.
const APART: usize = 2;

/// Consecutive samples of a track, some of which may be unresolved.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) request: &'a Request<'a>,
    pub(crate) index: usize,
    /// The first sample.
    pub(crate) first: usize,
    /// The index of a key at or before all of the samples between keys.
    pub(crate) key: usize,
}

/// Intervals with unresolved samples, and the samples from the first of these to the last.
struct Unresolved {
    intervals: Range<usize>,
    samples: Range<usize>,
}

/// What is prepared together, with their places in the result.
type Group<'o> = Vec<(Unresolved, &'o mut [[f32; 4]])>;

impl CpuEngine {
    /// Evaluates the unresolved samples of a row by way of segments. Resolved samples between them
    /// are evaluated again, to the same bits.
    pub(crate) fn resolve(
        &self,
        row: Row<'_>,
        mut output: &mut [[f32; 4]],
    ) -> Result<(), SetError> {
        let all = row.unresolved(output);
        let mut from = row.first;
        let mut batches: Vec<Group<'_>> = Vec::new();
        let mut intervals = PART_INTERVALS;
        for one in all {
            let others = &mut output[one.samples.start - from..];
            let (own, others) = others.split_at_mut(one.samples.len());
            (from, output) = (one.samples.end, others);
            if intervals >= PART_INTERVALS {
                batches.push(Vec::new());
                intervals = 0;
            }
            intervals += one.intervals.len();
            if let Some(batch) = batches.last_mut() {
                batch.push((one, own));
            }
        }
        let resolve = |batch: Group<'_>| -> Result<(), SetError> {
            let mut memory = self.scratch_pool.take(row.request);
            let intervals = (batch.iter()).map(|(one, _)| (row.index, one.intervals.clone()));
            memory.prepare(row.request.set, intervals)?;
            for (part, (one, own)) in memory.parts().zip(batch) {
                let own = &mut Output::Here(own);
                self.part(
                    part,
                    row.request.timeline,
                    &TrackCopy::own(one.samples),
                    own,
                )?;
            }
            self.scratch_pool.give_back(memory);
            Ok(())
        };
        batches.into_par_iter().try_for_each(resolve)
    }
}

impl<'a> Row<'a> {
    fn unresolved(&self, output: &[[f32; 4]]) -> Vec<Unresolved> {
        let (times, _) = self.request.set.times_and_keys(self.index);
        let last = times.len() - 1;
        let mut all: Vec<Unresolved> = Vec::new();
        let Ticks::Frames { rate, start } = self.request.timeline.ticks else {
            // Explicit times may be in any order, so the whole track is prepared.
            if output.contains(&UNRESOLVED) {
                all.push(Unresolved {
                    intervals: 0..last,
                    samples: self.first..self.first + output.len(),
                });
            }
            return all;
        };
        let clock = FrameClock::new(rate, start, times[last]);
        for (sample, rotation) in (self.first..).zip(output) {
            if *rotation != UNRESOLVED {
                continue;
            }
            let time = self.request.timeline.time_at(self.index, sample);
            let after = times.partition_point(|&key| key <= time);
            let mut interval = after.saturating_sub(1).clamp(self.key, last - 1);
            // A sample within rounding of a key is that key.
            while interval + 1 < last && clock.first_frame(times[interval + 1]) <= sample as f64 {
                interval += 1;
            }
            while interval > self.key && clock.first_frame(times[interval]) > sample as f64 {
                interval -= 1;
            }
            match all.last_mut() {
                Some(Unresolved {
                    intervals, samples, ..
                }) if interval <= intervals.end + APART && intervals.len() < PART_INTERVALS => {
                    (intervals.end, samples.end) = (interval + 1, sample + 1);
                }
                _ => all.push(Unresolved {
                    intervals: interval..interval + 1,
                    samples: sample..sample + 1,
                }),
            }
        }
        all
    }
}
