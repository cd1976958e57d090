//! A job: the samples of a clip on the device that are to be evaluated.

use std::sync::Arc;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::LogicalDevice;
use crate::gpu::kept_lists::ListCache;
use crate::gpu::submission::Binding;
use crate::gpu::work_list::GroupItems;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Kernel, List};
use crate::time::frames::Timeline;

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

    /// The buffers that the kernel binds for a group.
    pub(crate) fn bindings(
        &self,
        group: &GroupItems,
        listed: &[Binding],
        result: Binding,
    ) -> Vec<Binding> {
        let (segments, constants) = &self.buffers.groups[group.group];
        let mut all = vec![Binding::whole(segments), Binding::whole(constants)];
        all.extend(listed);
        all.push(result);
        all
    }

    /// The window of the whole result.
    pub(crate) fn whole(&self, layout: Layout) -> Window {
        Window::whole(self.clip.track_count(), self.timeline.len(), layout)
    }
}
