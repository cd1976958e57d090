//! Crowds on an application's Vulkan device, recorded into the application's command buffers. These functions are
//! unsafe, because the compiler cannot check the application's promises.
#![allow(unsafe_code)]

use std::sync::Arc;

use ash::vk;

use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;
use crate::gpu::crowd::{CrowdTarget, DeviceCrowd, VulkanCrowd};
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::recorded::{CommandScopes, Commands};
use crate::machine::crowd::MachineCrowd;
use crate::output::crowd::{CrowdOutput, CrowdStage};
use crate::output::pose_error::OFFSET_STEP;

impl Crowd {
    /// Prepares evaluations into a range of the application's buffer, on the device that the engine was made from
    /// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)). Kernels are compiled and memory is allocated
    /// here, not when a frame is recorded.
    ///
    /// The range must have room for the instances that are [visible](Crowd::set_visible) now. If it has room for
    /// more, more instances may be visible later.
    ///
    /// # Errors
    /// * When the engine was not made by [`Engine::from_vulkan`](crate::Engine::from_vulkan).
    /// * When the buffer is null, or the range does not start at a multiple of 256 bytes, is too short, or ends beyond
    ///   the buffer.
    /// * When skinning matrices are requested, and the library has no inverse bind matrices.
    /// * When the device fails.
    ///
    /// # Safety
    /// The buffer must belong to the engine's device, be bound to memory, have the usage `STORAGE_BUFFER`, contain
    /// the range, and live as long as the target. The target must be dropped after all work that was recorded with it
    /// has ended, and before the device is destroyed.
    pub unsafe fn target(
        &self,
        output: impl Into<CrowdOutput>,
        buffer: VulkanBuffer,
    ) -> Result<CrowdTarget, CrowdError> {
        let output = output.into();
        let (device, room) = self.room_in(output, buffer)?;
        let range = (buffer.buffer, buffer.offset);
        Ok(CrowdTarget::new(device, output, range, room)?)
    }

    /// Prepares a stage that continues matrices in a range of the application's buffer, in place, in 32 bits.
    ///
    /// A frame then has three parts, for example. [`Crowd::record`] with a target for
    /// [`CrowdValues::Local`](crate::crowd::CrowdValues::Local) writes matrices into this range. Commands of the
    /// application change these matrices (inverse kinematics). [`Crowd::record`] with the stage's target makes them
    /// skinning matrices. The stage continues the matrices of as many instances as are [visible](Crowd::set_visible)
    /// when it is recorded. A kernel, a copy, or the host before the commands are submitted may have written these
    /// matrices.
    ///
    /// Results have the bits of the functions on the CPU that [`CrowdStage`] names, if all numbers are finite and less
    /// than 2^36 in magnitude. Where nothing was changed, they have the bits of an evaluation without stages.
    ///
    /// # Errors
    /// As for [`Crowd::target`].
    ///
    /// # Safety
    /// As for [`Crowd::target`].
    pub unsafe fn stage_target(
        &self,
        stage: CrowdStage,
        buffer: VulkanBuffer,
    ) -> Result<CrowdTarget, CrowdError> {
        let (device, room) = self.room_in(stage.output(), buffer)?;
        let range = (buffer.buffer, buffer.offset);
        Ok(CrowdTarget::of_stage(device, stage, range, room)?)
    }

    /// The crowd on the application's device, and the number of instances for which a range has room.
    fn room_in(
        &self,
        output: CrowdOutput,
        buffer: VulkanBuffer,
    ) -> Result<(&Arc<DeviceCrowd>, u32), CrowdError> {
        // On a device that the engine opened, an application has no buffers.
        let device = vulkan_crowd(self.device.as_deref());
        let device = device.filter(|device| !device.engine.device.owned);
        let device = device.ok_or(CrowdError::OtherDevice)?;
        self.check(output)?;
        buffer.check(&device.engine.device.raw)?;
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
        Ok((device, room))
    }

    /// Records an evaluation at the clock's time, or the stage of the target, into the application's command buffer.
    ///
    /// The commands write up to 20 bytes for each layer that changed since the last evaluation and 4 bytes for each
    /// instance of a new [list](Crowd::set_visible), and dispatch the kernels. A [stage](Crowd::stage_target) writes
    /// none of these changes; they remain for the next evaluation. If no instance is visible, nothing is recorded.
    /// Recording neither waits nor allocates. Barriers are included: the evaluation waits for all commands recorded
    /// before it, and commands that are recorded after it, or submitted to the same queue later, see the result.
    ///
    /// # Errors
    /// When the target belongs to another crowd, or more instances are visible than it has room for; then nothing is
    /// recorded.
    ///
    /// # Safety
    /// The command buffer must belong to the engine's device and to the queue family of the engine's queue, and must be
    /// in the recording state, outside a render pass. All recorded evaluations must be submitted to the engine's queue,
    /// once and in the order in which they were recorded. Otherwise the device, which stores the layers of instances,
    /// would miss the changes of the frames that are not submitted ([`Crowd::forget_recorded`]). The engine must not
    /// submit while the application submits to this queue. Several targets may alternate. Two evaluations with one
    /// target are executed in order on the queue.
    pub unsafe fn record(
        &mut self,
        target: &CrowdTarget,
        commands: vk::CommandBuffer,
    ) -> Result<(), CrowdError> {
        // SAFETY: as the caller promises.
        unsafe { self.record_between(target, commands, CommandScopes::default()) }
    }

    /// As [`Crowd::record`], but the barriers order the evaluation only with the commands that `scopes` names: compute
    /// shaders, copies, vertex shaders or the host. Earlier evaluations of the crowd are always waited for.
    ///
    /// # Errors
    /// As for [`Crowd::record`].
    ///
    /// # Safety
    /// As for [`Crowd::record`]. In addition, the application must have its own barriers for all other commands that
    /// use the result's memory.
    pub unsafe fn record_between(
        &mut self,
        target: &CrowdTarget,
        commands: vk::CommandBuffer,
        scopes: CommandScopes,
    ) -> Result<(), CrowdError> {
        let device = vulkan_crowd(self.device.as_deref());
        let device = device.filter(|device| Arc::ptr_eq(device, &target.crowd));
        let device = device.ok_or(CrowdError::OtherCrowd)?;
        let instances = self.visible_count();
        if instances > target.room as usize {
            return Err(CrowdError::Buffer {
                offset: target.range.offset,
                size: target.range.size,
                needed: instances as u64 * device.bytes(target.output()),
            });
        }
        if instances > 0 {
            // SAFETY: as the caller promises.
            let commands = unsafe { Commands::new(&device.engine.device, commands) };
            let layers = self.layer_count();
            let commands = commands.between(scopes.with_earlier_recordings());
            let frame = match target.is_of_stage() {
                true => self.instances.frame_of_stage(layers),
                false => self.instances.take_frame(layers),
            };
            target.record(commands, &frame);
        }
        Ok(())
    }

    /// Marks all layers as unknown to the device, so that the next evaluation writes all of them. Call it if a
    /// recorded frame was discarded.
    pub fn forget_recorded(&mut self) {
        self.instances.forget();
    }
}

/// The crowd, if it is on a Vulkan device.
fn vulkan_crowd(crowd: Option<&dyn MachineCrowd>) -> Option<&Arc<DeviceCrowd>> {
    VulkanCrowd::of(crowd?).map(|crowd| &crowd.device)
}
