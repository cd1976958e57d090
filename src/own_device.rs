//! Evaluation on an application's own Vulkan device, and into its own buffers. These functions are
//! unsafe, because the compiler cannot check what the application promises of its handles.
#![allow(unsafe_code)]

use crate::clip::Clip;
use crate::engine::Engine;
use crate::error::Error;
use crate::evaluate::uploaded::Backend;
use crate::gpu::engine::{Job, VulkanEngine};
use crate::gpu::error::VulkanError;
use crate::gpu::handles::{VulkanBuffer, VulkanHandles};
use crate::gpu::in_flight::Target;
use crate::gpu::options::EngineOptions;
use crate::gpu::recovery::Opened;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::time::frames::Frames;

impl Engine {
    /// Evaluates on an application's own Vulkan device.
    ///
    /// # Errors
    /// As [`Engine::with_options`].
    ///
    /// # Safety
    /// The handles must be valid and belong together, must outlive the engine and
    /// all of its clips and results, and nobody else may use the queues while the
    /// engine does, unless both lock [`VulkanHandles::queue_lock`].
    pub unsafe fn from_vulkan(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, Error> {
        // SAFETY: promised by the caller.
        let engine = unsafe { VulkanEngine::from_handles(handles, options) }?;
        Ok(Self::with_opened(Opened::trusted(engine, options)?))
    }
}

impl Clip {
    /// Evaluates into a buffer of the application's own, on the device that the engine
    /// was made from ([`Engine::from_vulkan`]): the rotations stay there, for a
    /// renderer or another kernel. Returns when they are written; what is submitted
    /// to the queue afterwards sees them.
    ///
    /// # Errors
    /// When the engine is the CPU, the frames do not fit the clip, the range is not aligned or too
    /// short, or the device fails.
    ///
    /// # Safety
    /// The buffer must belong to the engine's device, have memory, be made for use as
    /// `STORAGE_BUFFER` and `TRANSFER_DST`, contain the given range, and not be used by anyone
    /// else before this returns.
    pub unsafe fn evaluate_to_buffer(
        &self,
        frames: &Frames,
        layout: Layout,
        encoding: Encoding,
        buffer: VulkanBuffer,
    ) -> Result<(), Error> {
        let Backend::Vulkan(opened) = &*self.engine().backend else {
            return Err(Error::BufferOnCpu);
        };
        encoding.check(self.quantity())?;
        let timeline = self.timeline(frames)?;
        let timeline = self.uploaded.folded(&timeline)?;
        let rotation = encoding.bytes() as u64;
        let needed = ((self.track_count() * timeline.len()) as u64).saturating_mul(rotation);
        if !buffer.offset.is_multiple_of(rotation) || buffer.size < needed {
            return Err(Error::Vulkan(VulkanError::OwnBuffer {
                offset: buffer.offset,
                size: buffer.size,
                rotation,
                needed,
            }));
        }
        let to_buffer = |engine: &VulkanEngine, job: Job<'_>| {
            engine.run(job, &job.whole(layout), Target::External(buffer))
        };
        Ok((self.uploaded).on_device(opened, &timeline, encoding, to_buffer)?)
    }
}
