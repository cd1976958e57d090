//! A command buffer in recording: a submission's, or one of an application's own.

use ash::vk;

use crate::gpu::device::LogicalDevice;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::Access;

/// A command buffer in recording.
#[derive(Clone, Copy)]
pub(crate) struct Commands<'a> {
    device: &'a ash::Device,
    raw: vk::CommandBuffer,
}

impl<'a> Commands<'a> {
    /// # Safety
    /// The command buffer must be of this device, in recording, outside of a render pass, and its queue
    /// must be able to do what is recorded. What is recorded may use only objects of this device, which
    /// must live until the work has ended.
    pub(crate) unsafe fn new(device: &'a LogicalDevice, raw: vk::CommandBuffer) -> Self {
        let device = &device.raw;
        Self { device, raw }
    }

    /// Records a dispatch with the buffers of a set.
    pub(crate) fn dispatch(
        self,
        pipeline: &Pipeline,
        set: vk::DescriptorSet,
        constants: &[u8],
        [x, y, z]: [u32; 3],
    ) {
        let (device, layout) = (self.device, pipeline.layout);
        let compute = vk::PipelineBindPoint::COMPUTE;
        let stage = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: recording is on, and set and pipeline belong to this device (`new`).
        unsafe {
            device.cmd_bind_pipeline(self.raw, compute, pipeline.raw);
            device.cmd_bind_descriptor_sets(self.raw, compute, layout, 0, &[set], &[]);
            device.cmd_push_constants(self.raw, layout, stage, 0, constants);
            device.cmd_dispatch(self.raw, x, y, z);
        }
    }

    /// Records that some bytes, a multiple of 4 and at most 65 536, are written into a buffer.
    pub(crate) fn update(self, to: vk::Buffer, offset: u64, bytes: &[u8]) {
        // SAFETY: as in `dispatch`; the range lies within the buffer, and the bytes are few and copied
        // into the commands.
        unsafe { self.device.cmd_update_buffer(self.raw, to, offset, bytes) };
    }

    /// Records a barrier: what `from` wrote before it is visible to `to` after it.
    pub(crate) fn barrier(self, from: Access, to: Access) {
        let (source_stage, source_access) = from.scope(true);
        let (destination_stage, destination_access) = to.scope(false);
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(source_access)
            .dst_access_mask(destination_access)];
        let none = vk::DependencyFlags::empty();
        // SAFETY: as in `dispatch`.
        unsafe {
            self.device.cmd_pipeline_barrier(
                self.raw,
                source_stage,
                destination_stage,
                none,
                &memory,
                &[],
                &[],
            );
        }
    }
}
