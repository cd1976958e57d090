//! Kernels, and the way of their results to the host: read where kernels wrote them, or copied out of
//! the device's own memory, by the kernels' submission or by another one beside later kernels.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::{Lane, LogicalDevice};
use crate::gpu::error::{Named, VulkanError};
use crate::gpu::submission::{Access, Point, Spent, Submission};

/// Kernels, and their results on the way. Whoever has one drops it before what else the kernels use.
pub(crate) struct ReadBack {
    // Kernels and copy go first: they wait for their end before the buffers are freed.
    pub(crate) kernels: Submission,
    apart: Option<CopyApart>,
    /// What kernels write.
    output: Option<Buffer>,
    /// What the host reads, where that is not the same.
    host: Option<Buffer>,
}

/// Copies in submissions of their own.
struct CopyApart {
    submission: Submission,
    /// What the kernels' queue has reached.
    done: Semaphore,
}

impl ReadBack {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Ok(Self {
            kernels: Submission::new(device, Lane::Kernels)?,
            apart: None,
            output: None,
            host: None,
        })
    }

    /// The buffer for kernels to write, of this size or longer; `staged` results are copied out of
    /// the device's own memory.
    pub(crate) fn room(
        &mut self,
        device: &Arc<LogicalDevice>,
        size: u64,
        staged: bool,
    ) -> Result<&Buffer, VulkanError> {
        if !staged {
            return grow(device, &mut self.output, size, Residence::InPlace);
        }
        self.copy_apart(device)?;
        grow(device, &mut self.host, size, Residence::Readback)?;
        grow(device, &mut self.output, size, Residence::Results)
    }

    /// The same for results that are copied to a buffer which is not one of these.
    pub(crate) fn room_apart(
        &mut self,
        device: &Arc<LogicalDevice>,
        size: u64,
    ) -> Result<&Buffer, VulkanError> {
        self.copy_apart(device)?;
        grow(device, &mut self.output, size, Residence::Results)
    }

    fn copy_apart(&mut self, device: &Arc<LogicalDevice>) -> Result<(), VulkanError> {
        if self.apart.is_none() && device.copies_apart {
            self.apart = Some(CopyApart {
                submission: Submission::new(device, Lane::Copies)?,
                done: Semaphore::new(device)?,
            });
        }
        Ok(())
    }

    /// Submits the recorded kernels, and what brings the first `size` bytes of the results to the host;
    /// with `None` they were written into other memory, where the host sees them.
    pub(crate) fn submit(&mut self, size: Option<u64>) -> Result<(), VulkanError> {
        self.submit_to(size, None)
    }

    /// As [`ReadBack::submit`]; the results go to another buffer that the host sees, from an offset on, if one
    /// is named.
    pub(crate) fn submit_to(
        &mut self,
        size: Option<u64>,
        place: Option<(&Buffer, u64)>,
    ) -> Result<(), VulkanError> {
        let kernels = &mut self.kernels;
        let place = place.or(self.host.as_ref().map(|host| (host, 0)));
        let (Some(size), Some(output), Some(place)) = (size, &self.output, place) else {
            (kernels.commands()).barrier(Access::Kernel, Access::Host);
            return kernels.submit();
        };
        let size = size.max(4); // no copy may be of nothing, and no buffer is shorter
        let Some(CopyApart { submission, done }) = &mut self.apart else {
            (kernels.commands()).barrier(Access::Kernel, Access::Copy);
            (kernels.commands()).copy_to(output, place, size);
            (kernels.commands()).barrier(Access::Copy, Access::Host);
            return kernels.submit();
        };
        // The semaphore orders the copy and makes the kernels' writes visible to it: there is no
        // barrier in between, and none that the next kernels would wait for.
        submission.begin(0)?;
        (submission.commands()).copy_to(output, place, size);
        (submission.commands()).barrier(Access::Copy, Access::Host);
        let point = done.advance();
        kernels.submit_between(None, Some(point))?;
        submission.submit_between(Some(point), None)
    }

    /// Whether the kernels and the copy have ended, as far as a look tells.
    pub(crate) fn is_done(&self) -> Result<bool, VulkanError> {
        let copied = match &self.apart {
            Some(apart) => apart.submission.is_done()?,
            None => true,
        };
        Ok(copied && self.kernels.is_done()?)
    }

    /// Waits for the copy and for the kernels, whose time it returns, the copy's end included.
    pub(crate) fn wait(&mut self) -> Result<Option<Spent>, VulkanError> {
        if let Some(apart) = &mut self.apart {
            apart.submission.wait()?;
        }
        self.kernels.wait()
    }

    /// Some of the results, after the wait.
    pub(crate) fn bytes(&self, range: Range<usize>) -> Result<&[u8], VulkanError> {
        let Some(buffer) = self.host.as_ref().or(self.output.as_ref()) else {
            return Ok(&[]);
        };
        buffer.invalidate(&range)?;
        Ok(buffer.bytes(range))
    }
}

/// A timeline semaphore, whose device has that feature: what one queue has reached, for another that
/// waits.
pub(crate) struct Semaphore {
    device: Arc<LogicalDevice>,
    pub(crate) raw: vk::Semaphore,
    /// The value of the point that was given last.
    last: u64,
    /// Whether others than this device may wait for it.
    is_exported: bool,
}

impl Semaphore {
    fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Self::made(device, "tumble kernels done", None)
    }

    /// One that may be exported as a file, of a device that can.
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

    /// The next point, later than all that were given before. One that is never reached, because
    /// its submission failed, does no harm.
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

/// A kept buffer of at least `size` bytes, which is replaced if it is shorter.
fn grow<'b>(
    device: &Arc<LogicalDevice>,
    kept: &'b mut Option<Buffer>,
    size: u64,
    residence: Residence,
) -> Result<&'b Buffer, VulkanError> {
    // A shorter one is freed before the new one is made, so that both need not fit.
    let own = kept.take().filter(|buffer| buffer.size >= size);
    let own = own.map_or_else(
        || Buffer::new(device, "tumble results", size, residence),
        Ok,
    );
    Ok(kept.insert(own?))
}
