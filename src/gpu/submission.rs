//! Submissions: a command buffer with its fence and descriptor sets, and semaphores with which one submission waits
//! for another.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::error::{Named, VulkanError};
use crate::gpu::pipeline::Pipeline;

/// The time limit: a dispatch takes milliseconds, so a device that needs this long has hung.
const TIMEOUT_SECONDS: u64 = 60;

/// A command buffer, a fence and a descriptor pool, which are reused.
pub(crate) struct Submission {
    device: Arc<LogicalDevice>,
    lane: QueueLane,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    descriptors: DescriptorPool,
    /// Two time stamps, at the start and the end of a submission. Null if the queue has none, and for copies beside
    /// kernels, because shared time must be counted once.
    stamps: vk::QueryPool,
    /// The time when the pending work was submitted.
    submitted: Option<Instant>,
}

/// The times of a submission.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spent {
    /// The time when it was submitted.
    pub(crate) submitted: Instant,
    /// The time when its fence was seen.
    pub(crate) finished: Instant,
    /// The time that it ran, by the device's clock; zero if it has none.
    pub(crate) on_device: Duration,
}

/// A point on a timeline: a semaphore and its value.
pub(crate) type Point = (vk::Semaphore, u64);

/// A range of a buffer that a kernel binds.
#[derive(Clone, Copy)]
pub(crate) struct Binding {
    pub(crate) buffer: vk::Buffer,
    /// A view of the whole buffer as texels; null unless kernels read it as a texel buffer.
    pub(crate) view: vk::BufferView,
    pub(crate) offset: u64,
    pub(crate) size: u64,
}

impl Binding {
    /// A range of a buffer that kernels do not read as texels.
    pub(crate) fn range(buffer: vk::Buffer, offset: u64, size: u64) -> Self {
        Self {
            buffer,
            view: vk::BufferView::null(),
            offset,
            size,
        }
    }

    pub(crate) fn whole(buffer: &Buffer) -> Self {
        Self {
            buffer: buffer.raw,
            view: buffer.view,
            offset: 0,
            size: buffer.size,
        }
    }
}

impl Submission {
    pub(crate) fn new(device: &Arc<LogicalDevice>, lane: QueueLane) -> Result<Self, VulkanError> {
        let mut submission = Self {
            device: Arc::clone(device),
            lane,
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            descriptors: DescriptorPool::new(device),
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
        if lane == QueueLane::Kernels && device.physical.timestamp_bits() > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2);
            // SAFETY: as above.
            submission.stamps =
                unsafe { raw.create_query_pool(&info, None) }.named("vkCreateQueryPool")?;
        }
        let name = match lane {
            QueueLane::Kernels => "tumble window",
            QueueLane::Copies => "tumble read back",
        };
        device.name(submission.commands, name);
        Ok(submission)
    }

    /// The command buffer in the recording state, after `begin`. The caller keeps the used resources alive until
    /// `wait`.
    pub(crate) fn commands(&mut self) -> Commands<'_> {
        // SAFETY: the command buffer is this device's, and nobody else records while `self` is lent; callers
        // have called `begin`, so recording is on.
        unsafe { Commands::new(&self.device, self.commands) }
    }

    /// Whether submitted work has ended, without waiting.
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
        self.device.check_process()?;
        debug_assert!(self.submitted.is_none());
        self.descriptors.make_room(sets)?;
        let raw = &self.device.raw;
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
        let set = self.descriptors.set(pipeline, bindings)?;
        self.commands().dispatch(pipeline, set, constants, groups);
        Ok(())
    }

    /// Ends recording and submits the work to the queue.
    pub(crate) fn submit(&mut self) -> Result<(), VulkanError> {
        self.submit_between(None, None)
    }

    /// As [`Submission::submit`]; its copies wait for the point `after`, and `reached` is signalled when all its work
    /// has ended.
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
        let (waits, wait_values) = after.unzip();
        let (signals, signal_values) = reached.unzip();
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
        let submitted = self.device.with_queue(self.lane, |queue| {
            // SAFETY: the fence is unsignalled and the queue is locked.
            unsafe { raw.queue_submit(queue, &info, self.fence) }
        });
        submitted
            .ok_or(VulkanError::QueueLock)?
            .named("vkQueueSubmit")?;
        self.submitted = Some(Instant::now());
        Ok(())
    }

    /// Waits until submitted work has ended; returns at once if there is none.
    pub(crate) fn wait(&mut self) -> Result<Option<Spent>, VulkanError> {
        let Some(submitted) = self.submitted else {
            return Ok(None);
        };
        self.device.check_process()?;
        let raw = &self.device.raw;
        let fences = [self.fence];
        // A device that has hung is not waited for again.
        let seconds = TIMEOUT_SECONDS * u64::from(self.device.may_destroy());
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

/// A command buffer in the recording state: a submission's, or an application's.
#[derive(Clone, Copy)]
pub(crate) struct Commands<'a> {
    device: &'a ash::Device,
    raw: vk::CommandBuffer,
}

impl<'a> Commands<'a> {
    /// # Safety
    /// The command buffer must belong to this device, must be in the recording state outside a render pass, and its
    /// queue must support the recorded commands. The commands may use only objects of this device, which must live
    /// until the work has ended.
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
        groups: [u32; 3],
    ) {
        let (device, layout) = (self.device, pipeline.layout);
        let compute = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: recording is on, and set and pipeline belong to this device (`new`).
        unsafe {
            device.cmd_bind_pipeline(self.raw, compute, pipeline.raw);
            device.cmd_bind_descriptor_sets(self.raw, compute, layout, 0, &[set], &[]);
        }
        self.dispatch_again(pipeline, constants, groups);
    }

    /// Records another dispatch of the last dispatched pipeline, with the same set.
    pub(crate) fn dispatch_again(self, pipeline: &Pipeline, constants: &[u8], [x, y, z]: [u32; 3]) {
        let stage = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: as in `dispatch`, which has bound pipeline and set.
        unsafe {
            (self.device).cmd_push_constants(self.raw, pipeline.layout, stage, 0, constants);
            self.device.cmd_dispatch(self.raw, x, y, z);
        }
    }

    /// Records a copy of `size` bytes.
    pub(crate) fn copy(self, from: &Buffer, to: &Buffer, size: u64) {
        let region = [vk::BufferCopy::default().size(size)];
        // SAFETY: as in `dispatch`; both ranges lie within their buffers.
        unsafe { (self.device).cmd_copy_buffer(self.raw, from.raw, to.raw, &region) };
    }

    /// Records a copy of the first `size` bytes of a buffer to an offset in another.
    pub(crate) fn copy_to(self, from: &Buffer, (to, offset): (&Buffer, u64), size: u64) {
        let size = size.min(to.size - offset);
        let region = [vk::BufferCopy::default().dst_offset(offset).size(size)];
        // SAFETY: as in `dispatch`; both ranges lie within their buffers.
        unsafe { (self.device).cmd_copy_buffer(self.raw, from.raw, to.raw, &region) };
    }

    /// Records that the first bytes of a buffer, a multiple of 4, are filled with a word.
    #[cfg(feature = "prove")]
    pub(crate) fn fill(self, to: &Buffer, bytes: u64, word: u32) {
        // SAFETY: as in `dispatch`; the range lies within the buffer.
        unsafe { (self.device).cmd_fill_buffer(self.raw, to.raw, 0, bytes.min(to.size), word) };
    }

    /// Records a copy of `size` bytes between ranges of buffers.
    pub(crate) fn copy_range(
        self,
        (from, from_offset): (vk::Buffer, u64),
        (to, to_offset): (vk::Buffer, u64),
        size: u64,
    ) {
        let region = [vk::BufferCopy::default()
            .src_offset(from_offset)
            .dst_offset(to_offset)
            .size(size)];
        // SAFETY: as in `dispatch`; both ranges lie within their buffers.
        unsafe { (self.device).cmd_copy_buffer(self.raw, from, to, &region) };
    }

    /// Records that some bytes, a multiple of 4, are written to a buffer. The bytes are stored in the commands.
    pub(crate) fn update(self, to: vk::Buffer, offset: u64, bytes: &[u8]) {
        /// The maximum number of bytes that one command may write.
        const UPDATE: usize = 1 << 16;
        for (start, part) in (offset..).step_by(UPDATE).zip(bytes.chunks(UPDATE)) {
            // SAFETY: as in `dispatch`; the range lies within the buffer, and the bytes are copied into the
            // commands.
            unsafe { self.device.cmd_update_buffer(self.raw, to, start, part) };
        }
    }

    /// Records a queue family ownership transfer of a range, which kernels and copies have written, to users outside
    /// this Vulkan instance.
    pub(crate) fn release(self, range: Binding, family: u32) {
        use vk::{AccessFlags as A, PipelineStageFlags as S};
        let memory = [vk::BufferMemoryBarrier::default()
            .src_access_mask(A::SHADER_WRITE | A::TRANSFER_WRITE)
            .src_queue_family_index(family)
            .dst_queue_family_index(vk::QUEUE_FAMILY_EXTERNAL)
            .buffer(range.buffer)
            .offset(range.offset)
            .size(range.size)];
        let (from, to) = (S::COMPUTE_SHADER | S::TRANSFER, S::BOTTOM_OF_PIPE);
        let none = vk::DependencyFlags::empty();
        // SAFETY: as in `dispatch`; the range lies within the buffer.
        unsafe { (self.device).cmd_pipeline_barrier(self.raw, from, to, none, &[], &memory, &[]) };
    }

    /// Records a barrier for a few ranges of buffers only: earlier writes by `from` are visible to `to` afterwards,
    /// and ranges that `from` has read may be overwritten.
    pub(crate) fn barrier_over(self, from: Access, to: Access, ranges: &[Binding]) {
        /// The maximum number of ranges; recording does not allocate.
        const MAX_RANGES: usize = 6;
        let mut buffers = [vk::BufferMemoryBarrier::default(); MAX_RANGES];
        for (barrier, range) in buffers.iter_mut().zip(ranges) {
            *barrier = barrier
                .src_access_mask(from.scope(true).1)
                .dst_access_mask(to.scope(false).1)
                .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .buffer(range.buffer)
                .offset(range.offset)
                .size(range.size);
        }
        self.order(from, to, &[], &buffers[..ranges.len()]);
    }

    /// Records a barrier: earlier writes by `from` are visible to `to` afterwards.
    pub(crate) fn barrier(self, from: Access, to: Access) {
        let memory = vk::MemoryBarrier::default()
            .src_access_mask(from.scope(true).1)
            .dst_access_mask(to.scope(false).1);
        self.order(from, to, &[memory], &[]);
    }

    fn order(
        self,
        from: Access,
        to: Access,
        memory: &[vk::MemoryBarrier<'_>],
        buffers: &[vk::BufferMemoryBarrier<'_>],
    ) {
        let (source, destination) = (from.scope(true).0, to.scope(false).0);
        let none = vk::DependencyFlags::empty();
        // SAFETY: as in `dispatch`; ranges lie within their buffers.
        unsafe {
            self.device.cmd_pipeline_barrier(
                self.raw,
                source,
                destination,
                none,
                memory,
                buffers,
                &[],
            );
        }
    }
}

/// The users of memory on one side of a barrier.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Access {
    Kernel,
    Copy,
    /// Kernels and copies, which may overwrite what others have read or written.
    KernelAndCopy,
    Host,
    /// All earlier or later work on the queue.
    Any,
}

impl Access {
    pub(crate) fn scope(self, writes: bool) -> (vk::PipelineStageFlags, vk::AccessFlags) {
        use vk::{AccessFlags as A, PipelineStageFlags as S};
        match (self, writes) {
            (Self::Kernel, true) => (S::COMPUTE_SHADER, A::SHADER_WRITE),
            (Self::Kernel, false) => (S::COMPUTE_SHADER, A::SHADER_READ | A::SHADER_WRITE),
            (Self::Copy, true) => (S::TRANSFER, A::TRANSFER_WRITE),
            (Self::Copy, false) => (S::TRANSFER, A::TRANSFER_READ),
            (Self::KernelAndCopy, true) => (
                S::COMPUTE_SHADER | S::TRANSFER,
                A::SHADER_WRITE | A::TRANSFER_WRITE,
            ),
            (Self::KernelAndCopy, false) => (
                S::COMPUTE_SHADER | S::TRANSFER,
                A::SHADER_READ | A::SHADER_WRITE | A::TRANSFER_READ | A::TRANSFER_WRITE,
            ),
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
        if self.wait().is_err() && self.submitted.is_some() && self.device.may_destroy() {
            self.device.wait_until_done(self.fence);
        }
        if self.device.may_destroy() {
            let raw = &self.device.raw;
            // SAFETY: created from this device, not in use; null is allowed.
            unsafe {
                raw.destroy_query_pool(self.stamps, None);
                raw.destroy_fence(self.fence, None);
                raw.destroy_command_pool(self.pool, None);
            }
        }
    }
}

/// A timeline semaphore, on a device with this feature: one queue signals it, and another one waits.
pub(crate) struct Semaphore {
    device: Arc<LogicalDevice>,
    pub(crate) raw: vk::Semaphore,
    /// The value of the last point.
    last: u64,
    /// Whether users outside this device may wait for it.
    is_exported: bool,
}

impl Semaphore {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Self::made(device, "tumble kernels done", None)
    }

    /// A semaphore that may be exported as a file descriptor, on a device that supports this.
    pub(crate) fn exportable(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        let file = vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD;
        Self::made(device, "tumble result done", Some(file))
    }

    fn made(
        device: &Arc<LogicalDevice>,
        name: &str,
        exported: Option<vk::ExternalSemaphoreHandleTypeFlags>,
    ) -> Result<Self, VulkanError> {
        let mut kind =
            vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let mut export =
            vk::ExportSemaphoreCreateInfo::default().handle_types(exported.unwrap_or_default());
        let mut info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        if exported.is_some() {
            info = info.push_next(&mut export);
        }
        // SAFETY: the device is alive, with the feature; what is made is destroyed in `drop`.
        let raw = unsafe { device.raw.create_semaphore(&info, None) }.named("vkCreateSemaphore")?;
        device.name(raw, name);
        Ok(Self {
            device: Arc::clone(device),
            raw,
            last: 0,
            is_exported: exported.is_some(),
        })
    }

    /// The next point, later than all previous ones. A point may stay unreached because its submission failed.
    pub(crate) fn advance(&mut self) -> Point {
        self.last += 1;
        (self.raw, self.last)
    }
}

impl Drop for Semaphore {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            // Fences say that copies have ended. But Mesa's drivers that make timelines of plain
            // semaphores let go of them a moment after they signal the fence.
            if !self.is_exported {
                self.device.settle(); // timelines that can be exported are no such
            }
            // SAFETY: created from this device; whoever submits with it waits for that before.
            unsafe { self.device.raw.destroy_semaphore(self.raw, None) };
        }
    }
}

/// The maximum number of buffers that a kernel binds.
const MAX_BINDINGS: u32 = 10;

/// A pool of descriptor sets. It must be dropped after all submitted work with its sets has ended.
pub(crate) struct DescriptorPool {
    device: Arc<LogicalDevice>,
    /// Null while the pool has no room.
    raw: vk::DescriptorPool,
    /// The number of sets for which it has room.
    room: u32,
}

impl DescriptorPool {
    /// A pool without room.
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Self {
        Self {
            device: Arc::clone(device),
            raw: vk::DescriptorPool::null(),
            room: 0,
        }
    }

    /// Frees all sets, which no submitted work may use any more, and makes room for `sets` sets.
    pub(crate) fn make_room(&mut self, sets: u32) -> Result<(), VulkanError> {
        let raw = &self.device.raw;
        if sets <= self.room {
            if self.room > 0 {
                let flags = vk::DescriptorPoolResetFlags::empty();
                // SAFETY: no set is in use.
                unsafe { raw.reset_descriptor_pool(self.raw, flags) }
                    .named("vkResetDescriptorPool")?;
            }
            return Ok(());
        }
        let sizes = [
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        ]
        .map(|kind| {
            vk::DescriptorPoolSize::default()
                .ty(kind)
                .descriptor_count(sets * MAX_BINDINGS)
        });
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(sets)
            .pool_sizes(&sizes);
        // SAFETY: no set of the old pool is in use; null is allowed.
        unsafe { raw.destroy_descriptor_pool(self.raw, None) };
        (self.raw, self.room) = (vk::DescriptorPool::null(), 0);
        // SAFETY: the device is alive; the pool is destroyed above or in `drop`.
        self.raw =
            unsafe { raw.create_descriptor_pool(&info, None) }.named("vkCreateDescriptorPool")?;
        self.room = sets;
        Ok(())
    }

    /// A set with one buffer for each binding of a pipeline.
    pub(crate) fn set(
        &mut self,
        pipeline: &Pipeline,
        bindings: &[Binding],
    ) -> Result<vk::DescriptorSet, VulkanError> {
        debug_assert_eq!(bindings.len(), pipeline.bindings as usize);
        let raw = &self.device.raw;
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.raw)
            .set_layouts(&layouts);
        // SAFETY: `make_room` made room for this set.
        let set =
            unsafe { raw.allocate_descriptor_sets(&info) }.named("vkAllocateDescriptorSets")?[0];
        for (index, binding) in (0..).zip(bindings) {
            let info = [vk::DescriptorBufferInfo::default()
                .buffer(binding.buffer)
                .offset(binding.offset)
                .range(binding.size)];
            let views = [binding.view];
            let kind = pipeline.kind(index);
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(index)
                .descriptor_type(kind);
            let write = match kind {
                vk::DescriptorType::STORAGE_BUFFER => write.buffer_info(&info),
                _ => write.texel_buffer_view(&views),
            };
            // SAFETY: nothing uses the set yet, and the buffers are alive.
            unsafe { raw.update_descriptor_sets(&[write], &[]) };
        }
        Ok(set)
    }
}

impl Drop for DescriptorPool {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            // SAFETY: created from this device, and no submitted work uses its sets any more (see the
            // type); null is allowed.
            unsafe { self.device.raw.destroy_descriptor_pool(self.raw, None) };
        }
    }
}
