//! Sets with fewer samples than keys, evaluated directly from the keys. A sample whose curve rotates too far for the
//! small-angle series is marked as `UNRESOLVED`; then only the intervals of such samples are prepared, and the
//! samples are overwritten.

use rayon::prelude::*;

use crate::cpu::engine::sparse_samples::{Group, intervals_of_frames};
use crate::cpu::engine::{CpuEngine, TASK, tasks};
use crate::cpu::streaming::RowOutput;
use crate::from_keys::evaluate::KeyEvaluator;
use crate::from_keys::{KeyCurve, UNRESOLVED};
use crate::output::encoded::EncodedOutput;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{Batch, BatchSize, PART_INTERVALS, SetRequest, batches};
use crate::threads::stop;
use crate::time::frame_clock::TrackCopy;
use crate::time::frames::Ticks;

/// Keys of one task.
const TASK_KEYS: usize = 16 * 1024;

impl CpuEngine {
    /// Evaluates some tracks, `[track][sample]`.
    pub(crate) fn evaluate_from_keys<'a>(
        &self,
        request: &'a SetRequest<'a>,
        curve: KeyCurve,
        output: EncodedOutput<'_>,
    ) -> Result<(), SetError> {
        let (set, timeline) = (request.set, request.timeline);
        let in_order = matches!(timeline.ticks, Ticks::Frames { .. });
        let size = BatchSize {
            keys: TASK_KEYS,
            tracks: TASK / request.samples.len(),
            cut: in_order.then_some(TASK_KEYS),
        };
        let stop = stop::current();
        let new = || KeyEvaluator::new(request.interpolation, curve);
        let values = |evaluator: &mut KeyEvaluator<'a>, batch: &Batch, output: &mut [[f32; 4]]| {
            stop::check_of(stop.as_ref())?;
            let window = request.samples_of(batch);
            let is_resolved = evaluator.evaluate(set, batch, timeline, &window, output)?;
            if is_resolved || window.is_empty() {
                return Ok(());
            }
            let rows = output.chunks_mut(window.len());
            batch
                .intervals(set)
                .zip(rows)
                .try_for_each(|((track, intervals), output)| {
                    self.resolve(request, track, (window.start, intervals.start), output)
                })
        };
        let task = |evaluator: &mut KeyEvaluator<'a>, batch: &Batch, output: EncodedOutput<'_>| {
            output.fill(|output| values(evaluator, batch, output))
        };
        let batches: Vec<Batch> = batches(set, request.batch_of_keys(), size);
        if let [batch] = &*batches {
            return task(&mut new(), batch, output);
        }
        let tasks = tasks(request, &batches, 1, output);
        self.on_threads(|| {
            (tasks.into_par_iter()).try_for_each_init(new, |evaluator, (batch, output)| {
                task(evaluator, &batch[0], output)
            })
        })?
    }
}

/// Groups that are prepared together, each with its samples in the result.
type FallbackBatch<'o> = Vec<(Group, &'o mut [[f32; 4]])>;

impl CpuEngine {
    /// Evaluates the unresolved ones of a track's consecutive samples from `first` on, by segments. Resolved samples
    /// between them are evaluated again, with the same bits. `key` is the index of a key at or before all samples
    /// that are between keys.
    pub(crate) fn resolve(
        &self,
        request: &SetRequest<'_>,
        track: usize,
        (first, key): (usize, usize),
        mut output: &mut [[f32; 4]],
    ) -> Result<(), SetError> {
        if let Ticks::Times { .. } = request.timeline.ticks {
            // In any order, and all samples of the track.
            if output.contains(&UNRESOLVED) {
                let tracks = track..track + 1;
                let request = SetRequest {
                    tracks,
                    ..request.clone()
                };
                self.evaluate_sparse(&request, EncodedOutput::of_values(output))?;
            }
            return Ok(());
        }
        let all = unresolved(request, track, (first, key), output);
        let mut from = first;
        let mut batches: Vec<FallbackBatch<'_>> = Vec::new();
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
        let resolve = |batch: FallbackBatch<'_>| -> Result<(), SetError> {
            let mut memory = self.scratch_pool.take(request);
            let intervals = (batch.iter()).map(|(one, _)| (track, one.intervals.clone()));
            memory.prepare(request.set, intervals)?;
            for (part, (one, values)) in memory.parts().zip(batch) {
                let (copy, values) = (
                    TrackCopy::of_track(one.samples),
                    &mut RowOutput::Here(values),
                );
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
    request: &SetRequest<'_>,
    track: usize,
    (first, key): (usize, usize),
    output: &[[f32; 4]],
) -> Vec<Group> {
    let samples = (first..).zip(output);
    let samples = samples.filter(|(_, rotation)| **rotation == UNRESOLVED);
    intervals_of_frames(request, track, key, samples.map(|(sample, _)| sample))
}
