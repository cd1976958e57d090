//! Passes over poses that are already there: up to the device, through one kernel, and
//! back.

use std::sync::{Arc, PoisonError};

use super::buffer::{Buffer, Residence};
use super::engine::VulkanEngine;
use super::error::VulkanError;
use super::pipeline::{Exactness, POSE_BINDINGS, Pipeline, PoseKernel, pose_shader};
use super::submission::{Access, Binding, Submission};
use crate::segment::Pass;

impl VulkanEngine {
    /// How many values of 16 bytes one pass takes.
    pub(crate) fn pass_limit(&self) -> usize {
        self.window()
    }

    /// Runs a kernel with these inputs.
    pub(crate) fn pass(
        &self,
        kernel: PoseKernel,
        inputs: [&[u8]; 3],
        pass: Pass,
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
        let pipeline = self.pose_pipeline(kernel)?;
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

    fn pose_pipeline(&self, kernel: PoseKernel) -> Result<Arc<Pipeline>, VulkanError> {
        let mut all = (self.pose_pipelines.lock()).unwrap_or_else(PoisonError::into_inner);
        let place = &mut all[kernel as usize];
        if let Some(pipeline) = place {
            return Ok(Arc::clone(pipeline));
        }
        let exactness = Exactness::Demanded;
        let shader = pose_shader(kernel);
        let pipeline = Pipeline::new(&self.device, shader, POSE_BINDINGS, exactness)?;
        Ok(Arc::clone(place.insert(Arc::new(pipeline))))
    }
}
