//! Passes over poses: the poses are copied to the device, one kernel runs, and its result is
//! copied back.

use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::shader::{Kernel, PoseDispatch};

impl VulkanEngine {
    /// The most values of 16 bytes that one pass takes.
    pub(crate) fn pass_limit(&self) -> usize {
        self.window()
    }

    /// Runs a kernel with these inputs.
    pub(crate) fn pass(
        &self,
        kernel: Kernel,
        inputs: &[&[u8]],
        pass: PoseDispatch,
        output: &mut [u8],
    ) -> Result<(), VulkanError> {
        for bytes in inputs.iter().copied().chain([&*output]) {
            self.check_size("poses", bytes)?;
        }
        let (pipeline, groups) = (self.pipeline(kernel)?, self.workgroups(pass.count));
        pipeline.run_once(inputs, bytemuck::bytes_of(&pass), groups, output)
    }
}
