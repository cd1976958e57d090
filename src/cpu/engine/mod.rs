//! The CPU as a device: its threads, its vector width, and the evaluation of one part of a track.

pub(crate) mod batches;
pub(crate) mod clip;
pub(crate) mod from_keys;
pub(crate) mod sparse_samples;

use crate::cpu::row::Row;
use crate::cpu::scratch::ScratchPool;
use crate::cpu::streaming::RowOutput;
use crate::prepare::clip_data::PartRef;
use crate::shader::Form;
use crate::simd::dispatch::VectorWidth;
use crate::threads::{self, OutOfThreadsError, Threads};
use crate::time::error::SampleTimesError;
use crate::time::frames::Timeline;
use crate::time::track_copy::TrackCopy;

/// Rotations that one task evaluates: enough to make its cost small, few enough to
/// share a short result among all threads.
pub(crate) const TASK: usize = 16 * 1024;

/// Evaluates clips with the f32 twins.
pub(crate) struct CpuEngine {
    pub(crate) width: VectorWidth,
    /// Whether results are written by streaming stores; `None` where that depends on them.
    pub(crate) streaming_stores: Option<bool>,
    /// `None`: the process's.
    private_threads: Option<Threads>,
    pub(crate) scratch_pool: ScratchPool,
    /// Bytes that the segments of a clip may take, if there is a limit.
    pub(crate) memory: Option<usize>,
}

impl CpuEngine {
    /// With `threads` threads of its own; by default with the process's shared ones.
    pub(crate) fn new(
        width: VectorWidth,
        streaming_stores: Option<bool>,
        threads: Option<usize>,
        memory: Option<u64>,
    ) -> Result<Self, OutOfThreadsError> {
        let private_threads = threads.map(|count| Threads::new(Some(count)));
        if let Some(threads) = &private_threads {
            threads.start()?;
        }
        Ok(Self {
            streaming_stores,
            private_threads,
            memory: memory.map(|bytes| usize::try_from(bytes).unwrap_or(usize::MAX)),
            ..Self::on_shared_threads(width)
        })
    }

    /// Without threads of its own.
    pub(crate) fn on_shared_threads(width: VectorWidth) -> Self {
        Self {
            width,
            streaming_stores: None,
            private_threads: None,
            scratch_pool: ScratchPool::default(),
            memory: None,
        }
    }

    /// Runs `work` with the engine's own threads, or with the process's where it has none.
    pub(crate) fn on_threads<R: Send>(
        &self,
        work: impl FnOnce() -> R + Send,
    ) -> Result<R, OutOfThreadsError> {
        match &self.private_threads {
            Some(threads) => threads.run(work),
            None => threads::on_threads(work),
        }
    }

    /// How many threads share work.
    pub(crate) fn thread_count(&self) -> usize {
        (self.private_threads.as_ref()).map_or_else(threads::count, Threads::count)
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
            Form::Arc => row.evaluate(&segments.arcs, output),
            Form::Polynomial => row.evaluate(&segments.polynomials, output),
        }
    }
}
