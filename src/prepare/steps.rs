//! Prepares tracks whose keys are held until the next key: every sample is a constant.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::{InterpolationError, Quantity};
use crate::method::interpolation::Interpolation;
use crate::prepare::preparation::Prepare;
use crate::prepare::prepared::Prepared;
use crate::time::spans::{NONE, Source};
use crate::tracks::set::TrackSet;

/// Prepares tracks whose keys are held.
pub(crate) struct StepPreparation(pub(crate) Interpolation);

impl Prepare for StepPreparation {
    fn add(
        &mut self,
        prepared: &mut Prepared,
        set: &TrackSet,
        index: usize,
        intervals: Range<usize>,
    ) -> Result<(), InterpolationError> {
        let track = set.track(index);
        self.0.ends.check(track.keys, index)?;
        let first = prepared.constants.len() as u32;
        let last = first + intervals.len() as u32;
        let stands_still = self.0.quantity != Quantity::Rotation;
        let value = |key: &Quat| {
            if stands_still {
                [0.0; 4]
            } else {
                key.to_array()
            }
        };
        let keys = track.keys[intervals.start..=intervals.end].iter();
        prepared.constants.extend(keys.map(value));
        let first_span = prepared.spans.len();
        let spans = first_span..first_span + intervals.len();
        prepared.push_part(index, track.times, &intervals, spans, [first, last]);
        for (i, constant) in intervals.zip(first..last) {
            prepared.push_span(track.times[i], Source::Constant(constant), NONE);
        }
        Ok(())
    }

    fn finish(&mut self, _: &mut Prepared) {}
}
