//! Curves defined by handles. A method has a rule for the handles at inner keys; this file computes the handles at
//! the ends of tracks, and the curves between handles.

use std::marker::PhantomData;

use glam::DVec3;

use crate::curve::options::Ends;
use crate::fit::block::{Intervals, TrackStretch, at, put};
use crate::fit::exact::handles::{
    BetweenHandles, ControlRotations, EndHandle, HandleRule, KeyHandles,
};
use crate::math::quaternion::{self, Vector, exp, product, scaled};
use crate::simd::dispatch::in_lanes;

/// The curves of a method with this rule for handles.
pub(crate) fn curves<R: HandleRule>(
    intervals: &mut Intervals,
    stretches: &[TrackStretch],
    ends: Ends,
) {
    set_handles::<R>(intervals, stretches, ends);
    if R::IS_CUMULATIVE {
        in_lanes(&mut BetweenHandles(intervals));
    } else {
        in_lanes(&mut ControlRotations(intervals));
    }
}

fn set_handles<R: HandleRule>(intervals: &mut Intervals, stretches: &[TrackStretch], ends: Ends) {
    in_lanes(&mut KeyHandles::<R> {
        intervals,
        stretches,
        rule: PhantomData,
    });
    let [start, end] = EndCondition::both(ends);
    for stretch in stretches {
        if let (Some(lane), 1) = (stretch.first(), stretch.track_intervals) {
            // With only two keys, the handles are those of constant velocity.
            let log = at(&intervals.logs, lane);
            let handle = R::end(log, [0.0; 3], EndHandle::Velocity(log));
            put(&mut intervals.outgoing, lane, handle);
            put(&mut intervals.incoming, lane + 1, handle);
            continue;
        }
        if matches!(ends, Ends::Loop) {
            continue;
        }
        let both = [(stretch.first(), start, true), (stretch.last(), end, false)];
        for (lane, end, is_first) in both {
            let Some(lane) = lane else { continue };
            let (log, step) = (at(&intervals.logs, lane), at(&intervals.steps, lane));
            // The handle at the other key of the interval, which is inside the track.
            let other = if is_first {
                at(&intervals.incoming, lane + 1)
            } else {
                at(&intervals.outgoing, lane)
            };
            let handle = match end {
                EndCondition::Parabolic => EndHandle::Parabolic,
                EndCondition::Natural => {
                    let back = exp(scaled(other, -1.0));
                    let (a, b) = if is_first { (step, back) } else { (back, step) };
                    EndHandle::Natural(quaternion::log(product(a, b)))
                }
                EndCondition::Secant => EndHandle::Velocity(log),
                EndCondition::Clamped(half) => {
                    EndHandle::Velocity(scaled(half, intervals.durations[lane]))
                }
            };
            let handle = R::end(log, other, handle);
            if is_first {
                put(&mut intervals.outgoing, lane, handle);
            } else {
                put(&mut intervals.incoming, lane + 1, handle);
            }
        }
    }
}

/// The condition at one end of a track.
#[derive(Clone, Copy)]
pub(crate) enum EndCondition {
    Parabolic,
    Natural,
    Secant,
    /// Half of an angular velocity in radians per second.
    Clamped(Vector),
}

impl EndCondition {
    /// The conditions at the first and at the last key.
    pub(crate) fn both(ends: Ends) -> [Self; 2] {
        let clamped = |rate: DVec3| Self::Clamped(scaled(rate.to_array(), 0.5));
        match ends {
            Ends::Clamped { start, end } => [clamped(start), clamped(end)],
            Ends::Natural => [Self::Natural; 2],
            Ends::Secant => [Self::Secant; 2],
            Ends::Parabolic | Ends::Loop | Ends::Frozen => [Self::Parabolic; 2],
        }
    }
}
