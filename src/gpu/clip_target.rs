//! Recording of a clip's samples into an application's commands, with all resources prepared once.

use std::sync::{Arc, Mutex};

use ash::vk;

use crate::gpu::clip::{ClipBuffers, Job};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::kept_lists::KeptLists;
use crate::gpu::recorded::{Binding, Commands, Recorded};
use crate::machine::error::{EvaluateError, VulkanError};
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::threads::lock;
use crate::work::recording::Resource;

/// Samples of a clip, prepared for recording into an application's commands, and the buffer for the result
/// ([`Request::target`](crate::engine::clip::request::Request::target)). The work lists are on the device already:
/// recording does not allocate.
pub struct ClipTarget {
    engine: Arc<VulkanEngine>,
    lists: KeptLists,
    /// The recording, whose steps depend on the offset and are recorded again each time.
    work: Mutex<Recorded>,
    result: Resource,
    encoding: Encoding,
    buffer: VulkanBuffer,
    /// The offset at which the buffer is bound, bytes.
    bound: u64,
    /// The length of the result, bytes.
    bytes: u64,
    // The sets lead to it. Whoever records promises that no work that uses it is in flight when the target is
    // dropped.
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
        let lists = KeptLists::new(
            &engine.device,
            engine.list_request(job),
            whole,
            values_per_window,
        )?;
        let mut work = Recorded::new(&engine.device);
        let result = work.resource(Binding::range(buffer.buffer, bound, range));
        job.add_kept_sets(&lists, &mut work, result);
        work.bind(|kernel| engine.pipeline(kernel))?;
        let target = Self {
            engine: Arc::clone(engine),
            lists,
            work: Mutex::new(work),
            result,
            encoding: job.encoding,
            buffer,
            bound,
            bytes: whole.len() as u64 * each,
            _segments: Arc::clone(job.buffers),
        };
        // Later recordings have memory for their steps.
        target.fill(&mut lock(&target.work), 0);
        Ok(target)
    }

    /// Records the steps for a result that starts at this value of the buffer's binding.
    fn fill(&self, work: &mut Recorded, first: u32) {
        let recording = &mut work.recording;
        recording.clear_steps();
        recording.wait_for_all();
        let stored = self.engine.stored(self.encoding, 0, first);
        self.lists.record(recording, self.result, stored);
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
        let first = (self.buffer.offset + offset - self.bound) / each;
        let mut work = lock(&self.work);
        self.fill(&mut work, first as u32);
        work.record(commands, &[]);
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
