//! Passes over poses: the poses are copied to the device, one kernel runs, and its result is
//! copied back.

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::submission::{Access, Binding, Submission};
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
        let limit = self.device.physical.info.max_storage_buffer_range;
        let lengths = inputs.iter().map(|input| input.len());
        for bytes in lengths.chain([output.len()]).map(|bytes| bytes as u64) {
            if bytes > limit {
                let what = "poses";
                return Err(VulkanError::TooLarge { what, bytes, limit });
            }
        }
        let pipeline = self.pipeline(kernel)?;
        let mut buffers = Vec::with_capacity(inputs.len());
        for input in inputs {
            let size = input.len() as u64;
            let mut buffer = Buffer::new(&self.device, "tumble poses", size, Residence::Upload)?;
            buffer.bytes_mut(0..input.len()).copy_from_slice(input);
            buffers.push(buffer);
        }
        let size = output.len() as u64;
        let result = Buffer::new(&self.device, "tumble poses", size, Residence::Readback)?;
        let mut bindings: Vec<Binding> = buffers.iter().map(Binding::whole).collect();
        bindings.push(Binding::whole(&result));
        let mut submission = Submission::new(&self.device)?;
        submission.begin(1)?;
        let groups = self.workgroups(pass.count);
        submission.dispatch(&pipeline, &bindings, bytemuck::bytes_of(&pass), groups)?;
        submission.barrier(Access::Kernel, Access::Host);
        submission.submit()?;
        submission.wait()?;
        output.copy_from_slice(result.bytes(0..output.len()));
        Ok(())
    }
}
