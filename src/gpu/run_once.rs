//! One run of a kernel on data of the host, for checks and for poses.

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::QueueLane;
use crate::gpu::physical::upload_memory::KernelReads;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::Submission;
use crate::gpu::upload::Upload;
use crate::machine::error::VulkanError;
use crate::work::recording::Slice;

/// Runs a kernel once: copies inputs to the device, and its output back.
pub(crate) fn run_once(
    pipeline: &Pipeline,
    inputs: &[&[u8]],
    constants: &[u8],
    groups: [u32; 3],
    output: &mut [u8],
) -> Result<(), VulkanError> {
    run_over(pipeline, inputs, constants, groups, false, output)
}

/// As [`run_once`], with the previous contents of `output` in the kernel's output buffer.
pub(crate) fn run_on(
    pipeline: &Pipeline,
    inputs: &[&[u8]],
    constants: &[u8],
    groups: [u32; 3],
    output: &mut [u8],
) -> Result<(), VulkanError> {
    run_over(pipeline, inputs, constants, groups, true, output)
}

fn run_over(
    pipeline: &Pipeline,
    inputs: &[&[u8]],
    constants: &[u8],
    groups: [u32; 3],
    is_filled: bool,
    output: &mut [u8],
) -> Result<(), VulkanError> {
    let (name, once) = ("tumble once", KernelReads::Once);
    let mut uploads = Vec::with_capacity(inputs.len());
    for input in inputs {
        let mut upload = Upload::default();
        let room = upload.room(&pipeline.device, name, once, input.len())?;
        room.copy_from_slice(input);
        uploads.push(upload);
    }
    let bytes = output.len() as u64;
    let mut found = Buffer::new(&pipeline.device, name, bytes, Residence::InPlace)?;
    if is_filled {
        found.bytes_mut(0..output.len()).copy_from_slice(output);
        found.flush(&(0..output.len()))?;
    }
    // Created last, so that it is dropped first: it waits for its work before the buffers are freed.
    let mut submission = Submission::new(&pipeline.device, QueueLane::Kernels)?;
    submission.begin()?;
    let work = &mut submission.work;
    let mut bindings: Vec<Slice> = (uploads.iter())
        .filter_map(|upload| Some(upload.copied_in(work)?.into()))
        .collect();
    let result = work.whole(&found);
    // Kernels that store in one of two precisions have a binding for each. Both get the same buffer.
    bindings.resize(pipeline.kernel.compiled().bindings.len(), result.into());
    let set = work.recording.set(pipeline.kernel, bindings);
    work.recording.dispatch_with(set, constants, groups);
    work.recording.read_by_host(result);
    work.bind(|_| Ok(pipeline))?;
    submission.run()?;
    found.invalidate(&(0..output.len()))?;
    output.copy_from_slice(found.bytes(0..output.len()));
    Ok(())
}
