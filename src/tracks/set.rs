//! The set of keyframe tracks: unit quaternions with their key times.
//!
//! A [`TrackSet`] has no method, frame rate or device. Keys are checked when they are added, and all later steps rely
//! on it: every track has at least one key, times are finite and strictly increasing, and keys are unit quaternions.

pub(crate) mod key_data;
pub(crate) mod scalars;
pub(crate) mod vectors;

use std::ops::Range;
use std::sync::Arc;

use glam::{DQuat, DVec3, Quat};

use crate::math::canonical::canonical;
use crate::math::quaternion::unit_f32;
use crate::tracks::error::{LATEST, NORM_TOLERANCE, TrackError};
use crate::tracks::rotation::Rotation;
use crate::tracks::set::key_data::{KeyData, Tcb};
use crate::tracks::set::scalars::ScalarTrack;
use crate::tracks::set::vectors::VectorTracks;
use crate::tracks::signs::{SignBits, Signs};

/// A set of keyframe tracks: the input of every evaluation.
///
/// Keys are f32 unit quaternions, `x y z w` in memory; times are f64 seconds.
/// Tracks may differ in their number of keys and in their times.
///
/// ```
/// use glam::Quat;
/// let mut set = tumble::TrackSet::new();
/// let keys = [Quat::IDENTITY, Quat::from_rotation_x(1.0)];
/// set.push("hinge", &[0.0, 2.0], &keys)?;
/// assert_eq!((set.track_count(), set.key_count()), (1, 2));
/// # Ok::<(), tumble::TrackError>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrackSet {
    keys: Vec<Quat>,
    times: Vec<f64>,
    tracks: Vec<TrackRange>,
    names: Vec<String>,
    pub(crate) velocities: KeyData<DVec3>,
    pub(crate) tangents: KeyData<[Quat; 2]>,
    pub(crate) tcb: KeyData<Tcb>,
    /// Translations and scales, in the order of [`Channel`](crate::tracks::set::vectors::Channel).
    pub(crate) vectors: [VectorTracks; 2],
    /// Single numbers over time, which belong to no track.
    scalars: Vec<Arc<ScalarTrack>>,
    /// First and last key time over all tracks and scalars.
    span: Option<(f64, f64)>,
    /// Number of keys of the longest track.
    longest: usize,
    signs: SignBits,
}

/// The ranges of a track's keys and times in the lists of its set. Consecutive tracks with equal times share them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TrackRange {
    first_key: usize,
    first_time: usize,
    len: usize,
}

/// One track, borrowed from its [`TrackSet`].
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Track<'a> {
    /// The track's name, if it has one.
    pub name: Option<&'a str>,
    /// Key times in seconds, strictly increasing.
    pub times: &'a [f64],
    /// Keys as unit quaternions, one for each time.
    pub keys: &'a [Quat],
    /// Angular velocities at the keys in rad/s in the body frame; empty if none were set.
    pub velocities: &'a [DVec3],
    /// The incoming and outgoing tangent of each key, `x y z w` per second; empty if none were set.
    pub tangents: &'a [[Quat; 2]],
    /// Tension, continuity and bias of the keys; empty if none were set.
    pub tcb: &'a [Tcb],
}

impl TrackSet {
    /// An empty set.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Reserves memory for `tracks` more tracks with `keys` keys in total, if there is enough, so that the set does
    /// not grow step by step.
    pub fn reserve(&mut self, tracks: usize, keys: usize) {
        // If there is too little memory, `push` fails later and reports this.
        let _ = self.tracks.try_reserve(tracks);
        let _ = self.keys.try_reserve(keys);
    }

    /// Appends a track. `times` are seconds, strictly increasing; `keys` are rotations, [`Quat`] or `[f32; 4]` (`x y
    /// z w`), one for each time.
    ///
    /// Keys whose norm is 1 within f32 rounding keep their bits; others, whose norm is within 0.1 of 1, are
    /// normalised.
    ///
    /// # Errors
    /// When there are no keys, the numbers of keys and times differ, the times are not finite and strictly
    /// increasing, or a key's norm is not within 0.1 of 1; then the set is unchanged.
    pub fn push<R: Rotation>(
        &mut self,
        name: impl Into<String>,
        times: &[f64],
        keys: &[R],
    ) -> Result<(), TrackError> {
        let track = self.tracks.len();
        check_times(track, times, keys.len())?;
        let first_key = self.keys.len();
        let added = keys.iter().enumerate().try_for_each(|(key, rotation)| {
            self.keys.push(unit_key(track, key, rotation.quat())?);
            Ok(())
        });
        match added {
            Ok(()) => self.add_track(name.into(), times, first_key),
            Err(_) => self.keys.truncate(first_key),
        }
        added
    }

    /// Makes a set whose tracks all have the same key times, as in a `.dat` file. `keys` are `times.len()` keys for
    /// each track, track by track.
    ///
    /// # Errors
    /// As [`TrackSet::push`]; also when the number of keys is not a multiple of the number of times.
    pub fn with_shared_times<R: Rotation>(times: &[f64], keys: &[R]) -> Result<Self, TrackError> {
        let keys = keys.iter().map(|rotation| rotation.quat());
        Self::from_shared_times(times.to_vec(), keys.collect())
    }

    /// As [`TrackSet::with_shared_times`], without a copy of the keys.
    ///
    /// # Errors
    /// As [`TrackSet::with_shared_times`].
    pub fn from_shared_times(times: Vec<f64>, mut keys: Vec<Quat>) -> Result<Self, TrackError> {
        let len = times.len();
        if len == 0 || !keys.len().is_multiple_of(len) {
            return Err(TrackError::LengthMismatch {
                track: 0,
                keys: keys.len(),
                times: len,
            });
        }
        check_times(0, &times, len)?;
        for (index, key) in keys.iter_mut().enumerate() {
            *key = unit_key(index / len, index % len, *key)?;
        }
        let mut set = Self {
            keys,
            ..Self::default()
        };
        for first_key in (0..set.keys.len()).step_by(len) {
            set.add_track(String::new(), &times, first_key);
        }
        Ok(set)
    }

    /// Number of tracks.
    #[must_use]
    pub fn track_count(&self) -> usize {
        self.tracks.len()
    }

    /// Number of keys of all tracks together.
    #[must_use]
    pub fn key_count(&self) -> usize {
        self.keys.len()
    }

    /// A set of only the rotations: without names, vectors, scalars, and data of keys that only some methods need, such
    /// as angular velocities.
    pub(crate) fn of_rotations(&self) -> Self {
        Self {
            keys: self.keys.clone(),
            times: self.times.clone(),
            tracks: self.tracks.clone(),
            span: self.span,
            longest: self.longest,
            signs: self.signs.clone(),
            ..Self::default()
        }
    }

    /// The number of bytes of the keys, the times, the tracks and the signs.
    pub(crate) fn rotation_bytes(&self) -> usize {
        size_of_val(&self.keys[..])
            + size_of_val(&self.times[..])
            + size_of_val(&self.tracks[..])
            + self.signs.bytes()
    }

    /// The signs of some keys for the shortest path, by their indices among all keys.
    pub(crate) fn signs_of<const COUNT: usize>(&self, keys: &[u32; COUNT]) -> [f32; COUNT] {
        let signs = self.signs.of(0..self.keys.len());
        keys.map(|key| signs.sign(key as usize))
    }

    /// Whether the sign of any key is changed for the shortest path.
    pub(crate) fn changes_signs(&self) -> bool {
        self.signs.bytes() > 0
    }

    /// Number of keys of the longest track.
    pub(crate) fn longest(&self) -> usize {
        self.longest
    }

    /// Whether neighbouring keys of every track, with their original signs, are less than 180° apart: then
    /// [`KeySigns::Shortest`](crate::KeySigns::Shortest) and [`KeySigns::AsAuthored`](crate::KeySigns::AsAuthored)
    /// are the same.
    pub(crate) fn arcs_are_short(&self) -> bool {
        !self.signs.any_long
    }

    /// The signs of a track's keys along the shortest path.
    #[inline]
    pub(crate) fn signs(&self, index: usize) -> Signs<'_> {
        let TrackRange { first_key, len, .. } = self.tracks[index];
        self.signs.of(first_key..first_key + len)
    }

    /// Whether the set has no tracks.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tracks.is_empty()
    }

    /// Refuses an index that is out of range.
    pub(crate) fn check_track(&self, track: usize) -> Result<(), TrackError> {
        let tracks = self.track_count();
        if track < tracks {
            Ok(())
        } else {
            Err(TrackError::NoSuchTrack { track, tracks })
        }
    }

    /// The track at `index`; `None` out of range.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<Track<'_>> {
        (index < self.track_count()).then(|| self.track(index))
    }

    /// The track at `index`. Use [`TrackSet::get`] for an index that may be out of range.
    ///
    /// # Panics
    /// When `index` is not below [`TrackSet::track_count`].
    #[track_caller]
    pub fn track(&self, index: usize) -> Track<'_> {
        let (times, keys) = self.times_and_keys(index);
        Track {
            name: (self.names.get(index).map(String::as_str)).filter(|name| !name.is_empty()),
            times,
            keys,
            velocities: self.velocities.of(index),
            tangents: self.tangents.of(index),
            tcb: self.tcb.of(index),
        }
    }

    /// The times and keys of a track without its other fields, whose lookup would take longer than the evaluation of
    /// a short track.
    #[inline]
    pub(crate) fn times_and_keys(&self, index: usize) -> (&[f64], &[Quat]) {
        let range = self.tracks[index];
        let times = &self.times[range.first_time..range.first_time + range.len];
        (
            times,
            &self.keys[range.first_key..range.first_key + range.len],
        )
    }

    /// The keys of all tracks, one track after another.
    pub(crate) fn keys(&self) -> &[Quat] {
        &self.keys
    }

    /// Number of keys of consecutive tracks together.
    pub(crate) fn keys_of(&self, tracks: Range<usize>) -> usize {
        self.first_key(tracks.end) - self.first_key(tracks.start)
    }

    /// The end of the longest range of tracks from the first of `tracks` that has at most `keys` keys.
    pub(crate) fn tracks_within(&self, tracks: Range<usize>, keys: usize) -> usize {
        let key_limit = self.first_key(tracks.start).saturating_add(keys);
        let fits = |track: &TrackRange| track.first_key + track.len <= key_limit;
        tracks.start + self.tracks[tracks].partition_point(fits)
    }

    /// The index of a track's first key among all keys; the number of keys for `track_count()`.
    pub(crate) fn first_key(&self, track: usize) -> usize {
        let range = self.tracks.get(track);
        range.map_or(self.keys.len(), |range| range.first_key)
    }

    /// All tracks in order.
    #[must_use]
    pub fn tracks(&self) -> impl ExactSizeIterator<Item = Track<'_>> {
        (0..self.tracks.len()).map(|index| self.track(index))
    }

    /// The track's name. If it has none, or the index is out of range, `box1`, `box2` … from the index.
    pub fn track_name(&self, index: usize) -> String {
        let name = self.get(index).and_then(|track| track.name);
        name.map_or_else(|| default_name(index), str::to_owned)
    }

    /// Names a track; with an empty name it has none.
    ///
    /// # Errors
    /// When the track's index is out of range.
    pub fn set_name(&mut self, track: usize, name: impl Into<String>) -> Result<(), TrackError> {
        self.check_track(track)?;
        let count = self.names.len().max(track + 1);
        self.names.resize(count, String::new());
        self.names[track] = name.into();
        Ok(())
    }

    /// The first and the last key time of all tracks and scalars in seconds; `None` if there are none.
    #[must_use]
    pub fn time_span(&self) -> Option<(f64, f64)> {
        self.span
    }

    /// Whether these are all tracks in their order, so that [`TrackSet::select`] would make an equal set.
    #[must_use]
    pub fn is_in_order(&self, tracks: &[usize]) -> bool {
        tracks.iter().copied().eq(0..self.track_count())
    }

    /// Makes a set of some tracks, such as `0..10` or a list, in this order, and of all scalars.
    ///
    /// # Errors
    /// When a track's index is out of range.
    pub fn select(&self, tracks: impl IntoIterator<Item = usize>) -> Result<Self, TrackError> {
        let mut set = Self::default();
        for scalar in &self.scalars {
            set.widen_span(&scalar.times);
            set.scalars.push(Arc::clone(scalar));
        }
        for index in tracks {
            self.check_track(index)?;
            let track = self.track(index);
            let (new_index, first_key) = (set.track_count(), set.keys.len());
            set.keys.extend_from_slice(track.keys);
            let name = track.name.unwrap_or_default().to_owned();
            set.add_track(name, track.times, first_key);
            set.velocities.set(new_index, track.velocities);
            set.tangents.set(new_index, track.tangents);
            set.tcb.set(new_index, track.tcb);
            for channel in 0..set.vectors.len() {
                let vectors = self.vectors[channel].get(index).cloned().flatten();
                if let Some(vectors) = &vectors {
                    set.widen_span(&vectors.times);
                }
                set.vectors[channel].push(vectors);
            }
        }
        Ok(set)
    }

    /// Adds a track whose keys are already in the list, from `first_key` on. If the times are equal to those of the
    /// previous track, the tracks share them, because all tracks of many files have the same times.
    fn add_track(&mut self, name: String, times: &[f64], first_key: usize) {
        let len = times.len();
        let keys = &self.keys[first_key..first_key + len];
        (self.signs).push_track(first_key, bytemuck::cast_slice(keys));
        let before = self.tracks.last().map(|last| last.first_time);
        let shared = before.filter(|&first| self.times[first..] == *times);
        let first_time = shared.unwrap_or(self.times.len());
        if shared.is_none() {
            self.times.extend_from_slice(times);
        }
        if !name.is_empty() {
            self.names.resize(self.tracks.len(), String::new());
            self.names.push(name);
        }
        self.tracks.push(TrackRange {
            first_key,
            first_time,
            len,
        });
        self.longest = self.longest.max(len);
        self.widen_span(times);
    }

    /// Extends the time span to these times.
    pub(crate) fn widen_span(&mut self, times: &[f64]) {
        let track_span = (times[0], times[times.len() - 1]);
        let (first, last) = self.span.unwrap_or(track_span);
        // Not `min` and `max`: for zeros with different signs, their result depends on the processor.
        let first = if track_span.0 < first {
            track_span.0
        } else {
            first
        };
        let last = if track_span.1 > last {
            track_span.1
        } else {
            last
        };
        self.span = Some((first, last));
    }
}

/// The name of a track without one.
pub(crate) fn default_name(index: usize) -> String {
    format!("box{}", index.saturating_add(1))
}

pub(crate) fn check_times(track: usize, times: &[f64], keys: usize) -> Result<(), TrackError> {
    if times.len() != keys {
        return Err(TrackError::LengthMismatch {
            track,
            keys,
            times: times.len(),
        });
    }
    if times.is_empty() {
        return Err(TrackError::Empty { track });
    }
    // Numbers that increase between two that are in range are in range, and finite. The loop goes to
    // the end in any case, so that it is compiled to vectors.
    let increase = |all: bool, pair: &[f64]| all & (pair[0] < pair[1]);
    let (first, last) = (times[0], times[keys - 1]);
    if first >= -LATEST && last <= LATEST && times.windows(2).fold(true, increase) {
        return Ok(());
    }
    if let Some(key) = times.iter().position(|time| !time.is_finite()) {
        return Err(TrackError::TimeNotFinite {
            track,
            key,
            time: times[key],
        });
    }
    if let Some(i) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        return Err(TrackError::TimeNotIncreasing {
            track,
            key: i + 1,
            time: times[i + 1],
            previous: times[i],
        });
    }
    match times.iter().position(|time| time.abs() > LATEST) {
        Some(key) => Err(TrackError::TimeOutOfRange {
            track,
            key,
            time: times[key],
        }),
        None => Ok(()),
    }
}

/// Refuses additional data that are not one value for each key.
pub(crate) fn check_length(
    track: usize,
    quantity: &'static str,
    keys: usize,
    values: usize,
) -> Result<(), TrackError> {
    if values == keys {
        Ok(())
    } else {
        Err(TrackError::DataLength {
            track,
            quantity,
            keys,
            values,
        })
    }
}

/// Refuses additional data that are NaN or infinite.
pub(crate) fn check_finite<T>(
    track: usize,
    quantity: &'static str,
    values: &[T],
    is_finite: impl Fn(&T) -> bool,
) -> Result<(), TrackError> {
    match values.iter().position(|value| !is_finite(value)) {
        Some(key) => Err(TrackError::DataNotFinite {
            track,
            key,
            quantity,
        }),
        None => Ok(()),
    }
}

/// The maximum difference of a key's norm from 1 with which the key keeps its bits, so that results which are written
/// and loaded again do not change. Rounding to f32 changes the norm of a unit quaternion by at most about 2 × 2^-24.
pub const UNIT_TOLERANCE: f64 = 4.0e-7;

/// A key as it is stored: normalised, with very small components replaced by +0.
pub(crate) fn unit_key(track: usize, key: usize, quat: Quat) -> Result<Quat, TrackError> {
    let exact: DQuat = quat.as_dquat();
    // |n² - 1| is about twice |n - 1|; most keys need no root.
    if (exact.length_squared() - 1.0).abs() <= 1.9 * UNIT_TOLERANCE {
        return Ok(Quat::from_array(quat.to_array().map(canonical)));
    }
    let norm = exact.length();
    if norm.is_nan() || (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(TrackError::NotUnit { track, key, norm });
    }
    if (norm - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(Quat::from_array(quat.to_array().map(canonical)));
    }
    Ok(unit_f32(exact))
}

#[cfg(test)]
mod tests;
