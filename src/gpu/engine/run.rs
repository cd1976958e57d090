//! Evaluation of a result window by window. Two windows are in flight: the host lists the work of one while the
//! device evaluates the other; three if a second queue copies results back.

use std::mem::take;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::in_flight::{Finish, InFlight, KeptAlive, Stopwatch, Target};
use crate::gpu::job::{Job, KeptLists, WorkLists};
use crate::gpu::recorded::Binding;
use crate::gpu::submission::Submission;
use crate::machine::error::{EvaluateError, VulkanError};
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::prepare::error::SetError;
use crate::shader::SpreadRun;
use crate::threads::exclusive::Exclusive;
use crate::threads::{lock, on_threads, stop};
use crate::work::lists::Stored;

/// The maximum size in bytes of the lines in which a card's memory is written.
const LINE_BYTES: u64 = 128;

/// The largest aligned offset that is a whole number of rotations before the start of a window, for a binding.
fn aligned_before(start: u64, rotation: u64, alignment: u64) -> Option<u64> {
    let mut aligned = start / alignment * alignment;
    while !(start - aligned).is_multiple_of(rotation) {
        aligned = aligned.checked_sub(alignment)?;
    }
    Some(aligned)
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

    /// The kept work lists of a result that the host reads, if the same result was requested before.
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
        if self.budget.is_some() {
            return Ok(None);
        }
        let request = self.list_request(job);
        (job.lists).lists(&self.device, request, whole, values_per_window)
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
        // Each window is divided again before it starts, because windows may have been halved meanwhile.
        let windows = window.cut(max_values()).flat_map(|window| {
            let first = window.start;
            window.cut(max_values()).map(move |part| Window {
                start: first + part.start,
                ..part
            })
        });
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
        let kernels = &mut flight.results.kernels;
        let (lists, fresh);
        let listed = match kept.and_then(|kept| kept.of(window)) {
            Some(kept) => {
                kernels.begin()?;
                lists = kept.resources(&mut kernels.work);
                &kept.work
            }
            None => {
                let uploads = &mut flight.uploads;
                let list = || uploads.list(&self.device, self.list_request(job), window);
                fresh = on_threads(list)??;
                kernels.begin()?;
                let uploads = uploads.uploads(fresh.list).into_iter();
                let copied = uploads.filter_map(|upload| upload.copied_in(&mut kernels.work));
                lists = copied.collect();
                &fresh
            }
        };
        let pipeline = self.pipeline(job.kernel(listed.list))?;
        flight.compiled = pipeline.has_run.swap(true, Ordering::Relaxed);
        let work = &mut kernels.work;
        let result = work.resource(Binding::range(buffer, aligned, size));
        job.add_sets(work, listed, &lists, result);
        let stored = self.stored(encoding, window.stride() as u32, shift as u32);
        let mut sets = work.recording.all_sets();
        listed.record(&mut work.recording, &mut sets, stored);
        work.bind(|_| Ok(&*pipeline))?;
        if matches!(target, Target::External(_) | Target::Exported(_)) {
            listed.patch(&mut work.recording, result, stored);
            work.recording.publish();
            flight.done = None; // nothing is left for the host to do
            let Target::Exported(exported) = target else {
                return Ok(kernels.submit()?);
            };
            let written = result.slice(shift * rotation, window.len() as u64 * rotation);
            work.recording.release(written);
            flight.kept = Some(KeptAlive {
                _segments: Arc::clone(job.buffers),
                _pipeline: pipeline,
            });
            let point = exported.next_point();
            kernels.submit_between(None, point)?;
            exported.has_submitted(point);
            return Ok(());
        }
        let apart = match target {
            Target::Staged(buffer) => Some((&**buffer, bytes.start as u64)),
            _ => None,
        };
        let size = destination.is_none().then_some(size);
        flight.results.submit(result, size, apart)?;
        flight.done = Some(Finish {
            output: bytes,
            encoding,
            patches: listed.patches.clone(),
        });
        Ok(())
    }

    /// Where values are stored: the first one has this index in the result.
    pub(crate) fn stored(&self, encoding: Encoding, stride: u32, first: u32) -> Stored {
        Stored {
            encoding,
            stride,
            first,
            begins_lines: self.maps_samples,
        }
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

    /// The number of values of a window whose results stay on a card, which is too fast for long windows to be a
    /// problem; `None` on slow devices.
    pub(crate) fn at_once(&self) -> Option<usize> {
        const AT_ONCE: usize = 1 << 24;
        let info = &self.device.physical.info;
        let largest = (info.max_storage_buffer_range).min(info.max_memory_allocation_size);
        let listed = largest / size_of::<SpreadRun>() as u64 / 2;
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
        // If a result is exported, work on it may continue after the call.
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
        kernels.begin()?;
        let (work, encoding) = (&mut kernels.work, job.encoding);
        let rotation = encoding.bytes() as u64;
        let aligned = self.binding_before(target.offset, rotation);
        let shift = (target.offset - aligned) / rotation;
        let end = (kept.windows.last()).map_or(0, |part| part.window.start + part.window.len());
        let size = (end as u64 + shift) * rotation;
        let result = work.resource(Binding::range(target.buffer, aligned, size));
        job.add_kept_sets(kept, work, result);
        let stored = self.stored(encoding, 0, shift as u32);
        kept.record(&mut work.recording, result, stored);
        work.bind(|kernel| self.pipeline(kernel))?;
        kernels.submit()
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
            self.halve_windows(); // the windows of this call are submitted; the next call uses the smaller ones
        }
        if result.is_err() {
            in_flight.clear(); // a fence or a recording may be half way
        }
        *lock(&self.timings) += stopwatch.timings;
        result
    }
}
