//! A clip: a set that is prepared for one interpolation, or for an interpolation of each track, and stored on a device.

pub(crate) mod request;
pub(crate) mod sampler;

use std::sync::Arc;

use glam::Quat;

use crate::checks::{check_encoding, check_window};
use crate::curve::options::Quantity;
use crate::engine::Engine;
use crate::engine::clip::request::Request;
use crate::engine::clip::sampler::Sampler;
use crate::engine::groups::GroupedTracks;
use crate::error::Error;
use crate::evaluate::uploaded::Uploaded;
use crate::output::encoded::EncodedOutput;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::output::value::OutputValue;
use crate::output::window::Window;
use crate::stream::{Chunk, run};
use crate::time::error::SampleTimesError;
use crate::time::frames::{SampleTimes, Timeline};

/// A set that is prepared for one method, or for a method of each track, and stored on its engine's device. It may be
/// evaluated any number of times, at any sample times.
pub struct Clip {
    engine: Engine,
    pub(crate) tracks: ClipTracks,
    /// Number of keys of all tracks.
    keys: usize,
}

/// The tracks of a clip.
pub(crate) enum ClipTracks {
    /// Tracks with the same interpolation.
    Alike(Uploaded),
    Grouped(Arc<GroupedTracks>),
}

impl Clip {
    pub(crate) fn new(engine: Engine, uploaded: Uploaded, keys: usize) -> Self {
        let tracks = ClipTracks::Alike(uploaded);
        Self {
            engine,
            tracks,
            keys,
        }
    }

    pub(crate) fn of_groups(engine: Engine, grouped: GroupedTracks, keys: usize) -> Self {
        let tracks = ClipTracks::Grouped(Arc::new(grouped));
        Self {
            engine,
            tracks,
            keys,
        }
    }

    /// The tracks as one set of segments, as results need that stay on a device.
    ///
    /// # Errors
    /// When the tracks have several interpolations.
    pub(crate) fn uploaded(&self) -> Result<&Uploaded, Error> {
        match &self.tracks {
            ClipTracks::Alike(uploaded) => Ok(uploaded),
            ClipTracks::Grouped(_) => Err(Error::SeveralInterpolations),
        }
    }

    /// The engine to which the clip was uploaded.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Number of tracks.
    #[must_use]
    pub fn track_count(&self) -> usize {
        match &self.tracks {
            ClipTracks::Alike(uploaded) => uploaded.data().track_count(),
            ClipTracks::Grouped(grouped) => grouped.track_count,
        }
    }

    /// The memory that the clip takes on the host for each key, in bytes; 0 for a clip without keys.
    ///
    /// By default a clip keeps a segment for each key. An arc takes 64 bytes, and a polynomial takes 144, 176 or 208
    /// bytes. For Catmull-Rom, Bessel-Overhauser, Hermite and B-spline curves the CPU leaves out coefficients that are
    /// 0. There are more of these if the rotation between two keys is small, so that nearly all segments of recorded
    /// motion take 144 bytes. Other methods mostly need all coefficients, and devices keep all. On the CPU a clip keeps
    /// its keys instead of segments if two conditions hold. First, the segments would take more memory than
    /// [`EngineOptions::kept_segments`](crate::EngineOptions::kept_segments) or than the engine may use; here a
    /// polynomial counts as 208 bytes, because its coefficients are not known before. Second, samples can be computed
    /// from the keys: for arcs, and for cubics that mostly rotate little between keys. A key then takes 16 bytes. Its
    /// time takes 8 bytes, once for all tracks with the same times.
    #[must_use]
    pub fn bytes_per_key(&self) -> f64 {
        let bytes = match &self.tracks {
            ClipTracks::Alike(uploaded) => uploaded.bytes(),
            ClipTracks::Grouped(grouped) => grouped.bytes(),
        };
        bytes as f64 / self.keys.max(1) as f64
    }

    /// Computes the sample times for this clip: for frames, from its first key to its last.
    ///
    /// # Errors
    /// As [`SampleTimes::resolve`].
    pub fn timeline(&self, times: &SampleTimes) -> Result<Timeline, SampleTimesError> {
        let span = match &self.tracks {
            ClipTracks::Alike(uploaded) => uploaded.data().time_span,
            ClipTracks::Grouped(grouped) => grouped.time_span,
        };
        times.resolve(self.track_count(), span)
    }

    /// Evaluates the rotation of every track at every sample, `[track][frame]`. Short for
    /// [`request`](Clip::request)`(times).`[`evaluate`](Request::evaluate)`()`.
    ///
    /// # Errors
    /// * [`Error::SampleTimes`] when the sample times do not fit the clip ([`SampleTimes::resolve`]).
    /// * When the clip is of velocities or accelerations, which [`Clip::rates`] evaluates.
    /// * When there is not enough memory for the result, or the device fails.
    pub fn evaluate(&self, times: &SampleTimes) -> Result<Rotations, Error> {
        self.request(times).evaluate()
    }

    /// Evaluates the vectors of a clip of angular velocities or accelerations. Short for
    /// [`request`](Clip::request)`(times).`[`layout`](Request::layout)`(layout).`[`rates`](Request::rates)`()`.
    ///
    /// # Errors
    /// As [`Clip::evaluate`], but the clip must not be of rotations.
    pub fn rates(&self, times: &SampleTimes, layout: Layout) -> Result<Vectors, Error> {
        self.request(times).layout(layout).rates()
    }

    pub(crate) fn quantity(&self) -> Quantity {
        match &self.tracks {
            ClipTracks::Alike(uploaded) => uploaded.data().interpolation.quantity,
            ClipTracks::Grouped(grouped) => grouped.quantity,
        }
    }

    /// The values of any quantity, of tracks with the same interpolation.
    pub(crate) fn samples<T>(
        &self,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Samples<T>, Error> {
        let uploaded = self.uploaded()?;
        let timeline = uploaded.data().folded(timeline)?;
        let storage = uploaded.prepared()?.evaluate(&timeline, layout)?;
        let (tracks, samples) = (self.track_count(), timeline.len());
        Ok(Samples::new(storage, tracks, samples, layout))
    }

    /// Evaluates into memory of the result's type, as [`Engine::evaluate_into`]. Short for
    /// [`request`](Clip::request)`(times).`[`layout`](Request::layout)`(layout).`[`evaluate_into`](Request::evaluate_into)`(output)`,
    /// which accepts memory of any type.
    ///
    /// # Errors
    /// As [`Clip::evaluate`], but for any quantity; also when `output` is not exactly as long as the result, or its
    /// type does not fit the quantity.
    pub fn evaluate_into<R: OutputValue>(
        &self,
        times: &SampleTimes,
        layout: Layout,
        output: &mut [R],
    ) -> Result<(), Error> {
        self.request(times)
            .layout(layout)
            .evaluate_values_into(output)
    }

    /// Evaluates a window of the result into `output`, in an encoding, of tracks with the same interpolation; refuses
    /// windows and outputs that do not fit.
    pub(crate) fn fill_window(
        &self,
        timeline: &Timeline,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), Error> {
        let encoding = output.encoding;
        check_encoding(encoding, self.quantity())?;
        let tracks = self.track_count();
        check_window(window, tracks, timeline.len(), encoding, output.bytes)?;
        if output.len() == 0 {
            return Ok(());
        }
        let uploaded = self.uploaded()?;
        let timeline = uploaded.data().folded(timeline)?;
        Ok(uploaded
            .prepared()?
            .evaluate_into(&timeline, window, output)?)
    }

    /// Starts a request for the samples at these times: by default of all tracks, track by track, with four f32 per
    /// value.
    pub fn request<'a>(&'a self, times: &'a SampleTimes) -> Request<'a> {
        Request::of_clip(self, times)
    }

    /// Prepares the evaluation of single samples and poses on the calling thread, with the bits of [`Clip::evaluate`]
    /// at listed times. A clip on a Vulkan device is sampled on the host, too; the sampler keeps the data that this
    /// needs in the host's memory.
    ///
    /// # Errors
    /// When the segments of the clip exceed the engine's memory limit, and samples cannot be computed from the keys of
    /// the clip within the limit.
    pub fn sampler(&self) -> Result<Sampler, Error> {
        let (clips, tracks) = match &self.tracks {
            ClipTracks::Alike(uploaded) => {
                let tracks = (0..self.track_count()).map(|track| (0, track)).collect();
                (vec![uploaded.source()?], tracks)
            }
            ClipTracks::Grouped(grouped) => grouped.prepared_tracks()?,
        };
        let (width, bytes) = (self.engine.machine.width(), self.bytes_per_key());
        Ok(Sampler::new(clips, tracks, self.quantity(), width, bytes))
    }

    /// Evaluates a window of the result in chunks of about `chunk` values, of tracks with the same interpolation.
    pub(crate) fn stream_window<E: From<Error>>(
        &self,
        timeline: &Timeline,
        window: &Window,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let uploaded = self.uploaded()?;
        let timeline = uploaded.data().folded(timeline).map_err(Error::from)?;
        let prepared = uploaded.prepared().map_err(Error::from)?;
        let fill = |window: &Window, output: &mut [Quat]| {
            let output = EncodedOutput::of_values(bytemuck::cast_slice_mut(output));
            Ok(prepared.evaluate_into(&timeline, window, output)?)
        };
        run(window.cut(chunk), self.quantity(), fill, sink)
    }
}

impl std::fmt::Debug for Clip {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut fields = f.debug_struct("Clip");
        fields.field("engine", &self.engine);
        match &self.tracks {
            ClipTracks::Alike(uploaded) => {
                fields.field("method", &uploaded.data().interpolation.method)
            }
            ClipTracks::Grouped(grouped) => {
                fields.field("methods", &grouped.methods().collect::<Vec<_>>())
            }
        };
        fields
            .field("tracks", &self.track_count())
            .finish_non_exhaustive()
    }
}
