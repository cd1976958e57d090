//! Reports of an engine about itself: its choices for its device, and the time to compile its kernels.

use std::time::{Duration, Instant};

use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::pipeline::{Exactness, Pipeline};
use crate::machine::error::VulkanError;

/// The engine's choices for a device, where options are `Automatic`.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct EngineChoices {
    /// `samples` or `runs`: the work of neighbouring invocations ([`Mapping`](crate::machine::options::Mapping)).
    pub mapping: &'static str,
    /// `texel-buffers` or `storage-buffers`: how kernels read.
    pub reads: &'static str,
    /// `in-place` or `staged`: how results reach the host.
    pub transfer: &'static str,
    /// `same-queue`, `apart` or `copy-queue`: the queue on which staged results are copied.
    pub read_back: &'static str,
    /// `direct`, `small-direct` or `host`: the default of uploads to the device.
    pub uploads: &'static str,
    /// The number of keys from which on the device prepares the arcs of a clip; `None` where the host always does.
    pub arcs_prepared_from: Option<usize>,
    /// Whether kernels write into the caller's memory, which is imported.
    pub imports_memory: bool,
    /// The number of windows in flight.
    pub windows_in_flight: usize,
    /// The maximum number of rotations of a window.
    pub window: usize,
    /// The index of the queue family that computes.
    pub queue_family: u32,
    /// The index of the queue family that copies.
    pub copy_queue_family: u32,
}

impl VulkanEngine {
    /// Compiles every kernel and reports how long each took.
    pub(crate) fn compile_kernels(
        &self,
        each: &mut dyn FnMut(&'static str, Duration) -> bool,
    ) -> Result<(), VulkanError> {
        for code in self.bindable() {
            let started = Instant::now();
            let pipeline = Pipeline::new(&self.device, code.kernel, Exactness::Demanded)?;
            if !each(pipeline.name, started.elapsed()) {
                break;
            }
        }
        Ok(())
    }

    /// The choices for the device.
    pub(crate) fn choices(&self) -> EngineChoices {
        let device: &LogicalDevice = &self.device;
        let queues = [QueueLane::Kernels, QueueLane::Copies].map(|lane| device.family(lane));
        EngineChoices {
            mapping: if self.maps_samples { "samples" } else { "runs" },
            reads: match device.reads_texels {
                true => "texel-buffers",
                false => "storage-buffers",
            },
            transfer: match device.placing.in_place {
                true => "in-place",
                false => "staged",
            },
            read_back: match (device.copies_apart, device.has_copy_queue()) {
                (false, _) => "same-queue",
                (true, false) => "apart",
                (true, true) => "copy-queue",
            },
            uploads: match device.placing.direct {
                Some(direct) if direct.largest == u64::MAX => "direct",
                Some(_) => "small-direct",
                None => "host",
            },
            arcs_prepared_from: (self.prepares_arcs_from < usize::MAX)
                .then_some(self.prepares_arcs_from),
            imports_memory: self.imports && device.borrows.is_some(),
            windows_in_flight: self.in_flight_count,
            window: self.window(),
            queue_family: queues[0],
            copy_queue_family: queues[1],
        }
    }
}
