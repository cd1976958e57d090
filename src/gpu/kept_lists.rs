//! Lists that stay on the device: what a kernel reads of a result's samples depends on the clip, the
//! samples and the layout alone, so whoever asks for the same ones again needs none of it anew.

use std::sync::{Arc, Mutex};

use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::error::EvaluateError;
use crate::gpu::submission::{Binding, Submission};
use crate::gpu::upload::Upload;
use crate::gpu::work_list::{ListRequest, Work, WorkLists};
use crate::output::window::Window;
use crate::threads::{lock, on_threads};
use crate::time::frames::{Ticks, Timeline};

/// The lists of a result, window by window, in the memory of a device.
pub(crate) struct KeptLists {
    device: Arc<LogicalDevice>,
    /// In the order in which they lie in the result.
    pub(crate) windows: Vec<KeptWindow>,
}

/// The lists of one window.
pub(crate) struct KeptWindow {
    pub(crate) window: Window,
    pub(crate) work: Work,
    lists: WorkLists,
}

impl KeptWindow {
    /// What kernels bind of the lists, in their order.
    pub(crate) fn bindings(&self) -> Vec<Binding> {
        let uploads = self.lists.uploads(self.work.list).into_iter();
        uploads.filter_map(Upload::binding).collect()
    }
}

impl KeptLists {
    /// Lists all of a result, in windows of at most so many values, and brings the lists to the device.
    pub(crate) fn new(
        request: ListRequest<'_>,
        whole: &Window,
        values_per_window: usize,
    ) -> Result<Self, EvaluateError> {
        let mut windows = Vec::new();
        for window in whole.cut(values_per_window) {
            let mut lists = WorkLists::default();
            let list = || lists.list(request, &window);
            let work = on_threads(list)??;
            lists.forget_spare();
            windows.push(KeptWindow {
                window,
                work,
                lists,
            });
        }
        let device = request.device;
        let uploads = || {
            windows
                .iter()
                .flat_map(|kept| kept.lists.uploads(kept.work.list))
        };
        if uploads().any(Upload::is_copied) {
            let mut submission = Submission::new(device, QueueLane::Kernels)?;
            submission.begin(0)?;
            Upload::record(uploads(), &mut submission);
            submission.submit()?;
            submission.wait()?;
        }
        for window in &mut windows {
            window.lists.forget_written();
        }
        Ok(Self {
            device: Arc::clone(device),
            windows,
        })
    }

    /// The lists of a window of the result, where the result was cut as it is now.
    pub(crate) fn of(&self, window: &Window) -> Option<&KeptWindow> {
        let start = |kept: &KeptWindow| kept.window.start;
        let index = self
            .windows
            .partition_point(|kept| start(kept) < window.start);
        self.windows
            .get(index)
            .filter(|kept| kept.window == *window)
    }

    /// Bytes of the device's memory.
    fn bytes(&self) -> u64 {
        let windows = self.windows.iter();
        let uploads = windows.flat_map(|kept| kept.lists.uploads(kept.work.list));
        uploads.map(Upload::bytes).sum()
    }
}

/// More bytes of lists than this are not kept.
const MAX_BYTES: u64 = 256 << 20;

/// Results of which a clip keeps the lists.
const MAX_RESULTS: usize = 2;

/// The lists that a clip keeps, of frames at a rate: from the second time on that the same ones are asked for,
/// so that whoever never asks twice pays for none.
#[derive(Default)]
pub(crate) struct ListCache(Mutex<CachedLists>);

#[derive(Default)]
struct CachedLists {
    /// What was asked for last.
    last: Option<Asked>,
    /// What was asked for again, and whose lists are too long to keep.
    too_long: Option<Asked>,
    /// The latest first.
    lists: Vec<(Asked, Arc<KeptLists>)>,
}

/// The samples, what of them is the result, and the values of its windows.
type Asked = (Timeline, Window, usize);

impl ListCache {
    /// The lists of a result in windows of so many values, if they are kept or shall be from now on.
    pub(crate) fn lists(
        &self,
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
            (kept.lists).retain(|(_, lists)| Arc::ptr_eq(&lists.device, request.device));
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
        let made = match KeptLists::new(request, whole, values_per_window) {
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

    /// Lets go of all, where memory is short.
    pub(crate) fn forget(&self) {
        *lock(&self.0) = CachedLists::default();
    }
}
