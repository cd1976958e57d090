//! Tracks at constant speed. The curves of a track are collected until all are known. Then the duration of each in
//! the track's time becomes proportional to its arc length.

use std::sync::Arc;

use crate::fit::exact::fit::{INDISTINCT, IntervalCurve};
use crate::fit::motion::arc_length::ArcLengths;
use crate::math::quaternion::round_quat;
use crate::prepare::fitting::Fitting;
use crate::prepare::prepared::Prepared;
use crate::threads::stop;
use crate::time::runs::NONE;
use crate::time::spans::{SpanSource, TrackPart};

/// The largest angle in radians that has no effect on results in f32.
const VISIBLE: f64 = 1e-8;

/// An interval of a track whose other intervals are not complete yet.
pub(crate) struct PendingInterval {
    /// Its part of the prepared tracks.
    pub(crate) part: usize,
    /// The start according to the key times in seconds.
    pub(crate) start: f64,
    /// The constant to store at exactly the start, or [`NONE`].
    pub(crate) key: u32,
    /// The curve; `None` if it stands still.
    pub(crate) curve: Option<IntervalCurve>,
}

/// Sets the times of the curves of every track, and passes them on to be fitted.
pub(crate) fn retime(
    prepared: &mut Prepared,
    waiting: &mut [PendingInterval],
    fitting: &mut Fitting,
) {
    for intervals in waiting.chunk_by_mut(|this, next| this.part == next.part) {
        let (part, first_span) = (intervals[0].part, prepared.spans.len());
        retime_track(prepared, intervals, part, fitting);
        prepared.parts[part].spans = first_span..prepared.spans.len();
    }
}

fn retime_track(
    prepared: &mut Prepared,
    intervals: &mut [PendingInterval],
    part: usize,
    fitting: &mut Fitting,
) {
    let (start, first_key) = (intervals[0].start, intervals[0].key);
    let paced = |interval: &mut PendingInterval| {
        if stop::is_stopped() {
            return None; // the caller asks again whether it was stopped
        }
        let curve = interval.curve.take()?;
        let pace = ArcLengths::new(&|u| curve.moving(u));
        let length = pace.total();
        (length > 0.0 && length.is_finite()).then_some((interval.key, curve, pace))
    };
    let paced: Vec<(u32, IntervalCurve, ArcLengths)> =
        intervals.iter_mut().filter_map(paced).collect();
    if paced.is_empty() {
        // The track does not move.
        let TrackPart {
            before, extension, ..
        } = &prepared.parts[part];
        let held = match (*before, first_key) {
            (NONE, NONE) => {
                let from_before = extension
                    .as_ref()
                    .map_or(0, |extension| extension.from_before);
                let value = prepared.exact[from_before as usize].value(0.0);
                prepared.constant(round_quat(value))
            }
            (NONE, key) => key,
            (before, _) => before,
        };
        prepared.push_span(start, SpanSource::Constant(held), NONE);
        return;
    }
    let total: f64 = paced.iter().map(|(_, _, pace)| pace.total()).sum();
    let (end, count) = (prepared.parts[part].end, paced.len());
    let seconds = end - start;
    // The first time in f64 at which the track has moved this far, in seconds from its start. At an earlier time, the
    // curve would be evaluated past its end.
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
        let exact_to = if is_last {
            seconds
        } else {
            seconds * (done / total)
        };
        let from = reached(exact_from);
        let to = if is_last { end } else { reached(exact_to) };
        let missed = [(from, exact_from, 0.0), (to, exact_to, 1.0)];
        let ends = missed.map(|(time, exact, fraction)| {
            let missed = ((time - start) - exact) / (exact_to - exact_from);
            if missed.abs() > INDISTINCT {
                fraction + missed
            } else {
                fraction
            }
        });
        pace.set_ends(ends);
        curve.arc_lengths = Some(Arc::new(pace));
        curve.rate = 1.0 / (to - from);
        if let (true, Some(extension)) = (is_last, &prepared.parts[part].extension)
            && extension.at_end != NONE
        {
            prepared.constants[extension.at_end as usize] = round_quat(curve.value_at(1.0));
        }
        if stop::is_stopped() {
            return;
        }
        if from < to {
            // If the exact time of the key is not an f64, no sample is at the key.
            let key = if ends[0] == 0.0 { key } else { NONE };
            fitting.queue_curve(prepared, curve, from, key);
        }
    }
    let Some(extension) = &prepared.parts[part].extension else {
        return;
    };
    for curve_index in [extension.from_before, extension.from_after] {
        if curve_index != NONE {
            prepared.exact[curve_index as usize].set_speed(total / seconds);
        }
    }
}
