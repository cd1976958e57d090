//! The walk over a result's windows. Two are in flight: the host lists the work of one while the
//! device evaluates the other; three where a second queue brings back the one before.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::time::Instant;

use crate::gpu::engine::{Job, VulkanEngine, lock};
use crate::gpu::error::EvaluateError;
use crate::gpu::in_flight::{Finish, Flight as _, InFlight, Stopwatch, Target};
use crate::gpu::submission::{Access, Binding};
use crate::gpu::upload::Upload;
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::shader::{Dispatch, Kernel, LINE, List, WORKGROUP};

/// Bytes of the lines in which a card's memory is written, at most.
const LINE_BYTES: u64 = 128;

/// The last aligned offset that is a whole number of rotations before the start of a window; a
/// binding begins there.
fn aligned_before(start: u64, rotation: u64, alignment: u64) -> Option<u64> {
    let mut aligned = start / alignment * alignment;
    while !(start - aligned).is_multiple_of(rotation) {
        aligned = aligned.checked_sub(alignment)?;
    }
    Some(aligned)
}

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
        while in_flight.len() < self.in_flight_count.min(windows.len()) {
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
        let start = match target {
            Target::Buffer(_) => window.start as u64 * rotation,
            Target::ImportedMemory(memory) => {
                memory.start() as u64 + window.start as u64 * rotation
            }
            Target::External(buffer) => buffer.offset + window.start as u64 * rotation,
            Target::Slice(_) => 0,
        };
        let least = info.min_storage_buffer_offset_alignment.max(1);
        let lines = self.maps_samples.then_some(least.max(LINE_BYTES));
        let aligned = (lines.into_iter().chain([least]))
            .find_map(|alignment| aligned_before(start, rotation, alignment))
            .unwrap_or(0);
        let shift = (start - aligned) / rotation;
        let size = (window.len() as u64 + shift) * rotation;
        let (timeline, shift) = (job.timeline, shift as u32);
        let samples = self.maps_samples;
        let work = evaluation.list(&self.device, clip, timeline, &window, shift, samples)?;

        let is_grid = matches!(work.list, List::FramesCoalesced | List::TimesCoalesced);
        let is_timed = matches!(work.list, List::Times | List::TimesCoalesced);
        let (buffer, first) = match target {
            Target::Buffer(buffer) => (buffer.raw, aligned),
            Target::ImportedMemory(memory) => (memory.raw(), aligned),
            Target::External(buffer) => (buffer.raw, aligned),
            Target::Slice(_) => {
                let results = &mut evaluation.results;
                let own = results.room(&self.device, size, !self.in_place)?;
                (own.raw, 0)
            }
        };
        let rotations = Binding::range(buffer, first, size);
        evaluation.submission.begin(work.groups.len() as u32)?;
        let mut listed = vec![&evaluation.items];
        listed.extend(is_grid.then_some(&evaluation.blocks));
        listed.extend(is_timed.then_some(&evaluation.distances));
        Upload::record(listed.iter().copied(), &mut evaluation.submission);
        let listed: Vec<Binding> = listed.into_iter().filter_map(Upload::binding).collect();
        let form = clip.interpolation.form();
        let pipeline =
            self.pipeline(Kernel::over_segments(form, work.list, encoding.row().store))?;
        evaluation.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        let mut first_item = 0_u32;
        for own in work.groups {
            let item_count = own.items;
            if item_count == 0 {
                continue;
            }
            let group = &job.buffers.groups[own.group];
            let mut bindings = vec![
                Binding::whole(&group.segments),
                Binding::whole(&group.constants),
            ];
            bindings.extend(&listed);
            bindings.push(rotations);
            let detail = encoding.row().detail;
            let (grid, dispatch);
            let (arguments, groups) = match own.grid {
                Some(of_group) => {
                    grid = of_group.arguments(detail);
                    let most = info.max_compute_work_group_count[0];
                    (bytemuck::bytes_of(&grid), of_group.workgroups(most))
                }
                None => {
                    // Only samples have a first output.
                    let idle = match self.maps_samples {
                        true => own.first_output % LINE,
                        false => 0,
                    };
                    dispatch = Dispatch {
                        first_item: first_item.wrapping_sub(idle),
                        item_count,
                        stride: window.stride() as u32,
                        detail,
                        first_output: own.first_output - idle,
                        idle,
                    };
                    let groups = self.workgroups(item_count + idle);
                    (bytemuck::bytes_of(&dispatch), groups)
                }
            };
            evaluation
                .submission
                .dispatch(&pipeline, &bindings, arguments, groups)?;
            first_item += item_count;
        }
        let mut patches = work.patches;
        match target {
            Target::Slice(_) => {
                let results = &mut evaluation.results;
                results.submit(&mut evaluation.submission, size)?;
            }
            Target::External(buffer) => {
                evaluation.submission.barrier(Access::Kernel, Access::Copy);
                let mut bytes = vec![0; encoding.bytes()];
                for (place, value) in patches.drain(..) {
                    encoding.encode_all(&[value], &mut bytes);
                    let offset = start + place as u64 * rotation;
                    evaluation.submission.update(buffer.raw, offset, &bytes);
                }
                evaluation.submission.barrier(Access::Kernel, Access::Any);
                evaluation.submission.barrier(Access::Copy, Access::Any);
                evaluation.submission.submit()?;
            }
            Target::Buffer(_) | Target::ImportedMemory(_) => {
                evaluation.submission.barrier(Access::Kernel, Access::Host);
                evaluation.submission.submit()?;
            }
        }
        evaluation.done = Some(Finish {
            window,
            encoding,
            patches,
        });
        Ok(())
    }

    /// Enough workgroups for `items`, within the limit along x.
    pub(crate) fn workgroups(&self, items: u32) -> [u32; 3] {
        let groups = items.div_ceil(WORKGROUP);
        let x = groups.min(self.device.physical.info.max_compute_work_group_count[0]);
        [x, groups.div_ceil(x), 1]
    }
}
