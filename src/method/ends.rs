//! Curves by handles: a method gives the rule for the handles of inner keys; this file computes the
//! handles at the ends of tracks, and the curves between handles.

use std::marker::PhantomData;

use glam::DVec3;

use crate::curve::options::Ends;
use crate::fit::double::handles::{
    BetweenHandles, ControlRotations, EndHandle, HandleRule, KeyHandles,
};
use crate::fit::double::intervals::{Intervals, Stretch, at, put};
use crate::math::quaternion::{self, Quaternion, Vector, exp, product, scaled};
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
        if let Some(lane) = stretch.first() {
            let other = at(&intervals.incoming, lane + 1);
            let without = |back| product(at(&intervals.steps, lane), back);
            let handle = end_handle::<R>(intervals, lane, other, without, start);
            put(&mut intervals.outgoing, lane, handle);
        }
        if let Some(lane) = stretch.last() {
            let other = at(&intervals.outgoing, lane);
            let without = |back| product(back, at(&intervals.steps, lane));
            let handle = end_handle::<R>(intervals, lane, other, without, end);
            put(&mut intervals.incoming, lane + 1, handle);
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

/// The handle of a track's first or last key towards the interval in `lane`. `other` is the handle
/// of that interval's inner key; `without` returns the interval's step without that handle, given
/// the exponential of its negative.
fn end_handle<R: HandleRule>(
    intervals: &Intervals,
    lane: usize,
    other: Vector,
    without: impl Fn(Quaternion) -> Quaternion,
    end: End,
) -> Vector {
    let log = at(&intervals.logs, lane);
    let handle = match end {
        End::Parabolic => EndHandle::Parabolic,
        End::Natural => {
            let rest = without(exp(scaled(other, -1.0)));
            EndHandle::Natural(quaternion::log(rest))
        }
        End::Secant => EndHandle::Turn(log),
        End::Clamped(half) => EndHandle::Turn(scaled(half, intervals.durations[lane])),
    };
    R::end(log, other, handle)
}
