//! Sets with few samples between keys, evaluated directly from the keys. A sample whose curve rotates too far for the
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
            let rows = evaluator.evaluate(set, batch, timeline, &window, output)?;
            if rows.is_empty() || window.is_empty() {
                return Ok(());
            }
            let mut rows = rows.iter().peekable();
            let all = batch.intervals(set).zip(output.chunks_mut(window.len()));
            let unresolved = all
                .enumerate()
                .filter_map(|(i, ((track, intervals), output))| {
                    rows.next_if_eq(&&i).map(|_| UnresolvedRow {
                        track,
                        first: window.start,
                        key: intervals.start,
                        output,
                    })
                });
            self.resolve(request, unresolved)
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

/// Consecutive samples of a track, some of which may be unresolved.
pub(crate) struct UnresolvedRow<'o> {
    pub(crate) track: usize,
    /// The index of the first sample.
    pub(crate) first: usize,
    /// The index of a key at or before all samples that are between keys.
    pub(crate) key: usize,
    pub(crate) output: &'o mut [[f32; 4]],
}

/// Groups of tracks that are prepared together, each with its samples in the result.
type FallbackBatch<'o> = Vec<(usize, Group, &'o mut [[f32; 4]])>;

impl CpuEngine {
    /// Evaluates the unresolved samples of some rows by segments, which are prepared together. Resolved samples between
    /// them are evaluated again, with the same bits.
    pub(crate) fn resolve<'o>(
        &self,
        request: &SetRequest<'_>,
        rows: impl Iterator<Item = UnresolvedRow<'o>>,
    ) -> Result<(), SetError> {
        let mut batches: Vec<FallbackBatch<'_>> = Vec::new();
        let mut intervals = PART_INTERVALS;
        for row in rows {
            if let Ticks::Times { .. } = request.timeline.ticks {
                // Unresolved samples may be anywhere; then all samples of the track are evaluated again.
                if row.output.contains(&UNRESOLVED) {
                    let request = SetRequest {
                        tracks: row.track..row.track + 1,
                        ..request.clone()
                    };
                    self.evaluate_sparse(&request, EncodedOutput::of_values(row.output))?;
                }
                continue;
            }
            let all = unresolved(request, &row);
            let (mut from, mut output) = (row.first, row.output);
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
                    batch.push((row.track, one, values));
                }
            }
        }
        let resolve = |batch: FallbackBatch<'_>| -> Result<(), SetError> {
            let mut memory = self.scratch_pool.take(request);
            let intervals = (batch.iter()).map(|(track, one, _)| (*track, one.intervals.clone()));
            memory.prepare(request.set, intervals)?;
            for (part, (_, one, values)) in memory.parts().zip(batch) {
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

/// The groups of the unresolved samples of a row.
fn unresolved(request: &SetRequest<'_>, row: &UnresolvedRow<'_>) -> Vec<Group> {
    let samples = (row.first..).zip(&*row.output);
    let samples = samples.filter(|(_, rotation)| **rotation == UNRESOLVED);
    intervals_of_frames(
        request,
        row.track,
        row.key,
        samples.map(|(sample, _)| sample),
    )
}
