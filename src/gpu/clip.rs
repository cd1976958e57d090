//! Clips on a device: their segments, the lists of samples that are requested again, and their recording into an
//! application's commands.

use std::any::Any;
use std::mem::take;
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::opened::Opened;
use crate::gpu::recorded::{Binding, Commands, Recorded};
use crate::gpu::submission::Submission;
use crate::gpu::upload::{KernelReads, Upload};
use crate::machine::MachineClip;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::shader::{Kernel, List};
use crate::threads::exclusive::Exclusive;
use crate::threads::{lock, on_threads};
use crate::time::frames::{Ticks, Timeline};
use crate::work::lists::{ListRequest, ListRoom, Lister, Stored, Work};
use crate::work::recording::{Recording, Resource};

/// The segments and constants of a clip, on the device.
pub(crate) struct ClipBuffers {
    pub(crate) device: Arc<LogicalDevice>,
    /// The segments of each group, and its constants.
    pub(crate) groups: Vec<(Buffer, Buffer)>,
}

/// The samples to evaluate, and their encoding.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) clip: &'a ClipData,
    pub(crate) buffers: &'a Arc<ClipBuffers>,
    pub(crate) timeline: &'a Timeline,
    pub(crate) encoding: Encoding,
    /// The lists that the clip keeps on the device.
    pub(crate) lists: &'a ListCache,
}

impl Job<'_> {
    /// The kernel for a kind of list.
    pub(crate) fn kernel(&self, list: List) -> Kernel {
        let form = self.clip.interpolation.form();
        Kernel::over_segments(form, list, self.encoding.row().store)
    }

    /// Adds the kernel of each group of a window that has work for the device, with the lists of the window and the
    /// result.
    pub(crate) fn add_sets(
        &self,
        work: &mut Recorded,
        listed: &Work,
        lists: &[Resource],
        result: Resource,
    ) {
        for group in listed.dispatched() {
            let (segments, constants) = &self.buffers.groups[group.group];
            let read = [segments, constants].map(|buffer| work.whole(buffer));
            let all = read.iter().chain(lists).chain([&result]);
            let bindings = all.map(|&resource| resource.into());
            work.recording.set(self.kernel(listed.list), bindings);
        }
    }

    /// Adds the kernels of all windows of kept lists.
    pub(crate) fn add_kept_sets(&self, kept: &KeptLists, work: &mut Recorded, result: Resource) {
        for window in &kept.windows {
            let lists = window.resources(work);
            self.add_sets(work, &window.work, &lists, result);
        }
    }

    /// The window of the whole result.
    pub(crate) fn whole(&self, layout: Layout) -> Window {
        Window::whole(self.clip.track_count(), self.timeline.len(), layout)
    }
}

/// Prepared tracks, and their segments on a device.
pub(crate) struct VulkanClip {
    opened: Arc<Opened>,
    data: ClipData,
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
            data,
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
        // One caller at a time uploads, and nothing is locked while it does.
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
    fn data(&self) -> &ClipData {
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
        take(&mut self.data.groups)
    }

    fn replace(&mut self, data: ClipData) -> Result<(), EvaluateError> {
        // They are of the other tracks.
        self.lists.forget();
        self.data = data;
        let old = lock(&self.buffers).take();
        let made = (self.opened).upload(&self.data, old.and_then(Arc::into_inner))?;
        *lock(&self.buffers) = Some(Arc::new(made));
        Ok(())
    }
}

/// The lists of a window for upload to the device, in memory that is kept for the next window.
#[derive(Default)]
pub(crate) struct WorkLists {
    uploads: ListUploads,
    lister: Lister,
}

#[derive(Default)]
struct ListUploads {
    /// Items, or the samples of a sample list.
    items: Upload,
    distances: Upload,
    /// The blocks of a grid.
    blocks: Upload,
}

impl<'r> ListRoom<'r> for (&'r mut ListUploads, &Arc<LogicalDevice>) {
    type Error = EvaluateError;

    fn room(self, bytes: [Option<usize>; 3]) -> Result<[&'r mut [u8]; 3], EvaluateError> {
        let (uploads, device) = self;
        let mut room: [&mut [u8]; 3] = Default::default();
        let all = [
            ("tumble items", &mut uploads.items),
            ("tumble distances", &mut uploads.distances),
            ("tumble blocks", &mut uploads.blocks),
        ];
        for (((name, upload), bytes), room) in all.into_iter().zip(bytes).zip(&mut room) {
            if let Some(bytes) = bytes {
                *room = upload.room(device, name, KernelReads::Often, bytes)?;
            }
        }
        Ok(room)
    }
}

impl WorkLists {
    /// Lists the work of a window. Must be called on one of the engine's threads.
    pub(crate) fn list(
        &mut self,
        device: &Arc<LogicalDevice>,
        request: ListRequest<'_>,
        window: &Window,
    ) -> Result<Work, EvaluateError> {
        let memory = (&mut self.uploads, device);
        self.lister.list(request, window, memory)
    }

    /// Frees the buffers that the device has copied.
    fn forget_written(&mut self) {
        let ListUploads {
            items,
            distances,
            blocks,
        } = &mut self.uploads;
        for upload in [items, distances, blocks] {
            upload.forget_written();
        }
    }

    /// The uploads of a list that kernels read, in the order of their bindings.
    pub(crate) fn uploads(&self, list: List) -> Vec<&Upload> {
        let ListUploads {
            items,
            distances,
            blocks,
        } = &self.uploads;
        match list {
            List::Samples | List::Frames => vec![items],
            List::Times => vec![items, distances],
            List::FramesCoalesced => vec![items, blocks],
            List::TimesCoalesced => vec![items, blocks, distances],
        }
    }
}

/// The lists of a result, window by window, in device memory.
pub(crate) struct KeptLists {
    device: Arc<LogicalDevice>,
    /// The windows, in the order of the result.
    pub(crate) windows: Vec<KeptWindow>,
}

/// The lists of one window.
pub(crate) struct KeptWindow {
    pub(crate) window: Window,
    pub(crate) work: Work,
    lists: WorkLists,
}

impl KeptWindow {
    /// The lists as resources of this work, in the order of the kernels' bindings.
    pub(crate) fn resources(&self, work: &mut Recorded) -> Vec<Resource> {
        let uploads = self.lists.uploads(self.work.list).into_iter();
        uploads
            .filter_map(|upload| upload.resource_of(work))
            .collect()
    }
}

impl KeptLists {
    /// Makes the lists of the whole result, in windows of at most this number of values, and uploads them.
    pub(crate) fn new(
        device: &Arc<LogicalDevice>,
        request: ListRequest<'_>,
        whole: &Window,
        values_per_window: usize,
    ) -> Result<Self, EvaluateError> {
        let mut windows = Vec::new();
        for window in whole.cut(values_per_window) {
            let mut lists = WorkLists::default();
            let list = || lists.list(device, request, &window);
            let work = on_threads(list)??;
            lists.lister = Lister::default(); // only the next list would use it
            windows.push(KeptWindow {
                window,
                work,
                lists,
            });
        }
        let uploads = || {
            windows
                .iter()
                .flat_map(|kept| kept.lists.uploads(kept.work.list))
        };
        if uploads().any(Upload::is_copied) {
            let mut submission = Submission::new(device, QueueLane::Kernels)?;
            submission.begin()?;
            let work = &mut submission.work;
            for upload in uploads() {
                upload.copied_in(work);
            }
            work.recording.publish();
            submission.run()?;
        }
        for window in &mut windows {
            window.lists.forget_written();
        }
        Ok(Self {
            device: Arc::clone(device),
            windows,
        })
    }

    /// The lists of a window of the result, if the result is divided in the same way as now.
    pub(crate) fn of(&self, window: &Window) -> Option<&KeptWindow> {
        let start = |kept: &KeptWindow| kept.window.start;
        let index = self
            .windows
            .partition_point(|kept| start(kept) < window.start);
        self.windows
            .get(index)
            .filter(|kept| kept.window == *window)
    }

    /// Records all windows, with the sets of `Job::add_kept_sets`. `stored` is where the whole result is stored.
    pub(crate) fn record(&self, recording: &mut Recording, result: Resource, stored: Stored) {
        let of_window = |window: &Window| Stored {
            first: stored.first + window.start as u32,
            stride: window.stride() as u32,
            ..stored
        };
        let mut sets = recording.all_sets();
        for kept in &self.windows {
            (kept.work).record(recording, &mut sets, of_window(&kept.window));
        }
        for kept in &self.windows {
            (kept.work).patch(recording, result, of_window(&kept.window));
        }
        recording.publish();
    }

    /// The size in device memory, bytes.
    fn bytes(&self) -> u64 {
        let windows = self.windows.iter();
        let uploads = windows.flat_map(|kept| kept.lists.uploads(kept.work.list));
        uploads.map(Upload::bytes).sum()
    }
}

/// The maximum size of kept lists, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// The number of results whose lists a clip keeps.
const MAX_RESULTS: usize = 2;

/// The lists that a clip keeps for frames at a rate. They are kept from the second time that the same ones are
/// requested, so that single requests cost nothing.
#[derive(Default)]
pub(crate) struct ListCache(Mutex<CachedLists>);

#[derive(Default)]
struct CachedLists {
    /// The last request.
    last: Option<Asked>,
    /// The repeated request whose lists are too long to keep.
    too_long: Option<Asked>,
    /// Kept lists, the latest first.
    lists: Vec<(Asked, Arc<KeptLists>)>,
}

/// A request: the samples, the window of the result, and the number of values of its windows.
type Asked = (Timeline, Window, usize);

impl ListCache {
    /// The lists of a result in windows of this number of values, if they are kept or are to be kept from now on.
    pub(crate) fn lists(
        &self,
        device: &Arc<LogicalDevice>,
        request: ListRequest<'_>,
        whole: &Window,
        values_per_window: usize,
    ) -> Result<Option<Arc<KeptLists>>, EvaluateError> {
        if !matches!(request.timeline.ticks, Ticks::Frames { .. }) {
            return Ok(None);
        }
        let asked = (request.timeline.clone(), whole.clone(), values_per_window);
        {
            let mut kept = lock(&self.0);
            // Those of a device that was lost are of no use.
            (kept.lists).retain(|(_, lists)| Arc::ptr_eq(&lists.device, device));
            if let Some(index) = kept.lists.iter().position(|(known, _)| *known == asked) {
                kept.lists[..=index].rotate_right(1);
                return Ok(Some(Arc::clone(&kept.lists[0].1)));
            }
            let is_new = kept.last.replace(asked.clone()).as_ref() != Some(&asked);
            if is_new || kept.too_long.as_ref() == Some(&asked) {
                return Ok(None);
            }
        }
        // Nothing is locked while they are made. Of several callers who make the same, the last one's stay.
        let made = match KeptLists::new(device, request, whole, values_per_window) {
            Err(EvaluateError::Vulkan(error)) if error.is_out_of_memory() => None,
            made => Some(Arc::new(made?)).filter(|made| made.bytes() <= MAX_BYTES),
        };
        let mut kept = lock(&self.0);
        match &made {
            Some(made) => {
                kept.lists.truncate(MAX_RESULTS - 1);
                kept.lists.insert(0, (asked, Arc::clone(made)));
            }
            None => kept.too_long = Some(asked),
        }
        Ok(made)
    }

    /// Drops all lists, if memory is short.
    pub(crate) fn forget(&self) {
        *lock(&self.0) = CachedLists::default();
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
