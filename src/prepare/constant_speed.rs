//! Tracks at constant speed. The curves of a track wait until all of them are known; then each gets
//! the fraction of the track's time that its arc length is of the track's.

use std::sync::Arc;

use crate::fit::double::curve::Curve;
use crate::fit::motion::arc_length::Pace;
use crate::math::canonical::round_quat;
use crate::math::quaternion::length;
use crate::prepare::fitting::Fitting;
use crate::prepare::prepared::Prepared;
use crate::time::spans::{NONE, Part, Source};

/// The place of an interval in its track and in time.
pub(crate) struct Place {
    /// Its part of the prepared tracks.
    pub(crate) part: usize,
    /// When it starts as keyed, in seconds.
    pub(crate) start: f64,
    /// The constant to store at exactly the start, or [`NONE`].
    pub(crate) key: u32,
}

/// The intervals that wait, in order. Those without a curve stand still.
#[derive(Default)]
pub(crate) struct Waiting(Vec<(Place, Option<Curve>)>);

impl Waiting {
    pub(crate) fn push(&mut self, place: Place, curve: Option<Curve>) {
        self.0.push((place, curve));
    }

    /// Gives the curves of every track their times, and hands them over to be fitted.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        let mut waiting = std::mem::take(&mut self.0);
        while let Some((Place { part, .. }, _)) = waiting.first() {
            let part = *part;
            let own = waiting
                .iter()
                .take_while(|(place, _)| place.part == part)
                .count();
            let others = waiting.split_off(own);
            let first_span = prepared.spans.len();
            retime(prepared, fitting, waiting, part);
            prepared.parts[part].spans = first_span..prepared.spans.len();
            waiting = others;
        }
    }
}

fn retime(
    prepared: &mut Prepared,
    fitting: &mut Fitting,
    intervals: Vec<(Place, Option<Curve>)>,
    part: usize,
) {
    let (start, end) = (intervals[0].0.start, prepared.parts[part].end);
    let mut paced: Vec<(Place, Curve, f64)> = Vec::new();
    let mut total = 0.0;
    let mut still = None;
    for (place, curve) in intervals {
        if let Some(mut curve) = curve {
            let pace = Arc::new(Pace::new(&curve));
            let own = pace.total();
            if own > 0.0 && own.is_finite() {
                total += own;
                curve.pace = Some(pace);
                paced.push((place, curve, own));
                continue;
            }
        }
        still.get_or_insert(place);
    }
    if let (true, Some(place)) = (paced.is_empty(), still) {
        // The track does not move at all.
        let Part { before, beyond, .. } = &prepared.parts[part];
        let held = match (*before, place.key) {
            (NONE, NONE) => {
                let from_before = beyond.as_ref().map_or(0, |beyond| beyond.from_before);
                let value = prepared.exact[from_before as usize].value(0.0);
                prepared.constant(round_quat(value))
            }
            (NONE, key) => key,
            (before, _) => before,
        };
        prepared.push_span(start, Source::Constant(held), NONE);
        return;
    }
    let (seconds, count) = (end - start, paced.len());
    let mut done = 0.0;
    for (i, (place, mut curve, own)) in paced.into_iter().enumerate() {
        let from = start + seconds * (done / total);
        done += own;
        let last = i + 1 == count;
        let to = if last {
            end
        } else {
            start + seconds * (done / total)
        };
        curve.rate = 1.0 / (to - from);
        if let (true, Some(beyond)) = (last, &prepared.parts[part].beyond)
            && beyond.at_end != NONE
        {
            prepared.constants[beyond.at_end as usize] = round_quat(curve.value_at(1.0));
        }
        if from < to {
            let source = fitting.take_curve(prepared, curve);
            prepared.push_span(from, source, place.key);
        }
    }
    let Some(beyond) = &prepared.parts[part].beyond else {
        return;
    };
    for goes_on in [beyond.from_before, beyond.from_after] {
        if goes_on != NONE {
            prepared.exact[goes_on as usize].set_speed(total / seconds);
        }
    }
}

impl Curve {
    /// Sets the speed of a curve of constant angular velocity, in radians per second.
    fn set_speed(&mut self, speed: f64) {
        let half = [self.numbers[4], self.numbers[5], self.numbers[6]];
        let own = 2.0 * length(half);
        if own > 0.0 {
            for number in &mut self.numbers[4..7] {
                *number *= speed / own;
            }
        }
    }
}
