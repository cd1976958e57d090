//! Consecutive keys of a track, borrowed with their times and signs.

use glam::Quat;

use crate::tracks::set::TrackSet;
use crate::tracks::signs::Signs;

/// Consecutive keys of a track.
#[derive(Clone, Copy)]
pub(crate) struct TrackKeys<'a> {
    pub(crate) times: &'a [f64],
    pub(crate) keys: &'a [Quat],
    /// Their signs along the shortest path.
    pub(crate) signs: Signs<'a>,
    /// The track's place in the set.
    pub(crate) index: usize,
    /// The index of the first of them in the track.
    pub(crate) first_key: usize,
    /// Number of keys of the whole track.
    pub(crate) all: usize,
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
            all: keys.len(),
        }
    }

    /// The keys of a whole track from `first_key` to `last_key`, both included.
    pub(crate) fn between(self, first_key: usize, last_key: usize) -> Self {
        Self {
            times: &self.times[first_key..=last_key],
            keys: &self.keys[first_key..=last_key],
            signs: self.signs.between(first_key..last_key + 1),
            first_key,
            ..self
        }
    }
}
