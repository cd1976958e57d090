//! Curves by handles: a method gives the rule for the handles of inner keys; this file computes the
//! handles at the ends of tracks, and the curves between handles.

use std::marker::PhantomData;

use crate::curve::options::Ends;
use crate::fit::double::handles::{
    BetweenHandles, ControlRotations, EndHandle, EndInterval, HandleRule, KeyHandles,
};
use crate::fit::double::intervals::{Intervals, Stretch};
use crate::math::quaternion::{Quaternion, Vector, exp, log, product, scaled};
use crate::simd::dispatch::in_lanes;

/// Curves in cumulative form, for a method with that rule for handles.
pub(crate) fn products<R: HandleRule>(
    intervals: &mut Intervals,
    stretches: &[Stretch],
    ends: Ends,
) {
    handles::<R>(intervals, stretches, ends);
    in_lanes(&mut BetweenHandles(intervals));
}

/// Curves by control rotations, for a method with that rule for handles.
pub(crate) fn controls<R: HandleRule>(
    intervals: &mut Intervals,
    stretches: &[Stretch],
    ends: Ends,
) {
    handles::<R>(intervals, stretches, ends);
    in_lanes(&mut ControlRotations(intervals));
}

fn handles<R: HandleRule>(intervals: &mut Intervals, stretches: &[Stretch], ends: Ends) {
    in_lanes(&mut KeyHandles::<R> {
        intervals,
        stretches,
        rule: PhantomData,
    });
    for stretch in stretches {
        let (first, last) = (stretch.first(), stretch.last());
        if let (Some(lane), 1) = (first, stretch.all) {
            // Two keys: the handles of constant velocity.
            let log = intervals.log(lane);
            let alone = EndInterval {
                log,
                other: [0.0; 3],
            };
            let handle = R::end(alone, EndHandle::Turn(log));
            intervals.set_outgoing(lane, handle);
            intervals.set_incoming(lane + 1, handle);
            continue;
        }
        if matches!(ends, Ends::Loop) {
            continue;
        }
        if let Some(lane) = first {
            let other = intervals.incoming(lane + 1);
            let without = |back| product(intervals.step(lane), back);
            let handle = end_handle::<R>(intervals, lane, other, without, ends.start());
            intervals.set_outgoing(lane, handle);
        }
        if let Some(lane) = last {
            let other = intervals.outgoing(lane);
            let without = |back| product(back, intervals.step(lane));
            let handle = end_handle::<R>(intervals, lane, other, without, ends.end());
            intervals.set_incoming(lane + 1, handle);
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
    /// What happens at the first key.
    pub(crate) fn start(self) -> End {
        match self {
            Self::Clamped { start, .. } => End::Clamped(scaled(start.to_array(), 0.5)),
            _ => self.either(),
        }
    }

    /// What happens at the last key.
    pub(crate) fn end(self) -> End {
        match self {
            Self::Clamped { end, .. } => End::Clamped(scaled(end.to_array(), 0.5)),
            _ => self.either(),
        }
    }

    fn either(self) -> End {
        match self {
            Self::Natural => End::Natural,
            Self::Secant => End::Secant,
            Self::Parabolic | Self::Clamped { .. } | Self::Loop | Self::Frozen => End::Parabolic,
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
    let step_log = intervals.log(lane);
    let interval = EndInterval {
        log: step_log,
        other,
    };
    let handle = match end {
        End::Parabolic => EndHandle::Parabolic,
        End::Natural => EndHandle::Natural(log(without(exp(scaled(other, -1.0))))),
        End::Secant => EndHandle::Turn(step_log),
        End::Clamped(half) => EndHandle::Turn(scaled(half, intervals.duration(lane))),
    };
    R::end(interval, handle)
}
