//! A clip: a set prepared for one method, on a device, ready for any frames.

#[cfg(feature = "vulkan")]
use std::sync::Arc;

use glam::{Quat, Vec4};

use crate::curve::options::Quantity;
use crate::engine::{Engine, check_encoding, check_rows, in_quats};
use crate::error::Error;
#[cfg(feature = "vulkan")]
use crate::evaluate::backend::Backend;
use crate::evaluate::uploaded::Uploaded;
#[cfg(feature = "vulkan")]
use crate::gpu::engine::{Job, VulkanEngine};
#[cfg(feature = "vulkan")]
use crate::gpu::error::EvaluateError;
#[cfg(feature = "vulkan")]
use crate::gpu::exported::{Exported, ExportedResult};
#[cfg(feature = "vulkan")]
use crate::gpu::in_flight::Target;
#[cfg(feature = "vulkan")]
use crate::memory::OutOfMemory;
use crate::memory::zeroed;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Rotations, Samples, Vectors};
use crate::output::value::OutputValue;
use crate::output::window::Window;
use crate::request::{Request, check_window};
use crate::stream::{Chunk, run};
use crate::time::frames::{SampleTimes, SampleTimesError, Timeline};

/// A set prepared for one method, on its engine's device; evaluate it as often as
/// needed, at any frames.
pub struct Clip {
    engine: Engine,
    pub(crate) uploaded: Uploaded,
}

impl Clip {
    pub(crate) fn new(engine: Engine, uploaded: Uploaded) -> Self {
        Self { engine, uploaded }
    }

    /// The engine that it was uploaded to.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Number of tracks.
    pub fn track_count(&self) -> usize {
        self.uploaded.data.track_count()
    }

    /// The samples that `frames` means for this clip.
    ///
    /// # Errors
    /// When they do not fit it.
    pub fn timeline(&self, frames: &SampleTimes) -> Result<Timeline, SampleTimesError> {
        frames.resolve(self.track_count(), self.uploaded.data.time_span)
    }

    /// The rotation of every track at every sample, `[track][frame]`.
    ///
    /// # Errors
    /// When the frames do not fit the clip, the clip is of velocities or accelerations, there is not
    /// the memory for the result, or the device fails.
    pub fn evaluate(&self, frames: &SampleTimes) -> Result<Rotations, Error> {
        self.evaluate_as(frames, Layout::TrackMajor)
    }

    /// As [`Clip::evaluate`], in the given layout.
    ///
    /// # Errors
    /// As [`Clip::evaluate`].
    pub fn evaluate_as(&self, frames: &SampleTimes, layout: Layout) -> Result<Rotations, Error> {
        check_rows::<Quat>(self.quantity())?;
        self.samples(frames, layout)
    }

    /// The vectors of a clip of angular velocities or accelerations
    /// ([`Interpolation::quantity`](crate::method::interpolation::Interpolation::quantity)).
    ///
    /// # Errors
    /// As [`Clip::evaluate`]; also when the clip is of rotations.
    pub fn rates(&self, frames: &SampleTimes, layout: Layout) -> Result<Vectors, Error> {
        check_rows::<Vec4>(self.quantity())?;
        self.samples(frames, layout)
    }

    pub(crate) fn quantity(&self) -> Quantity {
        self.uploaded.data.interpolation.quantity
    }

    /// The stored values, whatever they are.
    pub(crate) fn samples<T>(
        &self,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Samples<T>, Error> {
        let timeline = self.timeline(frames)?;
        let storage = (self.uploaded).evaluate(&timeline, layout)?;
        let (tracks, samples) = (self.track_count(), timeline.len());
        Ok(Samples::new(storage, tracks, samples, layout))
    }

    /// As [`Clip::evaluate_as`], or as [`Clip::rates`], into the caller's memory, of which
    /// [`Engine::evaluate_into`] says more.
    ///
    /// # Errors
    /// As [`Clip::evaluate`]; also when `output` is not exactly as long as the result, or of another
    /// type.
    pub fn evaluate_into<R: OutputValue>(
        &self,
        frames: &SampleTimes,
        layout: Layout,
        output: &mut [R],
    ) -> Result<(), Error> {
        check_rows::<R>(self.quantity())?;
        let timeline = self.timeline(frames)?;
        let whole = Window::whole(self.track_count(), timeline.len(), layout);
        in_quats(output, whole.len(), |quats| {
            let timeline = self.uploaded.folded(&timeline)?;
            let bytes = bytemuck::cast_slice_mut(quats);
            Ok((self.uploaded).evaluate_into(&timeline, &whole, Encoding::F32, bytes)?)
        })
    }

    /// Evaluates a window of the result into `output`, encoded, if both fit the result.
    pub(crate) fn encode_window_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        check_encoding(encoding, self.quantity())?;
        check_window(
            &window,
            self.track_count(),
            timeline.len(),
            encoding,
            output,
        )?;
        if output.is_empty() {
            return Ok(());
        }
        let timeline = self.uploaded.folded(timeline)?;
        Ok((self.uploaded).evaluate_into(&timeline, window, encoding, output)?)
    }

    /// The rotation of every track at every sample, encoded where it is evaluated. The bytes are
    /// those that [`Encoding::encode`] makes of the result of [`Clip::evaluate_as`].
    ///
    /// # Errors
    /// When the frames do not fit the clip, the encoding is for rotations and the clip
    /// has none, or the device fails.
    pub fn evaluate_encoded(
        &self,
        frames: &SampleTimes,
        layout: Layout,
        encoding: Encoding,
    ) -> Result<Vec<u8>, Error> {
        let timeline = self.timeline(frames)?;
        let whole = Window::whole(self.track_count(), timeline.len(), layout);
        let bytes = whole.len().saturating_mul(encoding.bytes());
        let mut output = zeroed(bytes, "a result")?;
        self.encode_window_into(&timeline, &whole, encoding, &mut output)?;
        Ok(output)
    }

    /// Evaluates into memory of the engine's device that others on the same card, such as CUDA, import. Where they
    /// can wait for the device, this returns while it still writes.
    ///
    /// # Errors
    /// When the engine is the CPU, the device exports no memory, the frames do not fit the clip, the encoding is for
    /// rotations and the clip has none, or the device fails.
    #[cfg(feature = "vulkan")]
    pub fn evaluate_exported(
        &self,
        frames: &SampleTimes,
        layout: Layout,
        encoding: Encoding,
    ) -> Result<ExportedResult, Error> {
        let Backend::Vulkan(opened) = &*self.engine().backend else {
            return Err(Error::ExportOnCpu);
        };
        check_encoding(encoding, self.quantity())?;
        let timeline = self.timeline(frames)?;
        let timeline = self.uploaded.folded(&timeline)?;
        let values = (self.track_count() as u64).saturating_mul(timeline.len() as u64);
        let bytes = values.saturating_mul(encoding.bytes() as u64);
        let needed = usize::try_from(bytes).unwrap_or(usize::MAX);
        let export = |engine: &VulkanEngine, job: Job<'_>| {
            // Smaller windows would not make room for it.
            let exported = match Exported::new(&engine.device, bytes) {
                Err(error) if error.is_out_of_memory() && engine.give_back() => {
                    Exported::new(&engine.device, bytes)
                }
                made => made,
            };
            let exported = Arc::new(exported.map_err(|error| match error.is_out_of_memory() {
                true => OutOfMemory::new::<u8>("a result in the device's memory", needed).into(),
                false => EvaluateError::from(error),
            })?);
            let target = Target::Exported(Arc::clone(&exported));
            engine.run(job, &job.whole(layout), target, None)?;
            Ok(ExportedResult::new(exported, bytes))
        };
        Ok((self.uploaded).on_device(opened, &timeline, encoding, export)?)
    }

    /// A request for the samples that `frames` means: of all tracks, track by track, as rotations of four
    /// f32, unless it says otherwise.
    pub fn request<'a>(&'a self, frames: &'a SampleTimes) -> Request<'a> {
        Request::new(self, frames)
    }

    /// Evaluates in chunks of about `chunk` rotations (at least one row of the layout
    /// is best); `sink` uses one while others are evaluated. The rotations are those
    /// of [`Clip::evaluate_as`]; memory is that of three chunks.
    ///
    /// ```
    /// # use glam::{Quat, Vec4};
    /// # use tumble::{Device, Engine, Error, SampleTimes, Layout, TrackSet, method};
    /// # let mut set = TrackSet::new();
    /// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)]).unwrap();
    /// # let clip = Engine::new(Device::Cpu)?.upload(&set, method::SLERP)?;
    /// let mut largest: f32 = 0.0;
    /// clip.stream(&SampleTimes::fps(60), Layout::FrameMajor, 1 << 20, |chunk| {
    ///     largest = chunk.rows.iter().map(|[x, ..]| *x).fold(largest, f32::max);
    ///     Ok::<(), Error>(())
    /// })?;
    /// # assert_eq!(largest, (0.5f32).sin());
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// The first error of `sink`; or when the frames do not fit the clip, or the
    /// device fails.
    pub fn stream<E: From<Error>>(
        &self,
        frames: &SampleTimes,
        layout: Layout,
        chunk: usize,
        sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let timeline = self.timeline(frames).map_err(Error::from)?;
        let whole = Window::whole(self.track_count(), timeline.len(), layout);
        let timeline = self.uploaded.folded(&timeline).map_err(Error::from)?;
        let fill = |window: &Window, output: &mut [Quat]| {
            let bytes = bytemuck::cast_slice_mut(output);
            Ok((self.uploaded).evaluate_into(&timeline, window, Encoding::F32, bytes)?)
        };
        run(whole.cut(chunk), self.quantity(), fill, sink)
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
