//! Results that stay on a device, timed by the device's clock, and the rate at which the device writes its memory,
//! which limits them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::checks::check_encoding;
use crate::engine::Engine;
use crate::engine::clip::Clip;
use crate::error::Error;
use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::clip::VulkanClip;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::engine::figures::WriteRates;
use crate::gpu::handles::VulkanBuffer;
use crate::machine::error::VulkanError;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::time::frames::{SampleTimes, Timeline};

/// A clip with memory for one result on its device.
pub struct Resident<'a> {
    clip: &'a Clip,
    timeline: Timeline,
    layout: Layout,
    encoding: Encoding,
    bytes: u64,
    /// Made again after the device was opened again.
    buffer: Buffer,
}

/// The time of one evaluation whose result stayed on the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct ResidentTime {
    /// The time by the device's clock.
    pub on_device: Duration,
    /// The time by the host's clock, from the call to its return.
    pub on_host: Duration,
}

impl Engine {
    /// Measures the rate at which the device writes its memory, by the device's clock. `None` on the CPU, and on
    /// devices without a clock.
    ///
    /// # Errors
    /// When the device fails, or has no memory for the test.
    pub fn write_rates(&self) -> Result<Option<WriteRates>, Error> {
        let Some(opened) = self.opened() else {
            return Ok(None);
        };
        Ok(opened.engine().write_rates()?)
    }
}

impl Clip {
    /// Allocates device memory for a result of [`Resident::evaluate`]. `None` on the CPU, on devices without a clock,
    /// and on devices that cannot allocate the result at once.
    ///
    /// # Errors
    /// When the sample times do not fit the clip, or the device fails.
    pub fn resident(
        &self,
        frames: &SampleTimes,
        layout: Layout,
        encoding: Encoding,
    ) -> Result<Option<Resident<'_>>, Error> {
        let Some(opened) = self.engine().opened() else {
            return Ok(None);
        };
        check_encoding(encoding, self.quantity())?;
        let timeline = self.timeline(frames)?;
        let timeline = self.uploaded()?.data().folded(&timeline)?;
        let engine = opened.engine();
        let count = (self.track_count() * timeline.len()) as u64;
        let bytes = count.saturating_mul(encoding.bytes() as u64);
        let physical = &engine.device.physical;
        if physical.timestamp_bits() == 0 || bytes > physical.info.max_memory_allocation_size {
            return Ok(None);
        }
        let buffer = match room(&engine, bytes) {
            Err(error) if error.is_out_of_memory() => return Ok(None),
            buffer => buffer?,
        };
        Ok(Some(Resident {
            clip: self,
            timeline: timeline.into_owned(),
            layout,
            encoding,
            bytes,
            buffer,
        }))
    }
}

fn room(engine: &VulkanEngine, bytes: u64) -> Result<Buffer, VulkanError> {
    Buffer::new(&engine.device, "tumble resident", bytes, Residence::Results)
}

impl Resident<'_> {
    /// The size of the result in bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Evaluates into the device's memory. Nothing else may use the engine at the same time, because this takes the
    /// engine's timings ([`Engine::take_timings`]).
    ///
    /// # Errors
    /// As [`Clip::evaluate`].
    pub fn evaluate(&mut self) -> Result<ResidentTime, Error> {
        let on_device = VulkanClip::of(self.clip.uploaded()?.prepared()?);
        let on_device = on_device.ok_or(Error::BufferOnCpu)?;
        let (layout, bytes, buffer) = (self.layout, self.bytes, &mut self.buffer);
        let _ = self.clip.engine().take_timings();
        let started = Instant::now();
        on_device.on_device(&self.timeline, self.encoding, |engine, job| {
            if !Arc::ptr_eq(&engine.device, &buffer.device) {
                *buffer = room(engine, bytes)?;
            }
            let target = VulkanBuffer {
                buffer: buffer.raw,
                offset: 0,
                size: bytes,
            };
            engine.run_into(job, &job.whole(layout), target)
        })?;
        let on_host = started.elapsed();
        let on_device = self.clip.engine().take_timings().on_device;
        Ok(ResidentTime { on_device, on_host })
    }
}
