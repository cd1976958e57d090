//! Clips on a device, and their recording into an application's commands.

use std::any::Any;
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::job::{ClipBuffers, Job, KeptLists, ListCache};
use crate::gpu::opened::Opened;
use crate::gpu::recorded::{Binding, CommandScopes, Commands, Recorded};
use crate::machine::MachineClip;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::threads::exclusive::Exclusive;
use crate::threads::lock;
use crate::time::frames::Timeline;
use crate::work::recording::Resource;

/// Prepared tracks, and their segments on a device.
pub(crate) struct VulkanClip {
    opened: Arc<Opened>,
    data: Arc<ClipData>,
    /// The segments on the device, which are uploaded again after the device was lost.
    buffers: Mutex<Option<Arc<ClipBuffers>>>,
    uploading: Exclusive<()>,
    /// The lists that the device reads for samples that were requested before.
    lists: ListCache,
}

impl VulkanClip {
    /// Uploads prepared tracks.
    pub(crate) fn new(opened: Arc<Opened>, data: ClipData) -> Result<Self, EvaluateError> {
        let buffers = opened.upload(&data, None)?;
        Ok(Self {
            opened,
            data: Arc::new(data),
            buffers: Mutex::new(Some(Arc::new(buffers))),
            uploading: Exclusive::default(),
            lists: ListCache::default(),
        })
    }

    /// The clip, if it is a Vulkan device's.
    pub(crate) fn of(clip: &dyn MachineClip) -> Option<&Self> {
        let clip: &dyn Any = clip;
        clip.downcast_ref()
    }

    /// Does some work on the device, again in smaller windows if memory runs out.
    pub(crate) fn on_device<T>(
        &self,
        timeline: &Timeline,
        encoding: Encoding,
        mut work: impl FnMut(&VulkanEngine, Job<'_>) -> Result<T, EvaluateError>,
    ) -> Result<T, EvaluateError> {
        self.opened.attempt_smaller(|engine| {
            let (clip, buffers) = (&self.data, &self.buffers_on(engine)?);
            let job = Job {
                clip,
                buffers,
                timeline,
                encoding,
                lists: &self.lists,
            };
            let done = work(engine, job);
            if let Err(EvaluateError::Vulkan(error)) = &done
                && error.is_out_of_memory()
            {
                self.lists.forget();
            }
            done
        })
    }

    /// The segments on a device; they are uploaded again if the device was replaced.
    fn buffers_on(&self, engine: &VulkanEngine) -> Result<Arc<ClipBuffers>, VulkanError> {
        let there = |buffers: &Option<Arc<ClipBuffers>>| {
            let there = buffers.as_ref().filter(|there| engine.owns(there));
            there.map(Arc::clone)
        };
        if let Some(there) = there(&lock(&self.buffers)) {
            return Ok(there);
        }
        // Only one caller uploads at a time. No lock is held during the upload.
        let _uploading = self.uploading.take();
        let old = {
            let mut buffers = lock(&self.buffers);
            if let Some(there) = there(&buffers) {
                return Ok(there);
            }
            buffers.take()
        };
        drop(old);
        let made = Arc::new(engine.upload(&self.data, None)?);
        *lock(&self.buffers) = Some(Arc::clone(&made));
        Ok(made)
    }
}

impl MachineClip for VulkanClip {
    fn data(&self) -> &Arc<ClipData> {
        &self.data
    }

    fn evaluate(
        &self,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Box<dyn Storage>, EvaluateError> {
        self.on_device(timeline, Encoding::F32, |engine, job| {
            engine.evaluate(job, layout)
        })
    }

    fn evaluate_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        let EncodedOutput { encoding, bytes } = output;
        self.on_device(timeline, encoding, |engine, job| {
            engine.evaluate_into(job, window, bytes)
        })
    }

    fn take_segments(&mut self) -> Vec<Prepared> {
        ClipData::take_groups(&mut self.data)
    }

    fn replace(&mut self, data: ClipData) -> Result<(), EvaluateError> {
        // The kept lists belong to the old tracks.
        self.lists.forget();
        self.data = Arc::new(data);
        let old = lock(&self.buffers).take();
        let made = (self.opened).upload(&self.data, old.and_then(Arc::into_inner))?;
        *lock(&self.buffers) = Some(Arc::new(made));
        Ok(())
    }
}

/// A range of an application's buffer for results of one size.
pub(crate) struct ResultRange {
    pub(crate) encoding: Encoding,
    buffer: VulkanBuffer,
    /// The offset at which the buffer is bound, bytes.
    bound: u64,
    /// The length of a result, bytes.
    pub(crate) bytes: u64,
}

impl ResultRange {
    pub(super) fn new(
        engine: &VulkanEngine,
        encoding: Encoding,
        buffer: VulkanBuffer,
        values: usize,
    ) -> Result<Self, VulkanError> {
        let each = encoding.bytes() as u64;
        let range = Self {
            encoding,
            buffer,
            bound: engine.binding_before(buffer.offset, each),
            bytes: values as u64 * each,
        };
        (engine.device.physical).check_range("the buffer", range.binding().size)?;
        Ok(range)
    }

    pub(super) fn binding(&self) -> Binding {
        let VulkanBuffer {
            buffer,
            offset,
            size,
        } = self.buffer;
        Binding::range(buffer, self.bound, offset + size - self.bound)
    }

    /// The index in the binding of the first value of a result that starts `offset` bytes after the range's start.
    pub(super) fn first(&self, offset: u64) -> Result<u32, VulkanError> {
        let each = self.encoding.bytes() as u64;
        let fits = offset
            .checked_add(self.bytes)
            .is_some_and(|end| end <= self.buffer.size);
        if !fits || !offset.is_multiple_of(each) {
            return Err(VulkanError::ResultOffset {
                offset,
                size: self.buffer.size,
                rotation: each,
                needed: self.bytes,
            });
        }
        Ok(((self.buffer.offset + offset - self.bound) / each) as u32)
    }
}

/// Samples of a clip, prepared for recording into an application's commands, and the buffer for the result
/// ([`Request::target`](crate::engine::clip::request::Request::target)). The work lists are on the device already:
/// recording does not allocate.
pub struct ClipTarget {
    engine: Arc<VulkanEngine>,
    lists: KeptLists,
    /// The recording, whose steps depend on the offset and are recorded again each time.
    work: Mutex<Recorded>,
    result: Resource,
    range: ResultRange,
    // The descriptor sets refer to this buffer. The caller guarantees that no work that uses it is in flight when the
    // target is dropped.
    _segments: Arc<ClipBuffers>,
}

impl ClipTarget {
    pub(crate) fn new(
        engine: &Arc<VulkanEngine>,
        job: Job<'_>,
        whole: &Window,
        buffer: VulkanBuffer,
    ) -> Result<Self, EvaluateError> {
        let range = ResultRange::new(engine, job.encoding, buffer, whole.len())?;
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
        let result = work.resource(range.binding());
        job.add_kept_sets(&lists, &mut work, result);
        work.bind(|kernel| engine.pipeline(kernel))?;
        let target = Self {
            engine: Arc::clone(engine),
            lists,
            work: Mutex::new(work),
            result,
            range,
            _segments: Arc::clone(job.buffers),
        };
        // Record once now, so that later recordings need not allocate memory for their steps.
        target.fill(&mut lock(&target.work), 0);
        Ok(target)
    }

    /// Records the steps for a result that starts at this value of the buffer's binding.
    fn fill(&self, work: &mut Recorded, first: u32) {
        let recording = &mut work.recording;
        recording.clear_steps();
        recording.wait_for_all();
        let stored = self.engine.stored(self.range.encoding, 0, first);
        self.lists.record(recording, self.result, stored);
    }

    /// The length of the result in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.range.bytes
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
        // SAFETY: as the caller promises.
        unsafe { self.record_between(commands, offset, CommandScopes::default()) }
    }

    /// As [`ClipTarget::record`], with barriers only for the commands that use the result's memory (`scopes`): the
    /// evaluation waits for earlier ones, and later ones see the result.
    ///
    /// # Errors
    /// As for [`ClipTarget::record`].
    ///
    /// # Safety
    /// As for [`ClipTarget::record`]; and the application has its own barriers for other commands that use the result's
    /// memory. Each recording of the target itself uses it by kernels and copies.
    pub unsafe fn record_between(
        &self,
        commands: vk::CommandBuffer,
        offset: u64,
        scopes: CommandScopes,
    ) -> Result<(), VulkanError> {
        let first = self.range.first(offset)?;
        // SAFETY: as the caller promises.
        let commands = unsafe { Commands::new(&self.engine.device, commands) };
        let mut work = lock(&self.work);
        self.fill(&mut work, first);
        work.record(commands.between(scopes), &[]);
        Ok(())
    }
}

impl std::fmt::Debug for ClipTarget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ClipTarget")
            .field("encoding", &self.range.encoding)
            .field("bytes", &self.range.bytes)
            .finish_non_exhaustive()
    }
}
