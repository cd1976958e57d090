//! Interpolating cubics: handles at the keys become curves. A method says what the
//! handles of an inner key are; this says what happens at the ends.

use std::marker::PhantomData;

use super::Ends;
use crate::branchless::{Vector, exp, log, product, scaled, sum};
use crate::cpu::in_lanes;
use crate::prepare::{BetweenHandles, HandleRule, Intervals, KeyHandles, Stretch};

/// The curves of a block of intervals, for a method with that rule for handles.
pub(super) fn curves<R: HandleRule>(intervals: &mut Intervals, stretches: &[Stretch], ends: Ends) {
    in_lanes(&mut KeyHandles::<R> {
        intervals,
        rule: PhantomData,
    });
    for stretch in stretches {
        let (first, last) = (stretch.first(), stretch.last());
        if let (Some(lane), 1) = (first, stretch.all) {
            // Two keys: the handles of constant velocity.
            let third = scaled(intervals.log(lane), 1.0 / 3.0);
            intervals.set_outgoing(lane, third);
            intervals.set_incoming(lane + 1, third);
            continue;
        }
        if matches!(ends, Ends::Loop) {
            continue;
        }
        if let Some(lane) = first {
            let handle = first_handle(intervals, lane, ends);
            intervals.set_outgoing(lane, handle);
        }
        if let Some(lane) = last {
            let handle = last_handle(intervals, lane, ends);
            intervals.set_incoming(lane + 1, handle);
        }
    }
    in_lanes(&mut BetweenHandles(intervals));
}

/// The handle of the first key towards its interval, that in `lane`.
fn first_handle(intervals: &Intervals, lane: usize, ends: Ends) -> Vector {
    let incoming = intervals.incoming(lane + 1);
    match ends {
        Ends::Clamped { start, .. } => scaled(start.to_array(), intervals.duration(lane) / 6.0),
        Ends::Natural => {
            // No acceleration: a lies half way between the key and b.
            let to_b = product(intervals.step(lane), exp(scaled(incoming, -1.0)));
            scaled(log(to_b), 0.5)
        }
        Ends::Parabolic | Ends::Loop | Ends::Frozen => sum(
            scaled(intervals.log(lane), 2.0 / 3.0),
            scaled(incoming, -1.0),
        ),
    }
}

/// The handle of the last key towards its interval, that in `lane`.
fn last_handle(intervals: &Intervals, lane: usize, ends: Ends) -> Vector {
    let outgoing = intervals.outgoing(lane);
    match ends {
        Ends::Clamped { end, .. } => scaled(end.to_array(), intervals.duration(lane) / 6.0),
        Ends::Natural => {
            let from_a = product(exp(scaled(outgoing, -1.0)), intervals.step(lane));
            scaled(log(from_a), 0.5)
        }
        Ends::Parabolic | Ends::Loop | Ends::Frozen => sum(
            scaled(intervals.log(lane), 2.0 / 3.0),
            scaled(outgoing, -1.0),
        ),
    }
}
