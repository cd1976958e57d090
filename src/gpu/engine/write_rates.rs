//! The rate at which a device writes its memory, by its time stamps.

use std::time::Duration;

use bytemuck::{NoUninit, Zeroable as _};

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::QueueLane;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::physical::DeviceKind;
use crate::gpu::submission::Submission;
use crate::machine::error::VulkanError;
use crate::shader::{
    BLOCK_SAMPLES, Block, Dispatch, Grid, IS_CONSTANT, ITEM_SAMPLES, Item, Kernel, SAMPLES_EACH,
};
use crate::work::recording::workgroups;

/// Rates at which a device writes its memory, bytes per second: medians of several runs, by the device's clock.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct WriteRates {
    /// The rate of the kernel that the engine uses on the device, for one constant. On cards, neighbouring
    /// invocations store neighbouring rotations.
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
        // No segment is read but the first.
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
        let item = Item {
            count: samples | IS_CONSTANT,
            ..Item::zeroed()
        };
        let grid = Grid {
            stride: 1,
            samples,
            rows: 1,
            ..Grid::zeroed()
        };
        let blocks = vec![Block::zeroed(); samples.div_ceil(BLOCK_SAMPLES) as usize];
        let items = upload(bytemuck::bytes_of(&item))?;
        let blocks = upload(bytemuck::cast_slice(&blocks))?;
        let buffers = [&constants, &constants, &items, &blocks, buffer];
        let groups = workgroups(samples.div_ceil(SAMPLES_EACH));
        self.rate(bytes, |submission| {
            let kernel = Kernel::ArcFramesCoalescedF32;
            self.dispatch_once(submission, kernel, &buffers, &grid, groups)
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

    /// The rate of recorded commands, bytes per second: the median of some runs.
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
