//! The caller's memory, which software devices use without a copy.

use std::marker::PhantomData;
use std::ops::Range;
use std::ptr::NonNull;
use std::sync::Arc;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::LogicalDevice;

/// The minimum number of bytes to import; fewer are copied faster.
const LEAST: usize = 1 << 20;

/// The size of whole pages, in which memory is imported, bytes.
const PAGE: usize = 4096;

/// Imported memory of the caller, which a device may read or write as long as this lives.
pub(crate) struct ImportedMemory<'a> {
    /// The pages that contain it.
    pub(crate) buffer: Buffer,
    /// Its start in the pages, bytes.
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
        // A binding begins at an aligned offset, a whole number of values before the result:
        // either every value is aligned, or the start of the page is such an offset.
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
        // SAFETY: pages that hold a byte of the process's memory are its own as a whole, and
        // this keeps the memory borrowed until nothing works on it any more.
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
