//! The fallback of evaluation from keys. A sample whose curve turns too far for the small-angle
//! series is `UNRESOLVED`; here the intervals of such samples alone are prepared, and the samples
//! are overwritten.

use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::cpu::few_samples::Group;
use crate::cpu::streaming::Output;
use crate::from_keys::UNRESOLVED;
use crate::prepare::batch::PART_INTERVALS;
use crate::prepare::error::SetError;
use crate::prepare::request::Request;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::Ticks;
use crate::time::wrap::TrackCopy;

/// Two unresolved intervals with at most this many others between them are prepared together.
pub(crate) const APART: usize = 2;

/// What is prepared together, with their places in the result.
type Prepared<'o> = Vec<(Group, &'o mut [[f32; 4]])>;

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
        if let Ticks::Times { .. } = request.timeline.ticks {
            // In any order, and all samples of the track.
            if output.contains(&UNRESOLVED) {
                let tracks = track..track + 1;
                let request = Request {
                    tracks,
                    ..request.clone()
                };
                self.evaluate_few(&request, output)?;
            }
            return Ok(());
        }
        let all = unresolved(request, track, (first, key), output);
        let mut from = first;
        let mut batches: Vec<Prepared<'_>> = Vec::new();
        let mut intervals = PART_INTERVALS;
        for one in all {
            let others = &mut output[one.samples.start - from..];
            let (values, others) = others.split_at_mut(one.samples.len());
            (from, output) = (one.samples.end, others);
            if intervals >= PART_INTERVALS {
                batches.push(Vec::new());
                intervals = 0;
            }
            intervals += one.intervals.len();
            if let Some(batch) = batches.last_mut() {
                batch.push((one, values));
            }
        }
        let resolve = |batch: Prepared<'_>| -> Result<(), SetError> {
            let mut memory = self.scratch_pool.take(request);
            let intervals = (batch.iter()).map(|(one, _)| (track, one.intervals.clone()));
            memory.prepare(request.set, intervals)?;
            for (part, (one, values)) in memory.parts().zip(batch) {
                let (copy, values) = (TrackCopy::of_track(one.samples), &mut Output::Here(values));
                self.part(part, request.timeline, &copy, values)?;
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
) -> Vec<Group> {
    let samples = (first..).zip(output);
    let samples = samples.filter(|(_, rotation)| **rotation == UNRESOLVED);
    intervals_of_frames(request, track, key, samples.map(|(sample, _)| sample))
}

/// The intervals of a track in which frames at a rate lie, which increase. `key` is the index of a key at or
/// before all of those between keys.
pub(crate) fn intervals_of_frames(
    request: &Request<'_>,
    track: usize,
    key: usize,
    samples: impl Iterator<Item = usize>,
) -> Vec<Group> {
    let (times, _) = request.set.times_and_keys(track);
    let last = times.len() - 1;
    let mut all = Vec::new();
    let Ticks::Frames { rate, start } = request.timeline.ticks else {
        return all; // explicit times have groups of their own
    };
    let clock = FrameClock::new(rate, start, request.interpolation.steps());
    for sample in samples {
        let time = request.timeline.time_at(track, sample);
        let after = times.partition_point(|&key| key <= time);
        let most = last.saturating_sub(1);
        let mut interval = after.saturating_sub(1).clamp(key.min(most), most);
        // A sample within rounding of a key is that key.
        while interval + 1 < last && clock.first_frame(times[interval + 1]) <= sample as f64 {
            interval += 1;
        }
        while interval > key && clock.first_frame(times[interval]) > sample as f64 {
            interval -= 1;
        }
        Group::put(&mut all, interval, last, sample);
    }
    all
}
