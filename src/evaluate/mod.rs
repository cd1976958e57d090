//! Evaluation of sets: a [`Plan`] says on which route, and a [`Machine`] carries it out.
//!
//! * [`Plan`]: directly from keys, only the intervals with a sample, batches in a thread's cache, or pieces.
//! * [`pieces`]: parts of a set whose segments are prepared together.
//! * [`Uploaded`](uploaded::Uploaded): prepared tracks of clips.

pub(crate) mod pieces;
#[cfg(test)]
pub(crate) mod steps;
pub(crate) mod uploaded;

use std::sync::Arc;

use crate::evaluate::pieces::PreparedWindow;
use crate::machine::Machine;
use crate::machine::error::EvaluateError;
use crate::machine::plan::{Plan, Route, Rows};
use crate::output::buffer::OutputBuffer;
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::Storage;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{Batch, SetRequest};
use crate::threads::stop;

/// Evaluates a request in f32; the result stays in the machine's memory if that saves a copy.
pub(crate) fn evaluate(
    machine: &Arc<dyn Machine>,
    request: &SetRequest<'_>,
    plan: &Plan,
) -> Result<Box<dyn Storage>, EvaluateError> {
    let has_all_samples = request.samples == (0..request.timeline.len());
    if let ([_], true) = (&*plan.pieces, has_all_samples) {
        check(request)?;
        return PreparedWindow::whole(machine, request)?.evaluate(plan.layout);
    }
    let mut quats = OutputBuffer::new(request.len())?;
    let output = EncodedOutput::of_values(bytemuck::cast_slice_mut(&mut quats));
    fill(machine, request, plan, output)?;
    Ok(Box::new(quats))
}

/// Carries a plan out: evaluates a request into `output`, which is exactly as long as the result.
pub(crate) fn fill(
    machine: &Arc<dyn Machine>,
    request: &SetRequest<'_>,
    plan: &Plan,
    output: EncodedOutput<'_>,
) -> Result<(), EvaluateError> {
    check(request)?;
    stop::check().map_err(SetError::from)?;
    match plan.route {
        Route::Nothing => Ok(()),
        #[cfg(not(smallest))]
        Route::Rows(rows) => fill_rows(machine, request, plan, rows, output),
        _ => pieces::evaluate(machine, request, plan, output),
    }
}

/// Evaluates a request in rows, and copies them into frames if the result is frame by frame.
#[cfg(not(smallest))]
fn fill_rows(
    machine: &Arc<dyn Machine>,
    request: &SetRequest<'_>,
    plan: &Plan,
    rows: Rows,
    output: EncodedOutput<'_>,
) -> Result<(), EvaluateError> {
    if !plan.transposes() {
        return evaluate_rows(&**machine, request, rows, output);
    }
    #[cfg(test)]
    steps::take_note(&**machine, steps::Step::Transposed);
    let (encoding, each) = (output.encoding, output.encoding.bytes());
    let mut in_rows = OutputBuffer::new(output.bytes.len().div_ceil(Encoding::F32.bytes()))?;
    let bytes: &mut [u8] = &mut bytemuck::cast_slice_mut(&mut in_rows)[..output.bytes.len()];
    let of_rows = EncodedOutput {
        encoding,
        bytes: &mut *bytes,
    };
    evaluate_rows(&**machine, request, rows, of_rows)?;
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
#[cfg(not(smallest))]
fn evaluate_rows(
    machine: &dyn Machine,
    request: &SetRequest<'_>,
    rows: Rows,
    output: EncodedOutput<'_>,
) -> Result<(), EvaluateError> {
    #[cfg(test)]
    steps::take_note(machine, steps::Step::Rows(rows));
    machine.rows(request, rows, output)
}

/// Refuses tracks that cannot be interpolated as requested. All routes also refuse keys that no sample needs, so that
/// they report the same errors.
fn check(request: &SetRequest<'_>) -> Result<(), SetError> {
    match request.len() == 0 || matches!(request.batch(), Batch::Span { .. }) {
        true => Ok(request.check()?),
        false => Ok(request.interpolation.check_wraps()?),
    }
}
