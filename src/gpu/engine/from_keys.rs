//! Evaluation from keys on a Vulkan device, for sets with fewer samples than keys. Two or three dispatches are in
//! flight: the host writes the keys of one while the device evaluates the others.

use std::iter::from_fn;
use std::ops::Range;
use std::sync::atomic::Ordering;

use glam::Quat;

use crate::from_keys::KeyCurve;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::external::ImportedMemory;
use crate::gpu::in_flight::{Finish, InFlight, Target};
use crate::gpu::physical::upload_memory::KernelReads;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::recorded::Binding;
use crate::gpu::upload::Upload;
use crate::machine::error::EvaluateError;
use crate::output::encoding::Encoding;
use crate::shader::{FROM_KEYS_WORKGROUP, Kernel};
use crate::work::lists::keys::{KeyDispatch, KeyJob};
use crate::work::recording::Slice;

/// The data that the host writes for one dispatch.
#[derive(Default)]
pub(crate) struct KeyUploads {
    keys: Upload,
    samples: Upload,
    weights: Upload,
}

impl VulkanEngine {
    /// Evaluates a job into `output`, which is exactly as long as the result.
    pub(crate) fn evaluate_keys(
        &self,
        job: &KeyJob<'_>,
        output: &mut [[f32; 4]],
    ) -> Result<(), EvaluateError> {
        let pipeline = self.pipeline(match job.curve {
            KeyCurve::Arcs => Kernel::FromKeysArcs,
            KeyCurve::TwoKeys => Kernel::FromKeysTwoKeys,
            KeyCurve::Cubics(_) => Kernel::FromKeysCubics,
        })?;
        let mut dispatches = job.dispatches(self.window())?;
        let each = size_of::<Quat>();
        // The result of a dispatch may begin at any rotation, so the device must allow bindings at every multiple of 16
        // bytes.
        let info = &self.device.physical.info;
        let imports = self.imports && info.min_storage_buffer_offset_alignment <= each as u64;
        // The set's keys as imported memory, if kernels can read them there.
        let mut keys = (job.keys().filter(|_| imports && self.device.reads_texels))
            .and_then(|keys| ImportedMemory::to_read(&self.device, bytemuck::cast_slice(keys)))
            .filter(|keys| keys.start.is_multiple_of(each));
        let output = bytemuck::cast_slice_mut(output);
        let mut target = Target::of(&self.device, imports, output, each);
        let dispatches = from_fn(|| dispatches.next(self.window()));
        let mut end = 0;
        let result = self.run_pipelined(
            &self.keys_in_flight,
            &mut target,
            dispatches,
            |flight, target, dispatch| {
                let start = end;
                end += dispatch.rotation_count() * each;
                let output = start..end;
                self.start_keys(flight, &pipeline, &dispatch, keys.as_ref(), target, output)
            },
        );
        if let (Some(keys), Ok(())) = (&mut keys, &result) {
            keys.has_come_back();
        }
        result
    }

    /// Submits one dispatch. `output` is the range of bytes in the whole result that it writes; `keys` are the bytes
    /// of the set's keys if kernels can read them in place.
    fn start_keys(
        &self,
        flight: &mut InFlight<KeyUploads>,
        pipeline: &Pipeline,
        dispatch: &KeyDispatch<'_, '_>,
        keys: Option<&ImportedMemory<'_>>,
        target: &Target<'_>,
        output: Range<usize>,
    ) -> Result<(), EvaluateError> {
        let device = &self.device;
        let size = output.len() as u64;
        let destination = target.destination();
        // With only one queue, a separate copy would not be faster, so kernels write directly into the host's memory.
        let staged = !device.placing.in_place && device.copies_apart;
        let rotations = match destination {
            Some((buffer, first)) => Binding::range(buffer, first + output.start as u64, size),
            None => Binding::whole(flight.results.room(device, size, staged)?),
        };
        let [key_bytes, sample_bytes, weight_bytes] = dispatch.bytes();
        let (uploads, once) = (&mut flight.uploads, KernelReads::Once);
        let in_place = keys.filter(|_| dispatch.has_no_negated_key());
        let keys = match in_place {
            Some(_) => &mut [],
            None => {
                let room = (uploads.keys).room(device, "tumble keys", once, key_bytes)?;
                bytemuck::cast_slice_mut(room)
            }
        };
        let samples = (uploads.samples).room(device, "tumble samples", once, sample_bytes)?;
        let weights = (uploads.weights).room(device, "tumble weights", once, weight_bytes)?;
        dispatch.write(
            in_place.map(|keys| keys.start / size_of::<Quat>()),
            keys,
            bytemuck::cast_slice_mut(samples),
            bytemuck::cast_slice_mut(weights),
        )?;
        let weights = (weight_bytes > 0).then_some(&uploads.weights);
        let rows = dispatch.rows(self.maps_samples);
        let groups = [
            (rows.samples + rows.line).div_ceil(FROM_KEYS_WORKGROUP),
            rows.count.div_ceil(rows.each),
            1,
        ];
        flight.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        let kernels = &mut flight.results.kernels;
        kernels.begin()?;
        let work = &mut kernels.work;
        let keys = match in_place {
            Some(keys) => Some(work.whole(&keys.buffer)),
            None => uploads.keys.copied_in(work),
        };
        let samples = uploads.samples.copied_in(work);
        let weights = weights.and_then(|weights| weights.copied_in(work));
        let result = work.resource(rotations);
        let bindings = [keys, samples, weights, Some(result)];
        let bindings = bindings.into_iter().flatten().map(Slice::from);
        let set = work.recording.set(pipeline.kernel, bindings);
        work.recording.dispatch(set, &rows, groups);
        work.bind(|_| Ok(pipeline))?;
        let size = destination.is_none().then_some(size);
        flight.results.submit(result, size, None)?;
        flight.done = Some(Finish {
            output,
            encoding: Encoding::F32,
            patches: Vec::new(),
        });
        Ok(())
    }
}
