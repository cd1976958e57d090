//! Results in buffers on an application's Vulkan device. These functions are unsafe, because the compiler cannot
//! check the application's promises about its buffers.
#![allow(unsafe_code)]

use std::sync::Arc;

use crate::engine::clip::request::{Request, RequestPart};
use crate::error::Error;
use crate::gpu::clip::ClipTarget;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::job::Job;
use crate::machine::error::VulkanError;

impl Request<'_> {
    /// Evaluates into a buffer of the application, on the device that the engine was made from
    /// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)), for a renderer or another kernel.
    ///
    /// Returns when the result is written; commands that are submitted to the queue afterwards see it. When the same
    /// request of a clip is repeated, its work lists are already on the device.
    ///
    /// # Errors
    /// * As [`Request::size`].
    /// * When the engine is the CPU, or was not made from the application's device.
    /// * When the buffer is null, or the range does not start at a multiple of a value's size, is too short, or ends
    ///   beyond the buffer.
    /// * When the device fails.
    ///
    /// # Safety
    /// The buffer must belong to the engine's device, be bound to memory, have the usages `STORAGE_BUFFER` and
    /// `TRANSFER_DST`, and contain the range. Nothing else may use the range until this returns.
    pub unsafe fn to_buffer(&self, buffer: VulkanBuffer) -> Result<(), Error> {
        let (_, part) = self.for_buffer(buffer)?;
        (self.source).with_uploaded(&part, |clip, timeline, window| {
            let to_buffer =
                |engine: &VulkanEngine, job: Job<'_>| engine.run_into(job, window, buffer);
            clip.on_device(timeline, self.encoding, to_buffer)
        })
    }

    /// Prepares this request for recording into the application's commands, with its result in a buffer on the device
    /// that the engine was made from ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)). The kernels are
    /// compiled, and the work lists are made and uploaded here, once.
    ///
    /// # Errors
    /// As [`Request::to_buffer`]; also when the range is longer than the device can bind, or the clip's segments take
    /// more than [`EngineOptions::memory`](crate::machine::options::EngineOptions::memory).
    ///
    /// # Safety
    /// As [`Request::to_buffer`]; the buffer must live as long as the target, and the target must be dropped after
    /// all work that was recorded with it has ended, and before the device is destroyed.
    pub unsafe fn target(&self, buffer: VulkanBuffer) -> Result<ClipTarget, Error> {
        let (engine, part) = self.for_buffer(buffer)?;
        (self.source).with_uploaded(&part, |clip, timeline, window| {
            let target =
                |_: &VulkanEngine, job: Job<'_>| ClipTarget::new(&engine, job, window, buffer);
            clip.on_device(timeline, self.encoding, target)
        })
    }

    /// The device and the part of the result, if the result fits the range of the buffer.
    fn for_buffer(&self, buffer: VulkanBuffer) -> Result<(Arc<VulkanEngine>, RequestPart), Error> {
        let Some(opened) = self.source.engine().opened() else {
            return Err(Error::BufferOnCpu);
        };
        let engine = opened.engine();
        if engine.device.owned {
            return Err(Error::BufferOfOther);
        }
        buffer.check(&engine.device.raw)?;
        let part = self.part()?;
        let rotation = self.encoding.bytes() as u64;
        let needed = (part.window.len() as u64).saturating_mul(rotation);
        if !buffer.offset.is_multiple_of(rotation) || buffer.size < needed {
            return Err(Error::Vulkan(VulkanError::BufferRange {
                offset: buffer.offset,
                size: buffer.size,
                rotation,
                needed,
            }));
        }
        Ok((engine, part))
    }
}
