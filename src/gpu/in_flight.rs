//! Work in flight: the host starts a piece of it while the device works on the previous ones, copies their results to
//! the host, and applies the rotations that the host computed. Results are read where kernels wrote them, or are copied
//! from device memory: by the kernels' submission, or by another one while later kernels run.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::{LogicalDevice, QueueLane};
use crate::gpu::external::{Exported, ImportedMemory};
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::job::ClipBuffers;
use crate::gpu::pipeline::Pipeline;
use crate::gpu::recorded::{Binding, Recorded};
use crate::gpu::submission::{Semaphore, Spent, Submission};
use crate::machine::error::VulkanError;
use crate::machine::options::Timings;
use crate::output::encoding::Encoding;
use crate::threads::copy;
use crate::work::lists::Patch;
use crate::work::recording::Resource;

/// The resources of one piece of work in flight; `U` are its uploads.
pub(crate) struct InFlight<U> {
    // Dropped first, because it waits for its work before the buffers are freed.
    pub(crate) results: KernelResults,
    pub(crate) uploads: U,
    pub(crate) done: Option<Finish>,
    /// Whether the kernel ran before. Some drivers compile at the first dispatch, which then does not count as slow.
    pub(crate) compiled: bool,
    /// The resources of work that continues after its call, until it has ended.
    pub(crate) kept: Option<KeptAlive>,
}

/// The resources of work on an exported result in addition to its uploads; the result waits for the work itself.
pub(crate) struct KeptAlive {
    pub(crate) _segments: Arc<ClipBuffers>,
    pub(crate) _pipeline: Arc<Pipeline>,
}

/// The remaining steps after the device has computed a piece of work.
pub(crate) struct Finish {
    /// The range of bytes of the whole result that the piece writes.
    pub(crate) output: Range<usize>,
    pub(crate) encoding: Encoding,
    /// Rotations that the host computed, by their index among those of the piece.
    pub(crate) patches: Vec<Patch>,
}

/// Sums of the times of an evaluation.
#[derive(Default)]
pub(crate) struct Stopwatch {
    pub(crate) timings: Timings,
    /// The time when the last window ended. Windows overlap, and the time that two share must be counted once.
    last: Option<Instant>,
    /// Whether a window took longer than [`LONG`].
    pub(crate) slow: bool,
}

/// The maximum time for a window. Systems reset a device that one program keeps busy for seconds (Windows after 2 s),
/// and the display stops long before that.
const LONG: Duration = Duration::from_millis(100);

impl Stopwatch {
    pub(crate) fn ran(&mut self, spent: Spent, compiled: bool) {
        let submitted = spent.submitted;
        let waited = spent.finished - self.last.map_or(submitted, |last| last.max(submitted));
        let by_its_clock = Some(spent.on_device).filter(|time| !time.is_zero());
        let took = by_its_clock.unwrap_or(waited);
        self.slow |= compiled && took > LONG;
        self.timings.submit_to_fence += waited;
        self.timings.on_device += spent.on_device;
        self.last = Some(spent.finished);
    }
}

/// The destination of results.
pub(crate) enum Target<'a> {
    /// Directly to a mapped buffer.
    Buffer(&'a mut Buffer),
    /// Through device memory to a buffer of the host.
    Staged(&'a mut Buffer),
    /// Directly to the caller's memory, which is imported.
    ImportedMemory(ImportedMemory<'a>),
    /// Through each window's buffer to the caller's memory.
    Slice(&'a mut [u8]),
    /// To a buffer that the application made on this device.
    External(VulkanBuffer),
    /// To memory that others import.
    Exported(Arc<Exported>),
}

impl<'a> Target<'a> {
    /// The caller's memory, for values of `each` bytes: imported if that is requested and possible.
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

    /// The buffer that kernels write, and the offset in bytes of the result in it; `None` if each piece of work has a
    /// buffer.
    pub(crate) fn destination(&self) -> Option<(vk::Buffer, u64)> {
        match self {
            Self::Buffer(buffer) => Some((buffer.raw, 0)),
            Self::ImportedMemory(memory) => Some((memory.buffer.raw, memory.start as u64)),
            Self::External(range) => Some((range.buffer, range.offset)),
            Self::Exported(result) => Some((result.buffer.raw, 0)),
            Self::Slice(_) | Self::Staged(_) => None,
        }
    }

    /// Whether the user of the result waits for the device.
    pub(crate) fn is_waited_for_elsewhere(&self) -> bool {
        matches!(self, Self::Exported(result) if result.has_timeline())
    }
}

impl<U: Default> InFlight<U> {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Ok(Self {
            results: KernelResults::new(device)?,
            uploads: U::default(),
            done: None,
            compiled: false,
            kept: None,
        })
    }
}

impl<U> InFlight<U> {
    /// Waits for the work, if there is any, and does the remaining steps.
    pub(crate) fn finish(
        &mut self,
        target: &mut Target<'_>,
        stopwatch: &mut Stopwatch,
    ) -> Result<(), VulkanError> {
        if let Some(mut spent) = self.results.wait()? {
            if self.kept.is_some() {
                // The work may have ended long before this call, so its start is computed from its time on the device.
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
        for (index, value) in done.patches {
            let offset = index * rotation;
            let patched = &mut output[offset..offset + rotation];
            done.encoding.encode_all(&[value], patched);
        }
        stopwatch.timings.read_back += copying.elapsed();
        Ok(())
    }
}

/// Submitted kernels, and the memory through which their results come back. It must be dropped before other resources
/// of the kernels.
pub(crate) struct KernelResults {
    // Dropped first, because they wait for their work before the buffers are freed.
    pub(crate) kernels: Submission,
    apart: Option<CopyApart>,
    /// The buffer that kernels write.
    output: Option<Buffer>,
    /// The buffer that the host reads, if it is another one.
    host: Option<Buffer>,
}

/// Copies in separate submissions.
struct CopyApart {
    submission: Submission,
    /// The timeline that the kernels' queue signals.
    done: Semaphore,
}

impl KernelResults {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Ok(Self {
            kernels: Submission::new(device, QueueLane::Kernels)?,
            apart: None,
            output: None,
            host: None,
        })
    }

    /// The buffer for kernels to write, of at least this size; `staged` results are copied from device memory.
    pub(crate) fn room(
        &mut self,
        device: &Arc<LogicalDevice>,
        size: u64,
        staged: bool,
    ) -> Result<&Buffer, VulkanError> {
        if !staged {
            return grow(device, &mut self.output, size, Residence::InPlace);
        }
        self.copy_apart(device)?;
        grow(device, &mut self.host, size, Residence::Readback)?;
        grow(device, &mut self.output, size, Residence::Results)
    }

    /// As `room`, for results that are copied to another buffer than this one's.
    pub(crate) fn room_apart(
        &mut self,
        device: &Arc<LogicalDevice>,
        size: u64,
    ) -> Result<&Buffer, VulkanError> {
        self.copy_apart(device)?;
        grow(device, &mut self.output, size, Residence::Results)
    }

    fn copy_apart(&mut self, device: &Arc<LogicalDevice>) -> Result<(), VulkanError> {
        if self.apart.is_none() && device.copies_apart {
            self.apart = Some(CopyApart {
                submission: Submission::new(device, QueueLane::Copies)?,
                done: Semaphore::new(device)?,
            });
        }
        Ok(())
    }

    /// Submits the work of the kernels, which write `result`, and the copy of its first `size` bytes to the host, or to
    /// another host-visible buffer, from an offset on, if one is specified. Without a size, the kernels write memory
    /// that the host can access.
    pub(crate) fn submit(
        &mut self,
        result: Resource,
        size: Option<u64>,
        destination: Option<(&Buffer, u64)>,
    ) -> Result<(), VulkanError> {
        let kernels = &mut self.kernels;
        let destination = destination.or(self.host.as_ref().map(|host| (host, 0)));
        let (Some(size), Some(output), Some((host, offset))) = (size, &self.output, destination)
        else {
            kernels.work.recording.read_by_host(result);
            return kernels.submit();
        };
        let size = size.max(4); // no copy may be of nothing, and no buffer is shorter
        let host = Binding::range(host.raw, offset, size.min(host.size - offset));
        let copy_back = |work: &mut Recorded, result: Resource| {
            let host = work.resource(host);
            work.recording.copy(result.slice(0, size), host);
            work.recording.read_by_host(host);
        };
        let Some(CopyApart { submission, done }) = &mut self.apart else {
            copy_back(&mut kernels.work, result);
            return kernels.submit();
        };
        // The semaphore orders the copy and makes the kernels' writes visible to it. So no barrier is needed, for which
        // the next kernels would have to wait.
        submission.begin()?;
        let result = submission.work.whole(output);
        copy_back(&mut submission.work, result);
        let point = done.advance();
        kernels.submit_between(None, Some(point))?;
        submission.submit_between(Some(point), None)
    }

    /// Whether the kernels and the copy have ended, without waiting.
    pub(crate) fn is_done(&self) -> Result<bool, VulkanError> {
        let copied = match &self.apart {
            Some(apart) => apart.submission.is_done()?,
            None => true,
        };
        Ok(copied && self.kernels.is_done()?)
    }

    /// Waits for the copy and for the kernels, and returns their time, including the end of the copy.
    pub(crate) fn wait(&mut self) -> Result<Option<Spent>, VulkanError> {
        if let Some(apart) = &mut self.apart {
            apart.submission.wait()?;
        }
        self.kernels.wait()
    }

    /// Some of the results, after the wait.
    pub(crate) fn bytes(&self, range: Range<usize>) -> Result<&[u8], VulkanError> {
        let Some(buffer) = self.host.as_ref().or(self.output.as_ref()) else {
            return Ok(&[]);
        };
        buffer.invalidate(&range)?;
        Ok(buffer.bytes(range))
    }
}

/// A kept buffer of at least `size` bytes; a shorter one is replaced.
pub(crate) fn grow<'b>(
    device: &Arc<LogicalDevice>,
    kept: &'b mut Option<Buffer>,
    size: u64,
    residence: Residence,
) -> Result<&'b Buffer, VulkanError> {
    // A buffer that is too short is freed before the new one is allocated, so that memory for both is not needed.
    let buffer = kept.take().filter(|buffer| buffer.size >= size);
    let buffer = buffer.map_or_else(
        || Buffer::new(device, "tumble results", size, residence),
        Ok,
    );
    Ok(kept.insert(buffer?))
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
