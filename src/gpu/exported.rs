//! Results in a device's memory that CUDA or another Vulkan device imports, without a copy.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::LogicalDevice;
#[cfg(unix)]
use crate::gpu::physical::external::{FILE, SEMAPHORE_FILE};
use crate::gpu::submission::Point;
use crate::gpu::submission::Semaphore;
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::threads::lock;

/// The time limit for waiting for a result; the same as for a fence.
const TIMEOUT_SECONDS: u64 = 60;

/// The memory of a result, and the semaphore that the device signals when it has written it.
pub(crate) struct Exported {
    // It goes first: nobody waits for it any more when the buffer is freed.
    done: Option<Mutex<Semaphore>>,
    /// The semaphore's value when the last submitted work has ended.
    submitted: AtomicU64,
    pub(crate) buffer: Buffer,
}

impl Exported {
    pub(crate) fn new(device: &Arc<LogicalDevice>, bytes: u64) -> Result<Self, VulkanError> {
        if device.exports.is_none() {
            let lacks = match (device.owned, device.physical.memory_files) {
                (false, _) => "it is an application's own, whose buffers are that application's",
                (true, false) => "it lacks the extension VK_KHR_external_memory_fd",
                (true, true) => "it exports no memory of storage buffers (OPAQUE_FD)",
            };
            let device = device.physical.info.name.clone();
            return Err(VulkanError::NoExport { device, lacks });
        }
        let exports_timelines = device.exports_timelines.is_some();
        let done = exports_timelines.then(|| Semaphore::exportable(device));
        Ok(Self {
            done: done.transpose()?.map(Mutex::new),
            submitted: AtomicU64::new(0),
            buffer: Buffer::exportable(device, "tumble exported", bytes)?,
        })
    }

    /// Whether importers can wait for the device.
    pub(crate) fn has_timeline(&self) -> bool {
        self.done.is_some()
    }

    /// The semaphore's next value, for the next submission.
    pub(crate) fn next_point(&self) -> Option<Point> {
        self.done.as_ref().map(|done| lock(done).advance())
    }

    /// Records that the work of a point was submitted.
    pub(crate) fn has_submitted(&self, point: Option<Point>) {
        if let Some((_, value)) = point {
            self.submitted.store(value, Ordering::Release);
        }
    }

    /// The point at which the whole result is written.
    fn last_point(&self) -> Option<Point> {
        let done = lock(self.done.as_ref()?);
        Some((done.raw, self.submitted.load(Ordering::Acquire)))
    }

    /// Waits until the whole result is written.
    fn wait(&self) -> Result<(), VulkanError> {
        let device = &self.buffer.device;
        device.check_process()?;
        let Some((semaphore, value)) = self.last_point() else {
            return Ok(());
        };
        let (semaphores, values) = ([semaphore], [value]);
        let info = vk::SemaphoreWaitInfo::default()
            .semaphores(&semaphores)
            .values(&values);
        // A device that has hung is not waited for again.
        let seconds = TIMEOUT_SECONDS * u64::from(device.may_destroy());
        // SAFETY: a timeline semaphore of this device, which has Vulkan 1.2.
        match unsafe { device.raw.wait_semaphores(&info, seconds * 1_000_000_000) } {
            Err(vk::Result::TIMEOUT) => {
                device.mark_hung();
                Err(VulkanError::Timeout {
                    seconds: TIMEOUT_SECONDS,
                })
            }
            waited => waited.named("vkWaitSemaphores"),
        }
    }
}

impl Drop for Exported {
    fn drop(&mut self) {
        // Nobody else waits for the work before the memory is freed. That of a lost device has ended; after
        // another error it may not have.
        if let Err(error) = self.wait()
            && !error.is_lost()
        {
            self.buffer.device.mark_hung();
        }
    }
}

/// A result in the memory of the device that evaluated it.
///
/// Other interfaces on the same card, such as CUDA, import this memory through a file descriptor and use it without a
/// copy. The memory lives as long as this object or an import of it.
///
/// If [`ExportedResult::timeline_file`] returns a semaphore, the device may still be writing: the importer's queue or
/// stream must wait for the semaphore, or the host waits ([`ExportedResult::wait`]). If there is none, the result is
/// written already.
#[derive(Clone)]
pub struct ExportedResult {
    exported: Arc<Exported>,
    bytes: u64,
}

impl ExportedResult {
    pub(crate) fn new(exported: Arc<Exported>, bytes: u64) -> Self {
        Self { exported, bytes }
    }

    /// The length of the result, bytes, from the start of the memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The length of the memory, bytes. It is a dedicated allocation of one buffer, which importers must specify.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        self.exported.buffer.memory().1
    }

    /// The device's UUID, by which other interfaces identify it, as in
    /// [`DeviceInfo::uuid`](crate::machine::reports::DeviceInfo::uuid).
    #[must_use]
    pub fn device_uuid(&self) -> &str {
        &self.device().physical.info.uuid
    }

    /// The device's name.
    #[must_use]
    pub fn device_name(&self) -> &str {
        &self.device().physical.info.name
    }

    fn device(&self) -> &LogicalDevice {
        &self.exported.buffer.device
    }

    /// A new file descriptor of the memory (`VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT`), for one import.
    ///
    /// # Errors
    /// When the device refuses, or the process was forked from the one that opened the device.
    #[cfg(unix)]
    pub fn memory_file(&self) -> Result<std::os::fd::OwnedFd, VulkanError> {
        let device = self.device();
        device.check_process()?;
        let Some(exports) = &device.exports else {
            return Err(VulkanError::NoExport {
                device: self.device_name().to_owned(),
                lacks: "it lacks the extension VK_KHR_external_memory_fd",
            });
        };
        let info = vk::MemoryGetFdInfoKHR::default()
            .memory(self.exported.buffer.memory().0)
            .handle_type(FILE);
        // SAFETY: memory of this device, allocated to be exported so.
        let file = unsafe { exports.get_memory_fd(&info) }.named("vkGetMemoryFdKHR")?;
        // SAFETY: the file was made just now, for the caller, who closes it.
        Ok(unsafe { std::os::fd::FromRawFd::from_raw_fd(file) })
    }

    /// A new file descriptor of the timeline semaphore (`VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT`), for one
    /// import, and the semaphore's value when the result is written. `None` if the device exports no semaphores; then
    /// the result is written already.
    ///
    /// # Errors
    /// As [`ExportedResult::memory_file`].
    #[cfg(unix)]
    pub fn timeline_file(&self) -> Result<Option<(std::os::fd::OwnedFd, u64)>, VulkanError> {
        let device = self.device();
        device.check_process()?;
        let (Some(exports), Some((semaphore, value))) =
            (&device.exports_timelines, self.exported.last_point())
        else {
            return Ok(None);
        };
        let info = vk::SemaphoreGetFdInfoKHR::default()
            .semaphore(semaphore)
            .handle_type(SEMAPHORE_FILE);
        // SAFETY: a semaphore of this device, made to be exported so.
        let file = unsafe { exports.get_semaphore_fd(&info) }.named("vkGetSemaphoreFdKHR")?;
        // SAFETY: the file was made just now, for the caller, who closes it.
        let file = unsafe { std::os::fd::FromRawFd::from_raw_fd(file) };
        Ok(Some((file, value)))
    }

    /// Whether the whole result is written; does not wait.
    ///
    /// # Errors
    /// When the device was lost, or the process was forked from the one that opened it.
    pub fn is_written(&self) -> Result<bool, VulkanError> {
        let device = self.device();
        device.check_process()?;
        let Some((semaphore, value)) = self.exported.last_point() else {
            return Ok(true);
        };
        // SAFETY: a timeline semaphore of this device, which has Vulkan 1.2.
        let reached = unsafe { device.raw.get_semaphore_counter_value(semaphore) };
        Ok(reached.named("vkGetSemaphoreCounterValue")? >= value)
    }

    /// Waits until the whole result is written.
    ///
    /// # Errors
    /// When the device was lost or did not finish in time, or the process was forked from the one that opened it.
    pub fn wait(&self) -> Result<(), VulkanError> {
        self.exported.wait()
    }
}

impl std::fmt::Debug for ExportedResult {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ExportedResult")
            .field("device", &self.device_name())
            .field("bytes", &self.bytes)
            .finish_non_exhaustive()
    }
}
