//! Evaluation of sets: a [`Plan`] says on which route, and a [`Backend`] carries it out.
//!
//! * [`Plan`]: directly from keys, only the intervals with a sample, batches in a thread's cache, or pieces.
//! * [`Backend`]: the CPU or a Vulkan device.
//! * [`pieces`]: parts of a set whose segments are prepared together.
//! * [`Uploaded`](uploaded::Uploaded): prepared tracks, and their segments on a device, for clips. After a device was
//!   lost they are uploaded again.

pub(crate) mod pieces;
pub(crate) mod plan;
#[cfg(test)]
pub(crate) mod steps;
pub(crate) mod uploaded;

use std::sync::Arc;

use rayon::prelude::*;

use crate::cpu::engine::CpuEngine;
use crate::evaluate::pieces::PreparedWindow;
use crate::evaluate::plan::{Limits, MachineKind, Plan, Route};
use crate::from_keys::dispatches::KeyJob;
use crate::from_keys::{KeyCurve, UNRESOLVED};
use crate::gpu::error::EvaluateError;
use crate::gpu::recovery::Opened;
use crate::output::buffer::OutputBuffer;
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::Storage;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{Batch, SetRequest};
use crate::simd::dispatch::VectorWidth;
use crate::threads::{on_threads, stop};

/// The device of an engine.
pub(crate) enum Backend {
    Cpu(CpuEngine),
    Vulkan(Box<Opened>),
}

impl Backend {
    /// What plans depend on.
    pub(crate) fn limits(&self) -> Limits {
        match self {
            Self::Cpu(engine) => Limits {
                kind: MachineKind::Cpu {
                    threads: engine.thread_count(),
                },
                memory: engine.memory,
                group_bytes: None,
                prepares_arcs_from: None,
            },
            Self::Vulkan(opened) => {
                let engine = opened.engine();
                let arcs_from = engine.prepares_arcs_from;
                Limits {
                    kind: MachineKind::Device {
                        window: engine.window(),
                    },
                    memory: engine.clip_bytes,
                    group_bytes: Some(engine.group_bytes),
                    prepares_arcs_from: Some(arcs_from).filter(|&from| from < usize::MAX),
                }
            }
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

/// Rotations that one task searches for unresolved ones.
const SEARCH_CHUNK: usize = 16 * 1024;

impl Backend {
    /// Evaluates a request in f32; the result stays in the device's memory if that saves a copy.
    pub(crate) fn evaluate(
        self: &Arc<Self>,
        request: &SetRequest<'_>,
        plan: &Plan,
    ) -> Result<Box<dyn Storage>, EvaluateError> {
        let has_all_samples = request.samples == (0..request.timeline.len());
        if let ([_], true) = (&*plan.pieces, has_all_samples) {
            check(request)?;
            return PreparedWindow::whole(self, request)?.evaluate(plan.layout);
        }
        let mut quats = OutputBuffer::new(request.len())?;
        let output = EncodedOutput::of_values(bytemuck::cast_slice_mut(&mut quats));
        self.fill(request, plan, output)?;
        Ok(Box::new(quats))
    }

    /// Carries a plan out: evaluates a request into `output`, which is exactly as long as the result.
    pub(crate) fn fill(
        self: &Arc<Self>,
        request: &SetRequest<'_>,
        plan: &Plan,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        check(request)?;
        stop::check().map_err(SetError::from)?;
        match plan.route {
            Route::Nothing => return Ok(()),
            Route::Pieces { .. } => return pieces::evaluate(self, request, plan, output),
            _ => {}
        }
        if !plan.transposes() {
            return self.rows(request, plan.route, output);
        }
        #[cfg(test)]
        steps::take_note(self, steps::Step::Transposed);
        let (encoding, each) = (output.encoding, output.encoding.bytes());
        let mut rows = OutputBuffer::new(output.bytes.len().div_ceil(Encoding::F32.bytes()))?;
        let bytes: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut rows)[..output.bytes.len()];
        let of_rows = EncodedOutput {
            encoding,
            bytes: &mut *bytes,
        };
        self.rows(request, plan.route, of_rows)?;
        let (tracks, samples) = (request.tracks.len(), request.samples.len());
        for (sample, frame) in output.bytes.chunks_mut(tracks * each).enumerate() {
            let column = bytes.chunks(each).skip(sample).step_by(samples);
            for (value, of_row) in frame.chunks_mut(each).zip(column) {
                value.copy_from_slice(of_row);
            }
        }
        Ok(())
    }

    /// Evaluates a request in rows, each with the samples of a track.
    fn rows(
        &self,
        request: &SetRequest<'_>,
        route: Route,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        #[cfg(test)]
        steps::take_note(self, steps::Step::Rows(route));
        match (route, self) {
            (Route::FromKeys(curve), Self::Cpu(engine)) => {
                Ok(engine.evaluate_from_keys(request, curve, output)?)
            }
            (Route::FromKeys(curve), Self::Vulkan(opened)) => {
                let job = KeyJob { request, curve };
                output.fill(|output| evaluate_from_keys(opened, &job, output))
            }
            (Route::SparseSamples, Self::Cpu(engine)) => {
                Ok(engine.evaluate_sparse(request, output)?)
            }
            (Route::Batches { cuts_tracks }, Self::Cpu(engine)) => {
                Ok(engine.evaluate_batches(request, cuts_tracks, output)?)
            }
            (Route::SparseSamples | Route::Batches { .. }, Self::Vulkan(_))
            | (Route::Pieces { .. } | Route::Nothing, _) => Ok(()),
        }
    }
}

/// Refuses what cannot be interpolated as requested; keys that no sample needs are refused too, on every route.
fn check(request: &SetRequest<'_>) -> Result<(), SetError> {
    match request.len() == 0 || matches!(request.batch(), Batch::Span { .. }) {
        true => Ok(request.check()?),
        false => Ok(request.interpolation.check_wraps()?),
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
    let request = job.request;
    let first = request.samples.start;
    let resolve = |(output, track): (&mut _, _)| engine.resolve(request, track, (first, 0), output);
    on_threads(|| {
        let rows = output.par_chunks_mut(request.samples.len());
        rows.zip(request.tracks.clone()).try_for_each(resolve)
    })??;
    Ok(())
}
