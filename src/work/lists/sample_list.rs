//! The sample list: a work list with an entry for every sample of a window, in the order of storage. It is used for
//! dense keys (no more samples than spans) and for sparse times (a few explicit times of each track, such as a
//! crowd's poses); other windows are listed by runs.

use rayon::prelude::*;

use crate::cpu::evaluate::SAMPLES_ONE_BY_ONE;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::prepared::Prepared;
use crate::shader::{IS_CONSTANT, List, ListedSample};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::{FrameClock, TrackCopy};
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::{Affine, Emit, Run, RunSource};
use crate::time::spans::TrackPart;
use crate::work::lists::{GroupItems, Patch, Work, WorkShape, parts_in, parts_per_chunk};

/// Whether the runs of a window are short.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum KeyDensity {
    /// Not listed before: they count as short if there are no more samples than spans, or few explicit times.
    Unknown,
    /// The runs were listed before, and are short.
    ShortRuns,
}

/// A window whose samples are listed separately.
pub(crate) struct SampleList<'a> {
    timeline: &'a Timeline,
    window: &'a Window,
    /// The parts of each group with samples in the window, in the order of their samples.
    groups: Vec<GroupParts<'a>>,
}

struct GroupParts<'a> {
    group: usize,
    prepared: &'a Prepared,
    parts: &'a [TrackPart],
    /// The offset of the first part's samples in the window.
    first: usize,
}

impl<'a> SampleList<'a> {
    /// `None` for a window that is listed by runs: one with longer runs than `keys` says, or whose samples are not
    /// stored in the order of the parts that have them.
    pub(crate) fn new(
        clip: &'a ClipData,
        timeline: &'a Timeline,
        window: &'a Window,
        keys: KeyDensity,
    ) -> Option<Self> {
        let samples = window.samples.len();
        let are_rows = window.layout == Layout::TrackMajor || samples == 1;
        if !are_rows || clip.interpolation.wrap().repeats() {
            return None;
        }
        let mut all = Self {
            timeline,
            window,
            groups: Vec::new(),
        };
        let (mut spans, mut part_count) = (0, 0);
        let mut before: Option<&TrackPart> = None;
        for (group, prepared) in clip.groups.iter().enumerate() {
            let parts = parts_in(prepared, window);
            let [part, ..] = parts else { continue };
            // An estimate: spans are not always in the order of the parts, but parts have about equally many.
            spans += prepared.spans.starts.len() * parts.len() / prepared.parts.len();
            part_count += parts.len();
            let first = all.start(prepared, part, before);
            before = parts.last();
            all.groups.push(GroupParts {
                group,
                prepared,
                parts,
                first,
            });
        }
        let is_dense = keys == KeyDensity::ShortRuns
            || timeline.len().saturating_mul(window.tracks.len()) <= spans;
        let are_listed = match timeline.ticks {
            Ticks::Frames { .. } => is_dense,
            // Explicit times may alternate between the parts of a track, so each track must have only one part.
            Ticks::Times { .. } => {
                part_count == window.tracks.len() && (is_dense || samples <= SAMPLES_ONE_BY_ONE)
            }
        };
        let starts = all.groups.iter().map(|group| group.first);
        let are_in_order = starts.clone().next() == Some(0) && starts.is_sorted();
        (are_listed && are_in_order).then_some(all)
    }

    /// The offset of a part's samples in the window; `before` is the part listed before it.
    fn start(&self, prepared: &Prepared, part: &TrackPart, before: Option<&TrackPart>) -> usize {
        let samples = &self.window.samples;
        let row = (part.track as usize - self.window.tracks.start) * samples.len();
        let Ticks::Frames { rate, start } = self.timeline.ticks else {
            return row;
        };
        if before.is_none_or(|before| before.track != part.track) {
            return row;
        }
        let starts = &prepared.spans.starts[part.spans.clone()];
        let clock = FrameClock::new(rate, start, prepared.spans.steps);
        let first = clock.first_frame(starts.first().copied().unwrap_or(part.end));
        row + (first as usize).clamp(samples.start, samples.end) - samples.start
    }

    /// Writes the list, on the engine's threads.
    pub(crate) fn write(&self, mut list: &mut [ListedSample]) -> Result<Work, SampleTimesError> {
        let mut chunks = Vec::new();
        let mut groups = Vec::new();
        for (i, group) in self.groups.iter().enumerate() {
            let end = (self.groups.get(i + 1)).map_or(self.window.len(), |next| next.first);
            groups.push(GroupItems {
                group: group.group,
                first_item: group.first as u32,
                items: (end - group.first) as u32,
                first_output: group.first as u32,
                shape: WorkShape::Alone,
            });
            let each = parts_per_chunk(self.window);
            let mut first = group.first;
            for (parts, next) in group.parts.chunks(each).zip((each..).step_by(each)) {
                let next = group.parts.get(next);
                let next = next.map_or(end, |next| self.start(group.prepared, next, parts.last()));
                let next = next.max(first).min(end);
                chunks.push(SampleChunk {
                    all: self,
                    prepared: group.prepared,
                    parts,
                    first,
                    list: list.split_off_mut(..next - first).unwrap_or_default(),
                    track: 0,
                    listed: 0,
                    patches: Vec::new(),
                    result: Ok(()),
                });
                first = next;
            }
        }
        let chunks: Vec<_> = chunks
            .into_par_iter()
            .map(|mut chunk| {
                in_lanes(&mut chunk);
                chunk.result.map(|()| chunk.patches)
            })
            .collect();
        // If several chunks fail, the error of the first is returned.
        let patches = chunks.into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(Work {
            list: List::Samples,
            groups,
            patches: patches.concat(),
        })
    }
}

/// The chunk of the list that one thread writes.
struct SampleChunk<'a> {
    all: &'a SampleList<'a>,
    prepared: &'a Prepared,
    parts: &'a [TrackPart],
    /// The offset of its first sample in the window.
    first: usize,
    list: &'a mut [ListedSample],
    /// The track of the current runs.
    track: usize,
    /// The number of samples that are listed already.
    listed: usize,
    patches: Vec<Patch>,
    result: Result<(), SampleTimesError>,
}

impl InLanes for SampleChunk<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (timeline, window) = (self.all.timeline, self.all.window);
        let (prepared, parts) = (self.prepared, self.parts);
        if let Ticks::Times { times, stride } = &timeline.ticks
            && window.samples.len() <= SAMPLES_ONE_BY_ONE
        {
            for part in parts {
                let times = &times[part.track as usize * stride..];
                self.list_sparse_times(part, times);
            }
        } else {
            let copy = TrackCopy::of_track(window.samples.clone());
            for part in parts {
                self.track = part.track as usize;
                let listed = prepared.spans.runs(part, timeline, &copy, self);
                if listed.is_err() {
                    self.result = listed;
                    return;
                }
            }
        }
        self.list[self.listed..].fill(NOTHING);
    }
}

/// A sample outside every segment, or one that the host computes in f64.
const NOTHING: ListedSample = held(0);

const fn held(constant: u32) -> ListedSample {
    ListedSample {
        source: constant | IS_CONSTANT,
        parameter: 0.0,
    }
}

impl Emit for SampleChunk<'_> {
    /// Lists the samples of a run that belong to this chunk and are not listed yet.
    #[inline(always)]
    fn run(&mut self, run: Run) {
        let (timeline, window) = (self.all.timeline, self.all.window);
        let track = self.track;
        let offset = window.offset(track, run.sample);
        // A sample within rounding of the boundary between two parts may come from both: the first
        // one counts.
        let skipped = (self.first + self.listed).saturating_sub(offset);
        let from = (offset + skipped - self.first).min(self.list.len());
        let to = (offset + run.count)
            .saturating_sub(self.first)
            .min(self.list.len());
        if from >= to {
            return;
        }
        if self.listed < from {
            self.list[self.listed..from].fill(NOTHING);
        }
        self.listed = to;
        let samples = &mut self.list[from..to];
        let first_sample = run.sample + skipped;
        match run.source {
            RunSource::Constant(constant) => samples.fill(held(constant)),
            RunSource::Segment(source, distance, Affine { scale, offset }) => {
                for (j, single) in samples.iter_mut().enumerate() {
                    let time = || timeline.time_at(track, first_sample + j);
                    let parameter = distance.at_sample(skipped + j, time) * scale + offset;
                    *single = ListedSample { source, parameter };
                }
            }
            RunSource::Exact { index, parameter } => {
                samples.fill(NOTHING);
                for sample in first_sample..first_sample + samples.len() {
                    let value = self
                        .prepared
                        .exact(index, parameter, timeline, track, sample);
                    self.patches.push((window.offset(track, sample), value));
                }
            }
        }
    }
}

impl SampleChunk<'_> {
    /// Lists the few samples of a part without runs.
    #[inline(always)]
    fn list_sparse_times(&mut self, part: &TrackPart, times: &[f64]) {
        self.track = part.track as usize;
        for sample in self.all.window.samples.clone() {
            let spans = &self.prepared.spans;
            self.list[self.listed] = match spans.source_at(part, times[sample]) {
                Some(RunSource::Constant(constant)) => held(constant),
                Some(RunSource::Segment(source, distance, Affine { scale, offset })) => {
                    let parameter = distance.at_sample(0, || times[sample]) * scale + offset;
                    ListedSample { source, parameter }
                }
                // The sample is outside the keys of the track: it is a constant or a curve, and is listed as a run.
                _ => {
                    spans.runs_of_times(part, times, sample..sample + 1, self);
                    continue;
                }
            };
            self.listed += 1;
        }
    }
}
