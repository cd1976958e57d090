//! The walk over tracks and samples: every thread takes a stretch of the output.

use crate::prepare::set::whole_tracks;
use std::ops::Range;

use glam::Quat;
use rayon::prelude::*;

use crate::cpu::evaluate::FEW;
use crate::cpu::row;
use crate::cpu::scratch::{Memories, Memory};
use crate::cpu::sparse_times::FewTimes;
use crate::cpu::streaming::{Output, Stage};
use crate::engine::Error;
use crate::from_keys::evaluate::{Sampled, Straight, straight};
use crate::from_keys::fallback::Row;
use crate::method::interpolation::Interpolation;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::prepare::clip_data::{ClipData, PartRef, Wanted};
use crate::shader::Form;
use crate::simd::dispatch::{VectorWidth, bring_near, in_lanes_of};
use crate::time::frames::{FramesError, Ticks, Timeline};
use crate::time::window::Window;
use crate::time::wrap::Cycle;
use crate::tracks::set::TrackSet;

/// Rotations that one task evaluates: enough to make its cost small, few enough to
/// share a short result among all threads.
const TASK: usize = 16 * 1024;

/// Rotations of a task's turn at most, where results are long.
const TURN: usize = 3 * TASK;

/// Tracks whose rows are made before they are written into frames: whole cache lines.
const TILE: usize = 16;

/// Frames that one task evaluates: fewer would cost as much as they do.
const TASK_FRAMES: usize = 256;

/// Keys that one turn of a task prepares: their segments stay in the cache.
pub(crate) const TASK_KEYS: usize = 1024;

/// Evaluates clips with the f32 twins.
pub(crate) struct CpuEngine {
    width: VectorWidth,
    pool: Option<rayon::ThreadPool>,
    pub(crate) memories: Memories,
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
            width,
            pool,
            memories: Memories::default(),
        })
    }

    /// As wide as it gets, on the process's threads.
    pub(crate) fn widest() -> Self {
        Self {
            width: VectorWidth::widest(),
            pool: None,
            memories: Memories::default(),
        }
    }

    /// Fills `output` with a window of the clip's result.
    pub(crate) fn evaluate(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        output: &mut [Quat],
    ) -> Result<(), FramesError> {
        let output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        if output.is_empty() {
            return Ok(());
        }
        // Waking a thread costs more than a task's worth of work.
        if output.len() <= TASK {
            return self.window(clip, timeline, window, 0, output);
        }
        if window.layout == Layout::FrameMajor {
            let tasks = frame_tasks(window, output);
            return self.on_threads(|| {
                tasks
                    .into_par_iter()
                    .try_for_each(|(window, frames)| self.frames(clip, timeline, &window, frames))
            });
        }
        let rotations = output.len();
        self.on_threads(|| {
            tasks(window, 1, output)
                .into_par_iter()
                .try_for_each(|(window, own)| self.window(clip, timeline, &window, rotations, own))
        })
    }

    /// As [`CpuEngine::evaluate`], encoded: a task's rotations are converted while they
    /// are in the cache.
    pub(crate) fn evaluate_encoded(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), FramesError> {
        let task = |rotations: &mut Vec<[f32; 4]>, window: &Window, output: &mut [u8]| {
            rotations.resize(window.len(), [0.0; 4]);
            self.window(clip, timeline, window, 0, rotations)?;
            encoding.encode(rotations, output);
            Ok(())
        };
        if window.len() <= TASK {
            return match output {
                [] => Ok(()),
                _ => task(&mut Vec::new(), window, output),
            };
        }
        self.on_threads(|| {
            tasks(window, encoding.bytes(), output)
                .into_par_iter()
                .try_for_each_init(Vec::new, |rotations, (window, own)| {
                    task(rotations, &window, own)
                })
        })
    }

    /// Runs `work` with the engine's own threads, where it has any.
    pub(crate) fn on_threads<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// A window of a result of so many `rotations`, on this thread.
    fn window(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        rotations: usize,
        output: &mut [[f32; 4]],
    ) -> Result<(), FramesError> {
        let (samples, tracks) = (window.samples.len(), window.tracks.len());
        let in_rows = window.layout == Layout::TrackMajor || samples == 1;
        if let Ticks::Times { times, stride } = &timeline.ticks
            && samples <= FEW
            && in_rows
            && !clip.interpolation.sides().repeats()
        {
            let mut few = FewTimes {
                clip,
                times,
                stride: *stride,
                window,
                output,
                others: Vec::new(),
            };
            in_lanes_of(self.width, &mut few);
            return few.others.into_iter().try_for_each(|place| {
                let row = &mut output[place * samples..][..samples];
                let track = window.tracks.start + place;
                let first = window.samples.start;
                self.row(clip, track, timeline, first, &mut Output::Here(row))
            });
        }
        match window.layout {
            Layout::TrackMajor => {
                let of_a_run = || clip.samples_of_a_run(timeline);
                let mut stage = Stage::new(self.width, rotations, samples, of_a_run, output);
                for track in window.tracks.clone() {
                    stage.row(samples, |samples, output| {
                        let first = window.samples.start + samples.start;
                        self.row(clip, track, timeline, first, output)
                    })?;
                }
                stage.finish();
                Ok(())
            }
            Layout::FrameMajor => {
                let frames = output.chunks_mut(tracks).collect();
                self.frames(clip, timeline, window, frames)
            }
        }
    }

    /// A window of which each frame lies in a place of its own, on this thread.
    fn frames(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        mut frames: Vec<&mut [[f32; 4]]>,
    ) -> Result<(), FramesError> {
        let (samples, tracks) = (window.samples.len(), window.tracks.len());
        let mut rows = vec![[0.0; 4]; samples * TILE.min(tracks)];
        for first in (0..tracks).step_by(TILE) {
            let own = first..(first + TILE).min(tracks);
            for (row, place) in rows.chunks_mut(samples).zip(own.clone()) {
                let track = window.tracks.start + place;
                let first = window.samples.start;
                self.row(clip, track, timeline, first, &mut Output::Here(row))?;
            }
            for (sample, frame) in frames.iter_mut().enumerate() {
                let column = rows[sample..].iter().step_by(samples);
                for (place, rotation) in frame[own.clone()].iter_mut().zip(column) {
                    *place = *rotation;
                }
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
        output: &mut Output<'_, '_>,
    ) -> Result<(), FramesError> {
        let samples = first..first + output.samples().len();
        if !clip.interpolation.sides().repeats() {
            let cycle = Cycle::own(samples.clone());
            return clip
                .parts_of(track, timeline, samples)
                .try_for_each(|part| self.part(part, timeline, &cycle, output));
        }
        for cycle in clip.cycles(track, timeline, samples) {
            let own = cycle.samples.start - first..cycle.samples.end - first;
            let own = &mut Output::Here(&mut output.samples()[own]);
            clip.parts_in(track, &cycle)
                .try_for_each(|part| self.part(part, timeline, &cycle, own))?;
        }
        Ok(())
    }

    /// The samples of one part of a track.
    pub(crate) fn part(
        &self,
        part: PartRef<'_>,
        timeline: &Timeline,
        cycle: &Cycle,
        output: &mut Output<'_, '_>,
    ) -> Result<(), FramesError> {
        let segments = &part.prepared.segments;
        match segments.form {
            Form::Arc => row::Row {
                part,
                segments: &segments.arcs,
                timeline,
                cycle,
            }
            .evaluate(self.width, output),
            Form::Polynomial => row::Row {
                part,
                segments: &segments.polynomials,
                timeline,
                cycle,
            }
            .evaluate(self.width, output),
        }
    }

    /// Prepares and evaluates some tracks in one go, `[track][frame]`: the segments of
    /// a few of them are used while they are still in the cache, and never kept.
    pub(crate) fn evaluate_set(
        &self,
        set: &TrackSet,
        tracks: Range<usize>,
        interpolation: &Interpolation,
        timeline: &Timeline,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        let output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(output);
        if output.is_empty() {
            // Also with nothing to evaluate a track may be refused.
            let wanted = Wanted {
                tracks,
                ..Wanted::all(set, None)
            };
            return Ok(ClipData::new(set, *interpolation, wanted).map(drop)?);
        }
        let samples = timeline.len();
        if let Some(straight) = straight(set, interpolation, timeline) {
            return self.sampled(set, tracks, (interpolation, straight), timeline, output);
        }
        let keys_each = set.key_count().div_ceil(set.track_count()).max(1);
        // As many as fill blocks best, where there are turns enough for all threads.
        let shared = tracks.len() / (8 * rayon::current_num_threads());
        let tracks_each = shared.clamp(TASK / samples, TURN / samples);
        let tracks_each = tracks_each.min(TASK_KEYS / keys_each).max(1);
        let rotations = output.len();
        let task = |first: usize, rows: &mut [_]| -> Result<(), Error> {
            let tracks = first..first + rows.len() / samples;
            let of_a_run = || samples / keys_each;
            let mut stage = Stage::new(self.width, rotations, samples, of_a_run, rows);
            let mut memory = self.memories.take(interpolation, timeline, set);
            let Memory {
                prepared,
                preparation,
                ..
            } = &mut memory;
            for first in tracks.clone().step_by(tracks_each) {
                prepared.clear();
                let own = first..(first + tracks_each).min(tracks.end);
                let next = own.end..(own.end + tracks_each).min(tracks.end);
                preparation.push(prepared, set, whole_tracks(set, own))?;
                // By then the results have pushed everything out of the caches.
                for (times, keys) in next.map(|track| set.times_and_keys(track)) {
                    let some = keys.len().min(TASK_KEYS);
                    bring_near(bytemuck::cast_slice(&times[..some]));
                    bring_near(bytemuck::cast_slice(&keys[..some]));
                }
                for part in &prepared.parts {
                    let part = PartRef { prepared, part };
                    stage.row(samples, |samples, output| {
                        self.part(part, timeline, &Cycle::own(samples), output)
                    })?;
                }
            }
            stage.finish();
            self.memories.give_back(memory);
            Ok(())
        };
        if output.len() <= TASK && keys_each * tracks.len() <= TASK_KEYS {
            return task(tracks.start, output);
        }
        let work = || {
            // Several turns for each task, whose memory serves them all.
            let tasks = 32 * rayon::current_num_threads();
            let turns = tracks.len().div_ceil(tracks_each).div_ceil(tasks);
            let each = turns * tracks_each;
            output
                .par_chunks_mut(samples * each)
                .enumerate()
                .try_for_each(|(i, rows)| task(tracks.start + i * each, rows))
        };
        self.on_threads(work)
    }

    /// As [`CpuEngine::evaluate_set`], straight from keys.
    pub(crate) fn sampled(
        &self,
        set: &TrackSet,
        tracks: Range<usize>,
        (interpolation, straight): (&Interpolation, Straight),
        timeline: &Timeline,
        output: &mut [[f32; 4]],
    ) -> Result<(), Error> {
        let samples = timeline.len();
        let each = (TASK / samples).max(1);
        let task = |(i, rows): (usize, &mut [[f32; 4]])| {
            let first = tracks.start + i * each;
            let own = first..first + rows.len() / samples;
            let mut sampled = Sampled::new(interpolation, straight);
            if !sampled.tracks(set, own, timeline, rows)? {
                return Ok(());
            }
            for (index, row) in (first..).zip(rows.chunks_mut(samples)) {
                let whole = Row::whole(set, index, interpolation, timeline);
                self.mend(whole, row)?;
            }
            Ok(())
        };
        if output.len() <= TASK {
            return task((0, output));
        }
        self.on_threads(|| {
            let rows = output.par_chunks_mut(samples * each).enumerate();
            rows.try_for_each(task)
        })
    }
}

/// A window of frames cut into tasks, each some frames of some tracks, with their places.
fn frame_tasks<'a>(
    window: &Window,
    output: &'a mut [[f32; 4]],
) -> Vec<(Window, Vec<&'a mut [[f32; 4]]>)> {
    let tracks = window.tracks.len();
    let frames_each = TASK_FRAMES.min(window.samples.len());
    let tracks_each = (TASK / frames_each).max(TILE);
    let mut all = Vec::new();
    let blocks = output.chunks_mut(frames_each * tracks);
    for (block, first) in blocks.zip(window.samples.clone().step_by(frames_each)) {
        let samples = first..first + block.len() / tracks;
        let starts = window.tracks.clone().step_by(tracks_each);
        let of_block = all.len();
        all.extend(starts.map(|start| {
            let tracks = start..(start + tracks_each).min(window.tracks.end);
            let window = Window {
                start: 0,
                tracks,
                samples: samples.clone(),
                layout: Layout::FrameMajor,
            };
            (window, Vec::with_capacity(samples.len()))
        }));
        for frame in block.chunks_mut(tracks) {
            for (task, piece) in all[of_block..]
                .iter_mut()
                .zip(frame.chunks_mut(tracks_each))
            {
                task.1.push(piece);
            }
        }
    }
    all
}

/// A window cut into tasks, each with its own part of the output, which has `each`
/// elements for a rotation.
fn tasks<'a, T>(
    window: &Window,
    each: usize,
    mut output: &'a mut [T],
) -> Vec<(Window, &'a mut [T])> {
    let with_output = |window: Window| {
        let (own, others) = std::mem::take(&mut output).split_at_mut(window.len() * each);
        output = others;
        (window, own)
    };
    let limit = match window.layout {
        Layout::TrackMajor => TASK,
        Layout::FrameMajor => {
            let share = window.samples.len() / (4 * rayon::current_num_threads());
            TASK.max(share.min(TASK_FRAMES / 4) * window.tracks.len())
        }
    };
    window.cut(limit).into_iter().map(with_output).collect()
}
