//! The walk over a result's windows. Two are in flight: the host lists the work of one while the
//! device evaluates the other.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::time::Instant;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::engine::{IN_FLIGHT, Job, VulkanEngine, lock};
use crate::gpu::error::EvaluateError;
use crate::gpu::in_flight::{Finish, Flight as _, InFlight, Stopwatch, Target, grow};
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
        let mut in_flight = lock(&self.in_flight);
        // `self.window()` counts rotations of 16 bytes; of larger ones a window holds fewer.
        let each = job.encoding.bytes().div_ceil(Encoding::F32.bytes());
        let most = || (self.window() / each).max(1);
        let mut windows: VecDeque<Window> = window.cut(most()).collect();
        while in_flight.len() < IN_FLIGHT.min(windows.len()) {
            in_flight.push(InFlight::new(&self.device)?);
        }
        let mut next = 0;
        let mut result = Ok(());
        let mut stopwatch = Stopwatch::default();
        while let Some(window) = windows.pop_front() {
            if stopwatch.is_slow() && self.halve_windows() {
                let rest = std::iter::once(window).chain(windows);
                windows = rest.flat_map(|window| window.within(most())).collect();
                continue;
            }
            next = (next + 1) % in_flight.len();
            let evaluation = &mut in_flight[next];
            result = evaluation
                .finish(&mut target, &mut stopwatch)
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
        self.land(&mut in_flight, next, &mut target, stopwatch, result)
    }

    /// Submits one window.
    fn start(
        &self,
        evaluation: &mut InFlight,
        job: Job<'_>,
        window: Window,
        target: &Target<'_>,
    ) -> Result<(), EvaluateError> {
        let (clip, encoding) = (job.clip, job.encoding);
        let rotation = encoding.bytes() as u64;
        let info = &self.device.physical.info;
        let alignment = info.min_storage_buffer_offset_alignment.max(1);
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
        let work = evaluation.list(&self.device, clip, job.timeline, &window, shift as u32)?;

        let room = |kept: &mut Option<Buffer>, size: u64, residence| {
            grow(&self.device, kept, size, residence).map(|_| ())
        };
        if !self.in_place {
            let (items, distances) = (evaluation.items.size(), evaluation.distances.size());
            room(&mut evaluation.device_items, items, Residence::Device)?;
            room(
                &mut evaluation.device_distances,
                distances,
                Residence::Device,
            )?;
        }
        if matches!(target, Target::Slice(_)) {
            let residence = if self.in_place {
                Residence::Readback
            } else {
                Residence::Device
            };
            room(&mut evaluation.rotations, size, residence)?;
            if !self.in_place {
                room(&mut evaluation.readback, size, Residence::Readback)?;
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
            (Target::Buffer(buffer), _) => Binding::range(buffer.raw, aligned, size),
            (Target::ImportedMemory(memory), _) => Binding::range(memory.raw(), aligned, size),
            (Target::External(buffer), _) => Binding::range(buffer.raw, aligned, size),
            (Target::Slice(_), Some(buffer)) => Binding::range(buffer.raw, 0, size),
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
            let group = &job.buffers.groups[own.group];
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
                    encoding.encode_all(&[value], &mut bytes);
                    let offset = start + place as u64 * rotation;
                    evaluation.submission.update(buffer.raw, offset, &bytes);
                }
                evaluation.submission.barrier(Access::Kernel, Access::Any);
                evaluation.submission.barrier(Access::Copy, Access::Any);
            }
            _ => evaluation.submission.barrier(Access::Kernel, Access::Host),
        }
        evaluation.submission.submit()?;
        evaluation.done = Some(Finish {
            window,
            encoding,
            patches,
        });
        Ok(())
    }

    /// Enough workgroups for `items`, within the limit along x.
    pub(crate) fn workgroups(&self, items: u32) -> [u32; 2] {
        let groups = items.div_ceil(WORKGROUP);
        let x = groups.min(self.device.physical.info.max_compute_work_group_count[0]);
        [x, groups.div_ceil(x)]
    }
}
