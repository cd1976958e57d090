//! Results of sets, in chunks or some tracks at a time: for results larger than memory, for iterators, and for those
//! who want to stop in between.

use glam::Quat;

use crate::checks::{check_encoding, check_window};
use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate::uploaded::pieces::{SetPieces, segment_bytes};
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::batch::Batch;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::request::SetRequest;
use crate::stream::{Chunk, run};
use crate::time::frames::Timeline;
use crate::tracks::set::TrackSet;

/// Segments that are prepared before the first chunk, where the engine's options have no limit; more are prepared
/// piece by piece.
const SEGMENT_BYTES: usize = 256 << 20;

impl Engine {
    /// Evaluates a window of a set's result in chunks of about `chunk` values.
    pub(crate) fn stream_window<E: From<Error>>(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        timeline: &Timeline,
        window: &Window,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let is_tracks = window.samples == (0..timeline.len());
        if window.layout == Layout::TrackMajor && is_tracks && timeline.len() <= chunk {
            let fill = |window: &Window, output: &mut [Quat]| {
                let request = SetRequest {
                    tracks: window.tracks.clone(),
                    ..SetRequest::whole(set, &interpolation, timeline)
                };
                Ok((self.backend).evaluate_tracks(&request, window.layout, output)?)
            };
            return run(window.cut(chunk), interpolation.quantity, fill, sink);
        }
        // A chunk has some samples of many tracks, or some of one track: every chunk needs
        // segments that others need too, so all are prepared at once, unless that takes too much.
        let limit = self.backend.budget().unwrap_or(SEGMENT_BYTES);
        if segment_bytes(set, &interpolation) > limit {
            ClipData::unprepared(set, interpolation).map_err(Error::from)?;
            let pieces = SetPieces {
                backend: &self.backend,
                set,
                interpolation: &interpolation,
                timeline,
                encoding: Encoding::F32,
                limit,
            };
            let fill = |window: &Window, output: &mut [Quat]| {
                Ok(pieces.evaluate_into(window, bytemuck::cast_slice_mut(output))?)
            };
            return run(window.cut(chunk), interpolation.quantity, fill, sink);
        }
        let to_prepare = PrepareRequest {
            only_for: Some(timeline),
            ..PrepareRequest::all(set)
        };
        let clip = self.upload_prepared(set, interpolation, to_prepare)?;
        clip.stream_window(timeline, window, chunk, sink)
    }

    /// Evaluates a window of a set's result into memory, encoded, if they fit.
    pub(crate) fn encode_window_into(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        timeline: &Timeline,
        window: &Window,
        (encoding, output): (Encoding, &mut [u8]),
    ) -> Result<(), Error> {
        check_encoding(encoding, interpolation.quantity)?;
        check_window(window, set.track_count(), timeline.len(), encoding, output)?;
        if output.is_empty() {
            return Ok(());
        }
        let tracks = window.tracks.clone();
        if window.samples == (0..timeline.len()) {
            let request = SetRequest {
                tracks: tracks.clone(),
                ..SetRequest::whole(set, &interpolation, timeline)
            };
            if encoding == Encoding::F32
                && let Ok(quats) = bytemuck::try_cast_slice_mut(&mut *output)
            {
                return Ok((self.backend).evaluate_tracks(&request, window.layout, quats)?);
            }
            if self.backend.route(&request, window.layout).is_sparse() {
                // Few are evaluated, whatever they take when they are encoded.
                let mut quats = OutputBuffer::new(window.len())?;
                (self.backend).evaluate_tracks(&request, window.layout, &mut quats)?;
                encoding.encode_all(bytemuck::cast_slice(&quats), output);
                return Ok(());
            }
        }
        if let Some(limit) = self.backend.budget() {
            let pieces = SetPieces {
                backend: &self.backend,
                set,
                interpolation: &interpolation,
                timeline,
                encoding,
                limit,
            };
            ClipData::unprepared(set, interpolation)?;
            return Ok(pieces.evaluate_into(window, output)?);
        }
        let timeline = timeline.of_tracks(tracks.clone());
        let to_prepare = PrepareRequest {
            batch: Batch::Tracks(tracks.clone()),
            only_for: Some(&timeline),
            ..PrepareRequest::all(set)
        };
        let clip = self.upload_prepared(set, interpolation, to_prepare)?;
        let window = Window::of(0..tracks.len(), window.samples.clone(), window.layout);
        clip.encode_window_into(&timeline, &window, encoding, output)
    }
}
