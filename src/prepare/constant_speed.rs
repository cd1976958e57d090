//! Tracks at constant speed. The curves of a track wait until all of them are known; then each gets
//! the fraction of the track's time that its arc length is of the track's.

use std::sync::Arc;

use crate::fit::double::curve::{Curve, INDISTINCT};
use crate::fit::motion::arc_length::Pace;
use crate::math::canonical::round_quat;
use crate::math::quaternion::length;
use crate::prepare::fitting::Fitting;
use crate::prepare::prepared::Prepared;
use crate::threads::stop;
use crate::time::spans::{NONE, Part, Source};

/// A smaller angle than this, radians, shows in no result in f32.
const VISIBLE: f64 = 1e-8;

/// An interval that waits until all of its track is there.
pub(crate) struct Waiting {
    /// Its part of the prepared tracks.
    pub(crate) part: usize,
    /// When it starts as keyed, in seconds.
    pub(crate) start: f64,
    /// The constant to store at exactly the start, or [`NONE`].
    pub(crate) key: u32,
    /// `None` if it stands still.
    pub(crate) curve: Option<Curve>,
}

/// Gives the curves of every track their times, and hands them over to be fitted.
pub(crate) fn retime(prepared: &mut Prepared, waiting: &mut [Waiting], fitting: &mut Fitting) {
    for own in waiting.chunk_by_mut(|own, next| own.part == next.part) {
        let (part, first_span) = (own[0].part, prepared.spans.len());
        retime_track(prepared, own, part, fitting);
        prepared.parts[part].spans = first_span..prepared.spans.len();
    }
}

fn retime_track(
    prepared: &mut Prepared,
    intervals: &mut [Waiting],
    part: usize,
    fitting: &mut Fitting,
) {
    let (start, first_key) = (intervals[0].start, intervals[0].key);
    let paced = |interval: &mut Waiting| {
        if stop::is_stopped() {
            return None; // whoever prepares looks again when this is done
        }
        let curve = interval.curve.take()?;
        let pace = Pace::new(&curve);
        let length = pace.total();
        (length > 0.0 && length.is_finite()).then_some((interval.key, curve, pace))
    };
    let paced: Vec<(u32, Curve, Pace)> = intervals.iter_mut().filter_map(paced).collect();
    if paced.is_empty() {
        // The track does not move at all.
        let Part { before, beyond, .. } = &prepared.parts[part];
        let held = match (*before, first_key) {
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
    let total: f64 = paced.iter().map(|(_, _, pace)| pace.total()).sum();
    let (end, count) = (prepared.parts[part].end, paced.len());
    let seconds = end - start;
    // The first time of f64 at which the track has got so far, in seconds from its start: before it, the
    // curve would be followed beyond its end.
    let reached = |exact: f64| {
        let time = start + exact;
        let is_before = (exact - (time - start)) * (total / seconds) > VISIBLE;
        if is_before { time.next_up() } else { time }
    };
    let mut done = 0.0;
    for (i, (key, mut curve, mut pace)) in paced.into_iter().enumerate() {
        let exact_from = seconds * (done / total);
        done += pace.total();
        let is_last = i + 1 == count;
        let exact_to = match is_last {
            true => seconds,
            false => seconds * (done / total),
        };
        let from = reached(exact_from);
        let to = if is_last { end } else { reached(exact_to) };
        let missed = [(from, exact_from, 0.0), (to, exact_to, 1.0)];
        let ends = missed.map(|(time, exact, fraction)| {
            let missed = ((time - start) - exact) / (exact_to - exact_from);
            match missed.abs() > INDISTINCT {
                true => fraction + missed,
                false => fraction,
            }
        });
        pace.set_ends(ends);
        curve.pace = Some(Arc::new(pace));
        curve.rate = 1.0 / (to - from);
        if let (true, Some(beyond)) = (is_last, &prepared.parts[part].beyond)
            && beyond.at_end != NONE
        {
            prepared.constants[beyond.at_end as usize] = round_quat(curve.value_at(1.0));
        }
        if stop::is_stopped() {
            return;
        }
        if from < to {
            // Where no f64 is the key's time, no sample is the key.
            let key = if ends[0] == 0.0 { key } else { NONE };
            fitting.take_curve(prepared, curve, from, key);
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
