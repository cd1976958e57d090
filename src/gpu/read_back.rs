//! The way of a window's results to the host: read where kernels wrote them, or copied out of the
//! device's own memory, by the kernels' submission or by another one beside later kernels.

use std::ops::Range;
use std::sync::Arc;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::{Lane, LogicalDevice};
use crate::gpu::error::VulkanError;
use crate::gpu::semaphore::Semaphore;
use crate::gpu::submission::{Access, Spent, Submission};

/// Results on their way. Whoever has one drops the kernels' submission first.
#[derive(Default)]
pub(crate) struct ReadBack {
    // The copy goes first: it waits for its end before the buffers are freed.
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
    /// The buffer for kernels to write, of this size or longer; `staged` results are copied out of
    /// the device's own memory.
    pub(crate) fn room(
        &mut self,
        device: &Arc<LogicalDevice>,
        size: u64,
        staged: bool,
    ) -> Result<&Buffer, VulkanError> {
        if !staged {
            let output = grow(device, &mut self.output, size, Residence::InPlace)?;
            return Ok(output);
        }
        if self.apart.is_none() && device.copies_apart() {
            self.apart = Some(CopyApart {
                submission: Submission::new(device, Lane::Copies)?,
                done: Semaphore::new(device)?,
            });
        }
        grow(device, &mut self.host, size, Residence::Readback)?;
        let output = grow(device, &mut self.output, size, Residence::Results)?;
        Ok(output)
    }

    /// Submits recorded kernels that wrote the first `size` bytes of the results, and what brings
    /// these to the host.
    pub(crate) fn submit(
        &mut self,
        kernels: &mut Submission,
        size: u64,
    ) -> Result<(), VulkanError> {
        let size = size.max(4); // no copy may be of nothing, and no buffer is shorter
        let (Some(output), Some(host)) = (&self.output, &self.host) else {
            kernels.barrier(Access::Kernel, Access::Host);
            return kernels.submit();
        };
        let Some(CopyApart { submission, done }) = &mut self.apart else {
            kernels.barrier(Access::Kernel, Access::Copy);
            kernels.copy(output, host, 0, size);
            kernels.barrier(Access::Copy, Access::Host);
            return kernels.submit();
        };
        // The semaphore orders the copy and makes the kernels' writes visible to it: there is no
        // barrier in between, and none that the next kernels would wait for.
        submission.begin(0)?;
        submission.copy(output, host, 0, size);
        submission.barrier(Access::Copy, Access::Host);
        let point = done.advance();
        kernels.submit_between(None, Some(point))?;
        submission.submit_between(Some(point), None)
    }

    /// Whether the kernels and the copy have ended, as far as a look tells.
    pub(crate) fn is_done(&self, kernels: &Submission) -> Result<bool, VulkanError> {
        let copied = match &self.apart {
            Some(apart) => apart.submission.is_done()?,
            None => true,
        };
        Ok(copied && kernels.is_done()?)
    }

    /// Waits for the copy and for the kernels, whose time it returns, the copy's end included.
    pub(crate) fn wait(&mut self, kernels: &mut Submission) -> Result<Option<Spent>, VulkanError> {
        if let Some(apart) = &mut self.apart {
            apart.submission.wait()?;
        }
        kernels.wait()
    }

    /// Some of the results, after the wait.
    pub(crate) fn bytes(&self, range: Range<usize>) -> &[u8] {
        let own = self.host.as_ref().or(self.output.as_ref());
        own.map_or(&[], |own| own.bytes(range))
    }
}

/// A kept buffer of at least `size` bytes, which is replaced if it is shorter.
fn grow<'b>(
    device: &Arc<LogicalDevice>,
    kept: &'b mut Option<Buffer>,
    size: u64,
    residence: Residence,
) -> Result<&'b mut Buffer, VulkanError> {
    // A shorter one is freed before the new one is made, so that both need not fit.
    let own = kept.take().filter(|buffer| buffer.size() >= size);
    let own = own.map_or_else(
        || Buffer::new(device, "tumble results", size, residence),
        Ok,
    );
    Ok(kept.insert(own?))
}
