//! Results in buffers on an application's own Vulkan device. These functions are unsafe, because the compiler cannot
//! check what the application promises of its buffers.
#![allow(unsafe_code)]

use crate::engine::clip::request::Request;
use crate::error::Error;
use crate::evaluate::Backend;
use crate::gpu::clip_target::ClipTarget;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::job::Job;
use crate::gpu::recovery::Opened;
use crate::output::window::Window;
use crate::time::frames::Timeline;

impl Request<'_> {
    /// Evaluates into a buffer of the application's own, on the device that the engine was made from
    /// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)): the result stays there, for a renderer or another kernel. Returns when it
    /// is written; what is submitted to the queue afterwards sees it. From the second time on that the same is
    /// asked of a clip, nothing is listed for the device any more.
    ///
    /// # Errors
    /// When the engine is the CPU, the frames do not fit the clip, the range is not aligned or too
    /// short, or the device fails.
    ///
    /// # Safety
    /// The buffer must belong to the engine's device, have memory, be made for use as
    /// `STORAGE_BUFFER` and `TRANSFER_DST`, contain the given range, and not be used by anyone
    /// else before this returns.
    pub unsafe fn to_buffer(&self, buffer: VulkanBuffer) -> Result<(), Error> {
        let (opened, timeline, window) = self.for_buffer(buffer)?;
        (self.source).with_uploaded((&timeline, &window), |uploaded, timeline, window| {
            let to_buffer =
                |engine: &VulkanEngine, job: Job<'_>| engine.run_into(job, window, buffer);
            uploaded.on_device(opened, timeline, self.encoding, to_buffer)
        })
    }

    /// Makes ready what it takes to record this into commands of the application's own, into a buffer on the
    /// device that the engine was made from ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)): the kernels are compiled, and what
    /// they read of the samples is listed and brought to the device, here, once.
    ///
    /// # Errors
    /// As [`Request::to_buffer`]; also when the range is longer than the device can bind, the clip's segments
    /// are more than [`EngineOptions::memory`](crate::gpu::options::EngineOptions::memory) allows, or the device is the engine's own, on which no
    /// application has a buffer.
    ///
    /// # Safety
    /// As [`Request::to_buffer`]; the buffer must live as long as the target, and the target must be dropped
    /// after all work that was recorded with it has ended, and before the device.
    pub unsafe fn target(&self, buffer: VulkanBuffer) -> Result<ClipTarget, Error> {
        let (opened, timeline, window) = self.for_buffer(buffer)?;
        let engine = opened.engine();
        if engine.device.owned {
            return Err(Error::BufferOfOther);
        }
        (self.source).with_uploaded((&timeline, &window), |uploaded, timeline, window| {
            let target =
                |_: &VulkanEngine, job: Job<'_>| ClipTarget::new(&engine, job, window, buffer);
            uploaded.on_device(opened, timeline, self.encoding, target)
        })
    }

    /// The device, the samples and the part of them, where the result fits a range of a buffer.
    fn for_buffer(&self, buffer: VulkanBuffer) -> Result<(&Opened, Timeline, Window), Error> {
        let Backend::Vulkan(opened) = &*self.source.engine().backend else {
            return Err(Error::BufferOnCpu);
        };
        let (timeline, window) = self.window()?;
        let rotation = self.encoding.bytes() as u64;
        let needed = (window.len() as u64).saturating_mul(rotation);
        if !buffer.offset.is_multiple_of(rotation) || buffer.size < needed {
            return Err(Error::Vulkan(VulkanError::BufferRange {
                offset: buffer.offset,
                size: buffer.size,
                rotation,
                needed,
            }));
        }
        Ok((opened, timeline, window))
    }
}
