//! Recording of a clip's samples into an application's commands, with all resources prepared once.

use std::sync::Arc;

use ash::vk;

use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::job::{ClipBuffers, Job};
use crate::gpu::kept_lists::KeptLists;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::DescriptorPool;
use crate::gpu::submission::{Access, Binding, Commands};
use crate::output::encoding::Encoding;
use crate::output::window::Window;

/// Samples of a clip, prepared for recording into an application's commands, and the buffer for the result
/// ([`Request::target`](crate::engine::clip::request::Request::target)). The work lists are on the device already:
/// recording does not allocate.
pub struct ClipTarget {
    engine: Arc<VulkanEngine>,
    lists: KeptLists,
    pipelines: Vec<Arc<Pipeline>>,
    /// The descriptor set of each window and group that has work.
    sets: Vec<vk::DescriptorSet>,
    encoding: Encoding,
    buffer: VulkanBuffer,
    /// The offset at which the buffer is bound, bytes.
    bound: u64,
    /// The length of the result, bytes.
    bytes: u64,
    // What the sets are made of and lead to. Whoever records promises that no work that uses it is in
    // flight when the target is dropped.
    _pool: DescriptorPool,
    _segments: Arc<ClipBuffers>,
}

impl ClipTarget {
    pub(crate) fn new(
        engine: &Arc<VulkanEngine>,
        job: Job<'_>,
        whole: &Window,
        buffer: VulkanBuffer,
    ) -> Result<Self, EvaluateError> {
        let each = job.encoding.bytes() as u64;
        let bound = engine.binding_before(buffer.offset, each);
        let range = buffer.offset + buffer.size - bound;
        (engine.device.physical).check_range("the buffer", range)?;
        let values_per_window = engine
            .at_once()
            .unwrap_or_else(|| engine.window_of(job.encoding));
        let lists = KeptLists::new(engine.list_request(job), whole, values_per_window)?;
        let mut pool = DescriptorPool::new(&engine.device);
        let sets = lists
            .windows
            .iter()
            .map(|kept| kept.work.dispatched().count());
        pool.make_room(sets.sum::<usize>() as u32)?;
        let (mut pipelines, mut sets) = (Vec::new(), Vec::new());
        let result = Binding::range(buffer.buffer, bound, range);
        for kept in &lists.windows {
            let pipeline = engine.pipeline(job.kernel(kept.work.list))?;
            let listed = kept.bindings();
            for group in kept.work.dispatched() {
                sets.push(pool.set(&pipeline, &job.bindings(group, &listed, result))?);
            }
            pipelines.push(pipeline);
        }
        Ok(Self {
            engine: Arc::clone(engine),
            lists,
            pipelines,
            sets,
            encoding: job.encoding,
            buffer,
            bound,
            bytes: whole.len() as u64 * each,
            _pool: pool,
            _segments: Arc::clone(job.buffers),
        })
    }

    /// The length of the result, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Records an evaluation into the application's command buffer. The result starts `offset` bytes after the start
    /// of the target's range.
    ///
    /// Recording neither waits nor allocates. It records one dispatch for each two million values, and the bytes of
    /// the few values that the host computed, if any. Barriers are included: the evaluation waits for all commands
    /// recorded before it, and later commands see the result. The commands may be submitted any number of times.
    ///
    /// # Errors
    /// When the result does not fit at this offset, or `offset` is not a multiple of a value's size; then nothing is
    /// recorded.
    ///
    /// # Safety
    /// The command buffer must belong to the engine's device and to a queue family that can compute, and must be in
    /// the recording state, outside a render pass. The target and the clip's engine must live until the work has
    /// ended.
    pub unsafe fn record(
        &self,
        commands: vk::CommandBuffer,
        offset: u64,
    ) -> Result<(), VulkanError> {
        let each = self.encoding.bytes() as u64;
        let fits = offset
            .checked_add(self.bytes)
            .is_some_and(|end| end <= self.buffer.size);
        if !fits || !offset.is_multiple_of(each) {
            return Err(VulkanError::BufferRange {
                offset: self.buffer.offset.saturating_add(offset),
                size: self.buffer.size.saturating_sub(offset),
                rotation: each,
                needed: self.bytes,
            });
        }
        // SAFETY: promised by the caller.
        let commands = unsafe { Commands::new(&self.engine.device, commands) };
        commands.barrier(Access::Any, Access::Kernel);
        let start = self.buffer.offset + offset;
        let shift = ((start - self.bound) / each) as u32;
        let mut sets = self.sets.iter();
        for (kept, pipeline) in self.lists.windows.iter().zip(&self.pipelines) {
            let behind = shift + kept.window.start as u32;
            let like = [
                kept.window.stride() as u32,
                self.encoding.row().detail,
                behind,
            ];
            for (group, &set) in kept.work.dispatched().zip(&mut sets) {
                let (arguments, groups) = self.engine.dispatch_of(&kept.work, group, like);
                commands.dispatch(pipeline, set, arguments.bytes(), groups);
            }
        }
        for kept in &self.lists.windows {
            let start = start + kept.window.start as u64 * each;
            (kept.work).patch(commands, self.buffer.buffer, start, self.encoding);
        }
        commands.barrier(Access::Kernel, Access::Any);
        Ok(())
    }
}

impl std::fmt::Debug for ClipTarget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClipTarget")
            .field("encoding", &self.encoding)
            .field("bytes", &self.bytes)
            .finish_non_exhaustive()
    }
}
