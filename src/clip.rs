//! A clip: a set prepared for one method, on a device, ready for any frames.

use std::sync::{Arc, Mutex, PoisonError};

use glam::Quat;

use crate::engine::{Backend, Engine, Error};
use crate::gpu::engine::{ClipBuffers, Job, VulkanEngine};
use crate::gpu::error::VulkanError;
use crate::method::interpolation::Quantity;
use crate::output::buffer::OutputBuffer;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Rotations, Storage};
use crate::prepare::Prepared;
use crate::prepare::clip_data::ClipData;
use crate::time::frames::{Frames, FramesError, Timeline};
use crate::time::window::Window;

/// A set prepared for one method, on its engine's device; evaluate it as often as
/// needed, at any frames.
pub struct Clip {
    pub(crate) engine: Engine,
    pub(crate) data: ClipData,
    /// On a Vulkan device; brought there again when it was lost.
    pub(crate) buffers: Mutex<Option<Arc<ClipBuffers>>>,
}

impl Clip {
    /// What the next clip can use again: its segments, and their buffers on a device.
    pub(crate) fn into_spare(self) -> (Vec<Prepared>, Option<ClipBuffers>) {
        let buffers = self.buffers.into_inner();
        let buffers = buffers.unwrap_or_else(PoisonError::into_inner);
        (self.data.groups, buffers.and_then(Arc::into_inner))
    }

    /// The engine that it was uploaded to.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Number of tracks.
    pub fn track_count(&self) -> usize {
        self.data.track_count()
    }

    /// The samples that `frames` means for this clip.
    ///
    /// # Errors
    /// When they do not fit it.
    pub fn timeline(&self, frames: &Frames) -> Result<Timeline, FramesError> {
        frames.resolve(self.data.track_count(), self.data.time_span())
    }

    /// The rotation of every track at every sample, `[track][frame]`.
    ///
    /// # Errors
    /// When the frames do not fit the clip, or the device fails.
    pub fn evaluate(&self, frames: &Frames) -> Result<Rotations, Error> {
        self.evaluate_as(frames, Layout::TrackMajor)
    }

    /// As [`Clip::evaluate`], in the given layout.
    ///
    /// # Errors
    /// When the frames do not fit the clip, or the device fails.
    pub fn evaluate_as(&self, frames: &Frames, layout: Layout) -> Result<Rotations, Error> {
        let timeline = self.timeline(frames)?;
        let (tracks, samples) = (self.data.track_count(), timeline.len());
        let storage: Box<dyn Storage> = match &*self.engine.backend {
            Backend::Vulkan(opened) => {
                let timeline = self.data.folded(&timeline);
                opened.attempt_smaller(|engine| {
                    let buffers = self.buffers_on(engine)?;
                    engine.evaluate(&self.data, &buffers, &timeline, layout)
                })?
            }
            Backend::Cpu(_) => {
                let mut quats = OutputBuffer::new(tracks * samples);
                self.evaluate_timeline_into(&timeline, layout, &mut quats)?;
                Box::new(quats)
            }
        };
        Ok(Rotations::new(storage, tracks, samples, layout))
    }

    /// As [`Clip::evaluate_as`], into the caller's memory, which is faster when it
    /// is used again ([`OutputBuffer`]): the first touch of fresh memory costs more than
    /// evaluating.
    ///
    /// # Errors
    /// Also when `output` is not exactly as long as the result.
    pub fn evaluate_into(
        &self,
        frames: &Frames,
        layout: Layout,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        self.evaluate_timeline_into(&self.timeline(frames)?, layout, output)
    }

    pub(crate) fn evaluate_timeline_into(
        &self,
        timeline: &Timeline,
        layout: Layout,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        let needed = self.data.track_count() * timeline.len();
        if output.len() != needed {
            return Err(Error::OutputLength {
                given: output.len(),
                needed,
            });
        }
        let timeline = self.data.folded(timeline);
        let whole = Window::whole(self.data.track_count(), timeline.len(), layout);
        self.evaluate_window_into(&timeline, &whole, output)
    }

    /// Evaluates a window of the result, which `output` fits; explicit times are folded
    /// into the keys.
    pub(crate) fn evaluate_window_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        output: &mut [Quat],
    ) -> Result<(), Error> {
        match &*self.engine.backend {
            Backend::Cpu(engine) => Ok(engine.evaluate(&self.data, timeline, window, output)?),
            Backend::Vulkan(_) => {
                let bytes = bytemuck::cast_slice_mut(output);
                self.evaluate_bytes_into(timeline, window, Encoding::F32, bytes)
            }
        }
    }

    fn evaluate_bytes_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        self.check_encoding(encoding)?;
        match &*self.engine.backend {
            Backend::Cpu(engine) => {
                Ok(engine.evaluate_encoded(&self.data, timeline, window, encoding, output)?)
            }
            Backend::Vulkan(opened) => {
                let done = opened.attempt_smaller(|engine| {
                    let buffers = self.buffers_on(engine)?;
                    let job = Job {
                        clip: &self.data,
                        buffers: &buffers,
                        timeline,
                        encoding,
                    };
                    engine.evaluate_into(job, window, output)
                });
                Ok(done?)
            }
        }
    }

    /// The segments on a device; brought there where it is not the one that had them.
    pub(crate) fn buffers_on(
        &self,
        engine: &VulkanEngine,
    ) -> Result<Arc<ClipBuffers>, VulkanError> {
        let mut buffers = self.buffers.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(there) = buffers.as_ref().filter(|there| engine.holds(there)) {
            return Ok(Arc::clone(there));
        }
        *buffers = None;
        let there = Arc::new(engine.upload(&self.data, None)?);
        *buffers = Some(Arc::clone(&there));
        Ok(there)
    }

    pub(crate) fn check_encoding(&self, encoding: Encoding) -> Result<(), Error> {
        let of_rotations = self.data.interpolation.quantity == Quantity::Rotation;
        if encoding.needs_rotations() && !of_rotations {
            return Err(Error::NotRotations { encoding });
        }
        Ok(())
    }

    /// Every track at every sample in another form: what [`Encoding::encode`] makes of
    /// [`Clip::evaluate_as`]'s, bit by bit, but made where they are evaluated.
    ///
    /// # Errors
    /// When the frames do not fit the clip, the encoding is for rotations and the clip
    /// has none, or the device fails.
    pub fn evaluate_encoded(
        &self,
        frames: &Frames,
        layout: Layout,
        encoding: Encoding,
    ) -> Result<Vec<u8>, Error> {
        let timeline = self.timeline(frames)?;
        let whole = Window::whole(self.track_count(), timeline.len(), layout);
        let mut output = bytemuck::zeroed_vec(whole.len() * encoding.bytes());
        let timeline = self.data.folded(&timeline);
        self.evaluate_bytes_into(&timeline, &whole, encoding, &mut output)?;
        Ok(output)
    }

    /// As [`Clip::evaluate_encoded`], into the caller's memory.
    ///
    /// # Errors
    /// Also when `output` has not exactly the bytes of the result.
    pub fn evaluate_encoded_into(
        &self,
        frames: &Frames,
        layout: Layout,
        encoding: Encoding,
        output: &mut [u8],
    ) -> Result<(), Error> {
        let timeline = self.timeline(frames)?;
        let whole = Window::whole(self.track_count(), timeline.len(), layout);
        let (given, needed) = (output.len(), whole.len() * encoding.bytes());
        if given != needed {
            return Err(Error::OutputBytes { given, needed });
        }
        let timeline = self.data.folded(&timeline);
        self.evaluate_bytes_into(&timeline, &whole, encoding, output)
    }
}

impl std::fmt::Debug for Clip {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Clip")
            .field("engine", &self.engine)
            .field("method", &self.data.interpolation.method)
            .field("tracks", &self.track_count())
            .finish_non_exhaustive()
    }
}
