//! Sets on the CPU, batch by batch: a thread prepares some intervals, evaluates them while
//! their segments are in its cache, and forgets them.

use glam::Quat;
use rayon::prelude::*;

use crate::cpu::engine::{CpuEngine, TASK};
use crate::cpu::streaming::Stage;
use crate::prepare::batch::{Batch, BatchSize, PART_INTERVALS, batches};
use crate::prepare::error::SetError;
use crate::prepare::request::SetRequest;
use crate::threads::stop;
use crate::time::frames::Timeline;
use crate::time::track_copy::TrackCopy;
use crate::tracks::set::TrackSet;

/// A batch has at most as many tracks as make this many rotations. Where a set has too few tracks
/// to keep all threads busy that way, the limit goes down to [`TASK`] rotations.
const BATCH_ROTATIONS: usize = 3 * TASK;

/// The most keys of a batch: so few that their segments stay in a core's cache.
const BATCH_KEYS: usize = 1024;

impl CpuEngine {
    /// Evaluates some tracks into `output`, `[track][sample]`. With `cuts_tracks` a long track may
    /// be cut into parts, which the threads share.
    pub(crate) fn evaluate_batches(
        &self,
        request: &SetRequest<'_>,
        cuts_tracks: bool,
        output: &mut [Quat],
    ) -> Result<(), SetError> {
        let (set, tracks, timeline) = (request.set, request.tracks.clone(), request.timeline);
        let output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        let (samples, rotations) = (timeline.len(), output.len());
        let threads = self.thread_count();
        // The more tracks a batch has, the better they fill the blocks that are prepared in lanes;
        // but about eight batches are left for each thread, so that all are busy to the end.
        let shared = tracks.len() / (8 * threads);
        let size = BatchSize {
            keys: BATCH_KEYS,
            tracks: shared.clamp(TASK / samples, BATCH_ROTATIONS / samples),
            cut: cuts_tracks.then_some(PART_INTERVALS),
        };
        let keys = set.keys_of(tracks.clone());
        let batches: Vec<Batch> = batches(set, Batch::Tracks(tracks), size);
        let samples_of_a_run = || rotations / keys.max(1);
        let stop = stop::current();
        let work = |(batches, output): (&[Batch], &mut [[f32; 4]])| {
            let mut stage = Stage::new(
                self.width,
                self.streaming_stores,
                rotations,
                samples,
                samples_of_a_run,
                output,
            );
            let mut memory = self.scratch_pool.take(request);
            for batch in batches {
                memory.prepare(set, batch.intervals(set))?;
                let batch_samples = batch.samples(set, timeline, request.interpolation.steps());
                for part in memory.parts() {
                    stage.row(batch_samples.len(), |row, output| {
                        let copy = TrackCopy::of_track(
                            batch_samples.start + row.start..batch_samples.start + row.end,
                        );
                        self.part(part, timeline, &copy, output)
                    })?;
                }
            }
            stage.finish();
            self.scratch_pool.give_back(memory);
            Ok(())
        };
        let task = |batch| stop::during(stop.clone(), || work(batch));
        if batches.len() <= 1 {
            return task((&batches, output));
        }
        // A task takes several batches, which share its scratch.
        let each = batches.len().div_ceil(32 * threads);
        let steps = request.interpolation.steps();
        let tasks = tasks(set, timeline, &batches, each, steps, output);
        self.on_threads(|| tasks.into_par_iter().try_for_each(task))?
    }
}

/// Cuts `output` among tasks of `each` consecutive batches; `steps` is the argument
/// of [`Batch::samples`].
pub(crate) fn tasks<'b, 'o>(
    set: &TrackSet,
    timeline: &Timeline,
    batches: &'b [Batch],
    each: usize,
    steps: bool,
    mut output: &'o mut [[f32; 4]],
) -> Vec<(&'b [Batch], &'o mut [[f32; 4]])> {
    let with_output = |batches: &'b [Batch]| {
        let rotations = (batches.iter())
            .map(|batch| batch.tracks().len() * batch.samples(set, timeline, steps).len());
        let values = output.split_off_mut(..rotations.sum());
        (batches, values.unwrap_or_default())
    };
    batches.chunks(each).map(with_output).collect()
}
