//! Evaluation of sets: the choice of a route, and its execution on the CPU or a Vulkan device.
//!
//! Every route gives the same bits; routes differ in the segments that they prepare and keep. If a set has fewer
//! samples than keys, most prepared segments would never be used, and a set larger than memory cannot be prepared as
//! a whole.
//!
//! * [`Backend`]: the CPU or a Vulkan device. It chooses a [`SetRoute`] for each call: directly from keys, only the
//!   intervals with a sample, batches in a thread's cache, or clips.
//! * [`Uploaded`]: prepared tracks, and their segments on a device, for clips. After a device was lost they are
//!   uploaded again.
//! * [`SetPieces`]: a set whose segments exceed the memory budget. A window of its result is halved until the
//!   segments of each half fit.

pub(crate) mod uploaded;

use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;

use glam::Quat;
use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::curve::options::Speed;
use crate::evaluate::uploaded::Uploaded;
use crate::evaluate::uploaded::pieces::{SetPieces, segment_bytes};
use crate::from_keys::dispatches::KeyJob;
use crate::from_keys::{KeyCurve, UNRESOLVED};
use crate::gpu::error::EvaluateError;
use crate::gpu::recovery::Opened;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::PrepareRequest;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{Batch, BatchSize, PART_INTERVALS, SetRequest, batches};
use crate::prepare::prepared::segment_size;
use crate::simd::dispatch::VectorWidth;
use crate::threads::{on_threads, stop};
use crate::time::frames::Ticks;

/// The device of an engine.
pub(crate) enum Backend {
    Cpu(CpuEngine),
    Vulkan(Box<Opened>),
}

impl Backend {
    /// Bytes of segments that go into one buffer of a Vulkan device.
    pub(crate) fn group_bytes(&self) -> Option<usize> {
        self.opened().map(|opened| opened.engine().group_bytes)
    }

    /// Whether a Vulkan device prepares the arcs between so many keys.
    pub(crate) fn prepares_arcs(&self, keys: usize) -> bool {
        self.opened()
            .is_some_and(|opened| opened.engine().prepares_arcs(keys))
    }

    /// Bytes that segments may take, if there is a limit.
    pub(crate) fn budget(&self) -> Option<usize> {
        match self {
            Self::Cpu(engine) => engine.memory,
            Self::Vulkan(opened) => opened.engine().clip_bytes,
        }
    }

    /// The Vulkan device; `None` for the CPU.
    pub(crate) fn opened(&self) -> Option<&Opened> {
        match self {
            Self::Cpu(_) => None,
            Self::Vulkan(opened) => Some(opened),
        }
    }
}

/// The maximum average number of keys of a track for batches of a set whose tracks must not be divided: with longer
/// tracks, too few threads would have work.
const LONG_TRACK: usize = 16 * 1024;

/// The number of key intervals that are prepared for one separate sample, plus the same number for the time to find
/// them. With fewer keys for each sample, preparing all intervals takes no longer.
const KEYS_OF_A_SAMPLE: usize = 8;

/// The same number for methods that solve equations for the velocities at the keys of a whole window of the track.
const KEYS_OF_A_SOLUTION: usize = 2048;

/// The route on which a set is evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SetRoute {
    /// Every sample is evaluated directly from the keys next to it.
    FromKeys(KeyCurve),
    /// In batches: a thread of the CPU prepares some intervals, evaluates them while their
    /// segments are in its cache, and forgets them.
    Batches {
        /// Whether a long track may be divided into several parts.
        cuts_tracks: bool,
    },
    /// On the CPU: only the key intervals that have a sample are prepared.
    SparseSamples,
    /// The segments of all tracks are prepared before the first is evaluated. A Vulkan device processes as many
    /// tracks at a time as fit its memory.
    Clips {
        /// Whether a track that exceeds that memory may be divided.
        cuts_tracks: bool,
    },
}

impl Backend {
    pub(crate) fn route(&self, request: &SetRequest<'_>, layout: Layout) -> SetRoute {
        let (set, timeline) = (request.set, request.timeline);
        let interpolation = request.interpolation;
        let in_rows = layout.of(timeline.len()) == Layout::TrackMajor;
        let in_order = matches!(timeline.ticks, Ticks::Frames { .. });
        let are_held = interpolation.wrap().are_held();
        let cuts_tracks = in_rows && in_order && are_held && interpolation.speed == Speed::AsKeyed;
        if timeline.is_empty() {
            return SetRoute::Clips { cuts_tracks };
        }
        let is_sparse = matches!(self, Self::Cpu(_)) && has_sparse_samples(request);
        let curve = match in_rows || is_sparse {
            true => KeyCurve::of_set(set, interpolation, timeline),
            false => None,
        };
        if is_sparse && curve.is_none() {
            return SetRoute::SparseSamples;
        }
        if !in_rows && !is_sparse {
            return SetRoute::Clips { cuts_tracks };
        }
        match (self, curve) {
            (Self::Cpu(_), Some(curve)) => SetRoute::FromKeys(curve),
            (Self::Cpu(_), None) => {
                let are_short = set.key_count() <= LONG_TRACK * set.track_count();
                match are_held && (are_short || cuts_tracks) {
                    true => SetRoute::Batches { cuts_tracks },
                    false => SetRoute::Clips { cuts_tracks },
                }
            }
            (Self::Vulkan(opened), Some(curve)) => {
                // Where samples are explicit times, the keys of a track are not cut.
                let window = opened.engine().window();
                match in_order || set.longest().max(timeline.len()) <= window {
                    true => SetRoute::FromKeys(curve),
                    false => SetRoute::Clips { cuts_tracks },
                }
            }
            (Self::Vulkan(_), None) => SetRoute::Clips { cuts_tracks },
        }
    }
}

impl SetRoute {
    /// Whether the route is for few samples of many keys.
    pub(crate) fn is_sparse(self) -> bool {
        matches!(self, Self::FromKeys(_) | Self::SparseSamples)
    }

    /// Whether the route computes rows, each with the samples of a track, regardless of the result's layout.
    pub(crate) fn is_of_rows(self) -> bool {
        !matches!(self, Self::Clips { .. })
    }
}

/// Whether there are so few samples for so many keys that only the intervals with a sample should be prepared, and
/// each of these can be prepared without the others.
fn has_sparse_samples(request: &SetRequest<'_>) -> bool {
    let (tracks, interpolation) = (request.tracks.clone(), request.interpolation);
    let in_frames = matches!(request.timeline.ticks, Ticks::Frames { .. });
    let are_together = in_frames && interpolation.wrap().repeats();
    let each = match interpolation.method.is_solved() {
        true => KEYS_OF_A_SOLUTION,
        false => KEYS_OF_A_SAMPLE,
    };
    let samples = tracks.len().saturating_mul(request.timeline.len());
    interpolation.speed == Speed::AsKeyed
        && !are_together
        && samples.saturating_mul(each) <= request.set.keys_of(tracks)
}

impl fmt::Display for SetRoute {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FromKeys(KeyCurve::Arcs) => {
                f.write_str("fewer samples than keys: each sample is computed from the two keys beside it")
            }
            Self::FromKeys(KeyCurve::TwoKeys) => f.write_str(
                "fewer samples than keys, two keys per track: each sample is computed from the keys of its track",
            ),
            Self::FromKeys(KeyCurve::Cubics(_)) => f.write_str(
                "fewer samples than keys, with mostly small rotations between them: each sample is computed from the four keys around it; intervals with too large rotations are prepared",
            ),
            Self::Batches { cuts_tracks } => {
                f.write_str("in batches: a thread prepares about a thousand keys, evaluates them while their segments are in the cache, and discards the segments")?;
                match cuts_tracks {
                    true => f.write_str("; long tracks are divided among the threads"),
                    false => Ok(()),
                }
            }
            Self::SparseSamples => f.write_str(
                "far fewer samples than keys: only the intervals that contain a sample are prepared",
            ),
            Self::Clips { .. } => f.write_str(
                "as a clip: all segments are prepared and uploaded to the device, for as many tracks at a time as it has memory for, then evaluated",
            ),
        }
    }
}

/// The size of segments that a Vulkan device gets at once if a set has far more keys than samples, bytes.
const DENSE_BYTES: usize = 64 << 20;

/// Rotations that one task searches for unresolved ones.
const SEARCH_CHUNK: usize = 16 * 1024;

impl Backend {
    /// Evaluates a set; the result stays in the device's memory if that saves a copy.
    pub(crate) fn evaluate(
        self: &Arc<Self>,
        request: &SetRequest<'_>,
        layout: Layout,
    ) -> Result<Box<dyn Storage>, EvaluateError> {
        let is_within = (self.budget())
            .is_none_or(|limit| segment_bytes(request.set, request.interpolation) <= limit);
        if let SetRoute::Clips { cuts_tracks } = self.route(request, layout)
            && is_within
            && self.clips(request, cuts_tracks).len() == 1
        {
            let to_prepare = PrepareRequest {
                only_for: Some(request.timeline),
                ..PrepareRequest::all(request.set)
            };
            let clip = Uploaded::new(self, request.set, *request.interpolation, to_prepare, None)?;
            return clip.evaluate(request.timeline, layout);
        }
        let mut quats = OutputBuffer::new(request.tracks.len() * request.timeline.len())?;
        self.evaluate_tracks(request, layout, &mut quats)?;
        Ok(Box::new(quats))
    }

    /// Evaluates into `output`, which is exactly as long as the result.
    pub(crate) fn evaluate_tracks(
        self: &Arc<Self>,
        request: &SetRequest<'_>,
        layout: Layout,
        output: &mut [Quat],
    ) -> Result<(), EvaluateError> {
        request.interpolation.check().map_err(SetError::from)?;
        stop::check().map_err(SetError::from)?;
        let route = self.route(request, layout);
        let (tracks, samples) = (request.tracks.len(), request.timeline.len());
        if route.is_of_rows() && layout.of(samples) == Layout::FrameMajor && tracks > 1 {
            let mut rows = OutputBuffer::new(output.len())?;
            self.evaluate_tracks(request, Layout::TrackMajor, &mut rows)?;
            for (sample, frame) in output.chunks_mut(tracks).enumerate() {
                let column = rows[sample..].iter().step_by(samples);
                for (sample, &value) in frame.iter_mut().zip(column) {
                    *sample = value;
                }
            }
            return Ok(());
        }
        if let (SetRoute::Clips { .. }, Self::Cpu(_), Some(limit)) = (route, &**self, self.budget())
        {
            let (tracks, samples) = (request.tracks.clone(), 0..request.timeline.len());
            let pieces = SetPieces {
                backend: self,
                set: request.set,
                interpolation: request.interpolation,
                timeline: request.timeline,
                encoding: Encoding::F32,
                limit,
            };
            let window = Window::of(tracks, samples, layout.of(request.timeline.len()));
            return pieces.evaluate_into(&window, bytemuck::cast_slice_mut(output));
        }
        match (route, &**self) {
            (SetRoute::FromKeys(curve), Self::Cpu(engine)) => {
                Ok(engine.evaluate_from_keys(request, curve, output)?)
            }
            (SetRoute::SparseSamples, Self::Cpu(engine)) => {
                Ok(engine.evaluate_sparse(request, bytemuck::cast_slice_mut(output))?)
            }
            (SetRoute::FromKeys(curve), Self::Vulkan(opened)) => {
                let job = KeyJob { request, curve };
                evaluate_from_keys(opened, &job, bytemuck::cast_slice_mut(output))
            }
            (SetRoute::Batches { cuts_tracks }, Self::Cpu(engine)) => {
                Ok(engine.evaluate_batches(request, cuts_tracks, output)?)
            }
            (route, _) => {
                let cuts_tracks = matches!(
                    route,
                    SetRoute::Batches { cuts_tracks: true } | SetRoute::Clips { cuts_tracks: true }
                );
                let clips = self.clips(request, cuts_tracks);
                let layout = layout.of(request.timeline.len());
                self.evaluate_clips(request, layout, clips, output)
            }
        }
    }

    /// Divides tracks into batches whose segments fit the device's memory budget. If there are far more keys than
    /// samples, a batch has at most 64 MiB, and each uses the buffers of the previous one: fresh memory for all
    /// segments would take longer than preparing them.
    fn clips(&self, request: &SetRequest<'_>, cuts_tracks: bool) -> VecDeque<Batch> {
        let (set, timeline) = (request.set, request.timeline);
        let whole = Batch::Tracks(request.tracks.clone());
        let Self::Vulkan(opened) = self else {
            return [whole].into();
        };
        let key_bytes = segment_size(request.interpolation.form()) + size_of::<Quat>();
        let result = set.track_count() * timeline.len() * size_of::<Quat>();
        let is_dense = (set.key_count() * key_bytes) / 4 > result;
        let budget = opened.engine().clip_bytes.unwrap_or(usize::MAX);
        let limit = match is_dense {
            true => budget.min(DENSE_BYTES),
            false => budget,
        };
        let keys = limit / key_bytes;
        let size = BatchSize {
            keys,
            tracks: usize::MAX,
            cut: cuts_tracks.then_some((keys / PART_INTERVALS).max(1) * PART_INTERVALS),
        };
        let batches = VecDeque::from(batches(set, whole.clone(), size));
        match batches.is_empty() {
            true => [whole].into(),
            false => batches,
        }
    }

    /// Prepares and evaluates one batch after another.
    fn evaluate_clips(
        self: &Arc<Self>,
        request: &SetRequest<'_>,
        layout: Layout,
        mut clips: VecDeque<Batch>,
        output: &mut [Quat],
    ) -> Result<(), EvaluateError> {
        let (set, tracks, timeline) = (request.set, &request.tracks, request.timeline);
        let interpolation = *request.interpolation;
        let is_whole = clips.len() == 1;
        // A clip uses the memory of the one before: fresh memory costs more than the work in it.
        let mut used: Option<Uploaded> = None;
        let mut columns: Vec<Quat> = Vec::new();
        while let Some(batch) = clips.pop_front() {
            stop::check().map_err(SetError::from)?;
            let batch_tracks = batch.tracks();
            let timeline = timeline.of_tracks(batch_tracks.clone());
            let (spare, buffers) = used
                .take()
                .map_or_else(Default::default, Uploaded::into_spare);
            let to_prepare = PrepareRequest {
                batch: batch.clone(),
                large_groups: !is_whole,
                only_for: Some(&timeline),
                spare,
                ..PrepareRequest::all(set)
            };
            let clip = match Uploaded::new(self, set, interpolation, to_prepare, buffers) {
                Err(EvaluateError::Vulkan(error))
                    if error.is_out_of_memory() && batch_tracks.len() > 1 =>
                {
                    let middle = batch_tracks.start + batch_tracks.len() / 2;
                    clips.push_front(Batch::Tracks(middle..batch_tracks.end));
                    clips.push_front(Batch::Tracks(batch_tracks.start..middle));
                    continue;
                }
                clip => clip?,
            };
            let folded = clip.data.folded(&timeline)?;
            let window = Window {
                samples: batch.samples(set, &timeline, interpolation.steps()),
                ..Window::whole(batch_tracks.len(), timeline.len(), layout)
            };
            let evaluate = |output: &mut [Quat]| {
                let output = bytemuck::cast_slice_mut(output);
                clip.evaluate_into(&folded, &window, Encoding::F32, output)
                    .map_err(|error| error.of_tracks_from(batch_tracks.start))
            };
            let columns_range = batch_tracks.start - tracks.start..batch_tracks.end - tracks.start;
            if layout == Layout::TrackMajor || columns_range.len() == tracks.len() {
                let start = columns_range.start * timeline.len() + window.samples.start;
                evaluate(&mut output[start..start + window.len()])?;
            } else {
                columns.resize(window.len(), Quat::IDENTITY);
                evaluate(&mut columns)?;
                let frames = output.chunks_mut(tracks.len());
                for (frame, column) in frames.zip(columns.chunks(columns_range.len())) {
                    frame[columns_range.clone()].copy_from_slice(column);
                }
            }
            used = Some(clip);
        }
        Ok(())
    }
}

/// Evaluates a job directly from keys, and on the CPU the samples that the device marked as unresolved.
fn evaluate_from_keys(
    opened: &Opened,
    job: &KeyJob<'_>,
    output: &mut [[f32; 4]],
) -> Result<(), EvaluateError> {
    opened.attempt_smaller(|engine| engine.evaluate_keys(job, output))?;
    let unresolved = |some: &[[f32; 4]]| some.contains(&UNRESOLVED);
    let is_cubic = matches!(job.curve, KeyCurve::Cubics(_));
    if !is_cubic || !on_threads(|| output.par_chunks(SEARCH_CHUNK).any(unresolved))? {
        return Ok(());
    }
    let engine = CpuEngine::on_shared_threads(VectorWidth::widest());
    let resolve = |(output, track): (&mut _, _)| engine.resolve(job.request, track, (0, 0), output);
    on_threads(|| {
        let rows = output.par_chunks_mut(job.request.timeline.len());
        rows.zip(job.request.tracks.clone()).try_for_each(resolve)
    })??;
    Ok(())
}
