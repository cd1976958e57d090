//! Data that the host writes for kernels.

use std::sync::Arc;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::LogicalDevice;
use crate::gpu::physical::upload_memory::{KernelReads, UploadMemory};
use crate::gpu::recorded::Recorded;
use crate::machine::error::VulkanError;
use crate::work::recording::Resource;

/// Bytes for kernels, in memory that is kept for the next ones.
#[derive(Default)]
pub(crate) struct Upload {
    /// The buffer that the host writes.
    written: Option<Buffer>,
    /// The copy in device memory, if there is one.
    copied: Option<Buffer>,
    /// The size of the last upload in bytes.
    used: usize,
}

impl Upload {
    /// Room for this number of bytes, which no kernel may use at this time. The memory may be write-combined, which
    /// is fast only for writes in order: the host must write all of it, from the first byte on, and must not read it.
    pub(crate) fn room(
        &mut self,
        device: &Arc<LogicalDevice>,
        name: &str,
        reads: KernelReads,
        bytes: usize,
    ) -> Result<&mut [u8], VulkanError> {
        let size = bytes as u64;
        if self
            .written
            .as_ref()
            .is_none_or(|buffer| buffer.size < size)
        {
            // Buffers that are too short are freed before new ones are allocated, so that memory for both is not
            // needed.
            (self.written, self.copied) = (None, None);
            let (written, is_staged) = writable(device, name, size, reads)?;
            if is_staged {
                self.copied = Some(Buffer::new(device, name, size, Residence::Device)?);
            }
            self.written = Some(written);
        }
        self.used = bytes;
        let written = self.written.as_mut();
        Ok(written.map_or(&mut [], |buffer| buffer.bytes_mut(0..bytes)))
    }

    /// The memory that kernels read, as a resource of this work, which copies it there if it is staged; `None` if
    /// nothing was uploaded yet.
    pub(crate) fn copied_in(&self, work: &mut Recorded) -> Option<Resource> {
        let resource = self.resource_of(work)?;
        if let (Some(from), Some(_)) = (&self.written, &self.copied)
            && self.used > 0
        {
            let size = (self.used as u64).next_multiple_of(4);
            let from = work.whole(from);
            work.recording.copy(from, resource.slice(0, size));
        }
        Some(resource)
    }

    /// As [`Upload::copied_in`], of an upload that the device has copied already.
    pub(crate) fn resource_of(&self, work: &mut Recorded) -> Option<Resource> {
        let buffer = self.copied.as_ref().or(self.written.as_ref());
        buffer.map(|buffer| work.whole(buffer))
    }

    /// Whether the device reads a copy.
    pub(crate) fn is_copied(&self) -> bool {
        self.copied.is_some()
    }

    /// Frees the buffer that the device has copied; the host must not write any more.
    pub(crate) fn forget_written(&mut self) {
        if self.is_copied() {
            self.written = None;
        }
    }

    /// The size in bytes of the memory that kernels read.
    pub(crate) fn bytes(&self) -> u64 {
        let read = self.copied.as_ref().or(self.written.as_ref());
        read.map_or(0, |buffer| buffer.size)
    }
}

/// A buffer for the host to write, and whether its bytes must be copied for kernels. If device memory has no
/// host-visible room, host memory is used.
pub(crate) fn writable(
    device: &Arc<LogicalDevice>,
    name: &str,
    size: u64,
    reads: KernelReads,
) -> Result<(Buffer, bool), VulkanError> {
    let mut memory = device.placing.memory_for(size, reads);
    if memory == UploadMemory::Direct {
        match Buffer::new(device, name, size, Residence::Direct) {
            Err(error) if !error.is_lost() => memory = device.placing.without_direct(reads),
            made => return Ok((made?, false)),
        }
    }
    let buffer = Buffer::new(device, name, size, Residence::Upload)?;
    Ok((buffer, memory == UploadMemory::Staged))
}
