//! Samples of a clip one at a time, for programs that need a pose now: a game's frame, a controller's tick.
//!
//! A request checks its times, makes a timeline and chooses a route, which takes longer than evaluating a few samples.
//! A sampler is made once. It remembers the span of time where it sampled last, for all tracks that share their key
//! times: the next sample there needs neither a search nor a division.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::ops::Range;
use std::sync::Arc;

use bytemuck::Zeroable as _;
use glam::{Quat, Vec4};

use crate::checks::check_rows;
use crate::cpu::evaluate::SAMPLES_ONE_BY_ONE;
use crate::curve::options::{Ends, Quantity};
use crate::error::Error;
use crate::evaluate::uploaded::ClipSource;
use crate::fit::tangent_weights::WeightRule;
use crate::from_keys::kept::{KeptKeys, TimeBetweenKeys, TracksInLanes};
use crate::output::value::OutputValue;
use crate::prepare::arcs::listed_arcs;
use crate::prepare::clip_data::{ClipData, PartRef};
use crate::prepare::prepared::Prepared;
use crate::shader::{ArcSegment, Form, TangentWeights};
use crate::simd::dispatch::{InLanesInto, VectorWidth, in_lanes_into};
use crate::simd::lanes::{Lanes, MAX_LANES, canonical};
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::{InSeconds, in_seconds};
use crate::time::runs::{NONE, Parameter, RunSource};
use crate::time::spans::{SpanSource, outside};
use crate::time::times::interval_at;
use crate::tracks::error::TrackError;
use crate::twin::Evaluate as _;
use crate::twin::evaluate_arc::{norm_squared, on_arc};

/// Evaluates a [`Clip`](crate::Clip) at one time after another, on the calling thread
/// ([`Clip::sampler`](crate::Clip::sampler)).
///
/// Every value has the bits that the clip's evaluation at [listed times](crate::SampleTimes::at) has. Times may be in
/// any order; sampling is fastest if most times are near the time before. Nothing is allocated after the sampler was
/// made. A clone is independent, for another thread or another playback of the same clip. Clones share the prepared
/// tracks, also after the clip was dropped.
///
/// ```
/// use glam::Quat;
/// use tumble::{Device, Engine, TrackSet, method};
///
/// let mut set = TrackSet::new();
/// let keys = [0.0, 0.7, 2.0].map(Quat::from_rotation_z);
/// set.push("elbow", &[0.0, 0.5, 1.0], &keys)?;
/// set.push("wrist", &[0.0, 0.5, 1.0], &keys)?;
/// let mut sampler = Engine::new(Device::Cpu)?.upload(&set, method::SLERP)?.sampler()?;
///
/// assert_eq!(sampler.sample(0, 0.5)?, keys[1]);
/// let mut pose = [Quat::IDENTITY; 2];
/// for frame in 0..60 {
///     sampler.pose(f64::from(frame) / 60.0, &mut pose)?;
/// }
/// # Ok::<(), tumble::Error>(())
/// ```
#[derive(Clone)]
pub struct Sampler {
    clip: Arc<SampledClip>,
    /// One for each group of tracks with the same spans of time.
    cursors: Vec<Cursor>,
}

/// The data of a sampler that its clones share.
struct SampledClip {
    groups: Vec<SampledGroup>,
    parts: Vec<SampledPart>,
    tracks: Vec<SampledTrack>,
    /// All tracks, in order.
    batches: Vec<TrackBatch>,
    quantity: Quantity,
    width: VectorWidth,
    bytes_per_key: f64,
}

/// Consecutive tracks that are evaluated together in poses: a single one, or several of one group and one cursor, each
/// with one part.
struct TrackBatch {
    tracks: Range<usize>,
    has_one_part: bool,
}

/// Tracks that are sampled from the same lists.
enum SampledGroup {
    Prepared(PreparedGroup),
    Keys(Arc<KeptKeys>),
}

/// A group of prepared tracks.
struct PreparedGroup {
    clip: Arc<ClipData>,
    /// Its index among the groups of `clip`.
    index: usize,
    /// Its arcs, if a device computes them from a list; else empty.
    arcs: Vec<ArcSegment>,
}

/// A part of a track; a whole track of a group of keys.
struct SampledPart {
    /// An index in [`SampledClip::groups`].
    group: u32,
    /// The track's index in its clip.
    track: u32,
    /// The index in the group of its first span, or of its first key.
    first_span: usize,
}

struct SampledTrack {
    /// The index in [`SampledClip::parts`] of its first part.
    first_part: usize,
    /// The track's index in its [`ClipData`].
    index: usize,
    cursor: usize,
}

/// The span of time in which the last sample was.
#[derive(Clone, Copy)]
struct Cursor {
    /// Seconds; `end` is in the next span.
    start: f64,
    end: f64,
    in_seconds: InSeconds,
    /// The number of the part, counted in each track, and of the span, counted in the part.
    part: usize,
    span: usize,
    /// The tangent weights of the keys at both ends of the span, for tracks that are sampled from keys.
    weights: [TangentWeights; 2],
}

impl Cursor {
    #[inline(always)]
    fn contains(&self, time: f64) -> bool {
        self.start <= time && time < self.end
    }

    /// The value of a curve that is evaluated in f64.
    #[cold]
    fn exact(&self, prepared: &Prepared, index: u32, time: f64) -> [f32; 4] {
        let (start, length) = (self.start, self.end - self.start);
        prepared.exact_at_time(index, Parameter { start, length }, time)
    }

    /// In no span.
    fn new() -> Self {
        Self {
            start: f64::INFINITY,
            end: f64::NEG_INFINITY,
            in_seconds: in_seconds(1.0),
            part: 0,
            span: 0,
            weights: [TangentWeights::zeroed(); 2],
        }
    }

    /// A time in the span, for tracks that are sampled from keys.
    #[inline(always)]
    fn between_keys(&self, time: f64) -> TimeBetweenKeys {
        TimeBetweenKeys {
            key: self.span,
            weights: self.weights,
            end: self.end,
            time,
            parameter: self.in_seconds.parameter(time - self.start),
        }
    }
}

impl Sampler {
    /// A sampler of tracks in several clips: for each track the index of its clip in `clips`, and its index there.
    pub(crate) fn new(
        clips: Vec<ClipSource>,
        tracks: Vec<(usize, usize)>,
        quantity: Quantity,
        width: VectorWidth,
        bytes_per_key: f64,
    ) -> Self {
        let mut groups = Vec::new();
        let mut first_groups = Vec::with_capacity(clips.len());
        for clip in &clips {
            first_groups.push(groups.len());
            match clip {
                ClipSource::Segments(clip) => {
                    groups.extend((clip.groups.iter().enumerate()).map(|(index, prepared)| {
                        SampledGroup::Prepared(PreparedGroup {
                            clip: Arc::clone(clip),
                            index,
                            arcs: listed_arcs(prepared),
                        })
                    }));
                }
                ClipSource::Keys(keys) => groups.push(SampledGroup::Keys(Arc::clone(keys))),
            }
        }
        let mut sampled = SampledClip {
            groups,
            parts: Vec::new(),
            tracks: Vec::new(),
            batches: Vec::new(),
            quantity,
            width,
            bytes_per_key,
        };
        // For each hash of times: the cursors with these times, each with one of its tracks.
        let mut known: HashMap<u64, Vec<(usize, usize, usize)>> = HashMap::new();
        let mut cursors = 0;
        for (clip, index) in tracks {
            let first_part = sampled.parts.len();
            let mut push = |group: u32, first_span| {
                sampled.parts.push(SampledPart {
                    group: first_groups[clip] as u32 + group,
                    track: index as u32,
                    first_span,
                });
            };
            let source = &clips[clip];
            match source {
                ClipSource::Segments(data) => {
                    for &(group, part) in data.part_indices(index) {
                        push(group, data.part((group, part)).part.spans.start);
                    }
                }
                ClipSource::Keys(keys) => push(0, keys.set.first_key(index)),
            }
            let times = times_of(source, index);
            let alike = known.entry(hash_of_times(&times)).or_default();
            let is_alike = |&&(_, other, track): &&(usize, usize, usize)| {
                let other = &clips[other];
                weight_rule(source) == weight_rule(other) && times == times_of(other, track)
            };
            let cursor = match alike.iter().find(is_alike) {
                Some(&(cursor, ..)) => cursor,
                None => {
                    alike.push((cursors, clip, index));
                    cursors += 1;
                    cursors - 1
                }
            };
            sampled.push(SampledTrack {
                first_part,
                index,
                cursor,
            });
        }
        Self {
            clip: Arc::new(sampled),
            cursors: vec![Cursor::new(); cursors],
        }
    }

    /// Number of tracks.
    #[must_use]
    pub fn track_count(&self) -> usize {
        self.clip.tracks.len()
    }

    /// As [`Clip::bytes_per_key`](crate::Clip::bytes_per_key) of the clip, whose memory the sampler keeps.
    #[must_use]
    pub fn bytes_per_key(&self) -> f64 {
        self.clip.bytes_per_key
    }

    /// The rotation of a track at `time`, which is in seconds.
    ///
    /// # Errors
    /// When there is no such track, the time is not finite, or the clip is of velocities or accelerations, which
    /// [`Sampler::pose_of`] evaluates.
    pub fn sample(&mut self, track: usize, time: f64) -> Result<Quat, Error> {
        check_rows::<Quat>(self.clip.quantity)?;
        let Some(sampled) = self.clip.tracks.get(track) else {
            return Err(self.no_such_track(track));
        };
        let value = self.clip.value(sampled, &mut self.cursors, time)?;
        Ok(Quat::from_array(value))
    }

    /// Stores the value of every track at `time`, which is in seconds, in `output`, which has an element for each
    /// track.
    ///
    /// # Errors
    /// When the time is not finite, `output` is not exactly as long as there are tracks, or its type does not fit the
    /// clip's quantity.
    pub fn pose<R: OutputValue>(&mut self, time: f64, output: &mut [R]) -> Result<(), Error> {
        check_rows::<R>(self.clip.quantity)?;
        self.fill(None, time, bytemuck::cast_slice_mut(output))
    }

    /// Stores the values of some tracks at `time`, which is in seconds, in `output`, which has an element for each of
    /// `tracks`.
    ///
    /// # Errors
    /// As [`Sampler::pose`]; also when there is no such track. Then nothing is written.
    pub fn pose_of<R: OutputValue>(
        &mut self,
        tracks: &[usize],
        time: f64,
        output: &mut [R],
    ) -> Result<(), Error> {
        check_rows::<R>(self.clip.quantity)?;
        self.fill(Some(tracks), time, bytemuck::cast_slice_mut(output))
    }

    /// The values of some tracks, or of all. Not generic: it is compiled with this crate's optimisation.
    fn fill(
        &mut self,
        tracks: Option<&[usize]>,
        time: f64,
        output: &mut [[f32; 4]],
    ) -> Result<(), Error> {
        let count = self.track_count();
        let (length, needed) = (output.len(), tracks.map_or(count, <[usize]>::len));
        if length != needed {
            return Err(Error::OutputLength { length, needed });
        }
        let (clip, cursors) = (&*self.clip, &mut self.cursors[..]);
        let Some(tracks) = tracks else {
            return Ok(clip.pose(cursors, time, output)?);
        };
        if let Some(&missing) = tracks.iter().find(|&&track| track >= count) {
            return Err(self.no_such_track(missing));
        }
        for (&track, value) in tracks.iter().zip(output) {
            *value = clip.value(&clip.tracks[track], cursors, time)?;
        }
        Ok(())
    }

    #[cold]
    fn no_such_track(&self, track: usize) -> Error {
        let tracks = self.track_count();
        TrackError::NoSuchTrack { track, tracks }.into()
    }
}

impl std::fmt::Debug for Sampler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sampler")
            .field("tracks", &self.track_count())
            .finish_non_exhaustive()
    }
}

impl SampledClip {
    /// Adds a track, whose parts were added last.
    fn push(&mut self, track: SampledTrack) {
        let has_one_part = self.parts.len() == track.first_part + 1;
        let is_beside = |batch: &&mut TrackBatch| {
            let other = &self.tracks[batch.tracks.start];
            let group_of = |track: &SampledTrack| self.parts[track.first_part].group;
            batch.has_one_part
                && has_one_part
                && other.cursor == track.cursor
                && group_of(other) == group_of(&track)
        };
        let index = self.tracks.len();
        match self.batches.last_mut().filter(is_beside) {
            Some(batch) => batch.tracks.end = index + 1,
            None => self.batches.push(TrackBatch {
                tracks: index..index + 1,
                has_one_part,
            }),
        }
        self.tracks.push(track);
    }

    /// The values of all tracks at a time, with their cursors.
    fn pose(
        &self,
        cursors: &mut [Cursor],
        time: f64,
        mut output: &mut [[f32; 4]],
    ) -> Result<(), SampleTimesError> {
        for batch in &self.batches {
            let tracks = &self.tracks[batch.tracks.clone()];
            let (values, rest) = output.split_at_mut(tracks.len());
            output = rest;
            let [first, _, ..] = tracks else {
                values[0] = self.value(&tracks[0], cursors, time)?;
                continue;
            };
            let cursor = &mut cursors[first.cursor];
            let mut time = time;
            if !cursor.contains(time) {
                time = self.folded(first, time)?;
                if !self.move_to(first, cursor, time) {
                    for (track, value) in tracks.iter().zip(values) {
                        *value = self.outside(track, time);
                    }
                    continue;
                }
            }
            let parts = &self.parts[first.first_part..][..tracks.len()];
            let at_cursor = TracksAtCursor {
                group: &self.groups[parts[0].group as usize],
                parts,
                cursor,
                time,
            };
            in_lanes_into(self.width, &at_cursor, &(), values);
        }
        Ok(())
    }

    /// The value of a track at a time, with its cursor among `cursors`, which moves if it was elsewhere.
    #[inline(always)]
    fn value(
        &self,
        track: &SampledTrack,
        cursors: &mut [Cursor],
        time: f64,
    ) -> Result<[f32; 4], SampleTimesError> {
        let cursor = &mut cursors[track.cursor];
        if cursor.contains(time) {
            return Ok(self.at_cursor(track, cursor, time));
        }
        self.find(track, cursor, time)
    }

    /// The value at a time in the span of the cursor.
    #[inline(always)]
    fn at_cursor(&self, track: &SampledTrack, cursor: &Cursor, time: f64) -> [f32; 4] {
        let part = &self.parts[track.first_part + cursor.part];
        let group = match &self.groups[part.group as usize] {
            SampledGroup::Prepared(group) => group,
            SampledGroup::Keys(keys) => return of_keys(keys, part, cursor, time),
        };
        let prepared = group.prepared();
        match source_at(prepared, part, cursor, time) {
            SpanSource::Segment(index) => {
                let parameter = cursor.in_seconds.parameter(time - cursor.start);
                group.at_parameter(index, parameter)
            }
            SpanSource::Constant(index) => prepared.constants[index as usize],
            SpanSource::Exact(index) => cursor.exact(prepared, index, time),
        }
    }

    /// The value at a time outside the span of the cursor, which moves to the time's span if there is one.
    #[cold]
    #[inline(never)]
    fn find(
        &self,
        track: &SampledTrack,
        cursor: &mut Cursor,
        time: f64,
    ) -> Result<[f32; 4], SampleTimesError> {
        let time = self.folded(track, time)?;
        Ok(match self.move_to(track, cursor, time) {
            true => self.at_cursor(track, cursor, time),
            false => self.outside(track, time),
        })
    }

    /// The group of a track's first part; `None` if it has no parts.
    fn group_of(&self, track: &SampledTrack) -> Option<&SampledGroup> {
        let first = self.parts.get(track.first_part)?;
        self.groups.get(first.group as usize)
    }

    /// The time between the keys whose value a track that repeats has at `time`.
    fn folded(&self, track: &SampledTrack, time: f64) -> Result<f64, SampleTimesError> {
        if !time.is_finite() {
            return Err(SampleTimesError::TimeNotFinite { index: 0, time });
        }
        Ok(match self.group_of(track) {
            Some(SampledGroup::Prepared(group)) => group.clip.folded_time(track.index, time),
            _ => time,
        })
    }

    /// Moves a cursor to the span of a time; returns whether there is one.
    fn move_to(&self, track: &SampledTrack, cursor: &mut Cursor, time: f64) -> bool {
        if cursor.contains(time) {
            return true;
        }
        let clip = match self.group_of(track) {
            Some(SampledGroup::Prepared(group)) => &group.clip,
            Some(SampledGroup::Keys(keys)) => return move_among_keys(keys, track, cursor, time),
            None => return false,
        };
        let parts = clip.part_indices(track.index);
        let number = parts.partition_point(|&index| clip.part(index).part.end <= time);
        let Some(&index) = parts.get(number) else {
            return false;
        };
        let PartRef { prepared, part } = clip.part(index);
        let starts = &prepared.spans.starts[part.spans.clone()];
        if time < prepared.spans.begin(part) {
            return false;
        }
        let span = interval_at(starts, time, cursor.span);
        let (start, end) = (starts[span], *starts.get(span + 1).unwrap_or(&part.end));
        *cursor = Cursor {
            start,
            end,
            in_seconds: in_seconds(end - start),
            part: number,
            span,
            ..*cursor
        };
        true
    }

    /// The value before the first key, which the track's first part has, or from the last key on, which the last has.
    fn outside(&self, track: &SampledTrack, time: f64) -> [f32; 4] {
        let clip = match self.group_of(track) {
            Some(SampledGroup::Prepared(group)) => &group.clip,
            Some(SampledGroup::Keys(keys)) => {
                let (times, keys) = keys.set.times_and_keys(track.index);
                let held = if time < times[0] { 0 } else { keys.len() - 1 };
                return keys[held].to_array();
            }
            None => return [0.0; 4],
        };
        let parts = clip.part_indices(track.index);
        let is_before = |&index: &(u32, u32)| clip.part(index).part.end > time;
        let number = match parts.first().is_some_and(is_before) {
            true => 0,
            false => parts.len() - 1,
        };
        let PartRef { prepared, part } = clip.part(parts[number]);
        let group = self.parts[track.first_part + number].group as usize;
        let (_, source) = outside(part, prepared.spans.begin(part), time);
        match source {
            Some(RunSource::Constant(index)) => prepared.constants[index as usize],
            Some(RunSource::Segment(index, distance, affine)) => {
                let distance = distance.at_sample(0, || time);
                let parameter = distance * affine.scale + affine.offset;
                match &self.groups[group] {
                    SampledGroup::Prepared(group) => group.at_parameter(index, parameter),
                    SampledGroup::Keys(_) => [0.0; 4],
                }
            }
            Some(RunSource::Exact { index, parameter }) => {
                prepared.exact_at_time(index, parameter, time)
            }
            None => [0.0; 4],
        }
    }
}

/// The source of a part's value at a time in the span of the cursor: the key at exactly its start, if it has one.
#[inline(always)]
fn source_at(prepared: &Prepared, part: &SampledPart, cursor: &Cursor, time: f64) -> SpanSource {
    let span = part.first_span + cursor.span;
    if time == cursor.start {
        let key = prepared.spans.keys[span];
        if key != NONE {
            return SpanSource::Constant(key);
        }
    }
    prepared.spans.source(span)
}

/// Tracks of one group with one part each, at a time in the span of their cursor.
struct TracksAtCursor<'a> {
    group: &'a SampledGroup,
    /// The part of each track.
    parts: &'a [SampledPart],
    cursor: &'a Cursor,
    time: f64,
}

impl InLanesInto<(), [[f32; 4]]> for TracksAtCursor<'_> {
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, (): &(), output: &mut [[f32; 4]]) {
        let group = match self.group {
            SampledGroup::Prepared(group) => group,
            SampledGroup::Keys(keys) => {
                return pose_of_keys::<L>(keys, self.parts, self.cursor, self.time, output);
            }
        };
        let form = group.prepared().segments.form;
        if cfg!(smallest) || form == Form::Polynomial || self.time == self.cursor.start {
            self.one_by_one(group, self.parts, output);
            return;
        }
        let chunks = self.parts.chunks(L::COUNT);
        for (parts, values) in chunks.zip(output.chunks_mut(L::COUNT)) {
            if parts.len() <= SAMPLES_ONE_BY_ONE {
                self.one_by_one(group, parts, values);
                continue;
            }
            self.arcs::<L>(group, parts, values);
        }
    }
}

impl TracksAtCursor<'_> {
    #[inline(always)]
    fn one_by_one(&self, group: &PreparedGroup, parts: &[SampledPart], output: &mut [[f32; 4]]) {
        let Self { cursor, time, .. } = *self;
        let prepared = group.prepared();
        let parameter = cursor.in_seconds.parameter(time - cursor.start);
        for (part, value) in parts.iter().zip(output) {
            *value = match source_at(prepared, part, cursor, time) {
                SpanSource::Segment(index) => group.at_parameter(index, parameter),
                SpanSource::Constant(index) => prepared.constants[index as usize],
                SpanSource::Exact(index) => cursor.exact(prepared, index, time),
            };
        }
    }

    /// A lane for each track, if all are on arcs. Lanes that stay unused have the arc of the first.
    #[inline(always)]
    fn arcs<L: Lanes>(
        &self,
        group: &PreparedGroup,
        parts: &[SampledPart],
        output: &mut [[f32; 4]],
    ) {
        let spans = &group.prepared().spans;
        // An arc is two rows: its middle and its tangent.
        let rotations: &[[f32; 4]] = bytemuck::cast_slice(group.arcs());
        let (mut middles, mut tangents) = ([0; MAX_LANES], [0; MAX_LANES]);
        let lanes = middles[..L::COUNT].iter_mut().zip(&mut tangents);
        for (lane, (middle, tangent)) in lanes.enumerate() {
            let part = parts.get(lane).unwrap_or(&parts[0]);
            let source = spans.source(part.first_span + self.cursor.span);
            let SpanSource::Segment(index) = source else {
                return self.one_by_one(group, parts, output);
            };
            (*middle, *tangent) = (2 * index, 2 * index + 1);
        }
        let middle = L::gather_rotations(rotations, &middles);
        let tangent = L::gather_rotations(rotations, &tangents);
        let seconds = self.time - self.cursor.start;
        let parameter = L::all(self.cursor.in_seconds.parameter(seconds));
        let found = on_arc(middle, tangent, norm_squared(tangent), parameter);
        let rotations = L::rotations(canonical(found));
        for (value, found) in output.iter_mut().zip(rotations.as_ref()) {
            *value = *found;
        }
    }
}

/// The value of a track at a time in the span of its cursor, from keys.
fn of_keys(keys: &KeptKeys, part: &SampledPart, cursor: &Cursor, time: f64) -> [f32; 4] {
    let mut value = [[0.0; 4]];
    pose_of_keys::<Vec4>(keys, std::slice::from_ref(part), cursor, time, &mut value);
    value[0]
}

/// The same of several tracks, a lane for each.
#[inline(always)]
fn pose_of_keys<L: Lanes>(
    keys: &KeptKeys,
    parts: &[SampledPart],
    cursor: &Cursor,
    time: f64,
    output: &mut [[f32; 4]],
) {
    if time == cursor.start {
        for (part, value) in parts.iter().zip(output) {
            *value = keys.set.keys()[part.first_span + cursor.span].to_array();
        }
        return;
    }
    let at = cursor.between_keys(time);
    let chunks = parts.chunks(2 * L::COUNT);
    for (parts, values) in chunks.zip(output.chunks_mut(2 * L::COUNT)) {
        let mut tracks = [TracksInLanes::zeroed(), TracksInLanes::zeroed()];
        for (tracks, parts) in tracks.iter_mut().zip(parts.chunks(L::COUNT)) {
            for (lane, part) in parts.iter().enumerate() {
                tracks.indices[lane] = part.track;
                tracks.first_keys[lane] = part.first_span as u32;
            }
        }
        keys.evaluate::<L>(&at, &tracks, values);
    }
}

impl PreparedGroup {
    #[inline(always)]
    fn prepared(&self) -> &Prepared {
        &self.clip.groups[self.index]
    }

    /// The value of a segment at a parameter.
    #[inline(always)]
    fn at_parameter(&self, index: u32, parameter: f32) -> [f32; 4] {
        let segments = &self.prepared().segments;
        match segments.form {
            Form::Polynomial => segments.polynomial_at(index, parameter),
            Form::Arc => self.arcs()[index as usize].value_at(parameter),
        }
    }

    #[inline(always)]
    fn arcs(&self) -> &[ArcSegment] {
        match self.arcs.is_empty() {
            true => &self.prepared().segments.arcs,
            false => &self.arcs,
        }
    }
}

/// The bounds of a track's spans: for each part the starts, and the end of the last one.
fn times_of(clip: &ClipSource, track: usize) -> Vec<(&[f64], f64)> {
    match clip {
        ClipSource::Segments(clip) => (clip.part_indices(track).iter())
            .map(|&index| {
                let PartRef { prepared, part } = clip.part(index);
                (&prepared.spans.starts[part.spans.clone()], part.end)
            })
            .collect(),
        ClipSource::Keys(keys) => {
            let (times, _) = keys.set.times_and_keys(track);
            let last = times.len() - 1;
            vec![(&times[..last], times[last])]
        }
    }
}

fn hash_of_times(parts: &[(&[f64], f64)]) -> u64 {
    let mut hasher = DefaultHasher::new();
    for (starts, end) in parts {
        bytemuck::cast_slice::<f64, u8>(starts).hash(&mut hasher);
        end.to_bits().hash(&mut hasher);
    }
    hasher.finish()
}

/// The times from which the weights of a cursor follow, which all its tracks share.
fn weight_rule(clip: &ClipSource) -> Option<(WeightRule, Ends)> {
    match clip {
        ClipSource::Segments(_) => None,
        ClipSource::Keys(keys) => keys.weight_rule(),
    }
}

/// Moves a cursor to the interval of a track's keys that has a time; returns whether there is one.
fn move_among_keys(keys: &KeptKeys, track: &SampledTrack, cursor: &mut Cursor, time: f64) -> bool {
    let (times, _) = keys.set.times_and_keys(track.index);
    let last = times.len() - 1;
    if time < times[0] || time >= times[last] {
        return false;
    }
    let span = interval_at(&times[..last], time, cursor.span);
    let (start, end) = (times[span], times[span + 1]);
    *cursor = Cursor {
        start,
        end,
        in_seconds: in_seconds(end - start),
        part: 0,
        span,
        weights: keys.weights_at(times, span),
    };
    true
}
