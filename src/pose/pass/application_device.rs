//! Passes from buffer to buffer on an application's Vulkan device. These functions are unsafe, because the compiler
//! cannot check the application's promises about its buffers.
#![allow(unsafe_code)]

use crate::error::Error;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::passes::PassTarget;
use crate::pose::pass::PassRequest;

impl PassRequest<'_> {
    /// Runs the pass with its result in a range of a buffer, and returns when the result is written.
    ///
    /// Commands that are submitted to the queue afterwards see it. The inputs may be written by commands that were
    /// submitted to the engine's queue before.
    ///
    /// # Errors
    /// * When the engine is the CPU, or was not made from the application's device.
    /// * When there is no layer, or a weight is out of range.
    /// * When the number of references or joints differs from the number of tracks.
    /// * When the layout for a skeleton is track by track.
    /// * When a buffer is null, or a range is not aligned, is too short, ends beyond its buffer, or is longer than the
    ///   device can bind.
    /// * When the result overlaps an input.
    /// * When the device fails.
    ///
    /// # Safety
    /// The buffers must belong to the engine's device, be bound to memory, have the usage `STORAGE_BUFFER`, and
    /// contain the ranges. The layers of a blend that are not contiguous must have the usage `TRANSFER_SRC` too.
    /// Nothing else may use the ranges until this returns.
    pub unsafe fn to_buffer(&self, buffer: VulkanBuffer) -> Result<(), Error> {
        // SAFETY: as the caller promises; `run` waits for the work before the target is dropped.
        let target = unsafe { self.target(buffer) }?;
        Ok(target.run()?)
    }

    /// Prepares the pass for recording into the application's commands. Here, once, the kernel is compiled, memory
    /// for weights, references and links is allocated, and the descriptors of all ranges are written.
    ///
    /// # Errors
    /// As [`PassRequest::to_buffer`].
    ///
    /// # Safety
    /// As [`PassRequest::to_buffer`]; the buffers must live as long as the target, and the target must be dropped
    /// after all work that was recorded with it has ended, and before the device is destroyed.
    pub unsafe fn target(&self, buffer: VulkanBuffer) -> Result<PassTarget, Error> {
        let (opened, job, weights) = self.checked(buffer)?;
        let engine = opened.engine();
        Ok(opened.attempt_smaller(|_| {
            PassTarget::new(&engine, &job, self.shape, weights.clone(), buffer)
        })?)
    }
}
