//! Crowds on an application's own Vulkan device, recorded into its own command buffers. These
//! functions are unsafe, because the compiler cannot check what the application promises.
#![allow(unsafe_code)]

use std::sync::Arc;

use ash::vk;

use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;
use crate::gpu::crowd::CrowdTarget;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::submission::Commands;
use crate::output::crowd::CrowdOutput;
use crate::output::pose_error::OFFSET_STEP;

impl Crowd {
    /// Makes ready what it takes to evaluate into a range of a buffer of the application's own, on the
    /// device that the engine was made from ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)):
    /// kernels are compiled and memory is allocated here, once, and not when a frame is recorded. The range has
    /// room for the instances that are [visible](Crowd::set_visible) now; where it has room for more, so many may be
    /// visible later.
    ///
    /// # Errors
    /// When the engine is the CPU, the range does not start at a multiple of 256 bytes or is too short,
    /// there are no inverse bind matrices for skinning matrices, or the device fails.
    ///
    /// # Safety
    /// The buffer must belong to the engine's device, have memory, be made for use as
    /// `STORAGE_BUFFER`, contain the range, and live as long as the target. The target must be
    /// dropped after all work that was recorded with it has ended, and before the device.
    pub unsafe fn target(
        &self,
        output: impl Into<CrowdOutput>,
        buffer: VulkanBuffer,
    ) -> Result<CrowdTarget, CrowdError> {
        let output = output.into();
        // No application has a buffer on a device that the engine opened.
        let device = self.device.as_ref();
        let device = device.filter(|device| !device.engine.device.owned);
        let device = device.ok_or(CrowdError::OtherDevice)?;
        self.check(output)?;
        let (offset, size) = (buffer.offset, buffer.size);
        let each = device.bytes(output);
        let needed = self.visible_count().max(1) as u64 * each;
        if !offset.is_multiple_of(OFFSET_STEP) || size < needed {
            return Err(CrowdError::Buffer {
                offset,
                size,
                needed,
            });
        }
        let room = (size / each).min(self.instance_count() as u64) as u32;
        let range = (buffer.buffer, offset);
        Ok(CrowdTarget::new(device, output, range, room)?)
    }

    /// Records an evaluation at the clock's time into the application's command buffer: up to 20 bytes for
    /// each layer that changed since the last evaluation, 4 for each instance of a new
    /// [list](Crowd::set_visible), and the dispatches; of an empty list nothing. Nothing is waited for and
    /// nothing allocated. What is recorded behind it, or submitted to the same queue later, sees the
    /// result; it waits for all that was recorded before it.
    ///
    /// # Errors
    /// When the target is another crowd's, or more instances are visible than it has room for; then nothing is
    /// recorded.
    ///
    /// # Safety
    /// The command buffer must be of the engine's device, in recording, outside of a render pass, and
    /// of the family of the engine's queue. Everything that is recorded must be submitted once to the
    /// engine's queue, in the order of the calls: the device keeps what instances play, and a frame
    /// that is thrown away would keep from it what changed. Whoever submits keeps the engine from
    /// submitting meanwhile. Several targets may alternate; two evaluations with one target are in order on
    /// the queue.
    pub unsafe fn record(
        &mut self,
        target: &CrowdTarget,
        commands: vk::CommandBuffer,
    ) -> Result<(), CrowdError> {
        let device = self.device.as_ref();
        let Some(device) = device.filter(|device| Arc::ptr_eq(device, &target.crowd)) else {
            return Err(CrowdError::OtherDevice);
        };
        let instances = self.visible_count();
        if instances > target.room as usize {
            return Err(CrowdError::Buffer {
                offset: target.range.offset,
                size: target.range.size,
                needed: instances as u64 * device.bytes(target.output()),
            });
        }
        if instances > 0 {
            // SAFETY: promised by the caller.
            let commands = unsafe { Commands::new(&device.engine.device, commands) };
            let layers = self.layer_count();
            target.record(commands, &self.instances.take_frame(layers));
        }
        Ok(())
    }

    /// Takes back that anything was recorded since the instances were last known to be on the device:
    /// the next evaluation writes all of them. Call it if a recorded frame was discarded.
    pub fn forget_recorded(&mut self) {
        self.instances.forget();
    }
}
