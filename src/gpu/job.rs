//! A job: the samples of a clip on the device that are to be evaluated.

use std::sync::Arc;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::LogicalDevice;
use crate::gpu::kept_lists::{KeptLists, ListCache};
use crate::gpu::recorded::Recorded;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Kernel, List};
use crate::time::frames::Timeline;
use crate::work::lists::Work;
use crate::work::recording::Resource;

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
