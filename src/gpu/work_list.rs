//! The work list of one window of the output: items, each some consecutive samples of one segment.

use rayon::prelude::*;

use crate::gpu::grid::GroupGrid;
use crate::math::canonical::round_f32;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::shader::{IS_CONSTANT, ITEM_SAMPLES, Item, List, MAY_BE_TINY};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::frames::{FramesError, Timeline};
use crate::time::runs::{Distance, Emit, Run, RunSource};
use crate::time::spans::Part;

/// What the device and the host have to do in a window.
pub(crate) struct Work {
    pub(crate) list: List,
    /// The groups, in the order in which their items lie in the list.
    pub(crate) groups: Vec<GroupItems>,
    /// Rotations that the host computed.
    pub(crate) patches: Vec<Patch>,
}

/// How much the device has to do for one group of a clip.
pub(crate) struct GroupItems {
    pub(crate) group: usize,
    /// How many items, or samples of a sample list.
    pub(crate) items: u32,
    /// Where the first sample of a sample list is stored.
    pub(crate) first_output: u32,
    /// The samples of the group, where neighbouring invocations take neighbours.
    pub(crate) grid: Option<GroupGrid>,
}

/// A place in the window, and the rotation there.
pub(crate) type Patch = (usize, [f32; 4]);

/// What one group of a clip has to do in a window.
pub(crate) struct GroupWork {
    pub(crate) group: usize,
    pub(crate) chunks: Vec<WorkChunk>,
}

/// A chunk of a work list, made by one thread. Where items take their distances from `distances`,
/// their `first` is an index into those of the chunk.
#[derive(Default)]
pub(crate) struct WorkChunk {
    pub(crate) items: Vec<Item>,
    pub(crate) distances: Vec<f32>,
    pub(crate) patches: Vec<Patch>,
}

impl WorkChunk {
    /// Empty, and ready to be used again.
    pub(crate) fn cleared(mut self) -> Self {
        self.items.clear();
        self.distances.clear();
        self.patches.clear();
        self
    }
}

impl GroupWork {
    pub(crate) fn item_count(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.items.len()).sum()
    }

    pub(crate) fn distance_count(&self) -> usize {
        self.chunks.iter().map(|chunk| chunk.distances.len()).sum()
    }
}

/// Parts of a group that one thread turns into items: at least this many, and more while they have
/// fewer samples than `SAMPLES_PER_CHUNK`.
const PARTS_PER_CHUNK: usize = 64;
const SAMPLES_PER_CHUNK: usize = 4096;

pub(crate) fn parts_per_chunk(window: &Window) -> usize {
    (SAMPLES_PER_CHUNK / window.samples.len().max(1)).max(PARTS_PER_CHUNK)
}

/// The parts of a group that belong to a window's tracks.
pub(crate) fn parts_in<'a>(prepared: &'a Prepared, window: &Window) -> &'a [Part] {
    let from = |track: usize| {
        let is_before = |part: &Part| (part.track as usize) < track;
        prepared.parts.partition_point(is_before)
    };
    &prepared.parts[from(window.tracks.start)..from(window.tracks.end)]
}

/// How runs become items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// An item for each invocation: at most `ITEM_SAMPLES` samples.
    Short,
    /// A whole run, for a grid, with the bit `MAY_BE_TINY` where the run needs it.
    Whole,
}

/// The work lists of a window: one for each group that has any of its tracks. `shift` is added to
/// every place in the output. `spare` are emptied chunks to use again: fresh memory would cost
/// more than listing.
pub(crate) fn work(
    clip: &ClipData,
    timeline: &Timeline,
    window: &Window,
    shift: u32,
    cut: Cut,
    spare: &mut Vec<WorkChunk>,
) -> Result<Vec<GroupWork>, FramesError> {
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
                shift,
                cut,
                chunk: spare.pop().unwrap_or_default(),
                listed: Ok(()),
            })
            .collect();
        let chunks: Vec<WorkChunk> = listings
            .into_par_iter()
            .map(|mut listing| {
                in_lanes(&mut listing);
                listing.listed.map(|()| listing.chunk)
            })
            .collect::<Result<_, FramesError>>()?;
        if !parts.is_empty() {
            all.push(GroupWork { group, chunks });
        }
    }
    Ok(all)
}

/// Lists the work of some parts of a group.
struct PartsList<'a> {
    prepared: &'a Prepared,
    parts: &'a [Part],
    timeline: &'a Timeline,
    window: &'a Window,
    shift: u32,
    cut: Cut,
    chunk: WorkChunk,
    listed: Result<(), FramesError>,
}

impl InLanes for PartsList<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for part in self.parts {
            let mut list = RunItems {
                prepared: self.prepared,
                timeline: self.timeline,
                window: self.window,
                shift: self.shift,
                cut: self.cut,
                track: part.track as usize,
                chunk: &mut self.chunk,
            };
            let samples = self.window.samples.clone();
            for copy in self.prepared.copies(part, self.timeline, samples) {
                let listed = self
                    .prepared
                    .spans
                    .runs(part, self.timeline, &copy, &mut list);
                if listed.is_err() {
                    self.listed = listed;
                    return;
                }
            }
        }
    }
}

/// Turns the runs of one part into items.
struct RunItems<'a> {
    prepared: &'a Prepared,
    timeline: &'a Timeline,
    window: &'a Window,
    shift: u32,
    cut: Cut,
    track: usize,
    chunk: &'a mut WorkChunk,
}

impl Emit for RunItems<'_> {
    #[inline(always)]
    fn run(&mut self, run: Run) {
        let chunk = &mut *self.chunk;
        let output = |sample| self.window.place(self.track, sample) as u32 + self.shift;
        let samples = run.sample..run.sample + run.count;
        if let RunSource::Exact { index, parameter } = run.source {
            chunk.patches.extend(samples.map(|sample| {
                let (timeline, track) = (self.timeline, self.track);
                let value = (self.prepared).exact(index, parameter, timeline, track, sample);
                (self.window.place(track, sample), value)
            }));
            return;
        }
        let mut first = 0;
        if let RunSource::Segment(_, distance, _) = run.source {
            first = match distance {
                Distance::Near { first } => first as i32,
                Distance::Frames { first } => first,
                Distance::Seconds { middle } => {
                    let own = chunk.distances.len() as i32;
                    let time = |sample| self.timeline.time_at(self.track, sample);
                    let from_middle = |sample| round_f32(time(sample) - middle);
                    chunk.distances.extend(samples.clone().map(from_middle));
                    own
                }
            };
        }
        if self.cut == Cut::Whole {
            let mut whole = item(run.source, output(run.sample), run.count as u32, first);
            if let RunSource::Segment(index, ..) = run.source
                && self.prepared.segments.may_be_tiny(index)
            {
                whole.count |= MAY_BE_TINY;
            }
            chunk.items.push(whole);
            return;
        }
        for done in (0..run.count).step_by(ITEM_SAMPLES as usize) {
            let count = (run.count - done).min(ITEM_SAMPLES as usize) as u32;
            let first = first.wrapping_add(done as i32);
            let output = output(run.sample + done);
            chunk.items.push(item(run.source, output, count, first));
        }
    }
}

/// The item of `count` samples of a run. For a run that the host evaluates its count is 0, and it
/// stores nothing.
#[inline(always)]
pub(crate) fn item(source: RunSource, output: u32, count: u32, first: i32) -> Item {
    let (source, count, scale, offset) = match source {
        RunSource::Constant(source) => (source, count | IS_CONSTANT, 0.0, 0.0),
        RunSource::Segment(index, _, affine) => (index, count, affine.scale, affine.offset),
        RunSource::Exact { .. } => (0, IS_CONSTANT, 0.0, 0.0),
    };
    Item {
        source,
        output,
        count,
        first,
        scale,
        offset,
    }
}
