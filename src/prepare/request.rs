//! What is evaluated of a set.

use std::ops::Range;

use crate::method::interpolation::Interpolation;
use crate::time::frames::Timeline;
use crate::tracks::set::TrackSet;

/// What is evaluated of a set: some of its tracks, by a method, at the samples of a timeline, which is
/// that of the whole set.
#[derive(Clone)]
pub(crate) struct SetRequest<'a> {
    pub(crate) set: &'a TrackSet,
    pub(crate) tracks: Range<usize>,
    pub(crate) interpolation: &'a Interpolation,
    pub(crate) timeline: &'a Timeline,
}

impl<'a> SetRequest<'a> {
    /// All tracks.
    pub(crate) fn whole(
        set: &'a TrackSet,
        interpolation: &'a Interpolation,
        timeline: &'a Timeline,
    ) -> Self {
        Self {
            set,
            tracks: 0..set.track_count(),
            interpolation,
            timeline,
        }
    }
}
