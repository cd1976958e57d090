//! Prepares tracks whose keys are held until the next key: every sample is a constant.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::Quantity;
use crate::prepare::preparation::Prepare;
use crate::prepare::prepared::Prepared;
use crate::time::spans::{NONE, Source};
use crate::tracks::set::TrackSet;

/// Prepares tracks whose keys are held, for this quantity.
pub(crate) struct StepPreparation(pub(crate) Quantity);

impl Prepare for StepPreparation {
    fn add(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        index: usize,
        intervals: Range<usize>,
    ) {
        let track = set.track(index);
        let first = prepared.constants.len() as u32;
        let last = first + intervals.len() as u32;
        let value = |key: &Quat| match self.0 {
            Quantity::Rotation => key.to_array(),
            _ => [0.0; 4],
        };
        let keys = track.keys[intervals.start..=intervals.end].iter();
        prepared.constants.extend(keys.map(value));
        let first_span = prepared.spans.len();
        let spans = first_span..first_span + intervals.len();
        prepared.push_part(index, track.times, &intervals, spans, [first, last]);
        for (i, constant) in intervals.zip(first..last) {
            prepared.push_span(track.times[i], Source::Constant(constant), NONE);
        }
    }
}
