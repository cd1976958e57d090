//! Samples of a clip one at a time, for programs that need a pose now: a game's frame, a controller's tick.
//!
//! A request checks its times, makes a timeline and chooses a route, which takes longer than evaluating a few samples.
//! A sampler is made once. It remembers the span of time where it sampled last, for all tracks that share their key
//! times: the next sample there needs neither a search nor a division.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::ops::Range;
use std::sync::Arc;

use glam::Quat;

use crate::checks::check_rows;
use crate::cpu::evaluate::at_parameter;
use crate::curve::options::Quantity;
use crate::error::Error;
use crate::output::value::OutputValue;
use crate::prepare::arcs::listed_arcs;
use crate::prepare::clip_data::{ClipData, PartRef};
use crate::prepare::prepared::Prepared;
use crate::shader::{ArcSegment, Form};
use crate::simd::dispatch::{InLanesInto, VectorWidth, in_lanes_into};
use crate::simd::lanes::{Lanes, MAX_LANES, canonical};
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::{InSeconds, in_seconds};
use crate::time::runs::{NONE, Parameter, RunSource};
use crate::time::spans::{SpanSource, outside};
use crate::time::times::interval_at;
use crate::tracks::error::TrackError;
use crate::twin::evaluate_arc::{norm_squared, on_arc};

/// Evaluates a [`Clip`](crate::Clip) at one time after another, on the calling thread
/// ([`Clip::sampler`](crate::Clip::sampler)).
///
/// Every value has the bits that the clip's evaluation at [listed times](crate::SampleTimes::at) has. Times may be in
/// any order; it is fastest if most are near the one before. Nothing is allocated after the sampler was made. A clone
/// is independent of it, for another thread or another playback of the same clip; both share the prepared tracks, also
/// after the clip was dropped.
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

/// What the clones of a sampler share.
struct SampledClip {
    groups: Vec<SampledGroup>,
    parts: Vec<SampledPart>,
    tracks: Vec<SampledTrack>,
    /// All tracks, in order.
    batches: Vec<TrackBatch>,
    quantity: Quantity,
    width: VectorWidth,
}

/// Consecutive tracks that are evaluated together in poses: a single one, or several of one group and one cursor, each
/// with one part.
struct TrackBatch {
    tracks: Range<usize>,
    has_one_part: bool,
}

/// A group of prepared tracks.
struct SampledGroup {
    clip: Arc<ClipData>,
    /// Its index among the groups of `clip`.
    index: usize,
    /// Its arcs, if a device computes them from a list; else empty.
    arcs: Vec<ArcSegment>,
}

/// A part of a track.
struct SampledPart {
    /// An index in [`SampledClip::groups`].
    group: u32,
    /// The index in the group of its first span.
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
        }
    }
}

impl Sampler {
    /// A sampler of tracks in several clips: for each track the index of its clip in `clips`, and its index there.
    pub(crate) fn new(
        clips: Vec<Arc<ClipData>>,
        tracks: Vec<(usize, usize)>,
        quantity: Quantity,
        width: VectorWidth,
    ) -> Self {
        let mut groups = Vec::new();
        let mut first_groups = Vec::with_capacity(clips.len());
        for clip in &clips {
            first_groups.push(groups.len());
            groups.extend(
                (clip.groups.iter().enumerate()).map(|(index, prepared)| SampledGroup {
                    clip: Arc::clone(clip),
                    index,
                    arcs: listed_arcs(prepared),
                }),
            );
        }
        let mut sampled = SampledClip {
            groups,
            parts: Vec::new(),
            tracks: Vec::new(),
            batches: Vec::new(),
            quantity,
            width,
        };
        // For each hash of times the cursors of such tracks, each with a track that has it.
        let mut known: HashMap<u64, Vec<(usize, usize, usize)>> = HashMap::new();
        let mut cursors = 0;
        for (clip, index) in tracks {
            let first_part = sampled.parts.len();
            let data = &clips[clip];
            for &(group, part) in data.part_indices(index) {
                let PartRef { part, .. } = data.part((group, part));
                sampled.parts.push(SampledPart {
                    group: (first_groups[clip] + group as usize) as u32,
                    first_span: part.spans.start,
                });
            }
            let alike = known.entry(hash_of_times(data, index)).or_default();
            let is_alike = |&&(_, other, track): &&(usize, usize, usize)| {
                have_same_times((data, index), (&clips[other], track))
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

    /// The rotation of a track at a time, seconds.
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

    /// The value of every track at a time, seconds, into `output`, which has an element for each track.
    ///
    /// # Errors
    /// When the time is not finite, `output` is not exactly as long as there are tracks, or its type does not fit the
    /// clip's quantity.
    pub fn pose<R: OutputValue>(&mut self, time: f64, output: &mut [R]) -> Result<(), Error> {
        check_rows::<R>(self.clip.quantity)?;
        self.fill(None, time, bytemuck::cast_slice_mut(output))
    }

    /// The values of some tracks at a time, seconds, into `output`, which has an element for each of `tracks`.
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
        let group = &self.groups[part.group as usize];
        let prepared = group.prepared();
        match source_at(prepared, part, cursor, time) {
            SpanSource::Segment(index) => {
                let parameter = cursor.in_seconds.parameter(time - cursor.start);
                group.at_parameter(index as usize, parameter)
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

    /// The clip of a track; `None` if it has no parts.
    fn clip_of(&self, track: &SampledTrack) -> Option<&ClipData> {
        let first = self.parts.get(track.first_part)?;
        Some(&self.groups[first.group as usize].clip)
    }

    /// The time between the keys whose value a track that repeats has at `time`.
    fn folded(&self, track: &SampledTrack, time: f64) -> Result<f64, SampleTimesError> {
        if !time.is_finite() {
            return Err(SampleTimesError::TimeNotFinite { index: 0, time });
        }
        let clip = self.clip_of(track);
        Ok(clip.map_or(time, |clip| clip.folded_time(track.index, time)))
    }

    /// Moves a cursor to the span of a time; returns whether there is one.
    fn move_to(&self, track: &SampledTrack, cursor: &mut Cursor, time: f64) -> bool {
        if cursor.contains(time) {
            return true;
        }
        let Some(clip) = self.clip_of(track) else {
            return false;
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
        };
        true
    }

    /// The value before the first key, which the track's first part has, or from the last key on, which the last has.
    fn outside(&self, track: &SampledTrack, time: f64) -> [f32; 4] {
        let Some(clip) = self.clip_of(track) else {
            return [0.0; 4];
        };
        let parts = clip.part_indices(track.index);
        let is_before = |&index: &(u32, u32)| clip.part(index).part.end > time;
        let number = match parts.first().is_some_and(is_before) {
            true => 0,
            false => parts.len() - 1,
        };
        let PartRef { prepared, part } = clip.part(parts[number]);
        let group = &self.groups[self.parts[track.first_part + number].group as usize];
        let (_, source) = outside(part, prepared.spans.begin(part), time);
        match source {
            Some(RunSource::Constant(index)) => prepared.constants[index as usize],
            Some(RunSource::Segment(index, distance, affine)) => {
                let distance = distance.at_sample(0, || time);
                let parameter = distance * affine.scale + affine.offset;
                group.at_parameter(index as usize, parameter)
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
    prepared.spans.sources[span]
}

/// Tracks of one group with one part each, at a time in the span of their cursor.
struct TracksAtCursor<'a> {
    group: &'a SampledGroup,
    /// Of each track.
    parts: &'a [SampledPart],
    cursor: &'a Cursor,
    time: f64,
}

impl InLanesInto<(), [[f32; 4]]> for TracksAtCursor<'_> {
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, (): &(), output: &mut [[f32; 4]]) {
        let form = self.group.prepared().segments.form;
        if cfg!(smallest) || form == Form::Polynomial || self.time == self.cursor.start {
            self.one_by_one(self.parts, output);
            return;
        }
        let mut parts = self.parts.chunks_exact(L::COUNT);
        let (whole, rest) = output.split_at_mut(output.len() - parts.remainder().len());
        for (parts, values) in (&mut parts).zip(whole.chunks_exact_mut(L::COUNT)) {
            self.arcs::<L>(parts, values);
        }
        self.one_by_one(parts.remainder(), rest);
    }
}

impl TracksAtCursor<'_> {
    #[inline(always)]
    fn one_by_one(&self, parts: &[SampledPart], output: &mut [[f32; 4]]) {
        let Self { cursor, time, .. } = *self;
        let prepared = self.group.prepared();
        let parameter = cursor.in_seconds.parameter(time - cursor.start);
        for (part, value) in parts.iter().zip(output) {
            *value = match source_at(prepared, part, cursor, time) {
                SpanSource::Segment(index) => self.group.at_parameter(index as usize, parameter),
                SpanSource::Constant(index) => prepared.constants[index as usize],
                SpanSource::Exact(index) => cursor.exact(prepared, index, time),
            };
        }
    }

    /// A lane for each track, if all are on arcs.
    #[inline(always)]
    fn arcs<L: Lanes>(&self, parts: &[SampledPart], output: &mut [[f32; 4]]) {
        let spans = &self.group.prepared().spans;
        // A middle and a tangent each.
        let rotations: &[[f32; 4]] = bytemuck::cast_slice(self.group.arcs());
        let (mut middles, mut tangents) = ([0; MAX_LANES], [0; MAX_LANES]);
        for (part, (middle, tangent)) in parts.iter().zip(middles.iter_mut().zip(&mut tangents)) {
            let SpanSource::Segment(index) = spans.sources[part.first_span + self.cursor.span]
            else {
                return self.one_by_one(parts, output);
            };
            (*middle, *tangent) = (2 * index, 2 * index + 1);
        }
        let middle = L::gather_rotations(rotations, &middles);
        let tangent = L::gather_rotations(rotations, &tangents);
        let seconds = self.time - self.cursor.start;
        let parameter = L::all(self.cursor.in_seconds.parameter(seconds));
        let found = on_arc(middle, tangent, norm_squared(tangent), parameter);
        L::store_rotations(canonical(found), output);
    }
}

impl SampledGroup {
    #[inline(always)]
    fn prepared(&self) -> &Prepared {
        &self.clip.groups[self.index]
    }

    /// The value of a segment at a parameter.
    #[inline(always)]
    fn at_parameter(&self, index: usize, parameter: f32) -> [f32; 4] {
        let segments = &self.prepared().segments;
        match segments.form {
            Form::Polynomial => at_parameter(&segments.polynomials[index], parameter),
            Form::Arc => at_parameter(&self.arcs()[index], parameter),
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
fn times_of(clip: &ClipData, track: usize) -> impl ExactSizeIterator<Item = (&[f64], f64)> {
    clip.part_indices(track).iter().map(|&index| {
        let PartRef { prepared, part } = clip.part(index);
        (&prepared.spans.starts[part.spans.clone()], part.end)
    })
}

fn hash_of_times(clip: &ClipData, track: usize) -> u64 {
    let mut hasher = DefaultHasher::new();
    for (starts, end) in times_of(clip, track) {
        bytemuck::cast_slice::<f64, u8>(starts).hash(&mut hasher);
        end.to_bits().hash(&mut hasher);
    }
    hasher.finish()
}

fn have_same_times(one: (&ClipData, usize), other: (&ClipData, usize)) -> bool {
    times_of(one.0, one.1).eq(times_of(other.0, other.1))
}
