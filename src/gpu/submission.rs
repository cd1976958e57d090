//! One submission at a time: a command buffer, its fence and its descriptor sets.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::{Lane, LogicalDevice};
use crate::gpu::error::{Named, VulkanError};
use crate::gpu::pipeline::Pipeline;
use crate::gpu::semaphore::Point;

/// A dispatch takes milliseconds; a device that needs this long has hung.
const TIMEOUT_SECONDS: u64 = 60;

/// The most buffers that a kernel binds.
const MOST_BINDINGS: u32 = 6;

/// Command buffer, fence and descriptor pool, used again and again.
pub(crate) struct Submission {
    device: Arc<LogicalDevice>,
    lane: Lane,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    descriptors: vk::DescriptorPool,
    /// Sets that the descriptor pool can hold.
    capacity: u32,
    /// Two time stamps, around all that a submission does; null where the queue
    /// takes none, and for copies beside kernels: time that both share must not count twice.
    stamps: vk::QueryPool,
    /// When the pending work was handed over.
    submitted: Option<Instant>,
}

/// When a submission ran.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spent {
    /// When it was handed over.
    pub(crate) submitted: Instant,
    /// When its fence was seen.
    pub(crate) finished: Instant,
    /// How long it ran, by the device's own clock; zero where it has none.
    pub(crate) on_device: Duration,
}

/// A range of a buffer that a kernel sees.
#[derive(Clone, Copy)]
pub(crate) struct Binding {
    pub(crate) buffer: vk::Buffer,
    /// A view of the whole buffer as texels; null unless kernels read it as a texel buffer.
    pub(crate) view: vk::BufferView,
    pub(crate) offset: u64,
    pub(crate) size: u64,
}

impl Binding {
    /// A range of a buffer that no kernel reads as texels.
    pub(crate) fn range(buffer: vk::Buffer, offset: u64, size: u64) -> Self {
        Self {
            buffer,
            view: vk::BufferView::null(),
            offset,
            size,
        }
    }

    /// All of a buffer.
    pub(crate) fn whole(buffer: &Buffer) -> Self {
        Self {
            buffer: buffer.raw,
            view: buffer.view,
            offset: 0,
            size: buffer.size(),
        }
    }
}

impl Submission {
    pub(crate) fn new(device: &Arc<LogicalDevice>, lane: Lane) -> Result<Self, VulkanError> {
        let mut submission = Self {
            device: Arc::clone(device),
            lane,
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            descriptors: vk::DescriptorPool::null(),
            capacity: 0,
            stamps: vk::QueryPool::null(),
            submitted: None,
        };
        let raw = &device.raw;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.family(lane));
        // SAFETY: the device is alive, here and below; what is created is destroyed
        // in `drop`, also when a later step fails.
        submission.pool =
            unsafe { raw.create_command_pool(&info, None) }.named("vkCreateCommandPool")?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(submission.pool)
            .command_buffer_count(1);
        // SAFETY: as above.
        submission.commands =
            unsafe { raw.allocate_command_buffers(&info) }.named("vkAllocateCommandBuffers")?[0];
        // SAFETY: as above.
        submission.fence = unsafe { raw.create_fence(&vk::FenceCreateInfo::default(), None) }
            .named("vkCreateFence")?;
        if lane == Lane::Kernels && device.physical.has_timestamps() {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2);
            // SAFETY: as above.
            submission.stamps =
                unsafe { raw.create_query_pool(&info, None) }.named("vkCreateQueryPool")?;
        }
        let name = match lane {
            Lane::Kernels => "tumble window",
            Lane::Copies => "tumble read back",
        };
        device.name(submission.commands, name);
        Ok(submission)
    }

    /// Where commands are recorded.
    pub(crate) fn commands(&self) -> vk::CommandBuffer {
        self.commands
    }

    /// Whether submitted work has ended, as far as a look tells.
    pub(crate) fn is_done(&self) -> Result<bool, VulkanError> {
        if self.submitted.is_none() {
            return Ok(true);
        }
        // SAFETY: the fence belongs to this device.
        unsafe { self.device.raw.get_fence_status(self.fence) }.named("vkGetFenceStatus")
    }

    /// Starts recording, with room for `sets` descriptor sets.
    ///
    /// Must not be called while work is pending.
    pub(crate) fn begin(&mut self, sets: u32) -> Result<(), VulkanError> {
        debug_assert!(self.submitted.is_none());
        let raw = &self.device.raw;
        if sets > self.capacity {
            let sizes = [
                vk::DescriptorType::STORAGE_BUFFER,
                vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            ]
            .map(|kind| {
                vk::DescriptorPoolSize::default()
                    .ty(kind)
                    .descriptor_count(sets * MOST_BINDINGS)
            });
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(sets)
                .pool_sizes(&sizes);
            // SAFETY: nothing is pending, so the old pool is not in use.
            unsafe { raw.destroy_descriptor_pool(self.descriptors, None) };
            (self.descriptors, self.capacity) = (vk::DescriptorPool::null(), 0);
            // SAFETY: the device is alive.
            self.descriptors = unsafe { raw.create_descriptor_pool(&info, None) }
                .named("vkCreateDescriptorPool")?;
            self.capacity = sets;
        } else if self.capacity > 0 {
            let flags = vk::DescriptorPoolResetFlags::empty();
            // SAFETY: nothing is pending, so no set is in use.
            unsafe { raw.reset_descriptor_pool(self.descriptors, flags) }
                .named("vkResetDescriptorPool")?;
        }
        // SAFETY: nothing is pending, so the command buffer is not in use.
        unsafe { raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .named("vkResetCommandPool")?;
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: as above.
        unsafe { raw.begin_command_buffer(self.commands, &info) }.named("vkBeginCommandBuffer")?;
        if self.stamps != vk::QueryPool::null() {
            let start = vk::PipelineStageFlags::TOP_OF_PIPE;
            // SAFETY: recording is on, and the pool has two queries of this device.
            unsafe {
                raw.cmd_reset_query_pool(self.commands, self.stamps, 0, 2);
                raw.cmd_write_timestamp(self.commands, start, self.stamps, 0);
            }
        }
        Ok(())
    }

    /// Records a dispatch with one buffer for each binding.
    pub(crate) fn dispatch(
        &mut self,
        pipeline: &Pipeline,
        bindings: &[Binding],
        constants: &[u8],
        groups: [u32; 3],
    ) -> Result<(), VulkanError> {
        debug_assert_eq!(bindings.len(), pipeline.bindings as usize);
        let raw = &self.device.raw;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.descriptors)
            .set_layouts(&layouts);
        // SAFETY: `begin` made room for this set.
        let set =
            unsafe { raw.allocate_descriptor_sets(&info) }.named("vkAllocateDescriptorSets")?[0];
        let infos: Vec<_> = bindings
            .iter()
            .map(|binding| {
                [vk::DescriptorBufferInfo::default()
                    .buffer(binding.buffer)
                    .offset(binding.offset)
                    .range(binding.size)]
            })
            .collect();
        let views: Vec<_> = bindings.iter().map(|binding| [binding.view]).collect();
        let writes: Vec<_> = (0..)
            .zip(infos.iter().zip(&views))
            .map(|(binding, (info, view))| {
                let kind = pipeline.kind(binding);
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(binding)
                    .descriptor_type(kind);
                match kind {
                    vk::DescriptorType::STORAGE_BUFFER => write.buffer_info(info),
                    _ => write.texel_buffer_view(view),
                }
            })
            .collect();
        let commands = self.commands;
        let compute = vk::PipelineBindPoint::COMPUTE;
        let stage = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: recording is on (`begin`); set, pipeline and buffers belong to this
        // device, and the caller keeps them until `wait`.
        unsafe {
            raw.update_descriptor_sets(&writes, &[]);
            raw.cmd_bind_pipeline(commands, compute, pipeline.raw);
            raw.cmd_bind_descriptor_sets(commands, compute, pipeline.layout, 0, &[set], &[]);
            raw.cmd_push_constants(commands, pipeline.layout, stage, 0, constants);
            raw.cmd_dispatch(commands, groups[0], groups[1], groups[2]);
        }
        Ok(())
    }

    /// Records a copy of `size` bytes.
    pub(crate) fn copy(&mut self, from: &Buffer, to: &Buffer, to_offset: u64, size: u64) {
        let region = [vk::BufferCopy::default().dst_offset(to_offset).size(size)];
        // SAFETY: as in `dispatch`; both ranges lie within their buffers.
        unsafe {
            self.device
                .raw
                .cmd_copy_buffer(self.commands, from.raw, to.raw, &region);
        }
    }

    /// Records that some bytes, a multiple of 4, are written into a buffer.
    pub(crate) fn update(&mut self, to: vk::Buffer, offset: u64, bytes: &[u8]) {
        // SAFETY: as in `copy`; the bytes are few, and copied into the commands.
        unsafe {
            self.device
                .raw
                .cmd_update_buffer(self.commands, to, offset, bytes);
        }
    }

    /// Records a barrier: what `from` wrote before it is visible to `to` after it.
    pub(crate) fn barrier(&mut self, from: Access, to: Access) {
        let (source_stage, source_access) = from.scope(true);
        let (destination_stage, destination_access) = to.scope(false);
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(source_access)
            .dst_access_mask(destination_access)];
        let none = vk::DependencyFlags::empty();
        // SAFETY: recording is on.
        unsafe {
            self.device.raw.cmd_pipeline_barrier(
                self.commands,
                source_stage,
                destination_stage,
                none,
                &memory,
                &[],
                &[],
            );
        }
    }

    /// Ends recording and hands the work to the queue.
    pub(crate) fn submit(&mut self) -> Result<(), VulkanError> {
        self.submit_between(None, None)
    }

    /// As [`Submission::submit`]; copies in it wait for the point `after`, and the point `reached` is
    /// reached when all of it has ended.
    pub(crate) fn submit_between(
        &mut self,
        after: Option<Point>,
        reached: Option<Point>,
    ) -> Result<(), VulkanError> {
        let raw = &self.device.raw;
        if self.stamps != vk::QueryPool::null() {
            let end = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
            // SAFETY: as in `begin`.
            unsafe { raw.cmd_write_timestamp(self.commands, end, self.stamps, 1) };
        }
        // SAFETY: recording is on.
        unsafe { raw.end_command_buffer(self.commands) }.named("vkEndCommandBuffer")?;
        let commands = [self.commands];
        let values = |point: Option<Point>| point.map(|point| point.value);
        let semaphores = |point: Option<Point>| point.map(|point| point.semaphore);
        let (waits, signals) = (semaphores(after), semaphores(reached));
        let (wait_values, signal_values) = (values(after), values(reached));
        let mut timelines = vk::TimelineSemaphoreSubmitInfo::default()
            .wait_semaphore_values(wait_values.as_slice())
            .signal_semaphore_values(signal_values.as_slice());
        let stages = [vk::PipelineStageFlags::TRANSFER];
        let mut info = vk::SubmitInfo::default()
            .command_buffers(&commands)
            .wait_semaphores(waits.as_slice())
            .wait_dst_stage_mask(&stages[..waits.as_slice().len()])
            .signal_semaphores(signals.as_slice());
        if after.or(reached).is_some() {
            info = info.push_next(&mut timelines);
        }
        let info = [info];
        let queue = self.device.queue(self.lane);
        // SAFETY: the fence is unsignalled and the queue is locked.
        unsafe { raw.queue_submit(*queue, &info, self.fence) }.named("vkQueueSubmit")?;
        self.submitted = Some(Instant::now());
        Ok(())
    }

    /// Waits until submitted work has finished; at once when there is none.
    pub(crate) fn wait(&mut self) -> Result<Option<Spent>, VulkanError> {
        let Some(submitted) = self.submitted else {
            return Ok(None);
        };
        let raw = &self.device.raw;
        let fences = [self.fence];
        // A device that has hung is not waited for again.
        let seconds = if self.device.may_destroy() {
            TIMEOUT_SECONDS
        } else {
            0
        };
        let timeout = seconds * 1_000_000_000;
        // SAFETY: the fence belongs to this device.
        match unsafe { raw.wait_for_fences(&fences, true, timeout) } {
            Err(vk::Result::TIMEOUT) => {
                self.device.mark_hung();
                return Err(VulkanError::Timeout {
                    seconds: TIMEOUT_SECONDS,
                });
            }
            waited => {
                // The work of a lost device has ended.
                if waited != Err(vk::Result::ERROR_OUT_OF_HOST_MEMORY)
                    && waited != Err(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)
                {
                    self.submitted = None;
                }
                waited.named("vkWaitForFences")?;
            }
        }
        let finished = Instant::now();
        // SAFETY: the fence is signalled and not in use.
        unsafe { raw.reset_fences(&fences) }.named("vkResetFences")?;
        let mut spent = Spent {
            submitted,
            finished,
            on_device: Duration::ZERO,
        };
        if self.stamps != vk::QueryPool::null() {
            let mut stamps = [0u64; 2];
            let flags = vk::QueryResultFlags::TYPE_64;
            // SAFETY: the pool has two queries of this device, and the work that
            // writes them has ended. A stamp that is not there is no reason to stop.
            if unsafe { raw.get_query_pool_results(self.stamps, 0, &mut stamps, flags) }.is_ok() {
                spent.on_device = self.device.physical.between(stamps[0], stamps[1]);
            }
        }
        Ok(Some(spent))
    }
}

/// Who touches memory on one side of a barrier.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Access {
    Kernel,
    Copy,
    Host,
    /// Whatever comes later on the queue.
    Any,
}

impl Access {
    fn scope(self, writes: bool) -> (vk::PipelineStageFlags, vk::AccessFlags) {
        use vk::{AccessFlags as A, PipelineStageFlags as S};
        match (self, writes) {
            (Self::Kernel, true) => (S::COMPUTE_SHADER, A::SHADER_WRITE),
            (Self::Kernel, false) => (S::COMPUTE_SHADER, A::SHADER_READ | A::SHADER_WRITE),
            (Self::Copy, true) => (S::TRANSFER, A::TRANSFER_WRITE),
            (Self::Copy, false) => (S::TRANSFER, A::TRANSFER_READ),
            (Self::Host, true) => (S::HOST, A::HOST_WRITE),
            (Self::Host, false) => (S::HOST, A::HOST_READ),
            (Self::Any, true) => (S::ALL_COMMANDS, A::MEMORY_WRITE),
            (Self::Any, false) => (S::ALL_COMMANDS, A::MEMORY_READ | A::MEMORY_WRITE),
        }
    }
}

impl Drop for Submission {
    fn drop(&mut self) {
        // An error may have left work pending; nothing may go before it ends.
        if self.wait().is_err() && self.submitted.is_some() {
            self.device.wait_until_idle();
        }
        if self.device.may_destroy() {
            let raw = &self.device.raw;
            // SAFETY: created from this device, not in use; null is allowed.
            unsafe {
                raw.destroy_query_pool(self.stamps, None);
                raw.destroy_descriptor_pool(self.descriptors, None);
                raw.destroy_fence(self.fence, None);
                raw.destroy_command_pool(self.pool, None);
            }
        }
    }
}
