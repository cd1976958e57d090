//! Reports of an engine about itself: its choices for its device, the time to compile its kernels, and the rate at
//! which the device writes its memory.

use std::time::{Duration, Instant};

use bytemuck::{NoUninit, Zeroable as _};

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::engine::VulkanEngine;
use crate::gpu::physical::DeviceKind;
use crate::gpu::pipeline::{Exactness, Pipeline};
use crate::gpu::submission::Submission;
use crate::machine::error::VulkanError;
use crate::shader::{Dispatch, IS_CONSTANT, ITEM_SAMPLES, Item, Kernel, SpreadRun};
use crate::work::lists::spread::{NO_RUN, SpreadLanes};
use crate::work::recording::workgroups;

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
    /// The number of keys from which on the device prepares the arcs of a clip; `None` if the host always does.
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
        for code in self.runnable() {
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

/// Rates at which a device writes its memory in bytes per second: medians of several runs, by the device's clock.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct WriteRates {
    /// The rate of the kernel that the engine uses on the device, which here evaluates one constant. On cards,
    /// neighbouring invocations store neighbouring rotations.
    pub store: f64,
    /// The rate of `vkCmdFillBuffer`.
    pub fill: f64,
    /// The number of bytes of one run.
    pub bytes: u64,
}

impl WriteRates {
    /// The higher of the two rates, which no kernel exceeds for long.
    #[must_use]
    pub fn limit(&self) -> f64 {
        self.store.max(self.fill)
    }
}

/// A size that exceeds the caches.
const CARD_BYTES: u64 = 512 << 20;
const SOFTWARE_BYTES: u64 = 16 << 20;
const LEAST_BYTES: u64 = 1 << 20;

/// The number of runs, after one that is ignored.
const RUNS: usize = 7;

impl VulkanEngine {
    /// Measures the rates; `None` on a device without a clock.
    pub(crate) fn write_rates(&self) -> Result<Option<WriteRates>, VulkanError> {
        let physical = &self.device.physical;
        if physical.timestamp_bits() == 0 {
            return Ok(None);
        }
        let info = &physical.info;
        let limit = match info.kind {
            DeviceKind::Cpu | DeviceKind::Other => SOFTWARE_BYTES,
            _ => CARD_BYTES,
        };
        let limit = limit.min(info.max_storage_buffer_range);
        let mut bytes = limit.min(info.max_memory_allocation_size) / LEAST_BYTES * LEAST_BYTES;
        let buffer = loop {
            let name = "tumble write rate";
            match Buffer::new(&self.device, name, bytes, Residence::Results) {
                Err(error) if error.is_out_of_memory() && bytes > LEAST_BYTES => bytes /= 2,
                buffer => break buffer?,
            }
        };
        Ok(Some(WriteRates {
            store: self.store_rate(&buffer, bytes)?,
            fill: self.rate(bytes, |submission| {
                submission.commands().fill(&buffer, bytes, 0x3f80_0000);
                Ok(())
            })?,
            bytes,
        }))
    }

    /// The rate of the kernel for the device's mapping, for one constant.
    fn store_rate(&self, buffer: &Buffer, bytes: u64) -> Result<f64, VulkanError> {
        let samples = (bytes / size_of::<[f32; 4]>() as u64) as u32;
        let upload = |bytes: &[u8]| self.resident("tumble write rate", bytes, &mut Vec::new());
        // Only the first segment is read.
        let constants = upload(bytemuck::cast_slice(&[[0.0_f32, 0.0, 0.0, 1.0]; 2]))?;
        if !self.maps_samples {
            let items: Vec<Item> = (0..samples / ITEM_SAMPLES)
                .map(|item| Item {
                    output: item * ITEM_SAMPLES,
                    count: ITEM_SAMPLES | IS_CONSTANT,
                    ..Item::zeroed()
                })
                .collect();
            let dispatch = Dispatch {
                item_count: items.len() as u32,
                stride: 1,
                ..Dispatch::zeroed()
            };
            let items = upload(bytemuck::cast_slice(&items))?;
            let buffers = [&constants, &constants, &items, buffer];
            let groups = workgroups(dispatch.item_count);
            return self.rate(bytes, |submission| {
                self.dispatch_once(
                    submission,
                    Kernel::ArcFramesF32,
                    &buffers,
                    &dispatch,
                    groups,
                )
            });
        }
        // With eight lanes, each store fills a cache line.
        let lanes = SpreadLanes::new(3);
        let each = 128;
        let runs: Vec<SpreadRun> = (0..samples / each)
            .map(|run| SpreadRun {
                output: run * each,
                count: each | IS_CONSTANT,
                ..NO_RUN
            })
            .collect();
        let dispatch = lanes.dispatch([0, runs.len() as u32], 0, 0);
        let groups = lanes.workgroups(runs.len() as u32, 1);
        let runs = upload(bytemuck::cast_slice(&runs))?;
        let buffers = [&constants, &constants, &runs, buffer];
        self.rate(bytes, |submission| {
            let kernel = Kernel::ArcFramesSpreadF32;
            self.dispatch_once(submission, kernel, &buffers, &dispatch, groups)
        })
    }

    /// Records a dispatch over whole buffers.
    fn dispatch_once(
        &self,
        submission: &mut Submission,
        kernel: Kernel,
        buffers: &[&Buffer],
        push: &impl NoUninit,
        groups: [u32; 3],
    ) -> Result<(), VulkanError> {
        let work = &mut submission.work;
        let bindings: Vec<_> = (buffers.iter())
            .map(|buffer| work.whole(buffer).into())
            .collect();
        let set = work.recording.set(kernel, bindings);
        work.recording.dispatch(set, push, groups);
        work.bind(|kernel| self.pipeline(kernel))
    }

    /// The rate of recorded commands in bytes per second: the median of some runs.
    fn rate(
        &self,
        bytes: u64,
        record: impl Fn(&mut Submission) -> Result<(), VulkanError>,
    ) -> Result<f64, VulkanError> {
        let mut submission = Submission::new(&self.device, QueueLane::Kernels)?;
        let mut times: Vec<Duration> = Vec::new();
        for run in 0..=RUNS {
            submission.begin()?;
            record(&mut submission)?;
            let spent = submission.run()?;
            times.extend(spent.filter(|_| run > 0).map(|spent| spent.on_device));
        }
        times.sort_unstable();
        let median = times.get(times.len() / 2).copied().unwrap_or_default();
        Ok(bytes as f64 / median.as_secs_f64().max(1e-9))
    }
}
