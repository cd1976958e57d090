//! Prepared tracks on an engine's device.

use std::sync::{Arc, Mutex, PoisonError};

use crate::evaluate::Backend;
use crate::evaluate::plan::segment_bytes;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::job::{ClipBuffers, Job};
use crate::gpu::kept_lists::ListCache;
use crate::gpu::recovery::Opened;
use crate::memory::{OutOfMemoryError, refuse_more_than_there_is};
use crate::method::interpolation::Interpolation;
use crate::output::buffer::OutputBuffer;
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::prepared::{Prepared, SEGMENTS};
use crate::threads::exclusive::Exclusive;
use crate::threads::lock;
use crate::time::frames::Timeline;
use crate::tracks::set::TrackSet;

/// Prepared tracks, and their segments on a Vulkan device.
pub(crate) struct Uploaded {
    backend: Arc<Backend>,
    pub(crate) data: ClipData,
    /// The segments on the device, which are uploaded again after the device was lost.
    buffers: Mutex<Option<Arc<ClipBuffers>>>,
    uploading: Exclusive<()>,
    /// The lists that a device reads for samples that were requested before.
    lists: ListCache,
    /// The set, if its segments exceed the engine's memory limit; then nothing is prepared before the evaluation.
    pub(crate) unprepared: Option<TrackSet>,
}

impl Uploaded {
    /// Prepares the requested tracks of a set, and uploads them to a Vulkan device. The buffers of `spare`, which are
    /// no longer needed, are reused if they are large enough.
    pub(crate) fn new(
        backend: &Arc<Backend>,
        set: &TrackSet,
        interpolation: Interpolation,
        mut to_prepare: PrepareRequest<'_>,
        spare: Option<ClipBuffers>,
    ) -> Result<Self, EvaluateError> {
        let limits = backend.limits();
        to_prepare.group_bytes = limits.group_bytes;
        to_prepare.lists_arcs = limits.prepares_arcs(to_prepare.batch.keys(set));
        let data = ClipData::new(set, interpolation, to_prepare)?;
        Self::of_data(backend, data, spare)
    }

    /// Uploads data that is prepared already.
    pub(crate) fn of_data(
        backend: &Arc<Backend>,
        data: ClipData,
        spare: Option<ClipBuffers>,
    ) -> Result<Self, EvaluateError> {
        let upload = |opened: &Opened| opened.upload(&data, spare).map(Arc::new);
        let buffers = backend.opened().map(upload).transpose()?;
        Ok(Self {
            backend: Arc::clone(backend),
            data,
            buffers: Mutex::new(buffers),
            uploading: Exclusive::default(),
            lists: ListCache::default(),
            unprepared: None,
        })
    }

    /// Prepares a whole set, for any timeline; nothing if its segments exceed the engine's memory limit.
    pub(crate) fn whole(
        backend: &Arc<Backend>,
        set: &TrackSet,
        interpolation: Interpolation,
    ) -> Result<Self, EvaluateError> {
        let needed = segment_bytes(set, &interpolation);
        if backend.limits().memory.is_none_or(|limit| needed <= limit) {
            refuse_more_than_there_is::<u8>(needed, SEGMENTS)?;
            return Self::new(backend, set, interpolation, PrepareRequest::all(set), None);
        }
        Ok(Self {
            backend: Arc::clone(backend),
            data: ClipData::unprepared(set, interpolation)?,
            buffers: Mutex::default(),
            uploading: Exclusive::default(),
            lists: ListCache::default(),
            unprepared: Some(set.clone()),
        })
    }

    /// The memory that the next clip can reuse: that of the segments, and their buffers on a device.
    pub(crate) fn into_spare(self) -> (Vec<Prepared>, Option<ClipBuffers>) {
        let buffers = self.buffers.into_inner();
        let buffers = buffers.unwrap_or_else(PoisonError::into_inner);
        (self.data.groups, buffers.and_then(Arc::into_inner))
    }

    /// Evaluates all tracks; the result stays in memory of the device where that saves a copy. Explicit times must have
    /// been folded into the time range of the keys by the wrap mode ([`ClipData::folded`]).
    pub(crate) fn evaluate(
        &self,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Box<dyn Storage>, EvaluateError> {
        match &*self.backend {
            Backend::Vulkan(opened) => {
                self.on_device(opened, timeline, Encoding::F32, |engine, job| {
                    engine.evaluate(job, layout)
                })
            }
            Backend::Cpu(engine) => {
                let whole = Window::whole(self.data.track_count(), timeline.len(), layout);
                let mut quats = OutputBuffer::new(whole.len())?;
                let output = bytemuck::cast_slice_mut(&mut quats);
                engine.evaluate(&self.data, timeline, &whole, output)?;
                Ok(Box::new(quats))
            }
        }
    }

    /// Evaluates a window of the result into `output`, which is exactly as long. The timeline is as in
    /// [`Uploaded::evaluate`].
    pub(crate) fn evaluate_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError> {
        match &*self.backend {
            Backend::Cpu(engine) => Ok(match output.into_values() {
                Ok(values) => engine.evaluate(&self.data, timeline, window, values),
                Err(encoded) => engine.evaluate_encoded(&self.data, timeline, window, encoded),
            }?),
            Backend::Vulkan(opened) => {
                let EncodedOutput { encoding, bytes } = output;
                self.on_device(opened, timeline, encoding, |engine, job| {
                    engine.evaluate_into(job, window, bytes)
                })
            }
        }
    }

    /// Does some work on a Vulkan device, again in smaller windows if memory runs out.
    pub(crate) fn on_device<T>(
        &self,
        opened: &Opened,
        timeline: &Timeline,
        encoding: Encoding,
        mut work: impl FnMut(&VulkanEngine, Job<'_>) -> Result<T, EvaluateError>,
    ) -> Result<T, EvaluateError> {
        if let Some(set) = &self.unprepared {
            let needed = segment_bytes(set, &self.data.interpolation);
            return Err(OutOfMemoryError::new::<u8>(SEGMENTS, needed).into());
        }
        opened.attempt_smaller(|engine| {
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
