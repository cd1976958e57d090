//! Spread runs of tracks with the same key times, which most clips have: the list has the runs of a few tracks, and is
//! repeated for all others. So the device reads a few kilobytes of lists instead of megabytes, and the host makes the
//! runs of one track. Frame by frame the list has the runs of one track, and each lane of a run evaluates another
//! repetition.
//!
//! Tracks with the same times have the same runs. Only the indices of the segment, the constant and the part of the
//! result differ; they grow from each track to the next by the same amounts as from the first to the second. This is
//! checked in what was prepared, not assumed: a curve that was cut, or a track that the host evaluates, has other spans.

use std::iter::zip;

use rayon::prelude::*;

use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::prepared::Prepared;
use crate::shader::{IS_CONSTANT, LINE, List, NEEDS_CARE, NO_KEY, SpreadRun};
use crate::time::error::SampleTimesError;
use crate::time::frames::Ticks;
use crate::time::runs::NONE;
use crate::time::spans::{SpanSource, StoredSource, TrackPart};
use crate::work::lists::spread::{RunCounts, RunRepetitions, SpreadLanes};
use crate::work::lists::{
    GroupItems, ListRequest, ListRoom, PartsList, Work, WorkChunk, WorkShape, may_be_tiny,
    parts_in, spread_list,
};

/// The number of tracks from which on a list is repeated instead of being written for each track.
const LEAST_TRACKS: u32 = 64;

/// The same frame by frame: as many as store a line of rotations together.
const LEAST_TRACKS_OF_FRAME: u32 = LINE;

/// The workgroups along any axis that every device dispatches.
const MAX_WORKGROUPS: u32 = 65_535;

/// The maximum number of tracks in a list that is repeated.
const MAX_TRACKS: u32 = 32;

/// How far the segments and constants of a track are from those of the track before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TrackStride {
    segments: u32,
    constants: u32,
}

impl TrackStride {
    /// From the first of some parts to the second.
    fn between(prepared: &Prepared, first: &TrackPart, second: &TrackPart) -> Self {
        let spans = &prepared.spans;
        let mut stride = Self {
            segments: 0,
            constants: 0,
        };
        for (span, next) in zip(first.spans.clone(), second.spans.clone()) {
            match (spans.source(span), spans.source(next)) {
                (SpanSource::Segment(one), SpanSource::Segment(other)) => {
                    stride.segments = other.wrapping_sub(one);
                }
                (SpanSource::Constant(one), SpanSource::Constant(other)) => {
                    stride.constants = other.wrapping_sub(one);
                }
                _ => {}
            }
            if spans.keys[span] != NONE {
                stride.constants = spans.keys[next].wrapping_sub(spans.keys[span]);
            }
        }
        for (one, other) in zip(held(first), held(second)) {
            if one != NONE {
                stride.constants = other.wrapping_sub(one);
            }
        }
        stride
    }

    /// Whether a part has the spans of the first part, with indices for `tracks` tracks further on.
    fn fits(self, prepared: &Prepared, first: &TrackPart, part: &TrackPart, tracks: u32) -> bool {
        let spans = &prepared.spans;
        let constants = self.constants.wrapping_mul(tracks);
        let segments = self.segments.wrapping_mul(tracks);
        let is_constant = |one: u32, other: u32| match one {
            NONE => other == NONE,
            _ => other != NONE && one.wrapping_add(constants) == other,
        };
        let is_source =
            |one: StoredSource, other: StoredSource| match (one.source(), other.source()) {
                (SpanSource::Segment(one), SpanSource::Segment(other)) => {
                    one.wrapping_add(segments) == other
                }
                (SpanSource::Constant(one), SpanSource::Constant(other)) => is_constant(one, other),
                _ => false,
            };
        let (here, there) = (first.spans.clone(), part.spans.clone());
        part.track == first.track + tracks
            && there.len() == here.len()
            && part.end.to_bits() == first.end.to_bits()
            && zip(held(first), held(part)).all(|(one, other)| is_constant(one, other))
            && zip(&spans.starts[here.clone()], &spans.starts[there.clone()])
                .all(|(one, other)| one.to_bits() == other.to_bits())
            && zip(&spans.keys[here.clone()], &spans.keys[there.clone()])
                .all(|(&one, &other)| is_constant(one, other))
            && zip(&spans.sources[here], &spans.sources[there])
                .all(|(&one, &other)| is_source(one, other))
    }
}

/// The constants that are held before a part and after it.
fn held(part: &TrackPart) -> [u32; 2] {
    [part.before, part.after]
}

/// The runs of a group's tracks, which all have those of the first.
struct SharedGroup {
    group: usize,
    tracks: u32,
    stride: TrackStride,
    /// How far the values of a track are from those of the track before.
    outputs: u32,
    /// The runs of the first track.
    first: WorkChunk,
}

impl SharedGroup {
    /// `None` if the tracks do not have the same runs, or the host evaluates some samples.
    fn new(
        request: ListRequest<'_>,
        window: &Window,
        (group, prepared): (usize, &Prepared),
        parts: &[TrackPart],
    ) -> Result<Option<Self>, SampleTimesError> {
        let tracks = parts.len() as u32;
        // Tracks that repeat have different runs in each copy, so they are listed separately.
        let is_plain = |part: &TrackPart| part.extension.is_none();
        let least = match window.layout {
            Layout::TrackMajor => LEAST_TRACKS,
            Layout::FrameMajor => LEAST_TRACKS_OF_FRAME,
        };
        let ([first, second, ..], true) = (parts, tracks >= least) else {
            return Ok(None);
        };
        let stride = TrackStride::between(prepared, first, second);
        let all = (0..tracks).into_par_iter().zip(parts);
        let fits = |(index, part)| is_plain(part) && stride.fits(prepared, first, part, index);
        if !all.all(fits) {
            return Ok(None);
        }
        let track = first.track as usize;
        let of_track = Window::of(track..track + 1, window.samples.clone(), Layout::TrackMajor);
        let list = PartsList::of_runs((prepared, &parts[..1]), request.timeline, &of_track);
        let mut first = list.list()?;
        if !first.patches.is_empty() {
            return Ok(None);
        }
        for run in &mut first.runs {
            let sample = window.samples.start + run.output as usize;
            run.output = window.offset(track, sample) as u32;
        }
        // A run has the mark for tiny components if any of the tracks needs it, because all tracks share the run.
        first.runs.par_iter_mut().for_each(|run| {
            let segment = |track: u32| run.source.wrapping_add(stride.segments.wrapping_mul(track));
            if run.count & (IS_CONSTANT | NEEDS_CARE) == 0
                && (0..tracks).any(|track| may_be_tiny(prepared, segment(track)))
            {
                run.count |= NEEDS_CARE;
            }
        });
        Ok(Some(Self {
            group,
            tracks,
            stride,
            outputs: match window.layout {
                Layout::TrackMajor => window.samples.len() as u32,
                Layout::FrameMajor => 1,
            },
            first,
        }))
    }

    /// The number of tracks of the list that is repeated: the smallest whose entries fill their workgroups to seven
    /// eighths. `None` if another would be as long as that of all tracks.
    fn tracks_of_list(&self, lanes: SpreadLanes) -> Option<u32> {
        let pieces = lanes.piece_count(&self.first);
        let mut sizes = (0..=MAX_TRACKS.ilog2()).map(|log2| 1 << log2);
        sizes.find(|&tracks: &u32| {
            let used = pieces * tracks as usize;
            let entries = used.next_multiple_of(lanes.runs_of_workgroup());
            8 * (entries - used) <= entries
                && tracks * 4 <= self.tracks
                && self.tracks / tracks <= MAX_WORKGROUPS
        })
    }

    /// The runs of some tracks, from the first on.
    fn runs(&self, first: u32, tracks: u32) -> WorkChunk {
        let shifted = |track: u32| {
            self.first.runs.iter().map(move |run| {
                let constants = track * self.stride.constants;
                let is_constant = run.count & IS_CONSTANT != 0;
                SpreadRun {
                    source: run.source
                        + match is_constant {
                            true => constants,
                            false => track * self.stride.segments,
                        },
                    output: run.output + track * self.outputs,
                    key: match run.key {
                        NO_KEY => NO_KEY,
                        key => key + constants,
                    },
                    ..*run
                }
            })
        };
        WorkChunk {
            runs: (first..first + tracks).flat_map(shifted).collect(),
            ..WorkChunk::default()
        }
    }

    /// The lists of a group: one of some tracks, which is repeated, and one of the remaining tracks. `None` as in
    /// [`SharedGroup::tracks_of_list`].
    fn lists_of_tracks(&self, lanes: SpreadLanes) -> Option<Vec<SharedList>> {
        let tracks = self.tracks_of_list(lanes)?;
        let count = self.tracks / tracks;
        let repetitions = RunRepetitions {
            count,
            segments: tracks * self.stride.segments,
            constants: tracks * self.stride.constants,
            outputs: tracks * self.outputs,
        };
        let done = count * tracks;
        let all = [
            (self.runs(0, tracks), repetitions),
            (self.runs(done, self.tracks - done), RunRepetitions::ONE),
        ];
        let lists = all.into_iter().map(|(chunk, repetitions)| SharedList {
            group: self.group,
            lanes,
            chunk,
            repetitions,
        });
        Some(lists.filter(|list| !list.chunk.runs.is_empty()).collect())
    }

    /// Its list frame by frame: the runs of the first track, repeated for each. `None` if it needs more workgroups than
    /// every device dispatches.
    fn list_of_frames(self, window: &Window) -> Option<SharedList> {
        let samples = window.samples.len() as u32;
        let lanes = SpreadLanes::of_tracks(self.tracks, samples, window.stride() as u32);
        let repetitions = RunRepetitions {
            count: self.tracks,
            segments: self.stride.segments,
            constants: self.stride.constants,
            outputs: self.outputs,
        };
        let entries = lanes.entries(&self.first) as u32;
        let workgroups = lanes.workgroups(entries, repetitions.count);
        let list = SharedList {
            group: self.group,
            lanes,
            chunk: self.first,
            repetitions,
        };
        (workgroups.iter().all(|&count| count <= MAX_WORKGROUPS)).then_some(list)
    }
}

/// Runs of a group, and how often they are evaluated.
struct SharedList {
    group: usize,
    lanes: SpreadLanes,
    chunk: WorkChunk,
    repetitions: RunRepetitions,
}

/// The lists of a window whose tracks have the same key times.
pub(super) struct SharedRuns {
    list: List,
    lists: Vec<SharedList>,
    distances: Vec<f32>,
}

impl SharedRuns {
    /// `None` if the tracks of any group do not have the same runs, or if samples should rather be listed one by one.
    /// Must be called on one of the engine's threads.
    pub(super) fn new(
        request: ListRequest<'_>,
        window: &Window,
    ) -> Result<Option<Self>, SampleTimesError> {
        let timeline = request.timeline;
        // If each track has separate times, no list can be shared.
        if matches!(timeline.ticks, Ticks::Times { stride, .. } if stride > 0) {
            return Ok(None);
        }
        let (mut groups, mut counts) = (Vec::new(), None::<RunCounts>);
        for (index, prepared) in request.clip.groups.iter().enumerate() {
            let parts = parts_in(prepared, window);
            if parts.is_empty() {
                continue;
            }
            let group = SharedGroup::new(request, window, (index, prepared), parts)?;
            let Some(group) = group else {
                return Ok(None);
            };
            let of_group = std::iter::once(&group.first);
            let of_group = RunCounts::of_chunks(of_group, u64::from(group.tracks));
            counts = Some(counts.map_or(of_group, |counts| counts.and(of_group)));
            groups.push(group);
        }
        let Some(counts) = counts else {
            return Ok(None);
        };
        if window.layout == Layout::TrackMajor && counts.are_too_short() {
            return Ok(None);
        }
        let (mut lists, mut distances) = (Vec::new(), Vec::new());
        for mut group in groups {
            // With explicit times, a run contains the index of its first distance.
            if !group.first.distances.is_empty() {
                let before = distances.len() as i32;
                for run in &mut group.first.runs {
                    run.first = run.first.wrapping_add(before);
                }
                distances.append(&mut group.first.distances);
            }
            let of_group = match window.layout {
                Layout::TrackMajor => {
                    group.lists_of_tracks(SpreadLanes::of_runs(counts, request.run_lanes))
                }
                Layout::FrameMajor => group.list_of_frames(window).map(|list| vec![list]),
            };
            let Some(of_group) = of_group else {
                return Ok(None);
            };
            lists.extend(of_group);
        }
        Ok(Some(Self {
            list: spread_list(timeline),
            lists,
            distances,
        }))
    }

    /// Writes the lists into a device's memory.
    pub(super) fn write<'r, R: ListRoom<'r>>(self, memory: R) -> Result<Work, R::Error> {
        let mut first_item = 0;
        let groups = self.lists.iter().map(|list| {
            let items = list.lanes.entries(&list.chunk) as u32;
            first_item += items;
            GroupItems {
                group: list.group,
                first_item: first_item - items,
                items,
                first_output: 0,
                shape: WorkShape::Spread(list.lanes, list.repetitions),
            }
        });
        let groups = groups.collect();
        let sizes = [
            Some(first_item as usize * size_of::<SpreadRun>()),
            Some(size_of_val(&*self.distances)),
            None,
        ];
        let [runs, distances, _] = memory.room(sizes)?;
        let mut runs: &mut [SpreadRun] = bytemuck::cast_slice_mut(runs);
        for SharedList { lanes, chunk, .. } in &self.lists {
            let (of_chunk, others) = runs.split_at_mut(lanes.entries(chunk));
            lanes.write_chunk(chunk, 0, of_chunk);
            runs = others;
        }
        bytemuck::cast_slice_mut(distances).copy_from_slice(&self.distances);
        Ok(Work {
            list: self.list,
            groups,
            patches: Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::gpu::physical::shapes::run_lanes;
    use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
    use crate::method::interpolation::Interpolation;
    use crate::method::slerp::SLERP;
    use crate::method::step::STEP;
    use crate::output::rotations::Layout;
    use crate::prepare::clip_data::{ClipData, PrepareRequest};
    use crate::time::frames::SampleTimes;
    use crate::time::wrap::WrapMode;
    use crate::tracks::set::TrackSet;
    use crate::work::lists::spread::sample_count;
    use crate::work::lists::{Cut, work};

    fn set(times: &[f64], tracks: usize) -> TrackSet {
        let key = |i: usize| {
            // Small rotations, so that no curve is divided.
            let angle = (i * 7919 % 1000) as f32 / 4000.0;
            Quat::from_rotation_x(angle) * Quat::from_rotation_z(0.3 + angle * 0.7)
        };
        let keys = Vec::from_iter((0..times.len() * tracks).map(key));
        TrackSet::with_shared_times(times, &keys).unwrap()
    }

    fn clip(set: &TrackSet, interpolation: Interpolation) -> ClipData {
        let request = PrepareRequest {
            group_bytes: Some(1 << 30),
            ..PrepareRequest::all(set)
        };
        ClipData::new(set, interpolation, request).unwrap()
    }

    /// The source of a sample: a constant; or a segment, the distance from its middle, scale and offset.
    type Source = (bool, u32, i32, [u32; 2]);

    /// The source of every sample, and whether it needs care. Neighbouring samples of a track are `stride` values
    /// apart.
    fn sources(
        runs: impl Iterator<Item = SpreadRun>,
        samples: usize,
        stride: u32,
    ) -> Vec<Option<(Source, bool)>> {
        let mut all = vec![None; samples];
        for run in runs {
            for j in 0..sample_count(&run) {
                let source = if run.count & IS_CONSTANT != 0 {
                    (true, run.source, 0, [0; 2])
                } else if j == 0 && run.key != NO_KEY {
                    (true, run.key, 0, [0; 2])
                } else {
                    let affine = [run.scale, run.offset].map(f32::to_bits);
                    (false, run.source, run.first + j as i32, affine)
                };
                let output = run.output + j * stride;
                let of_sample = &mut all[output as usize];
                assert!(of_sample.is_none(), "sample {output} has two runs");
                *of_sample = Some((source, run.count & NEEDS_CARE != 0));
            }
        }
        all
    }

    /// The runs of all repetitions.
    fn repeated(shared: &SharedRuns) -> impl Iterator<Item = SpreadRun> {
        shared.lists.iter().flat_map(|list| {
            let repetitions = list.repetitions;
            (0..repetitions.count).flat_map(move |number| {
                list.chunk.runs.iter().map(move |run| {
                    let constants = number * repetitions.constants;
                    let segments = number * repetitions.segments;
                    let is_constant = run.count & IS_CONSTANT != 0;
                    SpreadRun {
                        source: run.source + if is_constant { constants } else { segments },
                        key: if run.key == NO_KEY {
                            NO_KEY
                        } else {
                            run.key + constants
                        },
                        output: run.output + number * repetitions.outputs,
                        ..*run
                    }
                })
            })
        })
    }

    /// Keys on frames and off them, steps, cubics, listed times, and parts of a result in either layout: what is repeated
    /// gives every sample from the source that the list of all tracks names.
    #[test]
    fn repeated_lists_give_what_lists_of_all_tracks_give() {
        let on_frames = Vec::from_iter((0..26).map(|i| 0.8 * f64::from(i)));
        let off_frames = Vec::from_iter((0..26).map(|i| 0.037 + 0.7123 * f64::from(i)));
        let at = SampleTimes::at(Vec::from_iter((0..900).map(|i| 0.021 * f64::from(i) - 0.2)));
        let frames = SampleTimes::fps(60).between(-0.5, 20.5);
        for (times, method, frames) in [
            (&on_frames, SLERP, &frames),
            (&off_frames, SLERP, &frames),
            (&on_frames, BESSEL_OVERHAUSER, &frames),
            (&on_frames, STEP, &frames),
            (&off_frames, SLERP, &at),
        ] {
            let clip = &clip(&set(times, 205), method.into());
            let timeline = &frames.resolve(205, clip.time_span).unwrap();
            let samples = timeline.len();
            let request = ListRequest {
                maps_samples: true,
                run_lanes: run_lanes(0),
                clip,
                timeline,
            };
            for (tracks, part) in [(0..205, 0..samples), (7..201, 100..700)] {
                let of_layout = |layout| Window::of(tracks.clone(), part.clone(), layout);
                let by_track = of_layout(Layout::TrackMajor);
                let lists = work(clip, timeline, &by_track, Cut::Spread, &mut Vec::new()).unwrap();
                let all = lists.iter().flat_map(|list| &list.chunks);
                let distance = |chunk: &WorkChunk| chunk.distances.clone();
                let all_distances: Vec<f32> = all.clone().flat_map(distance).collect();
                let all = all.flat_map(|chunk| &chunk.runs).copied();
                let all = sources(all, by_track.len(), 1);
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let window = of_layout(layout);
                    let shared = SharedRuns::new(request, &window).unwrap();
                    let shared = shared.unwrap_or_else(|| panic!("{method}, {layout:?}"));
                    let distances = &shared.distances;
                    let stride = window.stride() as u32;
                    let found = sources(repeated(&shared), window.len(), stride);
                    for track in tracks.clone() {
                        for sample in part.clone() {
                            let found = found[window.offset(track, sample)];
                            let expected = all[by_track.offset(track, sample)];
                            let (Some((mut found, care)), Some((mut expected, needs_care))) =
                                (found, expected)
                            else {
                                panic!("{method}: {track}, {sample}: {found:?}, {expected:?}");
                            };
                            assert!(care || !needs_care, "{method}: {track}, {sample}");
                            // With listed times, the distances are compared instead of their indices. Samples at keys
                            // have no distance.
                            if !distances.is_empty() && !found.0 && !expected.0 {
                                let of = |list: &[f32], index: i32| {
                                    list[index as usize].to_bits() as i32
                                };
                                found.2 = of(distances, found.2);
                                expected.2 = of(&all_distances, expected.2);
                            }
                            assert_eq!(found, expected, "{method}, {layout:?}: {track}, {sample}");
                        }
                    }
                }
            }
        }
    }

    /// 4096 tracks of 26 keys, at 1200 frames: a list of four tracks instead of 3.3 MB.
    #[test]
    fn lists_of_tracks_with_the_same_times_are_a_thousandth_as_long() {
        let times = Vec::from_iter((0..26).map(|i| 0.8 * f64::from(i)));
        let clip = &clip(&set(&times, 4096), SLERP.into());
        let frames = SampleTimes::fps(60).between(0.0, 20.0 - 1.0 / 60.0);
        let timeline = &frames.resolve(4096, clip.time_span).unwrap();
        let window = Window::whole(4096, timeline.len(), Layout::TrackMajor);
        let request = ListRequest {
            maps_samples: true,
            run_lanes: run_lanes(0),
            clip,
            timeline,
        };
        let bytes = |shared: &SharedRuns| {
            let lists = shared.lists.iter();
            let entries = lists.map(|list| list.lanes.entries(&list.chunk));
            Vec::from_iter(entries.map(|entries| entries * size_of::<SpreadRun>()))
        };
        let shared = SharedRuns::new(request, &window).unwrap().unwrap();
        assert_eq!(bytes(&shared), [3_584]);
        assert_eq!(shared.lists[0].repetitions.count, 1024);
        // Frame by frame, the list has the runs of one track: 25 runs of 48 frames, each in two pieces. A workgroup
        // evaluates 128 tracks.
        let by_frames = Window::whole(4096, timeline.len(), Layout::FrameMajor);
        let shared = SharedRuns::new(request, &by_frames).unwrap().unwrap();
        assert_eq!(bytes(&shared), [1_600]);
        let SharedList {
            lanes, repetitions, ..
        } = shared.lists[0];
        assert_eq!(lanes.workgroups(50, repetitions.count), [50, 1, 32]);
        let lists = work(clip, timeline, &window, Cut::Spread, &mut Vec::new()).unwrap();
        let runs: usize = lists[0].chunks.iter().map(|chunk| chunk.runs.len()).sum();
        assert_eq!(runs * size_of::<SpreadRun>(), 3_276_800);
    }

    /// Other times in one track, few tracks, and tracks in copies have lists of their own.
    #[test]
    fn tracks_that_differ_are_listed() {
        let times = Vec::from_iter((0..26).map(|i| 0.8 * f64::from(i)));
        let mut other = set(&times, 99);
        let keys = [Quat::IDENTITY, Quat::from_rotation_y(0.5)];
        other.push("", &[0.0, 20.0], &keys).unwrap();
        let looped = Interpolation {
            after: WrapMode::Loop,
            ..SLERP.into()
        };
        for (set, interpolation) in [
            (set(&times, 63), SLERP.into()),
            (set(&times, 100), looped),
            (other, SLERP.into()),
        ] {
            let clip = &clip(&set, interpolation);
            let frames = SampleTimes::fps(60).between(0.0, 50.0);
            let timeline = &frames.resolve(clip.track_count(), clip.time_span).unwrap();
            let window = Window::whole(clip.track_count(), timeline.len(), Layout::TrackMajor);
            let request = ListRequest {
                maps_samples: true,
                run_lanes: run_lanes(0),
                clip,
                timeline,
            };
            assert!(SharedRuns::new(request, &window).unwrap().is_none());
            // Frame by frame 63 tracks are enough.
            let by_frames = Window::whole(clip.track_count(), timeline.len(), Layout::FrameMajor);
            let shared = SharedRuns::new(request, &by_frames).unwrap();
            assert_eq!(shared.is_some(), clip.track_count() == 63);
        }
    }
}
