//! A crowd's results for the host: evaluated into memory that the host reads, submitted without a wait.

use std::sync::Arc;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::crowd::{CrowdSteps, DeviceCrowd};
use crate::gpu::crowd_target::CrowdTarget;
use crate::gpu::error::VulkanError;
use crate::gpu::submission::{Access, Submission};
use crate::shader::CrowdEntry;

/// A target whose result the host reads.
pub(crate) struct CrowdReader {
    // The submission goes first: it waits for what uses the rest.
    submission: Submission,
    target: CrowdTarget,
    crowd: Arc<DeviceCrowd>,
    /// What kernels write; the host sees it where the device works in place.
    output: Buffer,
    readback: Option<Buffer>,
    bytes: u64,
}

impl CrowdReader {
    pub(crate) fn new(crowd: &Arc<DeviceCrowd>, steps: CrowdSteps) -> Result<Self, VulkanError> {
        let engine = &crowd.engine;
        let bytes = CrowdTarget::bytes(crowd, steps);
        let new = |residence| Buffer::new(&engine.device, "tumble crowd result", bytes, residence);
        let (output, readback) = match engine.in_place {
            true => (new(Residence::Readback)?, None),
            false => (new(Residence::Device)?, Some(new(Residence::Readback)?)),
        };
        Ok(Self {
            submission: Submission::new(&engine.device)?,
            target: CrowdTarget::new(crowd, steps, output.raw, 0)?,
            crowd: Arc::clone(crowd),
            output,
            readback,
            bytes,
        })
    }

    /// Submits an evaluation; the one before must have been waited for.
    pub(crate) fn submit<'e>(
        &mut self,
        clock: u64,
        changes: impl Iterator<Item = (usize, &'e [CrowdEntry])>,
    ) -> Result<(), VulkanError> {
        self.submission.begin(0)?;
        let commands = self.submission.commands();
        // SAFETY: the command buffer is this submission's, in recording, and submitted below.
        unsafe { self.crowd.record(&self.target, commands, clock, changes) };
        if let Some(readback) = &self.readback {
            self.submission.barrier(Access::Kernel, Access::Copy);
            self.submission.copy(&self.output, readback, 0, self.bytes);
            self.submission.barrier(Access::Copy, Access::Host);
        } else {
            self.submission.barrier(Access::Kernel, Access::Host);
        }
        self.submission.submit()
    }

    pub(crate) fn is_done(&self) -> Result<bool, VulkanError> {
        self.submission.is_done()
    }

    /// Waits, and copies the result, of which `output` has as many bytes.
    pub(crate) fn wait_into(&mut self, output: &mut [u8]) -> Result<(), VulkanError> {
        self.submission.wait()?;
        let from = self.readback.as_ref().unwrap_or(&self.output);
        output.copy_from_slice(from.bytes(0..output.len()));
        Ok(())
    }
}
