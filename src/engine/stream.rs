//! Results of sets, in chunks or some tracks at a time: for results larger than memory, for iterators, and for those
//! who want to stop in between.

use std::ops::Range;

use glam::Quat;

use crate::engine::{Engine, check_encoding};
use crate::error::Error;
use crate::evaluate::pieces::{SetPieces, segment_bytes};
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::batch::Batch;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::request::SetRequest;
use crate::request::check_window;
use crate::stream::{Chunk, run};
use crate::time::frames::SampleTimes;
use crate::tracks::set::TrackSet;

/// Segments that are prepared before the first chunk, where the engine's options have no limit; more are prepared
/// piece by piece.
const SEGMENT_BYTES: usize = 256 << 20;

impl Engine {
    /// As [`Clip::stream`](crate::clip::Clip::stream), from a set: with [`Layout::TrackMajor`] only the tracks of
    /// a chunk are prepared at a time. Frame by frame, and where a chunk is less than a track, all are
    /// prepared at once if that takes no more than
    /// [`EngineOptions::memory`](crate::gpu::options::EngineOptions::memory), or 256 MiB where that has no limit;
    /// else those that a chunk needs are.
    ///
    /// # Errors
    /// As [`Clip::stream`](crate::clip::Clip::stream) and [`Engine::upload`].
    pub fn stream<E: From<Error>>(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &SampleTimes,
        layout: Layout,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let interpolation = interpolation.into();
        let timeline = frames
            .resolve(set.track_count(), set.time_span())
            .map_err(Error::from)?;
        if layout == Layout::FrameMajor || timeline.len() > chunk {
            // A chunk has some samples of many tracks, or some of one track: every chunk needs
            // segments that others need too, so all are prepared at once, unless that takes too much.
            let limit = self.backend.budget().unwrap_or(SEGMENT_BYTES);
            if segment_bytes(set, &interpolation) > limit {
                ClipData::unprepared(set, interpolation).map_err(Error::from)?;
                let pieces = SetPieces {
                    backend: &self.backend,
                    set,
                    interpolation: &interpolation,
                    timeline: &timeline,
                    encoding: Encoding::F32,
                    limit,
                };
                let whole = Window::whole(set.track_count(), timeline.len(), layout);
                let fill = |window: &Window, output: &mut [Quat]| {
                    Ok(pieces.evaluate_into(window, bytemuck::cast_slice_mut(output))?)
                };
                return run(whole.cut(chunk), interpolation.quantity, fill, sink);
            }
            let to_prepare = PrepareRequest {
                only_for: Some(&timeline),
                ..PrepareRequest::all(set)
            };
            let clip = self.upload_prepared(set, interpolation, to_prepare)?;
            return clip.stream(frames, layout, chunk, sink);
        }
        let whole = Window::whole(set.track_count(), timeline.len(), layout);
        let fill = |window: &Window, output: &mut [Quat]| {
            let request = SetRequest {
                tracks: window.tracks.clone(),
                ..SetRequest::whole(set, &interpolation, &timeline)
            };
            Ok((self.backend).evaluate_tracks(&request, layout, output)?)
        };
        run(whole.cut(chunk), interpolation.quantity, fill, sink)
    }

    /// Some tracks of a result, `[track][sample]`, into the caller's memory. Only they are prepared;
    /// the frames are those of the whole set. The bytes are those of [`Clip::evaluate_encoded`](crate::clip::Clip::evaluate_encoded);
    /// memory that is aligned to 16 bytes is filled without a copy.
    ///
    /// ```
    /// # use glam::{Quat, Vec4};
    /// # use tumble::{Device, Encoding, Engine, Error, SampleTimes, TrackSet, method};
    /// # let mut set = TrackSet::new();
    /// # let keys = [Quat::IDENTITY, Quat::from_rotation_x(1.0)];
    /// # set.push("", &[0.0, 1.0], &keys).unwrap();
    /// # set.push("", &[0.0, 1.0], &keys).unwrap();
    /// let engine = Engine::new(Device::Cpu)?;
    /// let mut second = [[0.0_f32; 4]; 61];
    /// let bytes = bytemuck::cast_slice_mut(&mut second);
    /// let frames = SampleTimes::fps(60);
    /// engine.evaluate_tracks_into(&set, method::SLERP, &frames, 1..2, Encoding::F32, bytes)?;
    /// assert_eq!(Quat::from_array(second[60]), keys[1]);
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Engine::evaluate`]; also when there are no such tracks, `output` has not exactly the
    /// bytes of the result, or the encoding is for rotations and these are none.
    pub fn evaluate_tracks_into(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &SampleTimes,
        tracks: Range<usize>,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        let interpolation = interpolation.into();
        let whole = (tracks, Layout::TrackMajor);
        self.encode_into(set, interpolation, frames, whole, encoding, output)
    }

    /// All tracks of a set, encoded, in the given layout, into the caller's memory: what
    /// [`Engine::upload`] and [`Clip::request`](crate::clip::Clip::request) give, but only what the samples need is
    /// prepared. Memory that is aligned to 16 bytes is filled without a copy.
    ///
    /// # Errors
    /// As [`Engine::evaluate`]; also when `output` has not exactly the bytes of the result, or the
    /// encoding is for rotations and these are none.
    pub fn evaluate_encoded_into(
        &self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        frames: &SampleTimes,
        layout: Layout,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        let whole = (0..set.track_count(), layout);
        self.encode_into(set, interpolation.into(), frames, whole, encoding, output)
    }

    fn encode_into(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        frames: &SampleTimes,
        (tracks, layout): (Range<usize>, Layout),
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        check_encoding(encoding, interpolation.quantity)?;
        let timeline = frames.resolve(set.track_count(), set.time_span())?;
        let part = Window::of(tracks.clone(), 0..timeline.len(), layout);
        check_window(&part, set.track_count(), timeline.len(), encoding, output)?;
        if output.is_empty() {
            return Ok(());
        }
        if encoding == Encoding::F32
            && let Ok(quats) = bytemuck::try_cast_slice_mut(&mut *output)
        {
            let request = SetRequest {
                tracks,
                ..SetRequest::whole(set, &interpolation, &timeline)
            };
            return Ok((self.backend).evaluate_tracks(&request, layout, quats)?);
        }
        let request = SetRequest {
            tracks: tracks.clone(),
            ..SetRequest::whole(set, &interpolation, &timeline)
        };
        if self.backend.route(&request, layout).is_sparse() {
            // Few are evaluated, whatever they take when they are encoded.
            let mut quats = OutputBuffer::new(part.len())?;
            (self.backend).evaluate_tracks(&request, layout, &mut quats)?;
            encoding.encode_all(bytemuck::cast_slice(&quats), output);
            return Ok(());
        }
        if let Some(limit) = self.backend.budget() {
            let pieces = SetPieces {
                backend: &self.backend,
                set,
                interpolation: &interpolation,
                timeline: &timeline,
                encoding,
                limit,
            };
            ClipData::unprepared(set, interpolation)?;
            return Ok(pieces.evaluate_into(&part, output)?);
        }
        let timeline = timeline.of_tracks(tracks.clone());
        let to_prepare = PrepareRequest {
            batch: Batch::Tracks(tracks.clone()),
            only_for: Some(&timeline),
            ..PrepareRequest::all(set)
        };
        let clip = self.upload_prepared(set, interpolation, to_prepare)?;
        let whole = Window::whole(tracks.len(), timeline.len(), layout);
        clip.encode_window_into(&timeline, &whole, encoding, output)
    }
}
