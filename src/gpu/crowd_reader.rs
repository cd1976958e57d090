//! A crowd's results for the host: evaluated into memory that the host reads, submitted without a wait.

use std::sync::Arc;

use crate::gpu::crowd::{CrowdSteps, DeviceCrowd};
use crate::gpu::crowd_target::CrowdTarget;
use crate::gpu::error::VulkanError;
use crate::gpu::read_back::ReadBack;
use crate::shader::CrowdEntry;

/// A target whose result the host reads.
pub(crate) struct CrowdReader {
    // It goes first: it waits for what uses the rest.
    results: ReadBack,
    target: CrowdTarget,
    crowd: Arc<DeviceCrowd>,
    bytes: u64,
}

impl CrowdReader {
    pub(crate) fn new(crowd: &Arc<DeviceCrowd>, steps: CrowdSteps) -> Result<Self, VulkanError> {
        let engine = &crowd.engine;
        let bytes = CrowdTarget::bytes(crowd, steps);
        let mut results = ReadBack::new(&engine.device)?;
        let output = results.room(&engine.device, bytes, !engine.in_place)?.raw;
        Ok(Self {
            results,
            target: CrowdTarget::new(crowd, steps, output, 0)?,
            crowd: Arc::clone(crowd),
            bytes,
        })
    }

    /// Submits an evaluation; the one before must have been waited for.
    pub(crate) fn submit<'e>(
        &mut self,
        clock: u64,
        changes: impl Iterator<Item = (usize, &'e [CrowdEntry])>,
    ) -> Result<(), VulkanError> {
        self.results.kernels.begin(0)?;
        let commands = self.results.kernels.commands();
        // SAFETY: the command buffer is this submission's, in recording, and submitted below.
        unsafe { self.crowd.record(&self.target, commands, clock, changes) };
        self.results.submit(Some(self.bytes))
    }

    pub(crate) fn is_done(&self) -> Result<bool, VulkanError> {
        self.results.is_done()
    }

    /// Waits, and copies the result, of which `output` has as many bytes.
    pub(crate) fn wait_into(&mut self, output: &mut [u8]) -> Result<(), VulkanError> {
        self.results.wait()?;
        output.copy_from_slice(self.results.bytes(0..output.len()));
        Ok(())
    }
}
