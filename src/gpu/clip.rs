//! Clips on a device, and jobs: the samples of a clip that are to be evaluated.

use std::any::Any;
use std::mem::take;
use std::sync::{Arc, Mutex};

use crate::gpu::buffer::Buffer;
use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::kept_lists::{KeptLists, ListCache};
use crate::gpu::recorded::Recorded;
use crate::gpu::recovery::Opened;
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
use crate::threads::lock;
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
