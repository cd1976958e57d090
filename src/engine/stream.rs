//! Results of sets in chunks or some tracks at a time: for results larger than memory, for iterators, and for work
//! that can be stopped between chunks.

use glam::Quat;

use crate::checks::{check_encoding, check_window};
use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate::uploaded::pieces::SetPieces;
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::preparation::SetRequest;
use crate::stream::{Chunk, run};
use crate::time::frames::Timeline;
use crate::tracks::set::TrackSet;

/// The limit of the segments that are prepared before the first chunk, if the engine's options have no limit; more
/// segments are prepared piece by piece.
pub(super) const SEGMENT_BYTES: usize = 256 << 20;

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
        // A chunk has some samples of many tracks, or some of one track: every chunk needs segments that others
        // need too, so all that the window needs are prepared at once, unless that takes too much.
        let limit = self.backend.budget().unwrap_or(SEGMENT_BYTES);
        let pieces = SetPieces {
            backend: &self.backend,
            set,
            interpolation: &interpolation,
            timeline,
            encoding: Encoding::F32,
            limit,
        };
        let windows = window.cut(chunk);
        if pieces.bytes(window) > limit {
            ClipData::unprepared(set, interpolation).map_err(Error::from)?;
            let fill = |window: &Window, output: &mut [Quat]| {
                Ok(pieces.evaluate_into(window, bytemuck::cast_slice_mut(output))?)
            };
            return run(windows, interpolation.quantity, fill, sink);
        }
        let prepared = pieces.prepared(window).map_err(Error::from)?;
        let fill = |window: &Window, output: &mut [Quat]| {
            let output = bytemuck::cast_slice_mut(output);
            Ok(prepared.evaluate_into(window, Encoding::F32, output)?)
        };
        run(windows, interpolation.quantity, fill, sink)
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
        let pieces = |limit| SetPieces {
            backend: &self.backend,
            set,
            interpolation: &interpolation,
            timeline,
            encoding,
            limit,
        };
        if let Some(limit) = self.backend.budget() {
            ClipData::unprepared(set, interpolation)?;
            return Ok(pieces(limit).evaluate_into(window, output)?);
        }
        let prepared = pieces(usize::MAX).prepared(window)?;
        Ok(prepared.evaluate_into(window, encoding, output)?)
    }
}
