//! The walk over tracks and samples: every thread takes a stretch of the output.

use glam::Quat;
use rayon::prelude::*;

use super::dispatch::{Kernels, VectorWidth};
use crate::clock::{FramesError, Timeline};
use crate::prepare::ClipData;
use crate::rotations::Layout;
use crate::segment::Segments;

/// Rotations that one task evaluates: enough to make its cost small, few enough to
/// share a short result among all threads.
const TASK: usize = 16 * 1024;

/// Evaluates clips with the f32 twins.
pub(crate) struct CpuEngine {
    kernels: Kernels,
    pool: Option<rayon::ThreadPool>,
}

impl CpuEngine {
    /// `threads` of its own, or the process's shared ones.
    pub(crate) fn new(
        width: VectorWidth,
        threads: Option<usize>,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = threads
            .map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build())
            .transpose()?;
        Ok(Self {
            kernels: Kernels::new(width),
            pool,
        })
    }

    /// Fills `output` with every track of the clip at every sample.
    pub(crate) fn evaluate(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        layout: Layout,
        output: &mut [Quat],
    ) -> Result<(), FramesError> {
        let output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        if output.is_empty() {
            return Ok(());
        }
        // Waking a thread costs more than a task's worth of work.
        if output.len() <= TASK {
            return self.on_this_thread(clip, timeline, layout, output);
        }
        let mut work = || match layout {
            Layout::TrackMajor => self.track_major(clip, timeline, output),
            Layout::FrameMajor => self.frame_major(clip, timeline, output),
        };
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    fn on_this_thread(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        layout: Layout,
        output: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        match layout {
            Layout::TrackMajor => output
                .chunks_mut(timeline.len())
                .enumerate()
                .try_for_each(|(track, row)| self.row(clip, track, timeline, 0, row)),
            Layout::FrameMajor => self.frames(clip, timeline, 0, output),
        }
    }

    fn track_major(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        output: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        let samples = timeline.len();
        if samples > TASK {
            return output
                .par_chunks_mut(samples)
                .enumerate()
                .try_for_each(|(track, row)| {
                    let pieces = row.par_chunks_mut(TASK).enumerate();
                    pieces
                        .into_par_iter()
                        .try_for_each(|(i, piece)| self.row(clip, track, timeline, i * TASK, piece))
                });
        }
        let tracks_each = TASK / samples;
        output
            .par_chunks_mut(samples * tracks_each)
            .enumerate()
            .try_for_each(|(task, rows)| {
                rows.chunks_mut(samples)
                    .zip(task * tracks_each..)
                    .try_for_each(|(row, track)| self.row(clip, track, timeline, 0, row))
            })
    }

    fn frame_major(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        output: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        let tracks = clip.track_count();
        let frames_each = (TASK / tracks).max(1);
        output
            .par_chunks_mut(tracks * frames_each)
            .enumerate()
            .try_for_each(|(task, frames)| self.frames(clip, timeline, task * frames_each, frames))
    }

    /// Whole frames from `first` on, `[frame][track]`.
    fn frames(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        first: usize,
        frames: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        let tracks = clip.track_count();
        let mut row = vec![[0.0; 4]; frames.len() / tracks];
        for track in 0..tracks {
            self.row(clip, track, timeline, first, &mut row)?;
            for (frame, &rotation) in frames.chunks_mut(tracks).zip(&row) {
                frame[track] = rotation;
            }
        }
        Ok(())
    }

    /// The samples of one track from `first` on.
    fn row(
        &self,
        clip: &ClipData,
        track: usize,
        timeline: &Timeline,
        first: usize,
        row: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        let samples = first..first + row.len();
        for part in clip.parts_of(track) {
            let samples = samples.clone();
            match &part.prepared.segments {
                Segments::Arc(all) => self.kernels.arc.row(part, all, timeline, samples, row)?,
                Segments::Cumulative(all) => {
                    let kernel = &self.kernels.cumulative;
                    kernel.row(part, all, timeline, samples, row)?;
                }
            }
        }
        Ok(())
    }
}
