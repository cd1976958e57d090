//! The walk over tracks and samples: every thread takes a stretch of the output.

use glam::Quat;
use rayon::prelude::*;

use super::dispatch::{Kernel, Kernels, VectorWidth};
use super::evaluate::{Affine, Evaluate, Scratch};
use crate::clock::{FramesError, Timeline};
use crate::numeric::round_f32;
use crate::prepare::{ClipData, PartRef};
use crate::rotations::Layout;
use crate::schedule::{Distance, Run, RunSource};
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
        let mut work = || match layout {
            Layout::TrackMajor => self.track_major(clip, timeline, output),
            Layout::FrameMajor => self.frame_major(clip, timeline, output),
        };
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
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
            .try_for_each(|(task, frames)| {
                let mut row = vec![[0.0; 4]; frames.len() / tracks];
                for track in 0..tracks {
                    self.row(clip, track, timeline, task * frames_each, &mut row)?;
                    for (frame, &rotation) in frames.chunks_mut(tracks).zip(&row) {
                        frame[track] = rotation;
                    }
                }
                Ok(())
            })
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
        let mut scratch = Scratch::new();
        for PartRef { prepared, part } in clip.parts_of(track) {
            prepared.runs(part, timeline, first..first + row.len(), |run| {
                let output = &mut row[run.sample - first..];
                match run.source {
                    RunSource::Constant(index) => {
                        output[..run.count].fill(prepared.constants[index as usize]);
                    }
                    RunSource::Exact { index, parameter } => {
                        for (sample, rotation) in (run.sample..).zip(&mut output[..run.count]) {
                            *rotation = prepared.exact(index, parameter, timeline, track, sample);
                        }
                    }
                    RunSource::Segment {
                        index,
                        distance,
                        scale,
                        offset,
                    } => {
                        let affine = Affine { scale, offset };
                        let i = index as usize;
                        let place = Place {
                            timeline,
                            track,
                            run: &run,
                            distance,
                        };
                        match &prepared.segments {
                            Segments::Arc(all) => {
                                place.evaluate(
                                    &self.kernels.arc,
                                    &all[i],
                                    affine,
                                    &mut scratch,
                                    output,
                                );
                            }
                            Segments::Cumulative(all) => {
                                place.evaluate(
                                    &self.kernels.cumulative,
                                    &all[i],
                                    affine,
                                    &mut scratch,
                                    output,
                                );
                            }
                        }
                    }
                }
            })?;
        }
        Ok(())
    }
}

/// Which samples of a segment are wanted.
struct Place<'a> {
    timeline: &'a Timeline,
    track: usize,
    run: &'a Run,
    distance: Distance,
}

impl Place<'_> {
    fn evaluate<S: Evaluate>(
        &self,
        kernel: &Kernel<S>,
        segment: &S,
        affine: Affine,
        scratch: &mut Scratch,
        output: &mut [[f32; 4]],
    ) {
        match self.distance {
            Distance::Frames { first } => {
                kernel.frames(segment, affine, first, self.run.count, scratch, output);
            }
            Distance::Seconds { middle } => {
                let distances: Vec<f32> = (self.run.sample..self.run.sample + self.run.count)
                    .map(|sample| round_f32(self.timeline.time(self.track, sample) - middle))
                    .collect();
                kernel.distances(segment, affine, &distances, scratch, output);
            }
        }
    }
}
