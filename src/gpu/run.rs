//! The walk over a result's windows. Two are in flight: the host lists the work of one while the
//! device evaluates the other; three where a second queue brings back the one before.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::gpu::device::Lane;
use crate::gpu::engine::{Job, VulkanEngine};
use crate::gpu::error::EvaluateError;
use crate::gpu::in_flight::{Finish, InFlight, Kept, Target};
use crate::gpu::submission::{Access, Binding};
use crate::gpu::upload::Upload;
use crate::gpu::work_list::WorkLists;
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::shader::{Dispatch, Grid, Kernel, LINE, WORKGROUP};
use crate::threads::on_threads;

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
        // `self.window()` counts rotations of 16 bytes; of larger ones a window holds fewer.
        let each = job.encoding.bytes().div_ceil(Encoding::F32.bytes());
        let most = || (self.window() / each).max(1);
        // Each is cut again when its turn comes: windows may have been halved since.
        let windows = window.cut(most()).flat_map(|window| window.within(most()));
        self.fly(
            &self.in_flight,
            &mut target,
            windows,
            |own, target, window| self.start(own, job, &window, target),
        )
    }

    fn start(
        &self,
        own: &mut InFlight<WorkLists>,
        job: Job<'_>,
        window: &Window,
        target: &Target<'_>,
    ) -> Result<(), EvaluateError> {
        let (clip, encoding) = (job.clip, job.encoding);
        let rotation = encoding.bytes();
        let bytes = window.start * rotation..(window.start + window.len()) * rotation;
        let info = &self.device.physical.info;
        let place = target.place();
        let start = place.map_or(0, |(_, first)| first + bytes.start as u64);
        let rotation = rotation as u64;
        let least = info.min_storage_buffer_offset_alignment.max(1);
        let lines = self.maps_samples.then_some(least.max(LINE_BYTES));
        let aligned = (lines.into_iter().chain([least]))
            .find_map(|alignment| aligned_before(start, rotation, alignment))
            .unwrap_or(0);
        let shift = (start - aligned) / rotation;
        let size = (window.len() as u64 + shift) * rotation;
        let lists = &mut own.uploads;
        let list = || lists.list(self, clip, job.timeline, window, shift as u32);
        let work = on_threads(list)??;

        let staged = !self.device.placing.in_place;
        let buffer = match place {
            Some((buffer, _)) => buffer,
            None => (own.results.room(&self.device, size, staged)?).raw,
        };
        let rotations = Binding::range(buffer, aligned, size);
        let kernels = &mut own.results.kernels;
        kernels.begin(work.groups.len() as u32)?;
        let uploads = lists.uploads(work.list);
        Upload::record(uploads.iter().copied(), kernels);
        let listed: Vec<Binding> = uploads.into_iter().filter_map(Upload::binding).collect();
        let form = clip.interpolation.form();
        let (store, detail) = (encoding.row().store, encoding.row().detail);
        let pipeline = self.pipeline(Kernel::over_segments(form, work.list, store))?;
        own.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        let mut first_item = 0_u32;
        for group in work.groups {
            let item_count = group.items;
            if item_count == 0 {
                continue;
            }
            let (segments, constants) = &job.buffers.groups[group.group];
            let mut bindings = vec![Binding::whole(segments), Binding::whole(constants)];
            bindings.extend(&listed);
            bindings.push(rotations);
            let (grid, dispatch);
            let (arguments, groups) = match group.grid {
                Some(of_group) => {
                    grid = Grid {
                        detail,
                        ..of_group.arguments
                    };
                    let most = info.max_compute_work_group_count[0];
                    (bytemuck::bytes_of(&grid), of_group.workgroups(most))
                }
                None => {
                    // Only samples have a first output.
                    let idle = match self.maps_samples {
                        true => group.first_output % LINE,
                        false => 0,
                    };
                    dispatch = Dispatch {
                        first_item: first_item.wrapping_sub(idle),
                        item_count,
                        stride: window.stride() as u32,
                        detail,
                        first_output: group.first_output - idle,
                        idle,
                    };
                    let groups = self.workgroups(item_count + idle);
                    (bytemuck::bytes_of(&dispatch), groups)
                }
            };
            kernels.dispatch(&pipeline, &bindings, arguments, groups)?;
            first_item += item_count;
        }
        let external = match target {
            Target::External(range) => Some(range.buffer),
            Target::Exported(result) => Some(result.buffer.raw),
            _ => None,
        };
        if let Some(external) = external {
            let commands = kernels.commands();
            commands.barrier(Access::Kernel, Access::Copy);
            let mut value_bytes = vec![0; encoding.bytes()];
            for (place, value) in work.patches {
                encoding.encode_all(&[value], &mut value_bytes);
                let offset = start + place as u64 * rotation;
                commands.update(external, offset, &value_bytes);
            }
            commands.barrier(Access::Kernel, Access::Any);
            commands.barrier(Access::Copy, Access::Any);
            let Target::Exported(result) = target else {
                kernels.submit()?;
                own.done = None;
                return Ok(());
            };
            let written = Binding::range(external, start, window.len() as u64 * rotation);
            commands.release(written, self.device.family(Lane::Kernels));
            own.kept = Some(Kept {
                _segments: Arc::clone(job.buffers),
                _pipeline: pipeline,
            });
            let point = result.next_point();
            kernels.submit_between(None, point)?;
            result.has_submitted(point);
            own.done = None; // nothing is left for the host to do
            return Ok(());
        }
        own.results.submit(place.is_none().then_some(size))?;
        own.done = Some(Finish {
            output: bytes,
            encoding,
            patches: work.patches,
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
