//! What one window in flight needs, and what is done when it has been computed.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;
use bytemuck::Zeroable as _;
use rayon::prelude::*;

use crate::gpu::buffer::Buffer;
use crate::gpu::device::{Lane, LogicalDevice};
use crate::gpu::engine::{VulkanEngine, lock};
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::gpu::grid::{GridRows, GroupGrid, write_blocks};
use crate::gpu::imported_memory::ImportedMemory;
use crate::gpu::memory_types::KernelReads;
use crate::gpu::options::Timings;
use crate::gpu::read_back::ReadBack;
use crate::gpu::sample_list::SampleList;
use crate::gpu::submission::{Spent, Submission};
use crate::gpu::upload::Upload;
use crate::gpu::work_list::{Cut, GroupItems, GroupWork, Patch, Work, WorkChunk, work};
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Block, Item, List, ListedSample};
use crate::time::frames::{Ticks, Timeline};

/// What one window in flight needs. The submissions are the first fields: dropped first, they wait for
/// their work to end before the buffers are freed.
pub(crate) struct InFlight {
    pub(crate) submission: Submission,
    /// A window's rotations on their way to the host.
    pub(crate) results: ReadBack,
    pub(crate) items: Upload,
    pub(crate) distances: Upload,
    /// The blocks of a grid.
    pub(crate) blocks: Upload,
    pub(crate) done: Option<Finish>,
    /// Emptied work lists, whose memory is used again.
    pub(crate) spare: Vec<WorkChunk>,
    /// Blocks before they are uploaded.
    listed_blocks: Vec<Block>,
    /// Whether the kernel had run before: some drivers compile at the first dispatch, which then
    /// does not count as slow.
    pub(crate) compiled: bool,
}

/// What is left to do when a window has been computed.
pub(crate) struct Finish {
    pub(crate) window: Window,
    pub(crate) encoding: Encoding,
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
        let start = self
            .last
            .map_or(spent.submitted, |l| l.max(spent.submitted));
        let waited = spent.finished - start;
        let took = if spent.on_device.is_zero() {
            waited
        } else {
            spent.on_device
        };
        self.slow |= compiled && took > LONG;
        self.timings.submit_to_fence += waited;
        self.timings.on_device += spent.on_device;
        self.last = Some(spent.finished);
    }

    /// Whether a window took too long since this was last asked.
    pub(crate) fn is_slow(&mut self) -> bool {
        std::mem::take(&mut self.slow)
    }
}

/// Where results go.
pub(crate) enum Target<'a> {
    /// Straight into a mapped buffer.
    Buffer(&'a mut Buffer),
    /// Straight into the caller's memory, which is imported.
    ImportedMemory(ImportedMemory<'a>),
    /// Through a window's own buffer into the caller's memory.
    Slice(&'a mut [u8]),
    /// Into a buffer of the caller's.
    External(External),
}

/// A range of a buffer that the application made on this device.
#[derive(Clone, Copy)]
pub(crate) struct External {
    pub(crate) raw: vk::Buffer,
    /// Where it starts, bytes.
    pub(crate) offset: u64,
}

/// Work in flight.
pub(crate) trait Flight {
    /// Waits for it, if there is any, and does what is left to do then.
    fn finish(
        &mut self,
        target: &mut Target<'_>,
        stopwatch: &mut Stopwatch,
    ) -> Result<(), VulkanError>;
}

impl VulkanEngine {
    /// Finishes all that is in flight after the `last`th was started, the oldest first; also after
    /// an error, because work that was submitted uses the caller's buffers.
    pub(crate) fn land(
        &self,
        in_flight: &mut Vec<impl Flight>,
        last: usize,
        target: &mut Target<'_>,
        mut stopwatch: Stopwatch,
        mut result: Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError> {
        let count = in_flight.len();
        for i in 1..=count {
            let finished = in_flight[(last + i) % count].finish(target, &mut stopwatch);
            result = result.and(finished.map_err(EvaluateError::from));
        }
        if let (Target::ImportedMemory(memory), Ok(())) = (target, &result) {
            memory.has_come_back();
        }
        if stopwatch.is_slow() {
            self.halve_windows(); // those of the next call
        }
        if result.is_err() {
            in_flight.clear(); // a fence or a recording may be half way
        }
        *lock(&self.timings) += stopwatch.timings;
        result
    }
}

impl Flight for InFlight {
    fn finish(
        &mut self,
        target: &mut Target<'_>,
        stopwatch: &mut Stopwatch,
    ) -> Result<(), VulkanError> {
        if let Some(spent) = self.results.wait(&mut self.submission)? {
            stopwatch.ran(spent, self.compiled);
        }
        let copying = Instant::now();
        let Some(done) = self.done.take() else {
            return Ok(());
        };
        let (window, encoding) = (done.window, done.encoding);
        let rotation = encoding.bytes();
        let all = window.start * rotation..(window.start + window.len()) * rotation;
        let output: &mut [u8] = match target {
            Target::Buffer(buffer) => buffer.bytes_mut(all),
            Target::ImportedMemory(memory) => memory.bytes_mut(all),
            Target::External(_) => &mut [],
            Target::Slice(slice) => {
                let output = &mut slice[all];
                copy(output, self.results.bytes(0..output.len()));
                output
            }
        };
        for (place, value) in done.patches {
            let place = place * rotation;
            encoding.encode_all(&[value], &mut output[place..place + rotation]);
        }
        stopwatch.timings.read_back += copying.elapsed();
        Ok(())
    }
}

impl InFlight {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        Ok(Self {
            submission: Submission::new(device, Lane::Kernels)?,
            results: ReadBack::default(),
            items: Upload::new("tumble items", KernelReads::Often),
            distances: Upload::new("tumble distances", KernelReads::Often),
            blocks: Upload::new("tumble blocks", KernelReads::Often),
            done: None,
            spare: Vec::new(),
            listed_blocks: Vec::new(),
            compiled: false,
        })
    }

    /// Writes the work list of a window into its buffers, one group after another; `shift`
    /// is added to every place in the output. With `maps_samples` neighbouring invocations take
    /// neighbouring samples, where that can be.
    pub(crate) fn list(
        &mut self,
        device: &Arc<LogicalDevice>,
        clip: &ClipData,
        timeline: &Timeline,
        window: &Window,
        shift: u32,
        maps_samples: bool,
    ) -> Result<Work, EvaluateError> {
        if let Some(list) = SampleList::new(clip, timeline, window) {
            let bytes = window.len() * size_of::<ListedSample>();
            let place = self.items.room(device, bytes)?;
            return Ok(list.write(bytemuck::cast_slice_mut(place), shift)?);
        }
        let rows = GridRows::new(window, shift).filter(|_| maps_samples);
        if let Some(rows) = rows {
            let cut = Cut::Whole;
            let lists = work(clip, timeline, window, shift, cut, &mut self.spare)?;
            if let Some(grids) = rows.of_groups(&lists) {
                let last = self.write_lists(device, &lists, Some(rows))?;
                let blocks = grids.iter().map(GroupGrid::blocks).sum::<u32>() as usize;
                // They are written out of order, and read meanwhile.
                self.listed_blocks.resize(blocks, Block::zeroed());
                write_blocks(&lists, &grids, last, &mut self.listed_blocks);
                let bytes: &[u8] = bytemuck::cast_slice(&self.listed_blocks);
                copy(self.blocks.room(device, bytes.len())?, bytes);
                let grids = grids.into_iter().map(Some);
                return Ok(self.listed(timeline, lists, grids));
            }
            self.take_back(lists);
        }
        let lists = work(clip, timeline, window, shift, Cut::Short, &mut self.spare)?;
        self.write_lists(device, &lists, None)?;
        Ok(self.listed(timeline, lists, std::iter::repeat(None)))
    }

    /// Writes items and distances, and for a grid one item without samples after all others, whose
    /// place it returns.
    fn write_lists(
        &mut self,
        device: &Arc<LogicalDevice>,
        lists: &[GroupWork],
        rows: Option<GridRows>,
    ) -> Result<u32, VulkanError> {
        let item_count: usize = lists.iter().map(GroupWork::item_count).sum();
        let distance_count: usize = lists.iter().map(GroupWork::distance_count).sum();
        let item_bytes = (item_count + usize::from(rows.is_some())) * size_of::<Item>();
        let items = self.items.room(device, item_bytes)?;
        let distance_bytes = distance_count * size_of::<f32>();
        let distances = self.distances.room(device, distance_bytes)?;
        let (items, nothing) = bytemuck::cast_slice_mut(items).split_at_mut(item_count);
        nothing.fill(Item::zeroed());
        write(lists, rows, items, bytemuck::cast_slice_mut(distances));
        Ok(item_count as u32)
    }

    /// What is to be done of lists that were written, whose memory is kept.
    fn listed(
        &mut self,
        timeline: &Timeline,
        lists: Vec<GroupWork>,
        grids: impl Iterator<Item = Option<GroupGrid>>,
    ) -> Work {
        let is_timed = matches!(timeline.ticks, Ticks::Times { .. });
        let mut groups = Vec::new();
        for (list, grid) in lists.iter().zip(grids) {
            groups.push(GroupItems {
                group: list.group,
                items: list.item_count() as u32,
                first_output: 0,
                grid,
            });
        }
        let list = match (groups.iter().any(|own| own.grid.is_some()), is_timed) {
            (false, false) => List::Frames,
            (false, true) => List::Times,
            (true, false) => List::FramesCoalesced,
            (true, true) => List::TimesCoalesced,
        };
        Work {
            list,
            groups,
            patches: self.take_back(lists),
        }
    }

    /// Keeps the memory of lists for the next ones; returns what they leave to the host.
    fn take_back(&mut self, lists: Vec<GroupWork>) -> Vec<Patch> {
        let mut patches = Vec::new();
        for mut chunk in lists.into_iter().flat_map(|list| list.chunks) {
            patches.append(&mut chunk.patches);
            self.spare.push(chunk.cleared());
        }
        patches
    }
}

/// Writes the work lists of all groups, one after another; in `rows` of a grid, the position of an
/// item takes the place of where it is stored. Each element is written once, in order, and none is
/// read again: what is written to may be slow to read.
pub(crate) fn write(
    lists: &[GroupWork],
    rows: Option<GridRows>,
    mut items: &mut [Item],
    mut distances: &mut [f32],
) {
    let mut next_distance = 0;
    let mut places = Vec::new();
    for chunk in lists.iter().flat_map(|list| &list.chunks) {
        let (own_items, other_items) = items.split_at_mut(chunk.items.len());
        let (own_distances, others) = distances.split_at_mut(chunk.distances.len());
        (items, distances) = (other_items, others);
        places.push((chunk, own_items, own_distances, next_distance));
        next_distance += chunk.distances.len() as i32;
    }
    places
        .into_par_iter()
        .for_each(|(chunk, items, distances, first)| {
            distances.copy_from_slice(&chunk.distances);
            let first = if distances.is_empty() { 0 } else { first };
            if first == 0 && rows.is_none() {
                return items.copy_from_slice(&chunk.items);
            }
            for (to, item) in items.iter_mut().zip(&chunk.items) {
                *to = Item {
                    first: item.first.wrapping_add(first),
                    output: rows.map_or(item.output, |rows| rows.position(item.output)),
                    ..*item
                };
            }
        });
}

/// Bytes that one thread copies at once.
const COPIED: usize = 1 << 20;

/// Copies a result or an upload, on all threads where it is long.
pub(crate) fn copy(to: &mut [u8], from: &[u8]) {
    if to.len() <= COPIED {
        return to.copy_from_slice(from);
    }
    let pieces = to.par_chunks_mut(COPIED).zip(from.par_chunks(COPIED));
    pieces.for_each(|(to, from)| to.copy_from_slice(from));
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
        assert!(!stopwatch.is_slow());
    }
}
