//! A prepared set: its tracks in groups, and the indices of each track's parts.

use std::borrow::Cow;
use std::mem::take;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::{Quat, Vec3};
use rayon::prelude::*;

use crate::curve::options::{Axes, InterpolationError, KeySigns, Quantity, Speed};
use crate::memory::OutOfMemoryError;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::{ScalarQuantity, VectorMethod};
use crate::prepare::error::SetError;
use crate::prepare::preparation::{
    Batch, BatchSize, PART_INTERVALS, Preparation, SetRequest, batches,
};
use crate::prepare::prepared::{Prepared, segment_size};
use crate::prepare::vectors::{self, VectorRequest};
use crate::shader::Form;
use crate::threads::{self, OutOfThreadsError, on_threads, stop};
use crate::time::frame_clock::TrackCopy;
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::NONE;
use crate::time::spans::TrackPart;
use crate::tracks::set::TrackSet;
use crate::tracks::set::vectors::{Channel, VectorTrack};

/// The number of tracks whose vectors are prepared as one piece of work.
const VECTOR_BATCH: usize = 256;

/// With at least this many consecutive tracks with the same times, it is faster to find their samples once for all of
/// them.
const ALIKE: usize = 4;

/// The prepared tracks on the host, from which the work of every device is computed.
pub(crate) struct ClipData {
    pub(crate) interpolation: Interpolation,
    pub(crate) groups: Vec<Prepared>,
    /// Every part in order of tracks and time, as (group, index in the group).
    parts: Vec<(u32, u32)>,
    /// The start of each track's parts in `parts`, and the end of the last track's.
    tracks: Vec<usize>,
    /// The first and the last key time of the set in seconds.
    pub(crate) time_span: Option<(f64, f64)>,
    /// See [`ClipData::time_classes`].
    time_classes: OnceLock<Vec<u32>>,
}

/// A part and the prepared group whose lists it points into.
#[derive(Clone, Copy)]
pub(crate) struct PartRef<'a> {
    pub(crate) prepared: &'a Prepared,
    pub(crate) part: &'a TrackPart,
}

/// The tracks of a set to prepare, and the timelines for which they are prepared.
pub(crate) struct PrepareRequest<'a> {
    pub(crate) batch: Batch,
    /// Groups are merged while the segments of each stay within this number of bytes, because each becomes a buffer
    /// of a device. With `None` they are not merged.
    pub(crate) group_bytes: Option<usize>,
    /// Groups are made large from the start and not merged, because copying them together would take longer than one
    /// dispatch for each.
    pub(crate) large_groups: bool,
    /// Whether arcs are listed for a device that computes them. This is not possible with signs as authored, because
    /// arcs of more than half a turn are divided in f64.
    pub(crate) lists_arcs: bool,
    /// The only timeline that will be sampled; intervals without a sample of it may be left out.
    pub(crate) only_for: Option<&'a Timeline>,
    /// Whether polynomials are packed ([`Prepared::pack`]). This is worth its time for clips that are kept; groups that
    /// will be merged are not packed.
    pub(crate) packs: bool,
    /// Groups whose memory is reused.
    pub(crate) spare: Vec<Prepared>,
}

impl PrepareRequest<'_> {
    /// All tracks of a set, for any timeline.
    pub(crate) fn all(set: &TrackSet) -> Self {
        Self {
            batch: Batch::Tracks(0..set.track_count()),
            group_bytes: None,
            large_groups: false,
            lists_arcs: false,
            only_for: None,
            packs: false,
            spare: Vec::new(),
        }
    }

    /// The maximum number of keys of a group. If groups are to be large, there are four groups for each thread,
    /// within the limit of bytes.
    fn group_keys(&self, set: &TrackSet, form: Form) -> usize {
        let (Some(limit), true) = (self.group_bytes, self.large_groups) else {
            return PART_INTERVALS;
        };
        let max_keys = limit / (segment_size(form) + size_of::<Quat>()) / 2;
        let each = set.keys_of(self.batch.tracks()) / (4 * threads::count());
        each.min(max_keys).max(PART_INTERVALS)
    }
}

/// Prepares tracks of a set on all threads, in groups of batches, in order.
fn prepare(
    set: &TrackSet,
    interpolation: &Interpolation,
    request: PrepareRequest<'_>,
) -> Result<Vec<Prepared>, SetError> {
    let size = BatchSize {
        keys: request.group_keys(set, interpolation.form()),
        tracks: usize::MAX,
        cut: (interpolation.speed == Speed::AsKeyed).then_some(PART_INTERVALS),
    };
    let only_for = (request.only_for).filter(|_| interpolation.wrap().are_held());
    let lists_arcs = request.lists_arcs
        && interpolation.form() == Form::Arc
        && interpolation.signs == KeySigns::Shortest;
    let first_track = request.batch.tracks().start as u32;
    let packs = request.packs && request.group_bytes.is_none();
    let spare = Mutex::new(request.spare);
    let stop = stop::current();
    let group = |batch: Batch| {
        let reused = spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut prepared = reused.unwrap_or_else(|| Prepared::new(interpolation));
        prepared.clear();
        prepared.segments.are_arcs_listed = lists_arcs;
        let mut preparation = Preparation::new(interpolation);
        if let Some(timeline) = only_for {
            preparation.only_for(timeline, set);
        }
        let keys = match &batch {
            // Only intervals with a sample are prepared, so the number of segments is unknown. The lists are discarded
            // afterwards, so nothing is reserved.
            Batch::Intervals { .. } if preparation.leaves_intervals_out() => 0,
            batch => batch.keys(set),
        };
        prepared.reserve(keys)?;
        stop::during(stop.clone(), || {
            preparation.push(&mut prepared, set, batch.intervals(set))
        })?;
        // The track of a part is relative to the first requested track.
        for part in &mut prepared.parts {
            part.track -= first_track;
        }
        if packs {
            prepared.pack();
        }
        Ok(prepared)
    };
    let batches: Vec<Batch> = batches(set, request.batch, size);
    match batches.len() {
        0 | 1 => batches.into_iter().map(group).collect(),
        _ => on_threads(|| batches.into_par_iter().map(group).collect())?,
    }
}

impl ClipData {
    /// The data of a set that can be interpolated as requested, with nothing prepared: its tracks have no parts.
    pub(crate) fn unprepared(
        set: &TrackSet,
        interpolation: Interpolation,
    ) -> Result<Self, InterpolationError> {
        let no_samples = Timeline::at(Arc::default());
        SetRequest::whole(set, &interpolation, &no_samples).check()?;
        Ok(Self {
            interpolation,
            groups: Vec::new(),
            parts: Vec::new(),
            tracks: vec![0; set.track_count() + 1],
            time_span: set.time_span(),
            time_classes: OnceLock::new(),
        })
    }

    /// Prepares tracks of a set.
    pub(crate) fn new(
        set: &TrackSet,
        interpolation: Interpolation,
        request: PrepareRequest<'_>,
    ) -> Result<Self, SetError> {
        interpolation.check_wraps()?;
        let merged_bytes = request.group_bytes.filter(|_| !request.large_groups);
        let groups = prepare(set, &interpolation, request)?;
        let (tracks, span) = (set.track_count(), set.time_span());
        Ok(Self::of_groups(
            groups,
            tracks,
            span,
            interpolation,
            merged_bytes,
        ))
    }

    /// Prepares a set's translations or scales.
    pub(crate) fn of_vectors(
        set: &TrackSet,
        channel: Channel,
        request: &VectorRequest<'_>,
    ) -> Result<Self, OutOfThreadsError> {
        let rest = match (channel, request.quantity) {
            (Channel::Scale, ScalarQuantity::Value) => Vec3::ONE,
            _ => Vec3::ZERO,
        };
        // A track without vectors gets a single key, which is held.
        let still = VectorTrack {
            times: vec![0.0],
            keys: vec![rest],
            tangents: Vec::new(),
            ups: Vec::new(),
        };
        let track = |index| Cow::Borrowed(set.vectors(channel, index).unwrap_or(&still));
        Self::of_vector_tracks(set.track_count(), set.time_span(), track, request)
    }

    /// Prepares a set's scalars; each pack is a track ([`TrackSet::scalar_packs`]).
    pub(crate) fn of_scalars(
        set: &TrackSet,
        packs: &[usize],
        request: &VectorRequest<'_>,
    ) -> Result<Self, OutOfThreadsError> {
        let track = |index: usize| Cow::Owned(set.packed_scalars(packs[index]..packs[index + 1]));
        Self::of_vector_tracks(packs.len() - 1, set.time_span(), track, request)
    }

    fn of_vector_tracks<'t>(
        track_count: usize,
        time_span: Option<(f64, f64)>,
        track: impl Fn(usize) -> Cow<'t, VectorTrack> + Sync,
        request: &VectorRequest<'_>,
    ) -> Result<Self, OutOfThreadsError> {
        // Vectors count as velocities here, so that outputs that are for rotations only refuse them.
        let interpolation = Interpolation {
            quantity: Quantity::Velocity(Axes::Parent),
            ..*request.interpolation
        };
        let request = VectorRequest {
            interpolation: &interpolation,
            ..*request
        };
        let batches: Vec<usize> = (0..track_count).step_by(VECTOR_BATCH).collect();
        let batch = |first: usize| {
            let mut prepared = Prepared::new(&interpolation);
            prepared.spans.steps = request.method == VectorMethod::Step;
            for index in first..track_count.min(first + VECTOR_BATCH) {
                let track = track(index);
                let track = match request.only_for {
                    Some(timeline) => {
                        let samples = timeline.times(index);
                        vectors::thinned(&track, request.method, interpolation.wrap(), samples)
                    }
                    None => Cow::Borrowed(&*track),
                };
                match request.quantity {
                    ScalarQuantity::Value => {
                        vectors::add(&mut prepared, index, &track, &request);
                    }
                    ScalarQuantity::Velocity | ScalarQuantity::Acceleration => {
                        vectors::add_rates(&mut prepared, index, &track, &request);
                    }
                }
            }
            prepared
        };
        let groups = match batches.len() {
            0 | 1 => batches.into_iter().map(batch).collect(),
            _ => on_threads(|| batches.into_par_iter().map(batch).collect())?,
        };
        Ok(Self::of_groups(
            groups,
            track_count,
            time_span,
            interpolation,
            request.group_bytes,
        ))
    }

    pub(crate) fn of_groups(
        mut groups: Vec<Prepared>,
        track_count: usize,
        time_span: Option<(f64, f64)>,
        interpolation: Interpolation,
        group_bytes: Option<usize>,
    ) -> Self {
        if let Some(limit) = group_bytes {
            groups = merge(groups, limit);
        }
        let mut parts = Vec::new();
        let mut tracks = Vec::with_capacity(track_count + 1);
        for (g, group) in groups.iter().enumerate() {
            for (p, part) in group.parts.iter().enumerate() {
                while tracks.len() <= part.track as usize {
                    tracks.push(parts.len());
                }
                parts.push((g as u32, p as u32));
            }
        }
        tracks.push(parts.len());
        Self {
            interpolation,
            groups,
            parts,
            tracks,
            time_span,
            time_classes: OnceLock::new(),
        }
    }

    /// For each track a number, which consecutive tracks share if their intervals have the same times. It is [`NONE`]
    /// if the track is not [regular](Prepared::is_regular), if its arcs are not those between its stored keys, or if
    /// fewer than [`ALIKE`] consecutive tracks have these times. The numbers are found once, when they are first
    /// needed.
    pub(crate) fn time_classes(&self) -> &[u32] {
        self.time_classes.get_or_init(|| {
            let (mut last, mut class): (&[f64], u32) = (&[], 0);
            let mut end = f64::NAN;
            let mut classes: Vec<u32> = (0..self.track_count())
                .map(|track| {
                    let Some(PartRef { prepared, part }) = self.only_part(track) else {
                        return NONE;
                    };
                    let segments = &prepared.segments;
                    if !prepared.is_regular(part)
                        || segments.are_arcs_listed
                        || segments.form == Form::Arc && !prepared.has_signs_kept(part)
                    {
                        return NONE;
                    }
                    let starts = &prepared.spans.starts[part.spans.clone()];
                    if starts != last || part.end != end {
                        (last, end) = (starts, part.end);
                        class += 1;
                    }
                    class
                })
                .collect();
            for alike in classes.chunk_by_mut(|one, next| one == next) {
                if alike.len() < ALIKE {
                    alike.fill(NONE);
                }
            }
            classes
        })
    }

    /// Takes the groups out, unless a sampler still uses them.
    pub(crate) fn take_groups(data: &mut Arc<Self>) -> Vec<Prepared> {
        Arc::get_mut(data).map_or_else(Vec::new, |data| take(&mut data.groups))
    }

    /// The mean number of a timeline's samples for each span.
    pub(crate) fn samples_of_a_run(&self, timeline: &Timeline) -> usize {
        let spans = self.groups.iter().map(|group| group.spans.starts.len());
        timeline.len() * self.track_count() / spans.sum::<usize>().max(1)
    }

    pub(crate) fn track_count(&self) -> usize {
        self.tracks.len() - 1
    }

    /// The parts of a track as (group, index in the group), in order of time.
    #[inline(always)]
    pub(crate) fn part_indices(&self, track: usize) -> &[(u32, u32)] {
        &self.parts[self.tracks[track]..self.tracks[track + 1]]
    }

    /// The parts of one track that may contain any of `samples`, which are samples of the track
    /// itself, not of its copies; in order of time.
    #[inline]
    pub(crate) fn parts_of(
        &self,
        track: usize,
        timeline: &Timeline,
        samples: Range<usize>,
    ) -> impl Iterator<Item = PartRef<'_>> {
        let all = self.part_indices(track);
        let chosen = match timeline.ticks {
            Ticks::Frames { .. } if all.len() > 2 && !samples.is_empty() => {
                let first = timeline.time_at(track, samples.start);
                let last = timeline.time_at(track, samples.end - 1);
                // The start of a part is the end of the part before.
                let end = |&index: &(u32, u32)| self.part(index).part.end;
                let from = all.partition_point(|index| end(index) < first);
                let to = all.partition_point(|index| end(index) <= last) + 1;
                // One more part on either side: a time within rounding of a boundary may lie on
                // the other side of it.
                &all[from.saturating_sub(1).min(all.len() - 1)..(to + 1).min(all.len())]
            }
            _ => all,
        };
        chosen.iter().map(|&index| self.part(index))
    }

    /// The part of a track that has exactly one part.
    #[inline(always)]
    pub(crate) fn only_part(&self, track: usize) -> Option<PartRef<'_>> {
        match self.part_indices(track) {
            &[only] => Some(self.part(only)),
            _ => None,
        }
    }

    /// The parts of one track in the order in which a copy of it traverses them.
    pub(crate) fn parts_in(
        &self,
        track: usize,
        copy: &TrackCopy,
    ) -> impl Iterator<Item = PartRef<'_>> {
        let all = self.part_indices(track);
        let backwards = copy.is_backwards();
        (0..all.len()).map(move |i| {
            let position = if backwards { all.len() - 1 - i } else { i };
            self.part(all[position])
        })
    }

    /// The copies of a track among some samples.
    pub(crate) fn copies(
        &self,
        track: usize,
        timeline: &Timeline,
        samples: Range<usize>,
    ) -> impl Iterator<Item = TrackCopy> {
        let wrap = self.interpolation.wrap();
        wrap.copies(self.track_span(track), timeline, samples)
    }

    /// The first and the last key time of a track, if its wrap mode needs them.
    fn track_span(&self, track: usize) -> Option<(f64, f64)> {
        let first = self.part(*self.part_indices(track).first()?);
        Some(first.part.extension.as_ref()?.span)
    }

    /// The timeline with explicit times folded into the time range of their track's keys, if the wrap mode repeats
    /// tracks.
    pub(crate) fn folded<'t>(
        &self,
        timeline: &'t Timeline,
    ) -> Result<Cow<'t, Timeline>, OutOfMemoryError> {
        let wrap = self.interpolation.wrap();
        if !wrap.repeats() || matches!(timeline.ticks, Ticks::Frames { .. }) {
            return Ok(Cow::Borrowed(timeline));
        }
        let folded = |track, time| self.folded_time(track, time);
        Ok(Cow::Owned(timeline.map_times(self.track_count(), folded)?))
    }

    /// The time between the keys of a track whose value is repeated at `time`; `time` itself if it is in no other copy
    /// of the track.
    pub(crate) fn folded_time(&self, track: usize, time: f64) -> f64 {
        match self.track_span(track) {
            Some(span) => self.interpolation.wrap().folded(span, time),
            None => time,
        }
    }

    pub(crate) fn part(&self, (group, part): (u32, u32)) -> PartRef<'_> {
        let prepared = &self.groups[group as usize];
        PartRef {
            prepared,
            part: &prepared.parts[part as usize],
        }
    }
}

fn merge(groups: Vec<Prepared>, limit: usize) -> Vec<Prepared> {
    let bytes = |group: &Prepared| {
        group
            .segments
            .bytes_on_device()
            .max(size_of_val(group.constants.as_slice()))
    };
    let mut merged: Vec<Vec<Prepared>> = Vec::new();
    let mut merged_bytes = 0;
    for group in groups {
        let group_bytes = bytes(&group);
        match merged.last_mut() {
            Some(last) if merged_bytes + group_bytes <= limit => {
                merged_bytes += group_bytes;
                last.push(group);
            }
            _ => {
                merged_bytes = group_bytes;
                merged.push(vec![group]);
            }
        }
    }
    merged.into_iter().filter_map(Prepared::together).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method;

    /// Catches lists that grow by doubling: a clip keeps their memory.
    #[test]
    fn prepared_lists_have_hardly_more_room_than_they_need() {
        let times: Vec<f64> = (0..10_000).map(|key| f64::from(key) * 0.01).collect();
        let keys = times.iter().map(|&time| {
            let half = time as f32 * 0.4;
            Quat::from_xyzw(0.0, libm::sinf(half), 0.0, libm::cosf(half))
        });
        let keys: Vec<Quat> = keys.collect();
        let mut set = TrackSet::new();
        for _ in 0..3 {
            set.push("", &times, &keys).unwrap();
        }
        for method in [
            method::STEP,
            method::SLERP,
            method::BESSEL_OVERHAUSER,
            method::C2,
        ] {
            for group_bytes in [None, Some(2 << 20), Some(usize::MAX)] {
                let request = PrepareRequest {
                    group_bytes,
                    packs: true,
                    ..PrepareRequest::all(&set)
                };
                let clip = ClipData::new(&set, method.into(), request).unwrap();
                assert!(group_bytes != Some(usize::MAX) || clip.groups.len() == 1);
                for group in &clip.groups {
                    let (arcs, polynomials) = (&group.segments.arcs, &group.segments.polynomials);
                    let rooms = [
                        (arcs.len(), arcs.capacity()),
                        (polynomials.len(), polynomials.capacity()),
                        (
                            group.segments.packed.len(),
                            group.segments.packed.capacity(),
                        ),
                        (group.constants.len(), group.constants.capacity()),
                        (group.spans.starts.len(), group.spans.starts.capacity()),
                    ];
                    for (len, capacity) in rooms.into_iter().filter(|&(len, _)| len > 0) {
                        let allowed = len + len / 16 + 16;
                        assert!(capacity <= allowed, "{method}, {group_bytes:?}: {rooms:?}");
                    }
                }
            }
        }
    }
}
