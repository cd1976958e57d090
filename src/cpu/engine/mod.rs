//! The CPU as a device: its threads, its vector width, and the evaluation of sets batch by batch. For each batch, a
//! thread prepares some intervals, evaluates them while their segments are in its cache, and drops them.

pub(crate) mod clip;
pub(crate) mod from_keys;
mod machine;
pub(crate) mod poses;
pub(crate) mod sparse_samples;

use rayon::prelude::*;

use crate::cpu::row::Row;
use crate::cpu::scratch::ScratchPool;
use crate::cpu::streaming::{EncodedStage, RowOutput, RowStage, Stage};
use crate::machine::Machine as _;
use crate::output::encoded::EncodedOutput;
use crate::prepare::clip_data::PartRef;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{Batch, BatchSize, PART_INTERVALS, SetRequest, batches};
use crate::shader::Form;
use crate::simd::dispatch::VectorWidth;
use crate::threads::{OutOfThreadsError, Threads, stop};
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::TrackCopy;
use crate::time::frames::Timeline;

/// The number of rotations of one task: enough to make its overhead small, and few enough to divide a short result
/// among all threads.
pub(crate) const TASK: usize = 16 * 1024;

/// Evaluates clips with the f32 twins.
pub(crate) struct CpuEngine {
    pub(crate) width: VectorWidth,
    /// Whether results are written by streaming stores; `None` if that depends on the result.
    pub(crate) streaming_stores: Option<bool>,
    /// The engine's threads; `None`: the process's threads.
    pub(crate) private_threads: Option<Threads>,
    pub(crate) scratch_pool: ScratchPool,
    /// The limit of the segments of a clip in bytes, if there is one.
    pub(crate) memory: Option<usize>,
    /// The maximum size in bytes of the segments of a clip whose samples can be computed from its keys; a larger clip
    /// keeps its keys instead.
    pub(crate) kept_segments: usize,
}

impl CpuEngine {
    /// Makes an engine with `threads` threads; `None`: with the process's shared threads.
    pub(crate) fn new(
        width: VectorWidth,
        streaming_stores: Option<bool>,
        threads: Option<usize>,
        memory: Option<u64>,
        kept_segments: Option<u64>,
    ) -> Result<Self, OutOfThreadsError> {
        let private_threads = threads.map(|count| Threads::new(Some(count)));
        if let Some(threads) = &private_threads {
            threads.start()?;
        }
        let size = |bytes: u64| usize::try_from(bytes).unwrap_or(usize::MAX);
        Ok(Self {
            streaming_stores,
            private_threads,
            memory: memory.map(size),
            kept_segments: kept_segments.map_or(usize::MAX, size),
            ..Self::on_shared_threads(width)
        })
    }

    /// Makes an engine on the process's shared threads.
    pub(crate) fn on_shared_threads(width: VectorWidth) -> Self {
        Self {
            width,
            streaming_stores: None,
            private_threads: None,
            scratch_pool: ScratchPool::default(),
            memory: None,
            kept_segments: usize::MAX,
        }
    }

    /// Runs `work` on the engine's threads, or on the process's if the engine has none.
    pub(crate) fn on_threads<R: Send>(
        &self,
        work: impl FnOnce() -> R + Send,
    ) -> Result<R, OutOfThreadsError> {
        self.threads().run(work)
    }

    /// Evaluates the samples of a track copy that lie in one part of the track.
    pub(crate) fn part(
        &self,
        part: PartRef<'_>,
        timeline: &Timeline,
        copy: &TrackCopy,
        output: &mut RowOutput<'_, '_>,
    ) -> Result<(), SampleTimesError> {
        let row = Row {
            part,
            timeline,
            copy,
            width: self.width,
        };
        let segments = &part.prepared.segments;
        match segments.form {
            Form::Arc => row.evaluate(&segments.arcs[..], output),
            Form::Polynomial => match segments.packed() {
                Some(packed) => row.evaluate(packed, output),
                None => row.evaluate(&segments.polynomials[..], output),
            },
        }
    }
}

/// The maximum number of rotations of a batch's tracks. If a set has too few tracks to keep all threads busy with it,
/// the limit is reduced down to [`TASK`] rotations.
const BATCH_ROTATIONS: usize = 3 * TASK;

/// The maximum number of keys of a batch, whose segments then stay in a core's cache.
const BATCH_KEYS: usize = 1024;

impl CpuEngine {
    /// Evaluates a request into `output`, `[track][sample]`. With `cuts_tracks` a long track may be divided into parts
    /// for several threads.
    pub(crate) fn evaluate_batches(
        &self,
        request: &SetRequest<'_>,
        cuts_tracks: bool,
        output: EncodedOutput<'_>,
    ) -> Result<(), SetError> {
        let (set, tracks, timeline) = (request.set, &request.tracks, request.timeline);
        let (samples, rotations) = (request.samples.len(), output.len());
        let threads = self.threads().count();
        // The more tracks a batch has, the better they fill the blocks that are prepared in lanes;
        // but about eight batches are left for each thread, so that all are busy to the end.
        let shared = tracks.len() / (8 * threads);
        let size = BatchSize {
            keys: BATCH_KEYS,
            tracks: shared.clamp(TASK / samples, BATCH_ROTATIONS / samples),
            cut: cuts_tracks.then_some(PART_INTERVALS),
        };
        let whole = request.batch();
        let keys = whole.keys(set);
        let batches: Vec<Batch> = batches(set, whole, size);
        let samples_of_a_run = || rotations / keys.max(1);
        let stop = stop::current();
        let work = |(batches, output): (&[Batch], EncodedOutput<'_>)| {
            let mut stage = match output.into_values() {
                Ok(values) => RowStage::Values(Stage::new(
                    self.width,
                    self.streaming_stores,
                    rotations,
                    samples,
                    samples_of_a_run,
                    values,
                )),
                Err(encoded) => RowStage::Encoded(EncodedStage::new(encoded)),
            };
            let mut memory = self.scratch_pool.take(request);
            for batch in batches {
                memory.prepare(set, batch.intervals(set))?;
                let batch_samples = request.samples_of(batch);
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
        let tasks = tasks(request, &batches, each, output);
        self.on_threads(|| tasks.into_par_iter().try_for_each(task))?
    }
}

/// Divides `output` among tasks of `each` consecutive batches of a request.
pub(crate) fn tasks<'b, 'o>(
    request: &SetRequest<'_>,
    batches: &'b [Batch],
    each: usize,
    mut output: EncodedOutput<'o>,
) -> Vec<(&'b [Batch], EncodedOutput<'o>)> {
    let with_output = |batches: &'b [Batch]| {
        let rotations =
            (batches.iter()).map(|batch| batch.tracks().len() * request.samples_of(batch).len());
        (batches, output.split_off(rotations.sum()))
    };
    batches.chunks(each).map(with_output).collect()
}
