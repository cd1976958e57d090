//! Sets with fewer samples than keys on the CPU: straight from keys, and by way of segments
//! where curves turn too far for that.

use glam::Quat;
use rayon::prelude::*;

use crate::cpu::batches::tasks;
use crate::cpu::engine::{CpuEngine, TASK};
use crate::from_keys::KeyCurve;
use crate::from_keys::evaluate::KeyEvaluator;
use crate::prepare::batch::{Batch, BatchSize, batches};
use crate::prepare::error::SetError;
use crate::prepare::request::Request;
use crate::threads::stop;
use crate::time::frames::Ticks;

/// Keys of one task.
const TASK_KEYS: usize = 16 * 1024;

impl CpuEngine {
    /// Evaluates some tracks, `[track][sample]`.
    pub(crate) fn evaluate_from_keys<'a>(
        &self,
        request: &'a Request<'a>,
        curve: KeyCurve,
        output: &mut [Quat],
    ) -> Result<(), SetError> {
        let (set, timeline) = (request.set, request.timeline);
        let output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        let in_order = matches!(timeline.ticks, Ticks::Frames { .. });
        let size = BatchSize {
            keys: TASK_KEYS,
            tracks: TASK / timeline.len(),
            cut: in_order.then_some(TASK_KEYS),
        };
        let stop = stop::current();
        let new = || KeyEvaluator::new(request.interpolation, curve);
        let task = |evaluator: &mut KeyEvaluator<'a>, batch: &Batch, output: &mut [[f32; 4]]| {
            stop::check_of(stop.as_ref())?;
            let window = batch.samples(set, timeline, false);
            let is_resolved = evaluator.evaluate(set, batch, timeline, &window, output)?;
            if is_resolved || window.is_empty() {
                return Ok(());
            }
            let rows = output.chunks_mut(window.len());
            batch
                .intervals(set)
                .zip(rows)
                .try_for_each(|((track, own), output)| {
                    self.resolve(request, track, (window.start, own.start), output)
                })
        };
        let batches: Vec<Batch> = batches(set, Batch::Tracks(request.tracks.clone()), size);
        if let [batch] = &*batches {
            return task(&mut new(), batch, output);
        }
        let tasks = tasks(set, timeline, &batches, 1, false, output);
        self.on_threads(|| {
            (tasks.into_par_iter()).try_for_each_init(new, |evaluator, (batch, output)| {
                task(evaluator, &batch[0], output)
            })
        })?
    }
}
