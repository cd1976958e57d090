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
use crate::gpu::device::{Lane, LogicalDevice};
use crate::gpu::engine::{VulkanEngine, lock};
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::imported_memory::ImportedMemory;
use crate::gpu::in_flight::{Flight, Stopwatch, Target, copy};
use crate::gpu::memory_types::KernelReads;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::read_back::ReadBack;
use crate::gpu::submission::{Access, Binding, Submission};
use crate::gpu::upload::Upload;
use crate::shader::{FROM_KEYS_WORKGROUP, Kernel};

/// What one dispatch in flight needs. The submissions are the first fields: dropped first, they wait
/// for their work to end before the buffers are freed.
pub(crate) struct KeysInFlight {
    submission: Submission,
    results: ReadBack,
    keys: Upload,
    samples: Upload,
    weights: Upload,
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
        while in_flight.len() < self.in_flight_count {
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
            *next = (*next + 1) % in_flight.len();
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
            submission: Submission::new(device, Lane::Kernels)?,
            results: ReadBack::default(),
            keys: Upload::new("tumble keys", KernelReads::Once),
            samples: Upload::new("tumble samples", KernelReads::Once),
            weights: Upload::new("tumble weights", KernelReads::Once),
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
        let [key_bytes, sample_bytes, rotation_bytes, weight_bytes] = dispatch.bytes();
        let place = match &imported.target {
            Target::ImportedMemory(memory) if !output.is_empty() => {
                let start = memory.start() + output.start;
                let size = output.len() as u64;
                Some(Binding::range(memory.raw(), start as u64, size))
            }
            _ => None,
        };
        // One queue alone gains nothing by a copy: kernels then write where the host reads.
        let staged = !engine.in_place && device.copies_apart();
        let output_binding = match place {
            Some(place) => place,
            None => {
                let size = rotation_bytes as u64;
                Binding::whole(self.results.room(device, size, staged)?)
            }
        };
        let samples = self.samples.room(device, sample_bytes)?;
        let weights = self.weights.room(device, weight_bytes)?;
        let mut write = |keys: Keys<'_>| {
            dispatch.write(
                keys,
                bytemuck::cast_slice_mut(samples),
                bytemuck::cast_slice_mut(weights),
            )
        };
        let as_given = imported.keys.as_ref();
        let as_given = as_given.filter(|_| dispatch.keys_are_as_given());
        match as_given {
            Some(keys) => write(Keys::ImportedMemory(keys.start() / size_of::<Quat>()))?,
            None => {
                let copied = self.keys.room(device, key_bytes)?;
                write(Keys::Copied(bytemuck::cast_slice_mut(copied)))?;
            }
        }
        let mut uploads = vec![&self.samples];
        uploads.extend((weight_bytes > 0).then_some(&self.weights));
        let mut bindings = Vec::new();
        match as_given {
            Some(keys) => bindings.push(keys.binding()),
            None => uploads.insert(0, &self.keys),
        }
        bindings.extend(uploads.iter().filter_map(|upload| upload.binding()));
        bindings.push(output_binding);
        let rows = dispatch.rows(maps_samples);
        let groups = [
            (rows.samples + rows.line).div_ceil(FROM_KEYS_WORKGROUP),
            rows.count.div_ceil(rows.each),
            1,
        ];
        self.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        self.submission.begin(1)?;
        Upload::record(uploads.into_iter(), &mut self.submission);
        self.submission
            .dispatch(pipeline, &bindings, bytemuck::bytes_of(&rows), groups)?;
        match place {
            Some(_) => {
                self.submission.barrier(Access::Kernel, Access::Host);
                self.submission.submit()?;
            }
            None => {
                let size = rotation_bytes as u64;
                self.results.submit(&mut self.submission, size)?;
            }
        }
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
        if let Some(spent) = self.results.wait(&mut self.submission)? {
            stopwatch.ran(spent, self.compiled);
        }
        let copying = Instant::now();
        let own = std::mem::take(&mut self.output);
        if let Target::Slice(output) = target {
            copy(&mut output[own.clone()], self.results.bytes(0..own.len()));
        }
        stopwatch.timings.read_back += copying.elapsed();
        Ok(())
    }
}
