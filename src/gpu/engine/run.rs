//! Evaluation of a result window by window. Two windows are in flight: the host lists the work of one while the
//! device evaluates the other; three if a second queue copies results back.

use std::mem::take;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use crate::gpu::device::QueueLane;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::in_flight::{Finish, InFlight, KeptAlive, Stopwatch, Target};
use crate::gpu::job::Job;
use crate::gpu::kept_lists::KeptLists;
use crate::gpu::submission::{Access, Binding, Submission};
use crate::gpu::upload::Upload;
use crate::gpu::work_list::{GroupItems, Work, WorkLists};
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::prepare::error::SetError;
use crate::shader::{Dispatch, Grid, Item, LINE, List, WORKGROUP};
use crate::threads::exclusive::Exclusive;
use crate::threads::{lock, on_threads, stop};

/// The maximum size of the lines in which a card's memory is written, bytes.
const LINE_BYTES: u64 = 128;

/// The largest aligned offset that is a whole number of rotations before the start of a window, for a binding.
fn aligned_before(start: u64, rotation: u64, alignment: u64) -> Option<u64> {
    let mut aligned = start / alignment * alignment;
    while !(start - aligned).is_multiple_of(rotation) {
        aligned = aligned.checked_sub(alignment)?;
    }
    Some(aligned)
}

/// The push constants of one dispatch over segments.
#[derive(Clone, Copy)]
pub(crate) enum Arguments {
    /// For a grid, in which neighbouring invocations evaluate neighbouring samples.
    Grid(Grid),
    /// For items, or for listed samples.
    Listed(Dispatch),
}

impl Arguments {
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Self::Grid(grid) => bytemuck::bytes_of(grid),
            Self::Listed(dispatch) => bytemuck::bytes_of(dispatch),
        }
    }
}

impl VulkanEngine {
    /// The number of values of a window in this encoding. `self.window()` is for rotations of 16 bytes; for larger
    /// values it is smaller.
    pub(crate) fn window_of(&self, encoding: Encoding) -> usize {
        let each = encoding.bytes().div_ceil(Encoding::F32.bytes());
        (self.window() / each).max(1)
    }

    /// Evaluates a window of a result into an application's buffer.
    pub(crate) fn run_into(
        &self,
        job: Job<'_>,
        window: &Window,
        buffer: VulkanBuffer,
    ) -> Result<(), EvaluateError> {
        if let Some(values_per_window) = self.at_once()
            && self.binds_at_once(job, window)
            && let Some(kept) = self.kept_lists(job, window, values_per_window)?
        {
            return self.run_kept(job, &kept, &buffer);
        }
        self.run(job, window, Target::External(buffer), None)
    }

    /// The lists of a result that the host reads, if the same result was requested before.
    pub(crate) fn kept(
        &self,
        job: Job<'_>,
        window: &Window,
    ) -> Result<Option<Arc<KeptLists>>, EvaluateError> {
        self.kept_lists(job, window, self.window_of(job.encoding))
    }

    /// The lists that a clip keeps of a result, in windows of this number of values; `None` under a memory budget.
    fn kept_lists(
        &self,
        job: Job<'_>,
        whole: &Window,
        values_per_window: usize,
    ) -> Result<Option<Arc<KeptLists>>, EvaluateError> {
        if self.clip_bytes.is_some() {
            return Ok(None);
        }
        (job.lists).lists(self.list_request(job), whole, values_per_window)
    }

    /// Evaluates a window of a result, divided into smaller windows that suit the device.
    pub(crate) fn run(
        &self,
        job: Job<'_>,
        window: &Window,
        mut target: Target<'_>,
        kept: Option<&KeptLists>,
    ) -> Result<(), EvaluateError> {
        let max_values = || self.window_of(job.encoding);
        // Each is cut again before it starts: windows may have been halved since.
        let windows = window
            .cut(max_values())
            .flat_map(|window| window.within(max_values()));
        self.run_pipelined(
            &self.in_flight,
            &mut target,
            windows,
            |flight, target, window| self.start(flight, job, kept, &window, target),
        )
    }

    fn start(
        &self,
        flight: &mut InFlight<WorkLists>,
        job: Job<'_>,
        kept: Option<&KeptLists>,
        window: &Window,
        target: &Target<'_>,
    ) -> Result<(), EvaluateError> {
        let encoding = job.encoding;
        let rotation = encoding.bytes();
        let bytes = window.start * rotation..(window.start + window.len()) * rotation;
        let destination = target.destination();
        let start = destination.map_or(0, |(_, first)| first + bytes.start as u64);
        let rotation = rotation as u64;
        let aligned = self.binding_before(start, rotation);
        let shift = (start - aligned) / rotation;
        let size = (window.len() as u64 + shift) * rotation;

        let staged = !self.device.placing.in_place;
        let buffer = match destination {
            Some((buffer, _)) => buffer,
            None if matches!(target, Target::Staged(_)) => {
                (flight.results.room_apart(&self.device, size)?).raw
            }
            None => (flight.results.room(&self.device, size, staged)?).raw,
        };
        let rotations = Binding::range(buffer, aligned, size);
        let kernels = &mut flight.results.kernels;
        let (listed, fresh);
        let work = match kept.and_then(|kept| kept.of(window)) {
            Some(kept) => {
                kernels.begin(kept.work.groups.len() as u32)?;
                listed = kept.bindings();
                &kept.work
            }
            None => {
                let lists = &mut flight.uploads;
                let list = || lists.list(self.list_request(job), window);
                fresh = on_threads(list)??;
                kernels.begin(fresh.groups.len() as u32)?;
                let uploads = lists.uploads(fresh.list);
                Upload::record(uploads.iter().copied(), kernels);
                listed = uploads.into_iter().filter_map(Upload::binding).collect();
                &fresh
            }
        };
        let pipeline = self.pipeline(job.kernel(work.list))?;
        flight.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        let stride = window.stride() as u32;
        for group in work.dispatched() {
            let bindings = job.bindings(group, &listed, rotations);
            let like = [stride, encoding.row().detail, shift as u32];
            let (arguments, groups) = self.dispatch_of(work, group, like);
            kernels.dispatch(&pipeline, &bindings, arguments.bytes(), groups)?;
        }
        let external = match target {
            Target::External(range) => Some(range.buffer),
            Target::Exported(result) => Some(result.buffer.raw),
            _ => None,
        };
        if let Some(external) = external {
            let commands = kernels.commands();
            work.patch(commands, external, start, encoding);
            commands.barrier(Access::Kernel, Access::Any);
            let Target::Exported(result) = target else {
                kernels.submit()?;
                flight.done = None;
                return Ok(());
            };
            let written = Binding::range(external, start, window.len() as u64 * rotation);
            commands.release(written, self.device.family(QueueLane::Kernels));
            flight.kept = Some(KeptAlive {
                _segments: Arc::clone(job.buffers),
                _pipeline: pipeline,
            });
            let point = result.next_point();
            kernels.submit_between(None, point)?;
            result.has_submitted(point);
            flight.done = None; // nothing is left for the host to do
            return Ok(());
        }
        let apart = match target {
            Target::Staged(buffer) => Some((&**buffer, bytes.start as u64)),
            _ => None,
        };
        let size = destination.is_none().then_some(size);
        flight.results.submit_to(size, apart)?;
        flight.done = Some(Finish {
            output: bytes,
            encoding,
            patches: work.patches.clone(),
        });
        Ok(())
    }

    /// The start of a binding for a value at `start`: on cards the start of a memory line, and a whole number of
    /// values before `start`.
    pub(crate) fn binding_before(&self, start: u64, rotation: u64) -> u64 {
        let info = &self.device.physical.info;
        let least = info.min_storage_buffer_offset_alignment.max(1);
        let lines = self.maps_samples.then_some(least.max(LINE_BYTES));
        (lines.into_iter().chain([least]))
            .find_map(|alignment| aligned_before(start, rotation, alignment))
            .unwrap_or(0)
    }

    /// The dispatch of a group of a window. `like` is the stride of its samples, the parameter of the store, and the
    /// index of the window's first value in the binding.
    pub(crate) fn dispatch_of(
        &self,
        work: &Work,
        group: &GroupItems,
        [stride, detail, shift]: [u32; 3],
    ) -> (Arguments, [u32; 3]) {
        let max_x = self.device.physical.info.max_compute_work_group_count[0];
        if let Some(of_group) = group.grid {
            let mut grid = Grid {
                detail,
                ..of_group.arguments
            };
            match grid.stride {
                1 => grid.shift = shift,
                _ => grid.first_output += shift,
            }
            return (Arguments::Grid(grid), of_group.workgroups(max_x));
        }
        let first_output = group.first_output + shift;
        // Only samples lie one after another.
        let idle = match self.maps_samples && work.list == List::Samples {
            true => first_output % LINE,
            false => 0,
        };
        let dispatch = Dispatch {
            first_item: group.first_item.wrapping_sub(idle),
            item_count: group.items,
            stride,
            detail,
            first_output: first_output - idle,
            idle,
        };
        let groups = self.workgroups(group.items + idle);
        (Arguments::Listed(dispatch), groups)
    }

    /// The number of values of a window whose results stay on a card, which is too fast for long windows to be a
    /// problem; `None` on slow devices.
    pub(crate) fn at_once(&self) -> Option<usize> {
        const AT_ONCE: usize = 1 << 24;
        let info = &self.device.physical.info;
        let largest = (info.max_storage_buffer_range).min(info.max_memory_allocation_size);
        let listed = largest / size_of::<Item>() as u64 / 2;
        (self.maps_samples).then(|| AT_ONCE.min(usize::try_from(listed).unwrap_or(AT_ONCE)))
    }

    /// Whether the whole result fits one binding.
    fn binds_at_once(&self, job: Job<'_>, whole: &Window) -> bool {
        let bytes = (whole.len() * job.encoding.bytes()) as u64 + LINE_BYTES;
        let range = self.device.physical.info.max_storage_buffer_range;
        bytes <= range.min(u64::from(u32::MAX))
    }

    /// Evaluates all windows of a result whose lists are kept, in one submission, into an application's buffer.
    fn run_kept(
        &self,
        job: Job<'_>,
        kept: &KeptLists,
        target: &VulkanBuffer,
    ) -> Result<(), EvaluateError> {
        let mut in_flight = self.in_flight.take();
        if in_flight.is_empty() {
            in_flight.push(InFlight::new(&self.device)?);
        }
        let (flight, mut stopwatch) = (&mut in_flight[0], Stopwatch::default());
        // Work on a result that is exported may still go on.
        let mut finish = |flight: &mut InFlight<WorkLists>| {
            flight.finish(&mut Target::External(*target), &mut stopwatch)
        };
        let result = finish(flight)
            .and_then(|()| self.submit_kept(&mut flight.results.kernels, job, kept, target))
            .and_then(|()| finish(flight));
        if result.is_err() {
            in_flight.clear(); // a fence or a recording may be half way
        }
        *lock(&self.timings) += stopwatch.timings;
        Ok(result?)
    }

    fn submit_kept(
        &self,
        kernels: &mut Submission,
        job: Job<'_>,
        kept: &KeptLists,
        target: &VulkanBuffer,
    ) -> Result<(), VulkanError> {
        let sets = kept.windows.iter().map(|part| part.work.groups.len());
        kernels.begin(sets.sum::<usize>() as u32)?;
        let encoding = job.encoding;
        let rotation = encoding.bytes() as u64;
        let aligned = self.binding_before(target.offset, rotation);
        let shift = (target.offset - aligned) / rotation;
        let end = (kept.windows.last()).map_or(0, |part| part.window.start + part.window.len());
        let range = Binding::range(target.buffer, aligned, (end as u64 + shift) * rotation);
        for part in &kept.windows {
            let pipeline = self.pipeline(job.kernel(part.work.list))?;
            let listed = part.bindings();
            for group in part.work.dispatched() {
                let bindings = job.bindings(group, &listed, range);
                let shift = shift as u32 + part.window.start as u32;
                let like = [part.window.stride() as u32, encoding.row().detail, shift];
                let (arguments, groups) = self.dispatch_of(&part.work, group, like);
                kernels.dispatch(&pipeline, &bindings, arguments.bytes(), groups)?;
            }
        }
        let commands = kernels.commands();
        for part in &kept.windows {
            let start = target.offset + part.window.start as u64 * rotation;
            part.work.patch(commands, target.buffer, start, encoding);
        }
        commands.barrier(Access::Kernel, Access::Any);
        kernels.submit()
    }

    /// The number of workgroups for `items`, within the limit along x.
    pub(crate) fn workgroups(&self, items: u32) -> [u32; 3] {
        let groups = items.div_ceil(WORKGROUP);
        let x = groups.min(self.device.physical.info.max_compute_work_group_count[0]);
        [x, groups.div_ceil(x), 1]
    }

    /// Starts pieces of work one after another, and finishes all that are in flight, also after an error, because
    /// submitted work uses the caller's buffers. If a piece takes long, windows are halved before `work` is called
    /// again. Several callers wait for each other, so that only one uses memory for work in flight; nothing is locked
    /// during this. Work on an exported result continues after the call: the next user of the same buffers waits for
    /// it.
    pub(crate) fn run_pipelined<U: Default, W>(
        &self,
        kept: &Exclusive<Vec<InFlight<U>>>,
        target: &mut Target<'_>,
        mut work: impl Iterator<Item = W>,
        mut start: impl FnMut(&mut InFlight<U>, &Target<'_>, W) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        let mut in_flight = kept.take();
        let mut stopwatch = Stopwatch::default();
        let mut ended = in_flight.iter_mut().filter(|flight| flight.kept.is_some());
        let finished = ended.try_for_each(|flight| match flight.results.is_done()? {
            true => flight.finish(target, &mut stopwatch),
            false => Ok(()),
        });
        if let Err(error) = finished {
            in_flight.clear(); // as below
            return Err(error.into());
        }
        let is_free = |flight: &InFlight<U>| flight.kept.is_none();
        let beside = in_flight.len() % self.in_flight_count;
        let mut next = in_flight.iter().position(is_free).unwrap_or(beside);
        let mut result = work.try_for_each(|work| {
            stop::check().map_err(SetError::from)?;
            if next == in_flight.len() {
                in_flight.push(InFlight::new(&self.device)?);
            }
            let flight = &mut in_flight[next];
            next = (next + 1) % self.in_flight_count;
            flight.finish(target, &mut stopwatch)?;
            if take(&mut stopwatch.slow) {
                self.halve_windows();
            }
            let listing = Instant::now();
            let started = start(flight, target, work);
            stopwatch.timings.work_lists += listing.elapsed();
            started
        });
        let count = in_flight.len();
        let goes_on = result.is_ok() && target.is_waited_for_elsewhere();
        for i in (0..count).filter(|_| !goes_on) {
            let oldest = &mut in_flight[(next + i) % count];
            let finished = oldest.finish(target, &mut stopwatch);
            result = result.and(finished.map_err(EvaluateError::from));
        }
        if let (Target::ImportedMemory(memory), Ok(())) = (target, &result) {
            memory.has_come_back();
        }
        if stopwatch.slow {
            self.halve_windows(); // those of the next call
        }
        if result.is_err() {
            in_flight.clear(); // a fence or a recording may be half way
        }
        *lock(&self.timings) += stopwatch.timings;
        result
    }
}
