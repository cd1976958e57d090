//! The work list of one window of the output: items, each of which is some consecutive samples of one segment.

pub(crate) mod grid;
pub(crate) mod keys;
pub(crate) mod sample_list;
pub(crate) mod shared;
pub(crate) mod spread;

use bytemuck::Zeroable as _;
use rayon::prelude::*;

use crate::machine::options::RunLanes;
use crate::output::encoding::Encoding;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::shader::{
    Block, Dispatch, END_NEGATED, Form, Grid, IS_CONSTANT, ITEM_SAMPLES, Item, KEY_OF_INTERVAL,
    LINE, List, ListedSample, MAY_BE_TINY, NEEDS_CARE, NO_KEY, START_NEGATED, SpreadRun,
};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::threads::copy;
use crate::time::error::SampleTimesError;
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::{Distance, Emit, Run, RunSource};
use crate::time::spans::TrackPart;
use crate::twin::{COARSE, Evaluate as _};
use crate::work::lists::grid::{GridRows, GroupGrid, write_blocks};
use crate::work::lists::sample_list::{KeyDensity, SampleList};
use crate::work::lists::shared::SharedRuns;
use crate::work::lists::spread::{NO_RUN, RunCounts, RunRepetitions, SpreadLanes};
use crate::work::recording::{Recording, Resource, Set, workgroups};

/// The work of the device and of the host in a window.
pub(crate) struct Work {
    pub(crate) list: List,
    /// The groups, in the order of their items in the list.
    pub(crate) groups: Vec<GroupItems>,
    /// Rotations that the host computed.
    pub(crate) patches: Vec<Patch>,
}

impl Work {
    /// The groups with work for the device.
    pub(crate) fn dispatched(&self) -> impl Iterator<Item = &GroupItems> {
        self.groups.iter().filter(|group| group.items > 0)
    }

    /// Records the dispatches of the window, with the next sets.
    pub(crate) fn record(
        &self,
        recording: &mut Recording,
        sets: &mut impl Iterator<Item = Set>,
        stored: Stored,
    ) {
        for (group, set) in self.dispatched().zip(sets) {
            let detail = stored.encoding.row().detail;
            match group.shape {
                WorkShape::Alone => {}
                WorkShape::Grid(of_group) => {
                    let arguments = of_group.arguments;
                    let grid = Grid {
                        detail,
                        first_output: arguments.first_output + stored.first,
                        ..arguments
                    };
                    recording.dispatch(set, &grid, of_group.workgroups());
                    continue;
                }
                WorkShape::Spread(lanes, repetitions) => {
                    let entries = [group.first_item, group.items];
                    let first = group.first_output + stored.first;
                    let dispatch = lanes.dispatch_repeated(entries, repetitions, detail, first);
                    let workgroups = lanes.workgroups(group.items, repetitions.count);
                    recording.dispatch(set, &dispatch, workgroups);
                    continue;
                }
            }
            let first_output = group.first_output + stored.first;
            // Only sample lists store neighbouring values by neighbouring invocations, so only their results can begin
            // within a line.
            let idle = match stored.begins_lines && self.list == List::Samples {
                true => first_output % LINE,
                false => 0,
            };
            let dispatch = Dispatch {
                first_item: group.first_item.wrapping_sub(idle),
                item_count: group.items,
                stride: stored.stride,
                detail,
                first_output: first_output - idle,
                idle,
            };
            recording.dispatch(set, &dispatch, workgroups(group.items + idle));
        }
    }

    /// Records the writing of the host's rotations after the kernels.
    pub(crate) fn patch(&self, recording: &mut Recording, result: Resource, stored: Stored) {
        let Stored {
            encoding, first, ..
        } = stored;
        let bytes = encoding.bytes();
        let mut encoded = [0; PATCHED_BYTES];
        // Patches of neighbouring rotations are copied together.
        let are_neighbours = |one: &Patch, next: &Patch| next.0 == one.0 + 1;
        let per_command = PATCHED_BYTES / bytes;
        let rows = self.patches.chunk_by(are_neighbours);
        for patches in rows.flat_map(|row| row.chunks(per_command)) {
            let values = &mut encoded[..patches.len() * bytes];
            for ((_, value), into) in patches.iter().zip(values.chunks_exact_mut(bytes)) {
                encoding.encode_all(&[*value], into);
            }
            let offset = (first as usize + patches[0].0) * bytes;
            let to = result.slice(offset as u64, values.len() as u64);
            recording.write(to, values);
        }
    }
}

/// Where and how the values of a window are stored.
#[derive(Clone, Copy)]
pub(crate) struct Stored {
    pub(crate) encoding: Encoding,
    /// The distance between neighbouring samples of a track.
    pub(crate) stride: u32,
    /// The index of the window's first value in the result.
    pub(crate) first: u32,
    /// Whether neighbouring invocations store neighbouring values, from the start of a memory line on.
    pub(crate) begins_lines: bool,
}

/// The maximum number of bytes that one command patches. It is a whole number of values in every encoding, and Vulkan
/// allows 65 536.
const PATCHED_BYTES: usize = 48 * 48;

/// The amount of the device's work for one group of a clip.
pub(crate) struct GroupItems {
    pub(crate) group: usize,
    /// The index of the group's first item in the list.
    pub(crate) first_item: u32,
    /// The number of items, or of samples of a sample list.
    pub(crate) items: u32,
    /// The offset of the first sample of a sample list, or the number that is added to the offsets of spread runs.
    pub(crate) first_output: u32,
    pub(crate) shape: WorkShape,
}

/// Which invocation evaluates which sample of a group.
#[derive(Debug, Clone, Copy)]
pub(crate) enum WorkShape {
    /// Each invocation evaluates an item, or a listed sample.
    Alone,
    /// Neighbours evaluate neighbouring tracks.
    Grid(GroupGrid),
    /// Neighbours evaluate neighbouring samples of a run, or the same run of neighbouring tracks.
    Spread(SpreadLanes, RunRepetitions),
}

/// An offset in the window, and the rotation there.
pub(crate) type Patch = (usize, [f32; 4]);

/// The work of one group of a clip in a window.
pub(crate) struct GroupWork {
    pub(crate) group: usize,
    pub(crate) chunks: Vec<WorkChunk>,
}

/// A chunk of a work list, made by one thread. If items use `distances`, their `first` is an index into the chunk's
/// distances.
#[derive(Default)]
pub(crate) struct WorkChunk {
    pub(crate) items: Vec<Item>,
    /// Instead of items, the runs to spread.
    pub(crate) runs: Vec<SpreadRun>,
    pub(crate) distances: Vec<f32>,
    pub(crate) patches: Vec<Patch>,
}

impl WorkChunk {
    /// Removes the last run if it is one sample that stands before this position and is a constant: the key at the
    /// beginning of the run that begins here, or of the track before.
    fn take_key(&mut self, output: u32) -> Option<u32> {
        let is_key = |run: &mut SpreadRun| {
            run.count == 1 | IS_CONSTANT && run.output.checked_add(1) == Some(output)
        };
        self.runs.pop_if(is_key).map(|run| run.source)
    }
}

impl GroupWork {
    pub(crate) fn item_count(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.items.len()).sum()
    }
}

/// The samples to list.
#[derive(Clone, Copy)]
pub(crate) struct ListRequest<'a> {
    /// Whether neighbouring invocations evaluate neighbouring samples, if possible; otherwise each evaluates a run of
    /// samples.
    pub(crate) maps_samples: bool,
    /// The number of invocations that evaluate a run together.
    pub(crate) run_lanes: RunLanes,
    pub(crate) clip: &'a ClipData,
    pub(crate) timeline: &'a Timeline,
}

/// Memory of a device for the lists of a window.
pub(crate) trait ListRoom<'r> {
    type Error: From<SampleTimesError>;

    /// Memory for lists with these numbers of bytes: items or listed samples, distances, and blocks; none for lists
    /// that kernels do not bind. Reading from this memory may be slow.
    fn room(self, bytes: [Option<usize>; 3]) -> Result<[&'r mut [u8]; 3], Self::Error>;
}

/// Memory that is kept for the lists of the next window.
#[derive(Default)]
pub(crate) struct Lister {
    /// Emptied work lists.
    spare: Vec<WorkChunk>,
    /// Blocks before they are written to the device's memory.
    listed_blocks: Vec<Block>,
}

impl Lister {
    /// Writes the work list of a window into a device's memory, one group after another. If the request maps samples,
    /// neighbouring invocations evaluate neighbouring samples if possible. Must be called on one of the engine's
    /// threads.
    pub(crate) fn list<'r, R: ListRoom<'r>>(
        &mut self,
        request: ListRequest<'_>,
        window: &Window,
        memory: R,
    ) -> Result<Work, R::Error> {
        let ListRequest {
            maps_samples,
            clip,
            timeline,
            ..
        } = request;
        if let Some(list) = SampleList::new(clip, timeline, window, KeyDensity::Unknown) {
            return write_samples(&list, window, memory);
        }
        if maps_samples && window.stride() == 1 {
            return self.list_spread(request, window, memory);
        }
        if let Some(rows) = GridRows::new(window).filter(|_| maps_samples) {
            if let Some(shared) = SharedRuns::new(request, window)? {
                return shared.write(memory);
            }
            let lists = work(clip, timeline, window, Cut::Whole, &mut self.spare)?;
            let grids = rows.of_groups(&lists).unwrap_or_default();
            if !grids.is_empty() {
                return self.write_items(lists, Some(rows), &grids, timeline, memory);
            }
            self.take_back(lists);
        }
        self.list_items(request, window, memory)
    }

    /// Lists a window as items, one for each invocation, whatever the device and the times are. There are at most twice
    /// as many as samples, because a sample within rounding of the boundary between two parts may come from both.
    pub(crate) fn list_items<'r, R: ListRoom<'r>>(
        &mut self,
        request: ListRequest<'_>,
        window: &Window,
        memory: R,
    ) -> Result<Work, R::Error> {
        let ListRequest { clip, timeline, .. } = request;
        let lists = work(clip, timeline, window, Cut::Short, &mut self.spare)?;
        self.write_items(lists, None, &[], timeline, memory)
    }

    /// Writes items, and for a grid its blocks, into a device's memory.
    fn write_items<'r, R: ListRoom<'r>>(
        &mut self,
        lists: Vec<GroupWork>,
        rows: Option<GridRows>,
        grids: &[GroupGrid],
        timeline: &Timeline,
        memory: R,
    ) -> Result<Work, R::Error> {
        let chunks = lists.iter().flat_map(|list| &list.chunks);
        let item_count: usize = lists.iter().map(GroupWork::item_count).sum();
        let distance_count: usize = chunks.map(|chunk| chunk.distances.len()).sum();
        // A grid has one item without samples after all others.
        let item_bytes = (item_count + usize::from(rows.is_some())) * size_of::<Item>();
        let distance_bytes = distance_count * size_of::<f32>();
        let block_count = grids.iter().map(GroupGrid::blocks).sum::<u32>() as usize;
        let block_bytes = rows.map(|_| block_count * size_of::<Block>());
        let sizes = [Some(item_bytes), Some(distance_bytes), block_bytes];
        let [items, distances, blocks] = memory.room(sizes)?;
        let (items, nothing) = bytemuck::cast_slice_mut(items).split_at_mut(item_count);
        nothing.fill(Item::zeroed());
        write(&lists, rows, items, bytemuck::cast_slice_mut(distances));
        if rows.is_some() {
            // Blocks are written in any order and read meanwhile, so this is not done in the device's memory.
            self.listed_blocks.resize(block_count, Block::zeroed());
            write_blocks(&lists, grids, item_count as u32, &mut self.listed_blocks);
            copy(blocks, bytemuck::cast_slice(&self.listed_blocks));
        }

        let is_timed = matches!(timeline.ticks, Ticks::Times { .. });
        let mut first_item = 0;
        let groups = lists.iter().enumerate().map(|(i, list)| {
            let items = list.item_count() as u32;
            let group = GroupItems {
                group: list.group,
                first_item,
                items,
                first_output: 0,
                shape: (grids.get(i)).map_or(WorkShape::Alone, |grid| WorkShape::Grid(*grid)),
            };
            first_item += items;
            group
        });
        Ok(Work {
            list: match (rows.is_some(), is_timed) {
                (false, false) => List::Frames,
                (false, true) => List::Times,
                (true, false) => List::FramesCoalesced,
                (true, true) => List::TimesCoalesced,
            },
            groups: groups.collect(),
            patches: self.take_back(lists),
        })
    }

    /// Lists the runs of a window whose samples are contiguous, so that neighbouring invocations evaluate neighbouring
    /// samples.
    fn list_spread<'r, R: ListRoom<'r>>(
        &mut self,
        request: ListRequest<'_>,
        window: &Window,
        memory: R,
    ) -> Result<Work, R::Error> {
        let ListRequest { clip, timeline, .. } = request;
        if let Some(shared) = SharedRuns::new(request, window)? {
            return shared.write(memory);
        }
        let lists = work(clip, timeline, window, Cut::Spread, &mut self.spare)?;
        let counts = RunCounts::of_lists(&lists);
        let lanes = SpreadLanes::of_runs(counts, request.run_lanes);
        if counts.are_too_short()
            && let Some(list) = SampleList::new(clip, timeline, window, KeyDensity::ShortRuns)
        {
            self.take_back(lists);
            return write_samples(&list, window, memory);
        }
        let mut first_item = 0;
        let groups = lists.iter().map(|list| {
            let items = lanes.entries_of_group(list) as u32;
            first_item += items;
            GroupItems {
                group: list.group,
                first_item: first_item - items,
                items,
                first_output: 0,
                shape: WorkShape::Spread(lanes, RunRepetitions::ONE),
            }
        });
        let groups = groups.collect();
        let chunks = lists.iter().flat_map(|list| &list.chunks);
        let distance_count: usize = chunks.map(|chunk| chunk.distances.len()).sum();
        let sizes = [
            Some(first_item as usize * size_of::<SpreadRun>()),
            Some(distance_count * size_of::<f32>()),
            None,
        ];
        let [runs, distances, _] = memory.room(sizes)?;
        let distances = bytemuck::cast_slice_mut(distances);
        lanes.write(&lists, bytemuck::cast_slice_mut(runs), distances);
        Ok(Work {
            list: spread_list(timeline),
            groups,
            patches: self.take_back(lists),
        })
    }

    /// Keeps the memory of lists for the next ones; returns the host's patches.
    fn take_back(&mut self, lists: Vec<GroupWork>) -> Vec<Patch> {
        let mut patches = Vec::new();
        for mut chunk in lists.into_iter().flat_map(|list| list.chunks) {
            patches.append(&mut chunk.patches);
            chunk.items.clear();
            chunk.runs.clear();
            chunk.distances.clear();
            self.spare.push(chunk);
        }
        patches
    }
}

/// The list of spread runs of samples.
fn spread_list(timeline: &Timeline) -> List {
    match timeline.ticks {
        Ticks::Frames { .. } => List::FramesSpread,
        Ticks::Times { .. } => List::TimesSpread,
    }
}

/// Writes a sample list into a device's memory.
fn write_samples<'r, R: ListRoom<'r>>(
    list: &SampleList<'_>,
    window: &Window,
    memory: R,
) -> Result<Work, R::Error> {
    let bytes = window.len() * size_of::<ListedSample>();
    let [samples, ..] = memory.room([Some(bytes), None, None])?;
    Ok(list.write(bytemuck::cast_slice_mut(samples))?)
}

/// The minimum number of parts of a group that one thread converts to items; more while they have fewer samples than
/// `SAMPLES_PER_CHUNK`.
const PARTS_PER_CHUNK: usize = 64;
const SAMPLES_PER_CHUNK: usize = 4096;

pub(crate) fn parts_per_chunk(window: &Window) -> usize {
    (SAMPLES_PER_CHUNK / window.samples.len().max(1)).max(PARTS_PER_CHUNK)
}

/// The parts of a group that belong to a window's tracks.
pub(crate) fn parts_in<'a>(prepared: &'a Prepared, window: &Window) -> &'a [TrackPart] {
    let from = |track: usize| {
        let is_before = |part: &TrackPart| (part.track as usize) < track;
        prepared.parts.partition_point(is_before)
    };
    &prepared.parts[from(window.tracks.start)..from(window.tracks.end)]
}

/// How runs are divided into items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// An item for each invocation: at most `ITEM_SAMPLES` samples.
    Short,
    /// The whole run, for a grid, with the bit `MAY_BE_TINY` if the run needs it.
    Whole,
    /// The whole run with the key at its beginning, to be spread over neighbouring invocations.
    Spread,
}

/// The work lists of a window: one for each group that has any of its tracks. `spare` are empty chunks for reuse,
/// because fresh memory would take longer than listing.
pub(crate) fn work(
    clip: &ClipData,
    timeline: &Timeline,
    window: &Window,
    cut: Cut,
    spare: &mut Vec<WorkChunk>,
) -> Result<Vec<GroupWork>, SampleTimesError> {
    let mut all = Vec::new();
    for (group, prepared) in clip.groups.iter().enumerate() {
        let parts = parts_in(prepared, window);
        let listings: Vec<_> = parts
            .chunks(parts_per_chunk(window))
            .map(|parts| PartsList {
                prepared,
                parts,
                timeline,
                window,
                cut,
                track: 0,
                chunk: spare.pop().unwrap_or_default(),
                listed: Ok(()),
            })
            .collect();
        let chunks: Vec<WorkChunk> = listings
            .into_par_iter()
            .map(PartsList::list)
            .collect::<Result<_, SampleTimesError>>()?;
        if !parts.is_empty() {
            all.push(GroupWork { group, chunks });
        }
    }
    Ok(all)
}

/// Lists the work of some parts of a group.
struct PartsList<'a> {
    prepared: &'a Prepared,
    parts: &'a [TrackPart],
    timeline: &'a Timeline,
    window: &'a Window,
    cut: Cut,
    /// The track of the current runs.
    track: usize,
    chunk: WorkChunk,
    listed: Result<(), SampleTimesError>,
}

impl<'a> PartsList<'a> {
    /// Lists the runs of parts, each whole.
    fn of_runs(
        (prepared, parts): (&'a Prepared, &'a [TrackPart]),
        timeline: &'a Timeline,
        window: &'a Window,
    ) -> Self {
        Self {
            prepared,
            parts,
            timeline,
            window,
            cut: Cut::Spread,
            track: 0,
            chunk: WorkChunk::default(),
            listed: Ok(()),
        }
    }

    fn list(mut self) -> Result<WorkChunk, SampleTimesError> {
        in_lanes(&mut self);
        self.listed.map(|()| self.chunk)
    }
}

impl InLanes for PartsList<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (prepared, timeline) = (self.prepared, self.timeline);
        for part in self.parts {
            self.track = part.track as usize;
            let samples = self.window.samples.clone();
            let span = part.extension.as_ref().map(|extension| extension.span);
            for copy in prepared.wrap.copies(span, timeline, samples) {
                let listed = prepared.spans.runs(part, timeline, &copy, self);
                if listed.is_err() {
                    self.listed = listed;
                    return;
                }
            }
        }
    }
}

impl Emit for PartsList<'_> {
    /// Converts a run to items, or to patches if the host evaluates it.
    #[inline(always)]
    fn run(&mut self, run: Run) {
        let (prepared, timeline, window) = (self.prepared, self.timeline, self.window);
        let (track, chunk) = (self.track, &mut self.chunk);
        let samples = run.sample..run.sample + run.count;
        let output = window.offset(track, run.sample) as u32;
        let mut whole = Item::zeroed();
        let mut key = None;
        let flags = match run.source {
            RunSource::Constant(constant) => {
                whole.source = constant;
                IS_CONSTANT
            }
            RunSource::Segment(index, distance, affine) => {
                whole.source = index;
                (whole.scale, whole.offset) = (affine.scale, affine.offset);
                if self.cut == Cut::Spread {
                    key = chunk.take_key(output);
                }
                whole.first = match distance {
                    Distance::Near { first } => first as i32,
                    Distance::Frames { first } => first,
                    Distance::Seconds { .. } => {
                        let first_distance = chunk.distances.len() as i32;
                        let from_middle =
                            |sample| distance.at_sample(0, || timeline.time_at(track, sample));
                        // A key has no distance; 0 is a placeholder.
                        chunk.distances.extend(key.map(|_| 0.0));
                        chunk.distances.extend(samples.map(from_middle));
                        first_distance + i32::from(key.is_some())
                    }
                };
                match (self.cut, distance) {
                    (Cut::Short, _) => 0,
                    (Cut::Spread, Distance::Frames { .. }) => NEEDS_CARE,
                    (Cut::Spread, _) if may_be_tiny(prepared, index) => NEEDS_CARE,
                    (Cut::Whole, _) if may_be_tiny(prepared, index) => MAY_BE_TINY,
                    (Cut::Spread | Cut::Whole, _) => 0,
                }
            }
            RunSource::Exact { index, parameter } => {
                chunk.patches.extend(samples.map(|sample| {
                    let value = prepared.exact(index, parameter, timeline, track, sample);
                    (window.offset(track, sample), value)
                }));
                return;
            }
        };
        if self.cut == Cut::Spread {
            let before = u32::from(key.is_some());
            chunk.runs.push(SpreadRun {
                source: whole.source,
                output: output - before,
                count: (run.count as u32 + before) | flags,
                first: whole.first.wrapping_sub(before as i32),
                scale: whole.scale,
                offset: whole.offset,
                key: key.unwrap_or(NO_KEY),
                ..NO_RUN
            });
            return;
        }
        let max_samples = match self.cut {
            Cut::Short => ITEM_SAMPLES as usize,
            Cut::Whole | Cut::Spread => usize::MAX,
        };
        let mut done = 0;
        while done < run.count {
            let count = max_samples.min(run.count - done);
            chunk.items.push(Item {
                output: window.offset(track, run.sample + done) as u32,
                count: count as u32 | flags,
                first: whole.first.wrapping_add(done as i32),
                ..whole
            });
            done += count;
        }
    }
}

/// Writes the work lists of all groups, one after another. In `rows` of a grid, the offset of an item is replaced by
/// its position. Each element is written once, in order, and none is read again, because the memory may be slow to
/// read.
pub(crate) fn write(
    lists: &[GroupWork],
    rows: Option<GridRows>,
    mut items: &mut [Item],
    mut distances: &mut [f32],
) {
    let mut next_distance = 0;
    let mut destinations = Vec::new();
    for chunk in lists.iter().flat_map(|list| &list.chunks) {
        let (chunk_items, other_items) = items.split_at_mut(chunk.items.len());
        let (chunk_distances, others) = distances.split_at_mut(chunk.distances.len());
        (items, distances) = (other_items, others);
        destinations.push((chunk, chunk_items, chunk_distances, next_distance));
        next_distance += chunk.distances.len() as i32;
    }
    destinations
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
                    output: rows.map_or(item.output, |rows| rows.cell(item.output).1),
                    ..*item
                };
            }
        });
}

/// Whether a sample of a segment may have a component that is nearly 0, and needs the filter for those
/// ([`Evaluate::is_canonical`](crate::twin::Evaluate::is_canonical)). For arcs that only the device computes, the
/// answer may be true although no component is nearly 0.
#[inline(always)]
pub(crate) fn may_be_tiny(prepared: &Prepared, index: u32) -> bool {
    let (segments, index) = (&prepared.segments, index as usize);
    match segments.form {
        Form::Arc if segments.are_arcs_listed => may_be_tiny_between(prepared, index),
        Form::Arc => !segments.arcs[index].is_canonical(),
        Form::Polynomial => !segments.polynomials[index].is_canonical(),
    }
}

/// The same of an arc that is listed: each component of its middle is at least as large as that of half the sum
/// of its keys, which [`arc_between`](crate::twin::arc_between::arc_between) lengthens.
fn may_be_tiny_between(prepared: &Prepared, index: usize) -> bool {
    let interval = prepared.segments.intervals[index];
    let key = (interval & KEY_OF_INTERVAL) as usize;
    let [start, end] = [prepared.constants[key], prepared.constants[key + 1]];
    let is_start_negated = interval & START_NEGATED != 0;
    let sign = match is_start_negated == (interval & END_NEGATED != 0) {
        true => 1.0,
        false => -1.0,
    };
    let is_zero = |c: usize| start[c] == 0.0 && end[c] == 0.0;
    (0..4).any(|c| ((start[c] + end[c] * sign) * 0.5).abs() < COARSE && !is_zero(c))
}
