//! A clip's segments on a device, the samples that are evaluated of it, and the lists of samples that are requested again.

use std::sync::{Arc, Mutex};

use crate::gpu::buffer::Buffer;
use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::physical::upload_memory::KernelReads;
use crate::gpu::recorded::Recorded;
use crate::gpu::submission::Submission;
use crate::gpu::upload::Upload;
use crate::machine::error::EvaluateError;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Kernel, List};
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
            List::Samples | List::Frames | List::FramesSpread => vec![items],
            List::Times | List::TimesSpread => vec![items, distances],
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

    /// The size in device memory in bytes.
    fn bytes(&self) -> u64 {
        let windows = self.windows.iter();
        let uploads = windows.flat_map(|kept| kept.lists.uploads(kept.work.list));
        uploads.map(Upload::bytes).sum()
    }
}

/// The maximum size of kept lists in bytes.
const MAX_BYTES: u64 = 256 << 20;

/// The number of results whose lists a clip keeps.
const MAX_RESULTS: usize = 2;

/// The lists that a clip keeps for frames at a rate. They are kept when they are requested for the second time, so that
/// single requests take no memory for them.
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
            // Lists on a device that was lost cannot be used any more.
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
        // Created without a lock. If several callers create the same lists, the last ones are kept.
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
