//! Results of sets whose segments would exceed the memory limit: piece by piece. A piece is some samples of some
//! tracks, which is prepared, evaluated and dropped.

use std::sync::Arc;

use glam::Quat;

use crate::curve::options::Speed;
use crate::evaluate::Backend;
use crate::evaluate::uploaded::Uploaded;
use crate::gpu::error::EvaluateError;
use crate::method::interpolation::Interpolation;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::PrepareRequest;
use crate::prepare::preparation::Batch;
use crate::prepare::prepared::segment_size;
use crate::time::frames::{Ticks, Timeline};
use crate::tracks::set::TrackSet;

/// The minimum number of keys of a piece: with fewer, the repeated preparation of neighbouring intervals would take
/// most of the time.
const MIN_KEYS: usize = 256;

/// The number of values of a piece that are evaluated at once, if they are not contiguous in the result.
const SCATTERED: usize = 1 << 16;

/// The minimum number of keys of a track for which a piece is divided at a sample: both pieces prepare the intervals
/// at the division, which are then few relative to the others.
const KEYS_TO_CUT: usize = 8;

/// Bytes that a key takes when it is prepared: its segment, its constant, and its span.
fn key_bytes(interpolation: &Interpolation) -> usize {
    const SPAN: usize = size_of::<f64>() + 3 * size_of::<u32>();
    segment_size(interpolation.form()) + size_of::<Quat>() + SPAN
}

/// About how many bytes all segments of a set take.
pub(crate) fn segment_bytes(set: &TrackSet, interpolation: &Interpolation) -> usize {
    set.key_count().saturating_mul(key_bytes(interpolation))
}

/// A set that is evaluated in pieces.
pub(crate) struct SetPieces<'a> {
    pub(crate) backend: &'a Arc<Backend>,
    pub(crate) set: &'a TrackSet,
    pub(crate) interpolation: &'a Interpolation,
    /// The timeline of the whole set, with the original times.
    pub(crate) timeline: &'a Timeline,
    pub(crate) encoding: Encoding,
    /// Bytes that the segments of a piece may take.
    pub(crate) limit: usize,
}

impl SetPieces<'_> {
    /// Evaluates a window of the result into `output`, which is exactly as long.
    pub(crate) fn evaluate_into(
        &self,
        window: &Window,
        output: &mut [u8],
    ) -> Result<(), EvaluateError> {
        let (tracks, samples) = (window.tracks.clone(), window.samples.clone());
        let mut scratch = Vec::new();
        let mut pieces = vec![Window::of(tracks, samples, window.layout)];
        while let Some(piece) = pieces.pop() {
            match self.halves(&piece) {
                Some([first, second]) => pieces.extend([second, first]),
                None if piece.len() == 0 => {}
                None => self.evaluate(&piece, window, &mut scratch, output)?,
            }
        }
        Ok(())
    }

    /// Whether a piece may contain only the intervals of its samples: not if tracks continue outside their keys, and
    /// not if the speed depends on the whole track.
    fn cuts_tracks(&self) -> bool {
        self.interpolation.wrap().are_held() && self.interpolation.speed == Speed::AsKeyed
    }

    /// The approximate size of the segments of a window, bytes.
    pub(crate) fn bytes(&self, window: &Window) -> usize {
        let keys = self.keys(window);
        keys.saturating_mul(key_bytes(self.interpolation))
    }

    /// The number of keys of the intervals that are prepared for a piece.
    fn keys(&self, piece: &Window) -> usize {
        self.batch(piece).keys(self.set)
    }

    /// The intervals that are prepared for a piece.
    fn batch(&self, piece: &Window) -> Batch {
        let tracks = piece.tracks.clone();
        let Some((from, to)) = self.time_span(piece).filter(|_| self.cuts_tracks()) else {
            return Batch::Tracks(tracks);
        };
        Batch::Span { tracks, from, to }
    }

    /// The first and the last time of a piece's samples.
    fn time_span(&self, piece: &Window) -> Option<(f64, f64)> {
        let (first, last) = (piece.samples.start, piece.samples.end.checked_sub(1)?);
        let (timeline, track) = (self.timeline, piece.tracks.start);
        let (times, tracks) = match &timeline.ticks {
            Ticks::Frames { .. } => {
                return Some((
                    timeline.time_at(track, first),
                    timeline.time_at(track, last),
                ));
            }
            Ticks::Times { stride: 0, .. } => (timeline, track..track + 1),
            Ticks::Times { .. } => (timeline, piece.tracks.clone()),
        };
        let all = tracks.flat_map(|track| {
            let samples = piece.samples.clone();
            samples.map(move |sample| times.time_at(track, sample))
        });
        all.fold(None, |span, time| {
            let (from, to): (f64, f64) = span.unwrap_or((time, time));
            Some((from.min(time), to.max(time)))
        })
    }

    /// The two halves of a piece, if its segments are too large and it can be divided.
    fn halves(&self, piece: &Window) -> Option<[Window; 2]> {
        let limit = (self.limit / key_bytes(self.interpolation)).max(MIN_KEYS);
        let keys = self.keys(piece);
        let (tracks, samples) = (&piece.tracks, &piece.samples);
        if keys <= limit {
            return None;
        }
        let has_many = keys > KEYS_TO_CUT * tracks.len() || tracks.len() == 1;
        if self.cuts_tracks() && samples.len() > 1 && has_many {
            let middle = samples.start + samples.len() / 2;
            let part = |samples| Window::of(tracks.clone(), samples, piece.layout);
            return Some([part(samples.start..middle), part(middle..samples.end)]);
        }
        let middle = tracks.start + tracks.len() / 2;
        let part = |tracks| Window::of(tracks, samples.clone(), piece.layout);
        (tracks.len() > 1).then(|| [part(tracks.start..middle), part(middle..tracks.end)])
    }

    /// Prepares the segments of a window, all at once.
    pub(crate) fn prepared(&self, window: &Window) -> Result<PreparedWindow, EvaluateError> {
        let (timeline, first_sample) = self.timeline.part(&window.tracks, &window.samples);
        let to_prepare = PrepareRequest {
            batch: self.batch(window),
            only_for: Some(&timeline),
            ..PrepareRequest::all(self.set)
        };
        let (backend, interpolation) = (self.backend, *self.interpolation);
        let clip = Uploaded::new(backend, self.set, interpolation, to_prepare, None)?;
        let timeline = clip.data.folded(&timeline)?.into_owned();
        Ok(PreparedWindow {
            clip,
            timeline,
            first_track: window.tracks.start,
            skipped_samples: window.samples.start - first_sample,
        })
    }

    /// Evaluates one piece into its part of the window.
    fn evaluate(
        &self,
        piece: &Window,
        window: &Window,
        scratch: &mut Vec<Quat>,
        output: &mut [u8],
    ) -> Result<(), EvaluateError> {
        let prepared = self.prepared(piece)?;
        let each = self.encoding.bytes();
        let is_together = match piece.layout {
            Layout::TrackMajor => piece.samples == window.samples || piece.tracks.len() == 1,
            Layout::FrameMajor => piece.tracks == window.tracks || piece.samples.len() == 1,
        };
        if is_together {
            let start = window.offset(piece.tracks.start, piece.samples.start) * each;
            let output = &mut output[start..start + piece.len() * each];
            return prepared.evaluate_into(piece, self.encoding, output);
        }
        for part in piece.cut(SCATTERED) {
            let bytes = part.len() * each;
            scratch.resize(bytes.div_ceil(size_of::<Quat>()), Quat::IDENTITY);
            let values: &mut [u8] = &mut bytemuck::cast_slice_mut(scratch)[..bytes];
            prepared.evaluate_into(&part, self.encoding, values)?;
            let of_window = |track, sample| window.offset(track, sample) * each;
            let (row, starts): (usize, Vec<usize>) = match part.layout {
                Layout::TrackMajor => {
                    let starts = part.tracks.clone();
                    let start = |track| of_window(track, part.samples.start);
                    (part.samples.len(), starts.map(start).collect())
                }
                Layout::FrameMajor => {
                    let starts = part.samples.clone();
                    let start = |sample| of_window(part.tracks.start, sample);
                    (part.tracks.len(), starts.map(start).collect())
                }
            };
            for (row, start) in values.chunks(row * each).zip(starts) {
                output[start..start + row.len()].copy_from_slice(row);
            }
        }
        Ok(())
    }
}

/// Some samples of some tracks of a set, prepared.
pub(crate) struct PreparedWindow {
    clip: Uploaded,
    /// The timeline of the prepared tracks.
    timeline: Timeline,
    /// The index of the first prepared track.
    first_track: usize,
    /// Samples of the set's timeline before the first of `timeline`.
    skipped_samples: usize,
}

impl PreparedWindow {
    /// Evaluates a part of the window, of tracks and samples of the set, into `output`, which is exactly as long.
    pub(crate) fn evaluate_into(
        &self,
        part: &Window,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), EvaluateError> {
        self.with(part, |clip, timeline, window| {
            clip.evaluate_into(timeline, window, encoding, output)
        })
    }

    /// Calls `work` with the prepared tracks, the samples, and a part of the window relative to them.
    pub(crate) fn with<T>(
        &self,
        part: &Window,
        work: impl FnOnce(&Uploaded, &Timeline, &Window) -> Result<T, EvaluateError>,
    ) -> Result<T, EvaluateError> {
        let (tracks, samples) = (&part.tracks, &part.samples);
        let (first_track, skipped) = (self.first_track, self.skipped_samples);
        let window = Window::of(
            tracks.start - first_track..tracks.end - first_track,
            samples.start - skipped..samples.end - skipped,
            part.layout,
        );
        let done = work(&self.clip, &self.timeline, &window);
        done.map_err(|error| error.of_tracks_from(first_track))
    }
}
