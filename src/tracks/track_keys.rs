//! Consecutive keys of a track, borrowed with their times and signs.

use std::ops::Range;

use glam::Quat;

use crate::tracks::set::TrackSet;
use crate::tracks::signs::Signs;

/// Consecutive keys of a track.
#[derive(Clone, Copy)]
pub(crate) struct TrackKeys<'a> {
    pub(crate) times: &'a [f64],
    pub(crate) keys: &'a [Quat],
    /// The keys' signs for the shortest path.
    pub(crate) signs: Signs<'a>,
    /// The track's index in the set.
    pub(crate) index: usize,
    /// The index of the first of these keys in the track.
    pub(crate) first_key: usize,
    /// Number of keys of the whole track.
    pub(crate) track_key_count: usize,
}

impl<'a> TrackKeys<'a> {
    /// All keys of a track.
    #[inline(always)]
    pub(crate) fn whole(set: &'a TrackSet, index: usize) -> Self {
        let (times, keys) = set.times_and_keys(index);
        Self {
            times,
            keys,
            signs: set.signs(index),
            index,
            first_key: 0,
            track_key_count: keys.len(),
        }
    }

    /// The keys of some intervals of a whole track, and up to `beside` more keys on each side.
    pub(crate) fn around(self, intervals: &Range<usize>, beside: usize) -> Self {
        let end = self.track_key_count.min(intervals.end + 1 + beside);
        let range = intervals.start.saturating_sub(beside)..end;
        Self {
            times: &self.times[range.clone()],
            keys: &self.keys[range.clone()],
            signs: self.signs.between(range.clone()),
            first_key: range.start,
            ..self
        }
    }

    /// The keys as they were added.
    pub(crate) fn authored(self) -> &'a [[f32; 4]] {
        bytemuck::cast_slice(self.keys)
    }

    /// The keys with their signs for the shortest path: in `room` if any sign is changed.
    pub(crate) fn signed<'r>(self, room: &'r mut Vec<[f32; 4]>) -> &'r [[f32; 4]]
    where
        'a: 'r,
    {
        if !self.signs.any() {
            return self.authored();
        }
        room.resize(self.keys.len(), [0.0; 4]);
        (self.signs).copy(self.authored(), 0..self.keys.len(), room);
        room
    }
}

/// Keys of a track with their signs; `signs` is `None` if no sign is changed.
#[derive(Clone, Copy)]
pub(crate) struct SignedKeys<'a> {
    pub(crate) authored: &'a [[f32; 4]],
    signs: Option<Signs<'a>>,
}

impl<'a> SignedKeys<'a> {
    #[inline]
    pub(crate) fn new(keys: TrackKeys<'a>) -> Self {
        Self {
            authored: keys.authored(),
            signs: Some(keys.signs).filter(|signs| signs.any()),
        }
    }

    #[inline(always)]
    pub(crate) fn get(self, key: usize) -> [f32; 4] {
        let authored = self.authored[key];
        match self.signs {
            None => authored,
            Some(signs) => {
                let sign = signs.sign(key);
                authored.map(|component| component * sign)
            }
        }
    }
}
