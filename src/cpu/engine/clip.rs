//! Clips on the CPU: windows of a result, divided into tasks for the threads. For a window with a few explicit times
//! of each of many tracks, such as the poses of a crowd, each lane evaluates one sample, and no runs are listed.

use bytemuck::Zeroable;
use glam::Vec4;
use rayon::prelude::*;

use crate::cpu::engine::{CpuEngine, TASK};
use crate::cpu::evaluate::SAMPLES_ONE_BY_ONE;
use crate::cpu::short_runs::ShortRuns;
use crate::cpu::streaming::{RowOutput, Stage};
use crate::output::encoded::EncodedOutput;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::{ClipData, PartRef};
use crate::prepare::error::SetError;
use crate::shader::{ArcSegment, Form};
use crate::simd::dispatch::{InLanes, in_lanes_of};
use crate::simd::lanes::{Lanes, canonical};
use crate::threads::{self, stop};
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::TrackCopy;
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::RunSource;
use crate::twin::Evaluate as _;
use crate::twin::evaluate_arc::{norm_squared, on_arc};

/// The number of tracks whose rows are evaluated before they are transposed into frames: their rotations at one frame
/// fill four cache lines.
const TILE: usize = 16;

/// The number of frames of one task of a frame-major window; a task with fewer frames takes hardly less time.
const TASK_FRAMES: usize = 256;

impl CpuEngine {
    /// Fills `output` with a window of the clip's result.
    pub(crate) fn evaluate(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        output: &mut [[f32; 4]],
    ) -> Result<(), SetError> {
        if output.is_empty() {
            return Ok(());
        }
        let stop = stop::current();
        // Waking a thread takes longer than evaluating this many rotations.
        if output.len() <= TASK {
            return Ok(self.window(clip, timeline, window, Some(output.len()), output)?);
        }
        if window.layout == Layout::FrameMajor {
            let tasks = frame_tasks(window, output).into_par_iter();
            return self.on_threads(|| {
                tasks.try_for_each(|(window, frames)| {
                    stop::check_of(stop.as_ref())?;
                    Ok::<_, SetError>(self.frames(clip, timeline, &window, frames)?)
                })
            })?;
        }
        let rotations = Some(output.len());
        self.on_threads(|| {
            let tasks = tasks(window, 1, output).into_par_iter();
            tasks.try_for_each(|(window, part)| {
                stop::check_of(stop.as_ref())?;
                Ok::<_, SetError>(self.window(clip, timeline, &window, rotations, part)?)
            })
        })?
    }

    /// As [`CpuEngine::evaluate`], encoded: a task's rotations are converted while they
    /// are in the cache.
    pub(crate) fn evaluate_encoded(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), SetError> {
        let EncodedOutput { encoding, bytes } = output;
        let stop = stop::current();
        let task = |rotations: &mut Vec<[f32; 4]>, window: &Window, output: &mut [u8]| {
            stop::check_of(stop.as_ref())?;
            rotations.resize(window.len(), [0.0; 4]);
            self.window(clip, timeline, window, None, rotations)?;
            encoding.encode_all(rotations, output);
            Ok::<_, SetError>(())
        };
        if window.len() <= TASK {
            return match bytes {
                [] => Ok(()),
                _ => Ok(task(&mut Vec::new(), window, bytes)?),
            };
        }
        self.on_threads(|| {
            let tasks = tasks(window, encoding.bytes(), bytes).into_par_iter();
            tasks.try_for_each_init(Vec::new, |rotations, (window, output)| {
                task(rotations, &window, output)
            })
        })?
    }

    /// Evaluates a window on this thread. `rotations` is the number of rotations of the whole result; `None` if the
    /// result is read again at once.
    fn window(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        rotations: Option<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<(), SampleTimesError> {
        let (samples, tracks) = (window.samples.len(), window.tracks.len());
        let in_rows = window.layout == Layout::TrackMajor || samples == 1;
        if !cfg!(smallest)
            && let Ticks::Times { times, stride } = &timeline.ticks
            && samples <= SAMPLES_ONE_BY_ONE
            && in_rows
            && !clip.interpolation.wrap().repeats()
        {
            let mut sparse = SparseTimes {
                clip,
                times,
                stride: *stride,
                window,
                output,
                others: Vec::new(),
            };
            if sparse.output.len() <= SAMPLES_ONE_BY_ONE {
                // Clearing a block would take longer than these samples.
                sparse.fill::<Vec4>(None);
            } else {
                in_lanes_of(self.width, &mut sparse);
            }
            return sparse.others.into_iter().try_for_each(|row_index| {
                let row = &mut output[row_index * samples..][..samples];
                let track = window.tracks.start + row_index;
                let first = window.samples.start;
                self.row(clip, track, timeline, first, &mut RowOutput::Here(row))
            });
        }
        match window.layout {
            Layout::TrackMajor => {
                let of_a_run = || clip.samples_of_a_run(timeline);
                let streams = rotations.map_or(Some(false), |_| self.streaming_stores);
                let rotations = rotations.unwrap_or_default();
                let mut stage =
                    Stage::new(self.width, streams, rotations, samples, of_a_run, output);
                let mut short = ShortRuns::new(clip, timeline, &window.samples, self.width);
                for track in window.tracks.clone() {
                    stage.row(samples, |samples, output| {
                        if let (Some(short), RowOutput::Here(row)) = (&mut short, &mut *output)
                            && short.row(track, row)
                        {
                            return Ok(());
                        }
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

    /// Evaluates a frame-major window on this thread: each of `frames` receives the window's
    /// tracks at one sample.
    fn frames(
        &self,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        mut frames: Vec<&mut [[f32; 4]]>,
    ) -> Result<(), SampleTimesError> {
        let (samples, tracks) = (window.samples.len(), window.tracks.len());
        let mut rows = vec![[0.0; 4]; samples * TILE.min(tracks)];
        let mut short = ShortRuns::new(clip, timeline, &window.samples, self.width);
        for first in (0..tracks).step_by(TILE) {
            let tile = first..(first + TILE).min(tracks);
            for (row, row_index) in rows.chunks_mut(samples).zip(tile.clone()) {
                let track = window.tracks.start + row_index;
                let first = window.samples.start;
                if !short.as_mut().is_some_and(|short| short.row(track, row)) {
                    self.row(clip, track, timeline, first, &mut RowOutput::Here(row))?;
                }
            }
            for (sample, frame) in frames.iter_mut().enumerate() {
                let column = rows[sample..].iter().step_by(samples);
                for (value, rotation) in frame[tile.clone()].iter_mut().zip(column) {
                    *value = *rotation;
                }
            }
        }
        Ok(())
    }

    /// Evaluates the samples of one track from `first` on.
    fn row(
        &self,
        clip: &ClipData,
        track: usize,
        timeline: &Timeline,
        first: usize,
        output: &mut RowOutput<'_, '_>,
    ) -> Result<(), SampleTimesError> {
        let samples = first..first + output.samples().len();
        if !clip.interpolation.wrap().repeats() {
            let copy = TrackCopy::of_track(samples.clone());
            return clip
                .parts_of(track, timeline, samples)
                .try_for_each(|part| self.part(part, timeline, &copy, output));
        }
        for copy in clip.copies(track, timeline, samples) {
            let range = copy.samples.start - first..copy.samples.end - first;
            let values = &mut RowOutput::Here(&mut output.samples()[range]);
            clip.parts_in(track, &copy)
                .try_for_each(|part| self.part(part, timeline, &copy, values))?;
        }
        Ok(())
    }
}

/// Divides a frame-major window into tasks of some frames of some tracks, each with its slices of the output.
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
            let window = Window::of(tracks, samples.clone(), Layout::FrameMajor);
            (window, Vec::with_capacity(samples.len()))
        }));
        for frame in block.chunks_mut(tracks) {
            let rows = frame.chunks_mut(tracks_each);
            for ((_, frames), row) in all[of_block..].iter_mut().zip(rows) {
                frames.push(row);
            }
        }
    }
    all
}

/// Divides a window into tasks, each with its part of the output, which has `each` elements for a rotation.
fn tasks<'a, T>(
    window: &Window,
    each: usize,
    mut output: &'a mut [T],
) -> Vec<(Window, &'a mut [T])> {
    let with_output = |window: Window| {
        let values = output.split_off_mut(..window.len() * each);
        (window, values.unwrap_or_default())
    };
    let limit = match window.layout {
        Layout::TrackMajor => TASK,
        Layout::FrameMajor => {
            let share = window.samples.len() / (4 * threads::count());
            TASK.max(share.min(TASK_FRAMES / 4) * window.tracks.len())
        }
    };
    window.cut(limit).map(with_output).collect()
}

/// Samples that are evaluated together.
const LANES: usize = 64;

/// A window of a clip at sparse times, evaluated by one lookup for each sample.
pub(crate) struct SparseTimes<'a> {
    pub(crate) clip: &'a ClipData,
    /// Sample `k` of track `t` is at `times[t × stride + k]`.
    pub(crate) times: &'a [f64],
    pub(crate) stride: usize,
    pub(crate) window: &'a Window,
    /// `[track][sample]`.
    pub(crate) output: &'a mut [[f32; 4]],
    /// Tracks with a sample that needs more than a lookup, outside the keys or on a curve that is evaluated in f64,
    /// by their index in the window: the caller evaluates their rows.
    pub(crate) others: Vec<usize>,
}

/// Samples on arcs, gathered until the block is full.
#[derive(Zeroable)]
struct ArcLanes {
    middles: [[f32; 4]; LANES],
    tangents: [[f32; 4]; LANES],
    parameters: [f32; LANES],
    /// The index of each sample in the output.
    outputs: [usize; LANES],
    count: usize,
}

impl InLanes for SparseTimes<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        self.fill::<L>(Some(&mut ArcLanes::zeroed()));
    }
}

impl SparseTimes<'_> {
    /// Evaluates the window; arcs are gathered in a block, or evaluated one by one without it.
    #[inline(always)]
    fn fill<L: Lanes>(&mut self, mut block: Option<&mut ArcLanes>) {
        let samples = self.window.samples.clone();
        for (i, track) in self.window.tracks.clone().enumerate() {
            let Some(PartRef { prepared, part }) = self.clip.only_part(track) else {
                self.others.push(i);
                continue;
            };
            let times = &self.times[track * self.stride..][samples.clone()];
            for (k, &time) in times.iter().enumerate() {
                let output_index = i * samples.len() + k;
                let (index, parameter) = match prepared.spans.source_at(part, time) {
                    Some(RunSource::Constant(index)) => {
                        self.output[output_index] = prepared.constants[index as usize];
                        continue;
                    }
                    Some(RunSource::Segment(index, distance, affine)) => {
                        let distance = distance.at_sample(0, || time);
                        (index, distance * affine.scale + affine.offset)
                    }
                    _ => {
                        self.others.push(i);
                        break;
                    }
                };
                let segments = &prepared.segments;
                match (segments.form, &mut block) {
                    (Form::Arc, Some(block)) => {
                        let arc = &segments.arcs[index as usize];
                        block.push::<L>(arc, parameter, output_index, self.output);
                    }
                    (Form::Arc, None) => {
                        let arc = &segments.arcs[index as usize];
                        self.output[output_index] = arc.value_at(parameter);
                    }
                    (Form::Polynomial, _) => {
                        self.output[output_index] = segments.polynomial_at(index, parameter);
                    }
                }
            }
        }
        if let Some(block) = block {
            block.flush::<L>(self.output);
        }
    }
}

impl ArcLanes {
    /// Adds a sample, and evaluates all into `output` if there is no room for another.
    #[inline(always)]
    fn push<L: Lanes>(
        &mut self,
        segment: &ArcSegment,
        parameter: f32,
        output_index: usize,
        output: &mut [[f32; 4]],
    ) {
        self.middles[self.count] = segment.middle;
        self.tangents[self.count] = segment.tangent;
        self.parameters[self.count] = parameter;
        self.outputs[self.count] = output_index;
        self.count += 1;
        if self.count == LANES {
            self.flush::<L>(output);
        }
    }

    /// Evaluates the samples that wait.
    #[inline(always)]
    fn flush<L: Lanes>(&mut self, output: &mut [[f32; 4]]) {
        let mut rotations = [[0.0; 4]; LANES];
        for j in (0..self.count).step_by(L::COUNT) {
            let middle = L::load_rotations(&self.middles[j..]);
            let tangent = L::load_rotations(&self.tangents[j..]);
            let parameter = L::load(&self.parameters[j..]);
            let found = on_arc(middle, tangent, norm_squared(tangent), parameter);
            L::store_rotations(canonical(found), &mut rotations[j..j + L::COUNT]);
        }
        for (&index, rotation) in self.outputs[..self.count].iter().zip(rotations) {
            output[index] = rotation;
        }
        self.count = 0;
    }
}
