//! Evaluation from keys on a Vulkan device, for sets with fewer samples than keys. Two dispatches are
//! in flight: the host writes the keys of one while the device works on the other.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use glam::Quat;

use crate::from_keys::KeyCurve;
use crate::from_keys::dispatches::{KeyDispatch, KeyJob};
use crate::from_keys::upload::Keys;
use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::{IN_FLIGHT, VulkanEngine, lock};
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::imported_memory::ImportedMemory;
use crate::gpu::in_flight::{Flight, Stopwatch, Target, copy, grow};
use crate::gpu::pipeline::Pipeline;
use crate::gpu::submission::{Access, Binding, Submission};
use crate::shader::{FROM_KEYS_WORKGROUP, Kernel};

/// What one dispatch in flight needs. The submission is the first field: dropped first, it waits for
/// its work to end before the buffers are freed.
pub(crate) struct KeysInFlight {
    submission: Submission,
    keys: Option<Buffer>,
    samples: Option<Buffer>,
    rotations: Option<Buffer>,
    weights: Option<Buffer>,
    /// The bytes of the result that the dispatch in flight makes.
    output: Range<usize>,
    /// Whether the pipeline had run before: the first run of one may compile it.
    compiled: bool,
}

/// The caller's memory, imported where possible.
struct Borrowed<'a> {
    /// The set's keys, where kernels read them in place.
    keys: Option<ImportedMemory<'a>>,
    target: Target<'a>,
}

impl VulkanEngine {
    /// Evaluates a job into `output`, which is exactly as long as the result.
    pub(crate) fn evaluate_keys(
        &self,
        job: &KeyJob<'_>,
        output: &mut [[f32; 4]],
    ) -> Result<(), EvaluateError> {
        let mut in_flight = lock(&self.keys_in_flight);
        while in_flight.len() < IN_FLIGHT {
            in_flight.push(KeysInFlight::new(&self.device)?);
        }
        let each = size_of::<Quat>();
        // A dispatch's result may begin at any rotation, and a binding must be able to as well.
        let info = &self.device.physical.info;
        let lends = self.lends && info.min_storage_buffer_offset_alignment <= each as u64;
        let output = bytemuck::cast_slice_mut(output);
        let mut imported = Borrowed {
            keys: (job.keys().filter(|_| lends && self.device.reads_texels))
                .and_then(|keys| ImportedMemory::to_read(&self.device, bytemuck::cast_slice(keys)))
                .filter(|keys| keys.start().is_multiple_of(each)),
            target: match lends {
                true => ImportedMemory::to_write(&self.device, output, each)
                    .map_or_else(Target::Slice, Target::ImportedMemory),
                false => Target::Slice(output),
            },
        };
        let mut stopwatch = Stopwatch::default();
        let mut next = 0;
        let mut result = self.submit_dispatches(
            job,
            &mut in_flight,
            &mut next,
            &mut imported,
            &mut stopwatch,
        );
        result = self.land(
            &mut in_flight,
            next,
            &mut imported.target,
            stopwatch,
            result,
        );
        if let (Some(keys), Ok(())) = (&mut imported.keys, &result) {
            keys.has_come_back();
        }
        result
    }

    fn submit_dispatches(
        &self,
        job: &KeyJob<'_>,
        in_flight: &mut [KeysInFlight],
        next: &mut usize,
        imported: &mut Borrowed<'_>,
        stopwatch: &mut Stopwatch,
    ) -> Result<(), EvaluateError> {
        let kernel = match job.curve {
            KeyCurve::Arcs => Kernel::FromKeysArcs,
            KeyCurve::TwoKeys => Kernel::FromKeysTwoKeys,
            KeyCurve::Cubics(_) => Kernel::FromKeysCubics,
        };
        let pipeline = self.pipeline(kernel)?;
        let mut dispatches = job.dispatches();
        let mut start = 0;
        loop {
            if stopwatch.is_slow() {
                self.halve_windows();
            }
            let Some(dispatch) = dispatches.next(self.window())? else {
                return Ok(());
            };
            *next = (*next + 1) % IN_FLIGHT;
            let evaluation = &mut in_flight[*next];
            evaluation.finish(&mut imported.target, stopwatch)?;
            let writing = Instant::now();
            let own = start..start + dispatch.rotation_count() * size_of::<Quat>();
            evaluation.start(self, &pipeline, &dispatch, imported, own.clone())?;
            stopwatch.timings.work_lists += writing.elapsed();
            start = own.end;
        }
    }
}

impl KeysInFlight {
    fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Ok(Self {
            submission: Submission::new(device)?,
            keys: None,
            samples: None,
            rotations: None,
            weights: None,
            output: 0..0,
            compiled: false,
        })
    }

    /// Submits one dispatch; `output` are the bytes of the whole result that it makes.
    fn start(
        &mut self,
        engine: &VulkanEngine,
        pipeline: &Pipeline,
        dispatch: &KeyDispatch<'_, '_>,
        imported: &Borrowed<'_>,
        output: Range<usize>,
    ) -> Result<(), EvaluateError> {
        let (device, maps_samples) = (&engine.device, engine.maps_samples);
        let [key_bytes, sample_bytes, mut rotation_bytes, weight_bytes] = dispatch.bytes();
        let place = match &imported.target {
            Target::ImportedMemory(memory) if !output.is_empty() => {
                rotation_bytes = 0;
                let start = memory.start() + output.start;
                let size = output.len() as u64;
                Some(Binding::range(memory.raw(), start as u64, size))
            }
            _ => None,
        };
        let upload = Residence::Upload;
        let samples = grow(device, &mut self.samples, sample_bytes as u64, upload)?;
        let weights = grow(device, &mut self.weights, weight_bytes as u64, upload)?;
        let own = &mut self.rotations;
        let rotations = grow(device, own, rotation_bytes as u64, Residence::Readback)?;
        let mut write = |keys: Keys<'_>| {
            dispatch.write(
                keys,
                bytemuck::cast_slice_mut(samples.bytes_mut(0..sample_bytes)),
                bytemuck::cast_slice_mut(weights.bytes_mut(0..weight_bytes)),
            )
        };
        let keys = match &imported.keys {
            Some(keys) if dispatch.keys_are_as_given() => {
                write(Keys::ImportedMemory(keys.start() / size_of::<Quat>()))?;
                keys.binding()
            }
            _ => {
                let keys = grow(device, &mut self.keys, key_bytes as u64, upload)?;
                let copied = bytemuck::cast_slice_mut(keys.bytes_mut(0..key_bytes));
                write(Keys::Copied(copied))?;
                Binding::whole(keys)
            }
        };
        let mut bindings = vec![keys, Binding::whole(samples)];
        if weight_bytes > 0 {
            bindings.push(Binding::whole(weights));
        }
        bindings.push(place.unwrap_or_else(|| Binding::whole(rotations)));
        let rows = dispatch.rows(maps_samples);
        let groups = [
            (rows.samples + rows.line).div_ceil(FROM_KEYS_WORKGROUP),
            rows.count.div_ceil(rows.each),
            1,
        ];
        self.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        self.submission.begin(1)?;
        self.submission
            .dispatch(pipeline, &bindings, bytemuck::bytes_of(&rows), groups)?;
        self.submission.barrier(Access::Kernel, Access::Host);
        self.submission.submit()?;
        self.output = output;
        Ok(())
    }
}

impl Flight for KeysInFlight {
    fn finish(
        &mut self,
        target: &mut Target<'_>,
        stopwatch: &mut Stopwatch,
    ) -> Result<(), VulkanError> {
        if let Some(spent) = self.submission.wait()? {
            stopwatch.ran(spent, self.compiled);
        }
        let copying = Instant::now();
        let own = std::mem::take(&mut self.output);
        if let (Target::Slice(output), Some(rotations)) = (target, &self.rotations) {
            copy(&mut output[own.clone()], rotations.bytes(0..own.len()));
        }
        stopwatch.timings.read_back += copying.elapsed();
        Ok(())
    }
}
