//! Work in flight: the host starts one piece of it while the device works on those before, and does
//! what is left to do when they have been computed.

use std::mem::take;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;
use rayon::prelude::*;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::{ClipBuffers, VulkanEngine, lock};
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::exported::Exported;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::imported_memory::ImportedMemory;
use crate::gpu::options::Timings;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::read_back::ReadBack;
use crate::gpu::submission::Spent;
use crate::gpu::turns::Turns;
use crate::gpu::work_list::Patch;
use crate::output::encoding::Encoding;
use crate::prepare::error::SetError;
use crate::threads::{on_threads, stop};

/// What one piece of work in flight needs; `U` are its uploads.
pub(crate) struct InFlight<U> {
    // It goes first: it waits for its work to end before the buffers are freed.
    pub(crate) results: ReadBack,
    pub(crate) uploads: U,
    pub(crate) done: Option<Finish>,
    /// Whether the kernel had run before: some drivers compile at the first dispatch, which then
    /// does not count as slow.
    pub(crate) compiled: bool,
    /// What work that goes on after its call uses, until it has ended.
    pub(crate) kept: Option<Kept>,
}

/// What work on an exported result uses besides its uploads and the result, which waits for the work itself.
pub(crate) struct Kept {
    pub(crate) _segments: Arc<ClipBuffers>,
    pub(crate) _pipeline: Arc<Pipeline>,
}

/// What is left to do when a piece of work has been computed.
pub(crate) struct Finish {
    /// The bytes of the whole result that it makes.
    pub(crate) output: Range<usize>,
    pub(crate) encoding: Encoding,
    /// Rotations that the host computed, by their places among those of the piece.
    pub(crate) patches: Vec<Patch>,
}

/// Adds up where the time of an evaluation goes.
#[derive(Default)]
pub(crate) struct Stopwatch {
    pub(crate) timings: Timings,
    /// When the last window was seen to have ended. Windows overlap, and the time that two share
    /// must not count twice.
    last: Option<Instant>,
    /// A window took longer than [`LONG`].
    slow: bool,
}

/// A window should take no longer. Systems reset a device that one program keeps busy for seconds
/// (Windows after 2 s), and the display stands still long before that.
const LONG: Duration = Duration::from_millis(100);

impl Stopwatch {
    pub(crate) fn ran(&mut self, spent: Spent, compiled: bool) {
        let submitted = spent.submitted;
        let waited = spent.finished - self.last.map_or(submitted, |last| last.max(submitted));
        let by_its_clock = Some(spent.on_device).filter(|own| !own.is_zero());
        let took = by_its_clock.unwrap_or(waited);
        self.slow |= compiled && took > LONG;
        self.timings.submit_to_fence += waited;
        self.timings.on_device += spent.on_device;
        self.last = Some(spent.finished);
    }
}

/// Where results go.
pub(crate) enum Target<'a> {
    /// Straight into a mapped buffer.
    Buffer(&'a mut Buffer),
    /// Through the device's own memory into a buffer of the host's.
    Staged(&'a mut Buffer),
    /// Straight into the caller's memory, which is imported.
    ImportedMemory(ImportedMemory<'a>),
    /// Through a window's own buffer into the caller's memory.
    Slice(&'a mut [u8]),
    /// Into a buffer that the application made on this device.
    External(VulkanBuffer),
    /// Into memory that others import.
    Exported(Arc<Exported>),
}

impl<'a> Target<'a> {
    /// The caller's memory, for values of `each` bytes: imported if that is wanted and possible.
    pub(crate) fn of(
        device: &Arc<LogicalDevice>,
        imports: bool,
        output: &'a mut [u8],
        each: usize,
    ) -> Self {
        if !imports {
            return Self::Slice(output);
        }
        ImportedMemory::to_write(device, output, each)
            .map_or_else(Self::Slice, Self::ImportedMemory)
    }

    /// The buffer that kernels write into and where the result starts in it, bytes; `None` where each
    /// piece of work has a buffer of its own.
    pub(crate) fn place(&self) -> Option<(vk::Buffer, u64)> {
        match self {
            Self::Buffer(buffer) => Some((buffer.raw, 0)),
            Self::ImportedMemory(memory) => Some((memory.buffer.raw, memory.start as u64)),
            Self::External(range) => Some((range.buffer, range.offset)),
            Self::Exported(result) => Some((result.buffer.raw, 0)),
            Self::Slice(_) | Self::Staged(_) => None,
        }
    }

    /// Whether whoever uses the result waits by itself for the device to end.
    fn is_waited_for_elsewhere(&self) -> bool {
        matches!(self, Self::Exported(result) if result.has_timeline())
    }
}

impl VulkanEngine {
    /// Starts pieces of work one after another, and finishes all that is in flight, also after an
    /// error: work that was submitted uses the caller's buffers. Where a piece takes long, windows are
    /// halved before `work` is asked for more. Of several callers each waits for its turn, so that the
    /// memory in flight is that of one; nothing is locked meanwhile. Work on a result that others wait for
    /// goes on after the call: whoever uses the same buffers next waits for it.
    pub(crate) fn fly<U: Default, W>(
        &self,
        kept: &Turns<Vec<InFlight<U>>>,
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
            let own = &mut in_flight[next];
            next = (next + 1) % self.in_flight_count;
            own.finish(target, &mut stopwatch)?;
            if take(&mut stopwatch.slow) {
                self.halve_windows();
            }
            let listing = Instant::now();
            let started = start(own, target, work);
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

impl<U: Default> InFlight<U> {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Ok(Self {
            results: ReadBack::new(device)?,
            uploads: U::default(),
            done: None,
            compiled: false,
            kept: None,
        })
    }
}

impl<U> InFlight<U> {
    /// Waits for the work, if there is any, and does what is left to do then.
    pub(crate) fn finish(
        &mut self,
        target: &mut Target<'_>,
        stopwatch: &mut Stopwatch,
    ) -> Result<(), VulkanError> {
        if let Some(mut spent) = self.results.wait()? {
            if self.kept.is_some() {
                // It may have ended long ago.
                spent.submitted = (spent.finished)
                    .checked_sub(spent.on_device)
                    .unwrap_or(spent.finished);
            }
            stopwatch.ran(spent, self.compiled);
        }
        self.kept = None;
        let Some(done) = self.done.take() else {
            return Ok(());
        };
        let copying = Instant::now();
        let output: &mut [u8] = match target {
            Target::Buffer(buffer) | Target::Staged(buffer) => buffer.bytes_mut(done.output),
            Target::ImportedMemory(memory) => memory.bytes_mut(done.output),
            Target::External(_) | Target::Exported(_) => &mut [],
            Target::Slice(slice) => {
                let output = &mut slice[done.output];
                copy(output, self.results.bytes(0..output.len())?);
                output
            }
        };
        let rotation = done.encoding.bytes();
        for (place, value) in done.patches {
            let place = place * rotation;
            let own = &mut output[place..place + rotation];
            done.encoding.encode_all(&[value], own);
        }
        stopwatch.timings.read_back += copying.elapsed();
        Ok(())
    }
}

/// Bytes that one thread copies at once.
const COPIED: usize = 1 << 20;

/// Copies a result or an upload, on all threads where it is long and they can be had.
pub(crate) fn copy(to: &mut [u8], from: &[u8]) {
    let copied = (to.len() > COPIED).then(|| {
        on_threads(|| {
            let pieces = to.par_chunks_mut(COPIED).zip(from.par_chunks(COPIED));
            pieces.for_each(|(to, from)| to.copy_from_slice(from));
        })
    });
    if !matches!(copied, Some(Ok(()))) {
        to.copy_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time that windows share counts once, however many are in flight; the clock of the kernels' queue
    /// is added up, since its windows follow each other.
    #[test]
    fn time_that_windows_share_counts_once() {
        let start = Instant::now();
        let after = |milliseconds| start + Duration::from_millis(milliseconds);
        let mut stopwatch = Stopwatch::default();
        for (submitted, finished) in [(0, 30), (5, 40), (10, 50), (70, 80)] {
            let spent = Spent {
                submitted: after(submitted),
                finished: after(finished),
                on_device: Duration::from_millis(8),
            };
            stopwatch.ran(spent, true);
        }
        let timings = stopwatch.timings;
        assert_eq!(timings.submit_to_fence, Duration::from_millis(50 + 10));
        assert_eq!(timings.on_device, Duration::from_millis(4 * 8));
        assert!(!stopwatch.slow);
    }
}
