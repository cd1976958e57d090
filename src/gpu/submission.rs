//! Submissions: a command buffer with its fence and its recording, and semaphores with which one submission waits for
//! another.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;

use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::recorded::{Commands, Recorded};
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;

/// The time limit: a dispatch takes milliseconds, so a device that needs this long has hung.
const TIMEOUT_SECONDS: u64 = 60;

/// A command buffer, a fence and a recording, which are reused.
pub(crate) struct Submission {
    device: Arc<LogicalDevice>,
    lane: QueueLane,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    /// The work of the next submission, or of the one that is pending.
    pub(crate) work: Recorded,
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

impl Submission {
    pub(crate) fn new(device: &Arc<LogicalDevice>, lane: QueueLane) -> Result<Self, VulkanError> {
        let mut submission = Self {
            device: Arc::clone(device),
            lane,
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            work: Recorded::new(device),
            stamps: vk::QueryPool::null(),
            submitted: None,
        };
        let raw = &device.raw;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.family(lane));
        // SAFETY: the device is alive, here and below; created objects are destroyed
        // in `drop`, also when a later step fails.
        submission.pool =
            unsafe { raw.create_command_pool(&info, None) }.named("vkCreateCommandPool")?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(submission.pool)
            .command_buffer_count(1);
        // SAFETY: the device is alive; `drop` destroys what was created.
        submission.commands =
            unsafe { raw.allocate_command_buffers(&info) }.named("vkAllocateCommandBuffers")?[0];
        // SAFETY: the device is alive; `drop` destroys what was created.
        submission.fence = unsafe { raw.create_fence(&vk::FenceCreateInfo::default(), None) }
            .named("vkCreateFence")?;
        if lane == QueueLane::Kernels && device.physical.timestamp_bits() > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2);
            // SAFETY: the device is alive; `drop` destroys what was created.
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

    /// The command buffer in the recording state, after `begin`, for commands before the submission's work. The caller
    /// keeps the used resources alive until `wait`.
    pub(crate) fn commands(&mut self) -> Commands<'_> {
        // SAFETY: the command buffer is this device's, and no other code records while `self` is lent; callers
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

    /// Starts the recording of commands, and forgets the work of the last submission.
    ///
    /// Must not be called while work is pending.
    pub(crate) fn begin(&mut self) -> Result<(), VulkanError> {
        self.device.check_process()?;
        debug_assert!(self.submitted.is_none());
        self.work.clear();
        let raw = &self.device.raw;
        // SAFETY: nothing is pending, so the command buffer is not in use.
        unsafe { raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .named("vkResetCommandPool")?;
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer was just reset, and is not in use.
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

    /// Records the work, after the commands that were recorded directly, and submits it to the queue.
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
        // SAFETY: recording is on, and the caller keeps what the work uses until `wait`.
        let commands = unsafe { Commands::new(&self.device, self.commands) };
        self.work.record(commands, &[]);
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

    /// Submits the work, and waits until it has ended.
    pub(crate) fn run(&mut self) -> Result<Option<Spent>, VulkanError> {
        self.submit()?;
        self.wait()
    }

    /// Waits until submitted work has ended; returns at once if there is none.
    pub(crate) fn wait(&mut self) -> Result<Option<Spent>, VulkanError> {
        let Some(submitted) = self.submitted else {
            return Ok(None);
        };
        self.device.check_process()?;
        let raw = &self.device.raw;
        let fences = [self.fence];
        // If the device has hung, do not wait for it a second time.
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

impl Drop for Submission {
    fn drop(&mut self) {
        // After an error, submitted work may not have ended. Nothing that it uses may be destroyed before.
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
        // SAFETY: the device is alive, with the feature; the semaphore is destroyed in `drop`.
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
            // A fence shows that the copy has ended. But Mesa's drivers that emulate timeline semaphores still use
            // them for a moment after they signal the fence.
            if !self.is_exported {
                self.device.settle(); // semaphores that can be exported are not emulated
            }
            // SAFETY: created from this device; the code that submits with it has waited for the work.
            unsafe { self.device.raw.destroy_semaphore(self.raw, None) };
        }
    }
}
