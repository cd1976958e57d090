//! The walk over a result's windows. Two are in flight: the host lists the work of one while the
//! device evaluates the other.

use std::collections::VecDeque;
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::time::Instant;

use crate::gpu::buffer::Residence;
use crate::gpu::engine::{IN_FLIGHT, Job, VulkanEngine};
use crate::gpu::error::EvaluateError;
use crate::gpu::in_flight::{Finish, InFlight, Stopwatch, Target};
use crate::gpu::submission::{Access, Binding};
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::shader::{Dispatch, Kernel, List, WORKGROUP};

impl VulkanEngine {
    /// Evaluates a window of a result, cut into smaller windows that suit the device.
    pub(crate) fn run(
        &self,
        job: Job<'_>,
        window: &Window,
        mut target: Target<'_>,
    ) -> Result<(), EvaluateError> {
        let mut in_flight = self
            .in_flight
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        // `self.window()` counts rotations of 16 bytes; of larger ones a window holds fewer.
        let each = job.encoding.bytes().div_ceil(Encoding::F32.bytes());
        let cut = |window: &Window| window.cut((self.window() / each).max(1));
        let mut windows = VecDeque::from(cut(window));
        while in_flight.len() < IN_FLIGHT.min(windows.len()) {
            in_flight.push(InFlight::new(&self.device)?);
        }
        let mut next = 0;
        let mut result = Ok(());
        let mut stopwatch = Stopwatch::default();
        while let Some(window) = windows.pop_front() {
            if stopwatch.is_slow() && self.halve_windows() {
                let rest = std::iter::once(window).chain(windows);
                windows = rest.flat_map(|window| window.within(cut)).collect();
                continue;
            }
            next = (next + 1) % in_flight.len();
            let evaluation = &mut in_flight[next];
            result = evaluation
                .finish(job.encoding, &mut target, &mut stopwatch)
                .map_err(EvaluateError::from)
                .and_then(|()| {
                    let listing = Instant::now();
                    let started = self.start(evaluation, job, window, &target);
                    stopwatch.timings.work_lists += listing.elapsed();
                    started
                });
            if result.is_err() {
                break;
            }
        }
        // Also after an error: work that was submitted uses the caller's buffers.
        let oldest_first = in_flight.len();
        for i in 1..=oldest_first {
            let evaluation = &mut in_flight[(next + i) % oldest_first];
            let finished = evaluation.finish(job.encoding, &mut target, &mut stopwatch);
            result = result.and(finished.map_err(EvaluateError::from));
        }
        if let (Target::ImportedMemory(memory), Ok(())) = (&mut target, &result) {
            memory.has_come_back();
        }
        if stopwatch.is_slow() {
            self.halve_windows(); // those of the next call
        }
        if result.is_err() {
            in_flight.clear(); // a fence or a recording may be half way
        }
        *self.timings.lock().unwrap_or_else(PoisonError::into_inner) += stopwatch.timings;
        result
    }

    /// Submits one window.
    fn start(
        &self,
        evaluation: &mut InFlight,
        job: Job<'_>,
        window: Window,
        target: &Target<'_>,
    ) -> Result<(), EvaluateError> {
        let Job {
            clip,
            buffers,
            timeline,
            encoding,
        } = job;
        let rotation = encoding.bytes() as u64;
        let alignment = self
            .device
            .physical
            .info
            .min_storage_buffer_offset_alignment
            .max(1);
        let start = match target {
            Target::Buffer(_) => window.start as u64 * rotation,
            Target::ImportedMemory(memory) => {
                memory.start() as u64 + window.start as u64 * rotation
            }
            Target::External(buffer) => buffer.offset + window.start as u64 * rotation,
            Target::Slice(_) => 0,
        };
        // The binding begins at an aligned offset, a whole number of rotations before the window.
        let mut aligned = start / alignment * alignment;
        while !(start - aligned).is_multiple_of(rotation) {
            aligned -= alignment;
        }
        let shift = (start - aligned) / rotation;
        let size = (window.len() as u64 + shift) * rotation;
        let work = evaluation.list(&self.device, clip, timeline, &window, shift as u32)?;

        let staged_items = !self.in_place;
        if staged_items {
            InFlight::grow(
                &self.device,
                &mut evaluation.device_items,
                evaluation.items.size(),
                Residence::Device,
            )?;
            let size = evaluation.distances.size();
            InFlight::grow(
                &self.device,
                &mut evaluation.device_distances,
                size,
                Residence::Device,
            )?;
        }
        if matches!(target, Target::Slice(_)) {
            let residence = if self.in_place {
                Residence::Readback
            } else {
                Residence::Device
            };
            InFlight::grow(&self.device, &mut evaluation.rotations, size, residence)?;
            if !self.in_place {
                InFlight::grow(
                    &self.device,
                    &mut evaluation.readback,
                    size,
                    Residence::Readback,
                )?;
            }
        }
        evaluation.submission.begin(work.groups.len() as u32)?;
        let (mut items, mut distances) = (&evaluation.items, &evaluation.distances);
        if let (Some(own_items), Some(own_distances)) =
            (&evaluation.device_items, &evaluation.device_distances)
        {
            evaluation
                .submission
                .copy(items, own_items, 0, items.size());
            evaluation
                .submission
                .copy(distances, own_distances, 0, distances.size());
            evaluation.submission.barrier(Access::Copy, Access::Kernel);
            (items, distances) = (own_items, own_distances);
        }
        let rotations = match (target, &evaluation.rotations) {
            (Target::Buffer(buffer), _) => Binding::stretch(buffer.raw, aligned, size),
            (Target::ImportedMemory(memory), _) => Binding::stretch(memory.raw(), aligned, size),
            (Target::External(buffer), _) => Binding::stretch(buffer.raw, aligned, size),
            (Target::Slice(_), Some(buffer)) => Binding::stretch(buffer.raw, 0, size),
            (Target::Slice(_), None) => unreachable!("grown above"),
        };
        let form = clip.interpolation.form();
        let pipeline =
            self.pipeline(Kernel::over_segments(form, work.list, encoding.row().store))?;
        evaluation.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        let mut first_item = 0;
        for own in work.groups {
            let item_count = own.items;
            if item_count == 0 {
                continue;
            }
            let group = &buffers.groups[own.group];
            let mut bindings = vec![
                Binding::whole(&group.segments),
                Binding::whole(&group.constants),
                Binding::whole(items),
            ];
            if work.list == List::Times {
                bindings.push(Binding::whole(distances));
            }
            bindings.push(rotations);
            let dispatch = Dispatch {
                first_item,
                item_count,
                stride: window.stride() as u32,
                detail: encoding.row().detail,
                first_output: own.first_output,
            };
            let groups = self.workgroups(item_count);
            evaluation.submission.dispatch(
                &pipeline,
                &bindings,
                bytemuck::bytes_of(&dispatch),
                groups,
            )?;
            first_item += item_count;
        }
        let mut patches = work.patches;
        match (target, &evaluation.rotations, &evaluation.readback) {
            (Target::Slice(_), Some(rotations), Some(readback)) => {
                evaluation.submission.barrier(Access::Kernel, Access::Copy);
                evaluation.submission.copy(rotations, readback, 0, size);
                evaluation.submission.barrier(Access::Copy, Access::Host);
            }
            (Target::External(buffer), ..) => {
                evaluation.submission.barrier(Access::Kernel, Access::Copy);
                let mut bytes = vec![0; encoding.bytes()];
                for (place, value) in patches.drain(..) {
                    encoding.encode(&[value], &mut bytes);
                    let offset = start + place as u64 * rotation;
                    evaluation.submission.update(buffer.raw, offset, &bytes);
                }
                evaluation.submission.barrier(Access::Kernel, Access::Any);
                evaluation.submission.barrier(Access::Copy, Access::Any);
            }
            _ => evaluation.submission.barrier(Access::Kernel, Access::Host),
        }
        evaluation.submission.submit()?;
        evaluation.done = Some(Finish { window, patches });
        Ok(())
    }

    /// Enough workgroups for `items`, within the limit along x.
    pub(crate) fn workgroups(&self, items: u32) -> [u32; 2] {
        let groups = items.div_ceil(WORKGROUP);
        let x = groups.min(self.device.physical.info.max_compute_work_group_count[0]);
        [x, groups.div_ceil(x)]
    }
}
