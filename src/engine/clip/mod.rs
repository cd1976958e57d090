//! A clip: a set prepared for one method, stored on a device, for evaluation at any times.

pub(crate) mod request;

use glam::Quat;

use crate::checks::{check_encoding, check_window};
use crate::curve::options::Quantity;
use crate::engine::Engine;
use crate::engine::clip::request::Request;
use crate::error::Error;
use crate::evaluate::uploaded::Uploaded;
use crate::output::encoded::EncodedOutput;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::output::value::OutputValue;
use crate::output::window::Window;
use crate::stream::{Chunk, run};
use crate::time::error::SampleTimesError;
use crate::time::frames::{SampleTimes, Timeline};

/// A set that is prepared for one method and stored on its engine's device. It may be evaluated any number of times,
/// at any sample times.
pub struct Clip {
    engine: Engine,
    pub(crate) uploaded: Uploaded,
}

impl Clip {
    pub(crate) fn new(engine: Engine, uploaded: Uploaded) -> Self {
        Self { engine, uploaded }
    }

    /// The engine to which the clip was uploaded.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Number of tracks.
    pub fn track_count(&self) -> usize {
        self.uploaded.data.track_count()
    }

    /// The sample times of `frames` for this clip.
    ///
    /// # Errors
    /// When the frames do not fit the clip.
    pub fn timeline(&self, frames: &SampleTimes) -> Result<Timeline, SampleTimesError> {
        frames.resolve(self.track_count(), self.uploaded.data.time_span)
    }

    /// Evaluates the rotation of every track at every sample, `[track][frame]`. Short for
    /// [`request`](Clip::request)`(frames).`[`evaluate`](Request::evaluate)`()`.
    ///
    /// # Errors
    /// When the frames do not fit the clip, the clip is of velocities or accelerations, there is not enough memory
    /// for the result, or the device fails.
    pub fn evaluate(&self, frames: &SampleTimes) -> Result<Rotations, Error> {
        self.request(frames).evaluate()
    }

    /// Evaluates the vectors of a clip of angular velocities or accelerations. Short for
    /// [`request`](Clip::request)`(frames).`[`layout`](Request::layout)`(layout).`[`rates`](Request::rates)`()`.
    ///
    /// # Errors
    /// As [`Clip::evaluate`], but the clip must not be of rotations.
    pub fn rates(&self, frames: &SampleTimes, layout: Layout) -> Result<Vectors, Error> {
        self.request(frames).layout(layout).rates()
    }

    pub(crate) fn quantity(&self) -> Quantity {
        self.uploaded.data.interpolation.quantity
    }

    /// The values of any quantity.
    pub(crate) fn samples<T>(
        &self,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Samples<T>, Error> {
        let timeline = self.uploaded.data.folded(timeline)?;
        let storage = (self.uploaded).evaluate(&timeline, layout)?;
        let (tracks, samples) = (self.track_count(), timeline.len());
        Ok(Samples::new(storage, tracks, samples, layout))
    }

    /// Evaluates into memory of the result's type, as [`Engine::evaluate_into`]. Short for
    /// [`request`](Clip::request)`(frames).`[`layout`](Request::layout)`(layout).`[`evaluate_into`](Request::evaluate_into)`(output)`,
    /// which accepts memory of any type.
    ///
    /// # Errors
    /// As [`Clip::evaluate`], but for any quantity; also when `output` is not exactly as long as the result, or its
    /// type does not fit the quantity.
    pub fn evaluate_into<R: OutputValue>(
        &self,
        frames: &SampleTimes,
        layout: Layout,
        output: &mut [R],
    ) -> Result<(), Error> {
        self.request(frames)
            .layout(layout)
            .evaluate_values_into(output)
    }

    /// Evaluates a window of the result into `output`, in an encoding; refuses windows and outputs that do not fit.
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
        let timeline = self.uploaded.data.folded(timeline)?;
        Ok((self.uploaded).evaluate_into(&timeline, window, output)?)
    }

    /// Starts a request for the samples at the times of `frames`: by default of all tracks, track by track, with four
    /// f32 a value.
    pub fn request<'a>(&'a self, frames: &'a SampleTimes) -> Request<'a> {
        Request::of_clip(self, frames)
    }

    /// Evaluates a window of the result in chunks of about `chunk` values.
    pub(crate) fn stream_window<E: From<Error>>(
        &self,
        timeline: &Timeline,
        window: &Window,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let timeline = self.uploaded.data.folded(timeline).map_err(Error::from)?;
        let fill = |window: &Window, output: &mut [Quat]| {
            let output = EncodedOutput::of_values(bytemuck::cast_slice_mut(output));
            Ok((self.uploaded).evaluate_into(&timeline, window, output)?)
        };
        run(window.cut(chunk), self.quantity(), fill, sink)
    }
}

impl std::fmt::Debug for Clip {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Clip")
            .field("engine", &self.engine)
            .field("method", &self.uploaded.data.interpolation.method)
            .field("tracks", &self.track_count())
            .finish_non_exhaustive()
    }
}
