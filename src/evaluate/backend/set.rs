//! Evaluates a set by its route.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::Quat;
use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::curve::segment::segment_size;
use crate::evaluate::backend::Backend;
use crate::evaluate::backend::route::SetRoute;
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
use crate::prepare::batch::{Batch, BatchSize, PART_INTERVALS, batches};
use crate::prepare::clip_data::PrepareRequest;
use crate::prepare::error::SetError;
use crate::prepare::request::SetRequest;
use crate::simd::dispatch::VectorWidth;
use crate::threads::{on_threads, stop};

/// Bytes of segments that a Vulkan device gets at once where a set has far more keys than samples.
const DENSE_BYTES: usize = 64 << 20;

/// Rotations that one task searches for unresolved ones.
const SEARCH_CHUNK: usize = 16 * 1024;

impl Backend {
    /// Evaluates a set; the result stays in memory of the device where that saves a copy.
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

    /// Cuts tracks into batches whose segments fit the device's memory budget. Where keys are far
    /// more than samples a batch has at most 64 MiB, and each uses the buffers of the one before:
    /// fresh memory for all segments would cost more than preparing them.
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

/// Evaluates a job straight from keys, and on the CPU what the device left unresolved.
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
