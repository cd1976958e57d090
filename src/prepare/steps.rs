//! Prepares tracks whose keys are held until the next key: every sample is a constant.

use std::ops::Range;

use glam::Quat;

use crate::curve::options::Quantity;
use crate::prepare::prepared::Prepared;
use crate::time::spans::{NONE, Source};
use crate::tracks::set::TrackSet;

/// Adds some intervals of the `index`th track of a set, as a part of their own.
pub(crate) fn add(
    prepared: &mut Prepared,
    set: &TrackSet,
    index: usize,
    intervals: Range<usize>,
    quantity: Quantity,
) {
    let (times, keys) = set.times_and_keys(index);
    let first = prepared.constants.len() as u32;
    let last = first + intervals.len() as u32;
    let value = |key: &Quat| match quantity {
        Quantity::Rotation => key.to_array(),
        _ => [0.0; 4],
    };
    let keys = keys[intervals.start..=intervals.end].iter();
    prepared.constants.extend(keys.map(value));
    let first_span = prepared.spans.len();
    let spans = first_span..first_span + intervals.len();
    prepared.push_part(index, times, &intervals, spans, [first, last]);
    for (i, constant) in intervals.zip(first..last) {
        prepared.push_span(times[i], Source::Constant(constant), NONE);
    }
}
