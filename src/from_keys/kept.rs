//! Clips that keep keys instead of segments: 16 bytes per key, and segments for the few intervals that rotate too far
//! for the series of small angles. A segment takes 176 bytes, and a pose reads a segment of each track.

use bytemuck::Zeroable;

use crate::curve::options::Ends;
use crate::fit::tangent_weights::{TrackWeights, WeightRule};
use crate::from_keys::cubics::sample;
use crate::from_keys::intervals::{IntervalPlan, evaluate_intervals};
use crate::from_keys::{KeyCurve, UNRESOLVED};
use crate::method::interpolation::Interpolation;
use crate::prepare::clip_data::ClipData;
use crate::prepare::error::SetError;
use crate::prepare::preparation::{PART_INTERVALS, Preparation};
use crate::prepare::prepared::Prepared;
use crate::shader::{KEY_INNER, KeySample, PolynomialSegment, TangentWeights};
use crate::simd::dispatch::VectorWidth;
use crate::simd::lanes::{Lanes, MAX_LANES, Number, canonical};
use crate::simd::together::Together;
use crate::time::frame_clock::in_seconds;
use crate::time::runs::Parameter;
use crate::time::spans::{SpanSource, StoredSource};
use crate::time::times::interval_at;
use crate::tracks::set::TrackSet;
use crate::tracks::track_keys::TrackKeys;
use crate::twin::arc_between::arc_between;
use crate::twin::evaluate_arc::{norm_squared, on_arc};
use crate::twin::small_angle::small_angle_cubic;

/// Keys from which samples are computed.
pub(crate) struct KeptKeys {
    pub(crate) set: TrackSet,
    /// The parts of a clip that are known without its segments.
    pub(crate) data: ClipData,
    curve: KeyCurve,
    rest: Rest,
}

/// The curves of the intervals that rotate too far for the series, in the order of tracks and time.
struct Rest {
    /// The index of each track's first span, and the number of all spans.
    tracks: Vec<usize>,
    prepared: Prepared,
}

/// An interval between two keys that one or more tracks have, and a time in it.
#[derive(Clone, Copy)]
pub(crate) struct TimeBetweenKeys {
    /// The index in each track of the key before it.
    pub(crate) key: usize,
    /// The weights of the keys at its start and its end, by [`KeptKeys::weights_at`].
    pub(crate) weights: [TangentWeights; 2],
    /// Its end and the time in seconds.
    pub(crate) end: f64,
    pub(crate) time: f64,
    pub(crate) parameter: f32,
}

/// A track in each lane: its index and the index of its first key. Lanes that stay unused have a track, too.
#[derive(Zeroable)]
pub(crate) struct TracksInLanes {
    pub(crate) indices: [u32; MAX_LANES],
    pub(crate) first_keys: [u32; MAX_LANES],
}

/// Bytes of an interval whose segment is kept: mostly one span.
const REST_BYTES: usize =
    size_of::<PolynomialSegment>() + size_of::<f64>() + size_of::<StoredSource>();

impl KeptKeys {
    /// Keeps the keys of a set if its curves can be computed from them, and if all takes at most `bytes` bytes; `None`
    /// otherwise.
    pub(crate) fn new(
        set: &TrackSet,
        interpolation: Interpolation,
        bytes: usize,
    ) -> Result<Option<Self>, SetError> {
        let curve = match KeyCurve::of_set(set, &interpolation) {
            Some(curve @ (KeyCurve::Arcs | KeyCurve::Cubics(_)))
                if u32::try_from(set.key_count()).is_ok() =>
            {
                curve
            }
            _ => return Ok(None),
        };
        let data = ClipData::unprepared(set, interpolation)?;
        let large = match curve {
            KeyCurve::Cubics(rule) => large_intervals(set, rule, interpolation.ends),
            _ => Vec::new(),
        };
        if set.rotation_bytes() + large.len() * REST_BYTES > bytes {
            return Ok(None);
        }
        let kept = Self {
            rest: Rest::new(set, &interpolation, &large)?,
            set: set.of_rotations(),
            data,
            curve,
        };
        // The size is known only now: an interval that was divided has several segments.
        Ok((kept.bytes() <= bytes).then_some(kept))
    }

    /// Bytes that it takes.
    pub(crate) fn bytes(&self) -> usize {
        let Rest { tracks, prepared } = &self.rest;
        self.set.rotation_bytes() + size_of_val(&**tracks) + prepared.bytes()
    }

    /// The numbers from which the weights of keys follow, in addition to their times.
    pub(crate) fn weight_rule(&self) -> Option<(WeightRule, Ends)> {
        match self.curve {
            KeyCurve::Cubics(rule) => Some((rule, self.data.interpolation.ends)),
            _ => None,
        }
    }

    /// The tangent weights at both ends of the interval after a key of a track with these times.
    pub(crate) fn weights_at(&self, times: &[f64], key: usize) -> [TangentWeights; 2] {
        match self.weight_rule() {
            Some((rule, ends)) => [key, key + 1].map(|key| rule.at_key(ends, times, key)),
            None => [Zeroable::zeroed(); 2],
        }
    }

    /// The rotations of tracks at a time between two of their keys, of one vector of tracks or of two. The last lanes may
    /// have no element in `output`.
    #[inline(always)]
    pub(crate) fn evaluate<L: Lanes>(
        &self,
        at: &TimeBetweenKeys,
        tracks: &[TracksInLanes; 2],
        output: &mut [[f32; 4]],
    ) {
        if cfg!(smallest) {
            return; // no clip keeps keys there
        }
        match self.curve {
            KeyCurve::Arcs if output.len() > L::COUNT => {
                let found = self.on_arcs::<Together<L, 2>>(at, tracks);
                let [of_first, of_second] = Together::rotations(found);
                let (values, rest) = output.split_at_mut(L::COUNT);
                L::store_rotations(of_first, values);
                store(of_second, rest);
            }
            KeyCurve::Arcs => store::<L>(self.on_arcs(at, &tracks[0]), output),
            _ => {
                for (tracks, values) in tracks.iter().zip(output.chunks_mut(L::COUNT)) {
                    store::<L>(self.on_cubics(at, tracks), values);
                    // In an unresolved value all four components are 0. Comparing one is faster, and finds all of them.
                    if values.iter().any(|value| value[3] == 0.0) {
                        self.resolve(at, tracks, values);
                    }
                }
            }
        }
    }

    /// Evaluates the rotations in intervals that rotate too far for the series.
    #[cold]
    #[inline(never)]
    fn resolve(&self, at: &TimeBetweenKeys, tracks: &TracksInLanes, output: &mut [[f32; 4]]) {
        for (value, &track) in output.iter_mut().zip(&tracks.indices) {
            if *value == UNRESOLVED {
                *value = self.rest.at(track as usize, at);
            }
        }
    }

    #[inline(always)]
    fn on_arcs<N: Number>(&self, at: &TimeBetweenKeys, tracks: &impl KeysOf<N>) -> [N; 4] {
        let key = at.key as u32;
        let (middle, tangent) = arc_between(tracks.keys(self, key), tracks.keys(self, key + 1));
        let parameter = N::all(at.parameter);
        canonical(on_arc(middle, tangent, norm_squared(tangent), parameter))
    }

    #[inline(always)]
    fn on_cubics<L: Lanes>(&self, at: &TimeBetweenKeys, tracks: &TracksInLanes) -> [L; 4] {
        let key = at.key as u32;
        let [first, last] = at.weights;
        let before = key - u32::from(first.kind == KEY_INNER);
        let after = key + 1 + u32::from(last.kind == KEY_INNER);
        let curve = small_angle_cubic(
            self.keys::<L>(before, tracks),
            self.keys(key, tracks),
            self.keys(key + 1, tracks),
            self.keys(after, tracks),
            alike::<L>(first).into(),
            alike::<L>(last).into(),
        );
        sample(&curve, L::all(at.parameter))
    }

    /// The key of each track with this index in it, with its sign for the shortest path.
    #[inline(always)]
    fn keys<L: Lanes>(&self, key: u32, tracks: &TracksInLanes) -> [L; 4] {
        let mut indices = tracks.first_keys;
        for index in &mut indices {
            *index += key;
        }
        let mut keys = L::gather_rotations(bytemuck::cast_slice(self.set.keys()), &indices);
        if self.set.changes_signs() {
            let sign = L::load(&self.set.signs_of(&indices));
            keys = [
                keys[0] * sign,
                keys[1] * sign,
                keys[2] * sign,
                keys[3] * sign,
            ];
        }
        keys
    }
}

/// Stores the rotations of as many lanes as `output` has elements.
#[inline(always)]
fn store<L: Lanes>(components: [L; 4], output: &mut [[f32; 4]]) {
    let rotations = L::rotations(components);
    for (value, found) in output.iter_mut().zip(rotations.as_ref()) {
        *value = *found;
    }
}

/// Tracks whose keys are numbers of this type.
trait KeysOf<N> {
    /// As [`KeptKeys::keys`].
    fn keys(&self, kept: &KeptKeys, key: u32) -> [N; 4];
}

impl<L: Lanes> KeysOf<L> for TracksInLanes {
    #[inline(always)]
    fn keys(&self, kept: &KeptKeys, key: u32) -> [L; 4] {
        kept.keys(key, self)
    }
}

impl<L: Lanes> KeysOf<Together<L, 2>> for [TracksInLanes; 2] {
    #[inline(always)]
    fn keys(&self, kept: &KeptKeys, key: u32) -> [Together<L, 2>; 4] {
        let [a, b] = self;
        Together::of_rotations(kept.keys(key, a), kept.keys(key, b))
    }
}

/// Weights that are the same in all lanes.
#[inline(always)]
pub(crate) fn alike<L: Lanes>(weights: TangentWeights) -> [L; 4] {
    let TangentWeights {
        before,
        after,
        outgoing,
        kind,
    } = weights;
    [
        L::all(before),
        L::all(after),
        L::all(outgoing),
        L::all(kind),
    ]
}

impl Rest {
    /// Prepares these intervals, each by its track and the key before it.
    fn new(
        set: &TrackSet,
        interpolation: &Interpolation,
        intervals: &[(usize, usize)],
    ) -> Result<Self, SetError> {
        let mut prepared = Prepared::new(interpolation);
        let ranges = intervals.iter().map(|&(track, key)| (track, key..key + 1));
        Preparation::new(interpolation).push(&mut prepared, set, ranges)?;
        let mut tracks = Vec::with_capacity(set.track_count() + 1);
        for part in &prepared.parts {
            while tracks.len() <= part.track as usize {
                tracks.push(part.spans.start);
            }
        }
        tracks.resize(set.track_count() + 1, prepared.spans.len());
        prepared.keep_curves();
        Ok(Self { tracks, prepared })
    }

    /// The value of a track at a time in one of the intervals.
    #[cold]
    #[inline(never)]
    fn at(&self, track: usize, at: &TimeBetweenKeys) -> [f32; 4] {
        let (spans, segments) = (&self.prepared.spans, &self.prepared.segments);
        let first = self.tracks[track];
        let starts = &spans.starts[first..self.tracks[track + 1]];
        let span = interval_at(starts, at.time, 0);
        let start = starts[span];
        // An interval may be cut into several spans.
        let end = starts.get(span + 1).map_or(at.end, |next| next.min(at.end));
        match spans.source(first + span) {
            SpanSource::Segment(index) => {
                let parameter = in_seconds(end - start).parameter(at.time - start);
                segments.polynomial_at(index, parameter)
            }
            SpanSource::Exact(index) => {
                let length = end - start;
                (self.prepared).exact_at_time(index, Parameter { start, length }, at.time)
            }
            SpanSource::Constant(index) => self.prepared.constants[index as usize],
        }
    }
}

/// The intervals of a set whose cubics rotate too far for the series, by track and key.
fn large_intervals(set: &TrackSet, rule: WeightRule, ends: Ends) -> Vec<(usize, usize)> {
    let width = VectorWidth::widest();
    let (mut weights, mut plan) = (
        TrackWeights::new(rule, ends),
        IntervalPlan::new(KeyCurve::Cubics(rule)),
    );
    let (mut signed, mut found, mut samples) = (Vec::new(), Vec::new(), Vec::new());
    let (mut times, mut number): (&[f64], usize) = (&[], 0);
    let mut large = Vec::new();
    for track in 0..set.track_count() {
        let whole = TrackKeys::whole(set, track);
        let count = whole.keys.len() - 1;
        for first in (0..count).step_by(PART_INTERVALS) {
            let intervals = first..count.min(first + PART_INTERVALS);
            let keys = whole.around(&intervals, 1);
            let of_keys = weights.weights_of(keys.times, keys.first_key, keys.track_key_count);
            if !std::ptr::eq(times, keys.times) {
                (times, number) = (keys.times, number + 1);
                let keys = intervals.clone().map(|key| key - keys.first_key);
                samples.clear();
                samples.extend(keys.map(|key| KeySample {
                    key: key as u32,
                    parameter: 0.0,
                }));
            }
            plan.find(number, &samples, of_keys);
            found.resize(samples.len(), UNRESOLVED);
            let (authored, keys) = (keys.authored(), keys.signed(&mut signed));
            if !evaluate_intervals(width, &plan, authored, keys, &mut found) {
                let unresolved = intervals
                    .zip(&found)
                    .filter(|(_, value)| **value == UNRESOLVED);
                large.extend(unresolved.map(|(key, _)| (track, key)));
            }
        }
    }
    large
}
