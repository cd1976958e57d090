//! Curves by handles: a method gives the rule for the handles of inner keys; this file computes the
//! handles at the ends of tracks, and the curves between handles.

use std::marker::PhantomData;

use glam::DVec3;

use crate::curve::options::Ends;
use crate::fit::double::handles::{
    BetweenHandles, ControlRotations, EndHandle, HandleRule, KeyHandles,
};
use crate::fit::double::intervals::{Intervals, Stretch, at, put};
use crate::math::quaternion::{self, Vector, exp, product, scaled};
use crate::simd::dispatch::in_lanes;

/// The curves of a method with that rule for handles.
pub(crate) fn curves<R: HandleRule>(intervals: &mut Intervals, stretches: &[Stretch], ends: Ends) {
    set_handles::<R>(intervals, stretches, ends);
    if R::IS_CUMULATIVE {
        in_lanes(&mut BetweenHandles(intervals));
    } else {
        in_lanes(&mut ControlRotations(intervals));
    }
}

fn set_handles<R: HandleRule>(intervals: &mut Intervals, stretches: &[Stretch], ends: Ends) {
    in_lanes(&mut KeyHandles::<R> {
        intervals,
        stretches,
        rule: PhantomData,
    });
    let [start, end] = ends.both();
    for stretch in stretches {
        if let (Some(lane), 1) = (stretch.first(), stretch.all) {
            // Two keys: the handles of constant velocity.
            let log = at(&intervals.logs, lane);
            let handle = R::end(log, [0.0; 3], EndHandle::Turn(log));
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
            // The handle of the interval's inner key.
            let other = match is_first {
                true => at(&intervals.incoming, lane + 1),
                false => at(&intervals.outgoing, lane),
            };
            let handle = match end {
                End::Parabolic => EndHandle::Parabolic,
                End::Natural => {
                    let back = exp(scaled(other, -1.0));
                    let (a, b) = if is_first { (step, back) } else { (back, step) };
                    EndHandle::Natural(quaternion::log(product(a, b)))
                }
                End::Secant => EndHandle::Turn(log),
                End::Clamped(half) => EndHandle::Turn(scaled(half, intervals.durations[lane])),
            };
            let handle = R::end(log, other, handle);
            match is_first {
                true => put(&mut intervals.outgoing, lane, handle),
                false => put(&mut intervals.incoming, lane + 1, handle),
            }
        }
    }
}

/// The condition at one end of a track.
#[derive(Clone, Copy)]
pub(crate) enum End {
    Parabolic,
    Natural,
    Secant,
    /// Half of an angular velocity, radians per second.
    Clamped(Vector),
}

impl Ends {
    /// What happens at the first and at the last key.
    pub(crate) fn both(self) -> [End; 2] {
        let clamped = |rate: DVec3| End::Clamped(scaled(rate.to_array(), 0.5));
        match self {
            Self::Clamped { start, end } => [clamped(start), clamped(end)],
            Self::Natural => [End::Natural; 2],
            Self::Secant => [End::Secant; 2],
            Self::Parabolic | Self::Loop | Self::Frozen => [End::Parabolic; 2],
        }
    }
}
