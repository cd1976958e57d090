//! Passes from buffer to buffer on an application's Vulkan device. These functions are unsafe, because the compiler
//! cannot check what the application promises of its buffers.
#![allow(unsafe_code)]

use crate::error::Error;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::pass_target::PassTarget;
use crate::pose::pass::PassRequest;

impl PassRequest<'_> {
    /// Runs the pass into a range of a buffer, and returns when the result is written; what is submitted to the queue
    /// afterwards sees it. The inputs may have been written by what was submitted to the engine's queue before.
    ///
    /// # Errors
    /// When the engine is the CPU or opened its device itself, there is no layer, a weight lies outside of what the pass
    /// takes, the references or the skeleton are not of as many tracks, poses of a skeleton lie track by track, a range is
    /// not aligned or too short or longer than the device can bind, the result overlaps an input, or the device fails.
    ///
    /// # Safety
    /// The buffers must belong to the engine's device, have memory, be made for use as `STORAGE_BUFFER`, those of a
    /// blend's layers that do not lie one behind the other as `TRANSFER_SRC` too, contain the ranges, and not be used
    /// by anyone else before this returns.
    pub unsafe fn to_buffer(&self, buffer: VulkanBuffer) -> Result<(), Error> {
        // SAFETY: promised by the caller; `run` waits for the work before the target goes.
        let target = unsafe { self.target(buffer) }?;
        Ok(target.run()?)
    }

    /// Makes ready what it takes to record the pass into commands of the application's: the kernel is compiled, memory
    /// for weights, references and links is allocated, and descriptors lead to the inputs' ranges and the result's,
    /// here, once.
    ///
    /// # Errors
    /// As [`PassRequest::to_buffer`].
    ///
    /// # Safety
    /// As [`PassRequest::to_buffer`]; the buffers must live as long as the target, and the target must be dropped
    /// after all work that was recorded with it has ended, and before the device.
    pub unsafe fn target(&self, buffer: VulkanBuffer) -> Result<PassTarget, Error> {
        let (opened, job, weights) = self.checked(buffer)?;
        let engine = opened.engine();
        Ok(opened.attempt_smaller(|_| {
            PassTarget::new(&engine, &job, self.shape, weights.clone(), buffer)
        })?)
    }
}
