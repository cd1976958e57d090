//! Sets piece by piece: where a device has not the memory for all segments at once, or
//! where that would cost more than making them.

use std::collections::VecDeque;
use std::ops::Range;

use glam::Quat;

use crate::clip::Clip;
use crate::cpu::long::{first_sample, is_in_stretches};
use crate::curve::segment::segment_size;
use crate::engine::{Backend, Engine, Error};
use crate::from_keys::evaluate::straight;
use crate::from_keys::pieces::KeyJob;
use crate::method::interpolation::Interpolation;
use crate::output::rotations::Layout;
use crate::prepare::clip_data::Wanted;
use crate::prepare::set::BATCH;
use crate::time::frames::{FramesError, Timeline};
use crate::time::window::Window;
use crate::tracks::set::TrackSet;

/// Bytes of segments that a Vulkan device gets at once where keys are many.
const DENSE_PIECE: usize = 64 << 20;

/// What a device gets at once: some tracks, or some intervals of one.
pub(crate) struct Piece {
    tracks: Range<usize>,
    intervals: Option<Range<usize>>,
}

impl Piece {
    fn of_tracks(tracks: Range<usize>) -> Self {
        Self {
            tracks,
            intervals: None,
        }
    }
}

impl Engine {
    /// Some tracks at the samples of a timeline, which is the whole set's; `output` fits
    /// them.
    pub(crate) fn evaluate_tracks_into(
        &self,
        set: &TrackSet,
        tracks: Range<usize>,
        interpolation: Interpolation,
        timeline: &Timeline,
        layout: Layout,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        let samples = timeline.len();
        if let (Backend::Cpu(engine), true) =
            (&*self.backend, self.is_fused(set, &interpolation, layout))
        {
            return engine.evaluate_set(set, tracks, &interpolation, timeline, output);
        }
        if let (Backend::Cpu(engine), Layout::TrackMajor) = (&*self.backend, layout)
            && let Some(straight) = straight(set, &interpolation, timeline)
            && samples > 0
        {
            let mut rows = tracks.zip(output.chunks_mut(samples));
            return rows.try_for_each(|(track, row)| {
                engine.sampled_track(set, track, (&interpolation, straight), timeline, row)
            });
        }
        if let (Backend::Cpu(engine), true) = (
            &*self.backend,
            self.is_in_stretches(set, &interpolation, timeline, layout),
        ) {
            let mut rows = tracks.zip(output.chunks_mut(samples));
            return rows.try_for_each(|(track, row)| {
                engine.long_track(set, track, &interpolation, timeline, row)
            });
        }
        if let Backend::Vulkan(opened) = &*self.backend
            && let Some(job) = self.key_job(set, tracks.clone(), &interpolation, timeline, layout)
        {
            let output = bytemuck::cast_slice_mut(output);
            opened.attempt_smaller(|engine| engine.evaluate_keys(&job, output))?;
            return job.mend(output);
        }
        let pieces = self.pieces(set, tracks.clone(), &interpolation, timeline, layout);
        let mut pieces = VecDeque::from(pieces);
        // What one piece needed, the next one uses again: fresh memory costs more than
        // what is done with it.
        let mut used: Option<Clip> = None;
        let mut columns: Vec<Quat> = Vec::new();
        while let Some(Piece {
            tracks: piece,
            intervals,
        }) = pieces.pop_front()
        {
            let of_piece = timeline.of_tracks(piece.clone());
            let (spare, buffers) = used.take().map_or_else(Default::default, Clip::into_spare);
            let wanted = Wanted {
                tracks: piece.clone(),
                few_groups: piece != tracks || intervals.is_some(),
                only_for: Some(&of_piece),
                intervals: intervals.clone(),
                spare,
                ..Wanted::all(set, None)
            };
            let clip = match self.upload_wanted(set, interpolation, wanted, buffers) {
                Err(Error::Vulkan(error)) if error.is_out_of_memory() && piece.len() > 1 => {
                    let middle = piece.start + piece.len() / 2;
                    pieces.push_front(Piece::of_tracks(middle..piece.end));
                    pieces.push_front(Piece::of_tracks(piece.start..middle));
                    continue;
                }
                clip => clip?,
            };
            if let Some(own) = intervals {
                let track = set.track(piece.start);
                let from = match own.start {
                    0 => 0,
                    start => first_sample(track.times, timeline, start),
                };
                let to = match own.end + 1 == track.keys.len() {
                    true => samples,
                    false => first_sample(track.times, timeline, own.end).max(from),
                };
                let window = Window {
                    samples: from..to,
                    ..Window::whole(1, samples, layout)
                };
                let row = (piece.start - tracks.start) * samples;
                let place = &mut output[row + from..row + to];
                clip.evaluate_window_into(&of_piece, &window, place)
                    .map_err(|error| error.of_tracks_from(piece.start))?;
                used = Some(clip);
                continue;
            }
            let own = piece.start - tracks.start..piece.end - tracks.start;
            let is_contiguous = layout == Layout::TrackMajor || piece == tracks;
            let place = if is_contiguous {
                &mut output[own.start * samples..own.end * samples]
            } else {
                columns.resize(own.len() * samples, Quat::IDENTITY);
                &mut columns
            };
            clip.evaluate_timeline_into(&of_piece, layout, place)
                .map_err(|error| error.of_tracks_from(piece.start))?;
            if !is_contiguous {
                let frames = output
                    .chunks_mut(tracks.len())
                    .zip(columns.chunks(own.len()));
                for (frame, part) in frames {
                    frame[own.clone()].copy_from_slice(part);
                }
            }
            used = Some(clip);
        }
        Ok(())
    }

    /// Whether a set's tracks are so long that the threads share each.
    pub(crate) fn is_in_stretches(
        &self,
        set: &TrackSet,
        interpolation: &Interpolation,
        timeline: &Timeline,
        layout: Layout,
    ) -> bool {
        let on_cpu = matches!(*self.backend, Backend::Cpu(_));
        let in_rows = layout == Layout::TrackMajor && !timeline.is_empty();
        let long = !self.is_fused(set, interpolation, layout);
        on_cpu && in_rows && long && is_in_stretches(interpolation, timeline)
    }

    /// What a Vulkan device does straight from keys.
    pub(crate) fn key_job<'a>(
        &self,
        set: &'a TrackSet,
        tracks: Range<usize>,
        interpolation: &'a Interpolation,
        timeline: &'a Timeline,
        layout: Layout,
    ) -> Option<KeyJob<'a>> {
        let Backend::Vulkan(opened) = &*self.backend else {
            return None;
        };
        let most = opened.engine().window();
        KeyJob::new(set, tracks, interpolation, timeline, layout, most)
    }

    /// Tracks whose segments fit the device's budget, or intervals of a track that does not;
    /// and where keys are far more than samples, pieces that are quickly done with: fresh
    /// memory for all of their segments would cost more than making them.
    pub(crate) fn pieces(
        &self,
        set: &TrackSet,
        tracks: Range<usize>,
        interpolation: &Interpolation,
        timeline: &Timeline,
        layout: Layout,
    ) -> Vec<Piece> {
        let key_bytes = segment_size(interpolation.form()) + size_of::<Quat>();
        let result = set.track_count() * timeline.len() * size_of::<Quat>();
        let is_dense = (set.key_count() * key_bytes) / 4 > result;
        let limit = match &*self.backend {
            Backend::Vulkan(opened) => {
                let budget = opened.engine().clip_bytes().unwrap_or(usize::MAX);
                if is_dense {
                    budget.min(DENSE_PIECE)
                } else {
                    budget
                }
            }
            Backend::Cpu(_) => usize::MAX,
        };
        let in_stretches = layout == Layout::TrackMajor && is_in_stretches(interpolation, timeline);
        let mut pieces = Vec::new();
        let (mut start, mut bytes) = (tracks.start, 0usize);
        for index in tracks.clone() {
            let keys = set.times_and_keys(index).1.len();
            let own = keys * key_bytes;
            if bytes.saturating_add(own) > limit && index > start {
                pieces.push(Piece::of_tracks(start..index));
                (start, bytes) = (index, 0);
            }
            if own > limit && in_stretches && keys > BATCH {
                let each = (limit / key_bytes / BATCH).max(1) * BATCH;
                pieces.extend((0..keys - 1).step_by(each).map(|first| Piece {
                    tracks: index..index + 1,
                    intervals: Some(first..(first + each).min(keys - 1)),
                }));
                start = index + 1;
                continue;
            }
            bytes += own;
        }
        if start < tracks.end || pieces.is_empty() {
            pieces.push(Piece::of_tracks(start..tracks.end));
        }
        pieces
    }
}

impl Error {
    /// What a piece of a set says of its tracks, said of the set's.
    fn of_tracks_from(mut self, first: usize) -> Self {
        if let Self::Frames(FramesError::GapTooLong { track, .. }) = &mut self {
            *track += first;
        }
        self
    }
}
