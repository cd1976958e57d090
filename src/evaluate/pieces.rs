//! Results in pieces: some samples of some tracks, whose segments are prepared together, evaluated and dropped.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::Quat;

#[cfg(test)]
use crate::evaluate::steps;
use crate::evaluate::uploaded::prepare;
use crate::machine::error::EvaluateError;
use crate::machine::plan::{Plan, halves};
use crate::machine::{Machine, MachineClip};
use crate::output::encoded::EncodedOutput;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::PrepareRequest;
use crate::prepare::error::SetError;
use crate::prepare::preparation::SetRequest;
use crate::threads::stop;
use crate::time::frames::Timeline;

/// The number of values of a piece that are evaluated at once, if they are not contiguous in the result.
const SCATTERED: usize = 1 << 18;

/// Evaluates the pieces of a plan into `output`, which is exactly as long as the request's result. If a device has no
/// memory for a piece, it is halved.
pub(crate) fn evaluate(
    machine: &Arc<dyn Machine>,
    request: &SetRequest<'_>,
    plan: &Plan,
    output: EncodedOutput<'_>,
) -> Result<(), EvaluateError> {
    let whole = Window::of(request.tracks.clone(), request.samples.clone(), plan.layout);
    let mut pieces = VecDeque::from(plan.pieces.clone());
    let are_several = pieces.len() > 1;
    // The next piece reuses the memory of the last one, because the first access to new memory takes longer than the
    // computation.
    let mut spare = None;
    let mut scratch = Vec::new();
    while let Some(piece) = pieces.pop_front() {
        stop::check().map_err(SetError::from)?;
        let part = request.part(piece.tracks.clone(), piece.samples.clone());
        match PreparedWindow::new(machine, &part, are_several, spare.take()) {
            Err(EvaluateError::NoRoom(error)) => {
                let halves = halves(request, &piece).ok_or(error)?;
                halves
                    .into_iter()
                    .rev()
                    .for_each(|half| pieces.push_front(half));
            }
            prepared => {
                let prepared = prepared?;
                let bytes = &mut *output.bytes;
                let encoding = output.encoding;
                prepared.scatter(
                    &piece,
                    &whole,
                    &mut scratch,
                    EncodedOutput { encoding, bytes },
                )?;
                spare = Some(prepared.clip);
            }
        }
    }
    Ok(())
}

/// Some samples of some tracks of a set, prepared.
pub(crate) struct PreparedWindow {
    clip: Box<dyn MachineClip>,
    /// The timeline of the prepared tracks.
    timeline: Timeline,
    /// The index of the first prepared track.
    first_track: usize,
    /// Samples of the set's timeline before the first of `timeline`.
    skipped_samples: usize,
}

impl PreparedWindow {
    /// Prepares the segments of a request, all at once.
    pub(crate) fn whole(
        machine: &Arc<dyn Machine>,
        request: &SetRequest<'_>,
    ) -> Result<Self, EvaluateError> {
        Self::new(machine, request, false, None)
    }

    fn new(
        machine: &Arc<dyn Machine>,
        request: &SetRequest<'_>,
        large_groups: bool,
        spare: Option<Box<dyn MachineClip>>,
    ) -> Result<Self, EvaluateError> {
        #[cfg(test)]
        steps::take_note(&**machine, steps::Step::Piece);
        let (timeline, first_sample) = (request.timeline).part(&request.tracks, &request.samples);
        let to_prepare = PrepareRequest {
            batch: request.batch(),
            large_groups,
            only_for: Some(&timeline),
            ..PrepareRequest::all(request.set)
        };
        let (set, interpolation) = (request.set, *request.interpolation);
        let clip = prepare(machine, set, interpolation, to_prepare, spare)?;
        let timeline = clip.data().folded(&timeline)?.into_owned();
        Ok(Self {
            clip,
            timeline,
            first_track: request.tracks.start,
            skipped_samples: request.samples.start - first_sample,
        })
    }

    /// Evaluates a part of the window, of tracks and samples of the set, into `output`, which is exactly as long.
    pub(crate) fn evaluate_into(
        &self,
        part: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        self.with(part, |timeline, window| {
            self.clip().evaluate_into(timeline, window, output)
        })
    }

    /// The prepared tracks.
    pub(crate) fn clip(&self) -> &dyn MachineClip {
        &*self.clip
    }

    /// Calls `work` with the samples, and a part of the window relative to the prepared tracks.
    pub(crate) fn with<T>(
        &self,
        part: &Window,
        work: impl FnOnce(&Timeline, &Window) -> Result<T, EvaluateError>,
    ) -> Result<T, EvaluateError> {
        let (tracks, samples) = (&part.tracks, &part.samples);
        let (first_track, skipped) = (self.first_track, self.skipped_samples);
        let window = Window::of(
            tracks.start - first_track..tracks.end - first_track,
            samples.start - skipped..samples.end - skipped,
            part.layout,
        );
        let done = work(&self.timeline, &window);
        done.map_err(|error| error.of_tracks_from(first_track))
    }

    /// Evaluates a piece into its part of `whole`, for which there is `output`.
    fn scatter(
        &self,
        piece: &Window,
        whole: &Window,
        scratch: &mut Vec<Quat>,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        let EncodedOutput { encoding, bytes } = output;
        let each = encoding.bytes();
        let is_together = match piece.layout {
            Layout::TrackMajor => piece.samples == whole.samples || piece.tracks.len() == 1,
            Layout::FrameMajor => piece.tracks == whole.tracks || piece.samples.len() == 1,
        };
        if is_together {
            let start = whole.offset(piece.tracks.start, piece.samples.start) * each;
            let bytes = &mut bytes[start..start + piece.len() * each];
            return self.evaluate_into(piece, EncodedOutput { encoding, bytes });
        }
        for part in piece.cut(SCATTERED) {
            let size = part.len() * each;
            scratch.resize(size.div_ceil(size_of::<Quat>()), Quat::IDENTITY);
            let values: &mut [u8] = &mut bytemuck::cast_slice_mut(scratch)[..size];
            let output = EncodedOutput {
                encoding,
                bytes: &mut *values,
            };
            self.evaluate_into(&part, output)?;
            let of_whole = |track, sample| whole.offset(track, sample) * each;
            let (row, starts): (usize, Vec<usize>) = match part.layout {
                Layout::TrackMajor => {
                    let start = |track| of_whole(track, part.samples.start);
                    (part.samples.len(), part.tracks.clone().map(start).collect())
                }
                Layout::FrameMajor => {
                    let start = |sample| of_whole(part.tracks.start, sample);
                    (part.tracks.len(), part.samples.clone().map(start).collect())
                }
            };
            for (row, start) in values.chunks(row * each).zip(starts) {
                bytes[start..start + row.len()].copy_from_slice(row);
            }
        }
        Ok(())
    }

    /// All tracks at all samples of the request from which it was prepared, if those are all samples of its timeline:
    /// the result stays in memory of the device if this saves a copy.
    pub(crate) fn evaluate(&self, layout: Layout) -> Result<Box<dyn Storage>, EvaluateError> {
        let done = self.clip.evaluate(&self.timeline, layout);
        done.map_err(|error| error.of_tracks_from(self.first_track))
    }
}
