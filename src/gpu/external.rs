//! Memory that a device shares: with the caller, whose memory software devices use without a copy, and with CUDA or
//! another Vulkan device, which import results.

use std::marker::PhantomData;
use std::ops::Range;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::LogicalDevice;
#[cfg(unix)]
use crate::gpu::physical::external::{FILE, SEMAPHORE_FILE};
use crate::gpu::submission::{Point, Semaphore};
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::threads::lock;

/// The time limit for waiting for a result; the same as for a fence.
const TIMEOUT_SECONDS: u64 = 60;

/// The memory of a result, and the semaphore that the device signals when it has written it.
pub(crate) struct Exported {
    // Dropped before the buffer, so that no thread waits for it when the buffer is freed.
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
        // If the device has hung, do not wait for it a second time.
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
        // The memory is freed next, so this must wait for the work. The work of a lost device has ended; after
        // another error it may still run.
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

    /// The length of the result in bytes, from the start of the memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The length of the memory in bytes. It is a dedicated allocation of one buffer, which importers must specify.
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
        // SAFETY: memory of this device, which was allocated for export as a file descriptor.
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
        // SAFETY: a semaphore of this device, which was created for export as a file descriptor.
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

/// The minimum number of bytes to import; fewer are copied faster.
const LEAST: usize = 1 << 20;

/// The size in bytes of whole pages, in which memory is imported.
const PAGE: usize = 4096;

/// Imported memory of the caller, which a device may read or write as long as this lives.
pub(crate) struct ImportedMemory<'a> {
    /// The pages that contain it.
    pub(crate) buffer: Buffer,
    /// Its start in the pages in bytes.
    pub(crate) start: usize,
    memory: NonNull<u8>,
    size: usize,
    /// Whether all work that was submitted has ended, so that dropping need not wait.
    is_idle: bool,
    lender: PhantomData<&'a mut [u8]>,
}

impl<'a> ImportedMemory<'a> {
    /// Imports memory for kernels to write values of `each` bytes; returns the slice if that is impossible.
    pub(crate) fn to_write(
        device: &Arc<LogicalDevice>,
        bytes: &'a mut [u8],
        each: usize,
    ) -> Result<Self, &'a mut [u8]> {
        let (size, start) = (bytes.len(), bytes.as_ptr().addr() % PAGE);
        let alignment = device.physical.info.min_storage_buffer_offset_alignment as usize;
        let is_aligned = |offset: usize| offset.is_multiple_of(alignment.max(1));
        // A binding must begin at an aligned offset and a whole number of values before the result. Either the offset
        // of every value is aligned, or the start of the page is a whole number of values before the result.
        let binds = is_aligned(start) && is_aligned(each) || start.is_multiple_of(each);
        let imported = binds.then(|| Self::new(device, NonNull::from(&mut *bytes).cast(), size));
        imported.flatten().ok_or(bytes)
    }

    /// Imports memory for kernels to read.
    pub(crate) fn to_read(device: &Arc<LogicalDevice>, bytes: &'a [u8]) -> Option<Self> {
        Self::new(device, NonNull::from(bytes).cast(), bytes.len())
    }

    fn new(device: &Arc<LogicalDevice>, memory: NonNull<u8>, size: usize) -> Option<Self> {
        let alignment = usize::try_from(device.physical.lent_alignment?).ok()?;
        let start = memory.addr().get() % PAGE;
        let pages = (start + size).next_multiple_of(PAGE);
        let limit = device.physical.info.max_memory_allocation_size;
        if size < LEAST || !PAGE.is_multiple_of(alignment) || pages as u64 > limit {
            return None;
        }
        let first = NonNull::new(memory.as_ptr().wrapping_sub(start))?;
        // SAFETY: a page that has a byte of this process's memory belongs wholly to the process, and the returned value
        // borrows the memory until the device has finished with it.
        let buffer = unsafe { Buffer::around(device, first, pages as u64) }?;
        Some(Self {
            buffer,
            start,
            memory,
            size,
            is_idle: false,
            lender: PhantomData,
        })
    }

    /// Some of its bytes, for the host to write. No kernel may use them at the same time.
    pub(crate) fn bytes_mut(&mut self, range: Range<usize>) -> &mut [u8] {
        assert!(range.start <= range.end && range.end <= self.size);
        // SAFETY: it is borrowed as a whole, and the range lies within it.
        unsafe {
            std::slice::from_raw_parts_mut(self.memory.as_ptr().add(range.start), range.len())
        }
    }

    /// Records that all work that was submitted with it has ended.
    pub(crate) fn has_come_back(&mut self) {
        self.is_idle = true;
    }
}

impl Drop for ImportedMemory<'_> {
    fn drop(&mut self) {
        // After an error or a panic, submitted work may not have ended.
        if !self.is_idle {
            self.buffer.device.wait_in_any_case();
        }
    }
}
