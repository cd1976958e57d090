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

/// Intervals with unresolved samples, and the samples from the first of these to the last.
struct Unresolved {
    intervals: Range<usize>,
    samples: Range<usize>,
}

/// What is prepared together, with their places in the result.
type Group<'o> = Vec<(Unresolved, &'o mut [[f32; 4]])>;

impl CpuEngine {
    /// Evaluates the unresolved ones of a track's consecutive samples from `first` on, by way of
    /// segments. Resolved samples between them are evaluated again, to the same bits. `key` is the index
    /// of a key at or before all of the samples between keys.
    pub(crate) fn resolve(
        &self,
        request: &Request<'_>,
        track: usize,
        (first, key): (usize, usize),
        mut output: &mut [[f32; 4]],
    ) -> Result<(), SetError> {
        let all = unresolved(request, track, (first, key), output);
        let mut from = first;
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
            let mut memory = self.scratch_pool.take(request);
            let intervals = (batch.iter()).map(|(one, _)| (track, one.intervals.clone()));
            memory.prepare(request.set, intervals)?;
            for (part, (one, own)) in memory.parts().zip(batch) {
                let (copy, own) = (TrackCopy::of_track(one.samples), &mut Output::Here(own));
                self.part(part, request.timeline, &copy, own)?;
            }
            self.scratch_pool.give_back(memory);
            Ok(())
        };
        if batches.len() <= 1 {
            return batches.into_iter().try_for_each(resolve);
        }
        self.on_threads(|| batches.into_par_iter().try_for_each(resolve))?
    }
}

/// The unresolved ones of some samples; the arguments are those of [`CpuEngine::resolve`].
fn unresolved(
    request: &Request<'_>,
    track: usize,
    (first, key): (usize, usize),
    output: &[[f32; 4]],
) -> Vec<Unresolved> {
    let (times, _) = request.set.times_and_keys(track);
    let last = times.len() - 1;
    let mut all: Vec<Unresolved> = Vec::new();
    let Ticks::Frames { rate, start } = request.timeline.ticks else {
        // Explicit times may be in any order, so the whole track is prepared.
        if output.contains(&UNRESOLVED) {
            all.push(Unresolved {
                intervals: 0..last,
                samples: first..first + output.len(),
            });
        }
        return all;
    };
    let clock = FrameClock::new(rate, start, false);
    for (sample, rotation) in (first..).zip(output) {
        if *rotation != UNRESOLVED {
            continue;
        }
        let time = request.timeline.time_at(track, sample);
        let after = times.partition_point(|&key| key <= time);
        let mut interval = after.saturating_sub(1).clamp(key, last - 1);
        // A sample within rounding of a key is that key.
        while interval + 1 < last && clock.first_frame(times[interval + 1]) <= sample as f64 {
            interval += 1;
        }
        while interval > key && clock.first_frame(times[interval]) > sample as f64 {
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
