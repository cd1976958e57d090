//! Data that the host writes for kernels.

use std::sync::Arc;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::LogicalDevice;
use crate::gpu::error::VulkanError;
use crate::gpu::physical::upload_memory::{KernelReads, UploadMemory};
use crate::gpu::submission::{Access, Binding, Submission};

/// Bytes for kernels, in memory that is kept for the next ones.
#[derive(Default)]
pub(crate) struct Upload {
    /// The buffer that the host writes.
    written: Option<Buffer>,
    /// The copy in device memory, if there is one.
    copied: Option<Buffer>,
    /// The size of the last upload, bytes.
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
            // Shorter ones are freed before new ones are made, so that both need not fit.
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

    /// Records the copies of some uploads, if they are copied, and the barrier for kernels.
    pub(crate) fn record<'u>(uploads: impl Iterator<Item = &'u Self>, submission: &mut Submission) {
        let mut any = false;
        for upload in uploads {
            if let (Some(from), Some(to)) = (&upload.written, &upload.copied)
                && upload.used > 0
            {
                let size = (upload.used as u64).next_multiple_of(4);
                submission.commands().copy(from, to, size);
                any = true;
            }
        }
        if any {
            (submission.commands()).barrier(Access::Copy, Access::Kernel);
        }
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

    /// The size of the memory that kernels read, bytes.
    pub(crate) fn bytes(&self) -> u64 {
        let read = self.copied.as_ref().or(self.written.as_ref());
        read.map_or(0, |buffer| buffer.size)
    }

    /// The binding for kernels; `None` if nothing was uploaded yet.
    pub(crate) fn binding(&self) -> Option<Binding> {
        let buffer = self.copied.as_ref().or(self.written.as_ref());
        buffer.map(Binding::whole)
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
