//! Keys of a track that follow one another.

use glam::Quat;

use crate::tracks::set::TrackSet;
use crate::tracks::signs::Signs;

/// Keys of a track that follow one another.
#[derive(Clone, Copy)]
pub(crate) struct TrackKeys<'a> {
    pub(crate) times: &'a [f64],
    pub(crate) keys: &'a [Quat],
    /// The signs that they count with by the shortest path.
    pub(crate) signs: Signs<'a>,
    /// The track's place in the set.
    pub(crate) index: usize,
    /// The place of the first of them among the track's keys.
    pub(crate) first_key: usize,
    /// How many keys the whole track has.
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

    /// Those of a whole track from one key to another.
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
