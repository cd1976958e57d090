//! The cumulative B-spline, with the key times as knots.

use glam::DVec3;

use crate::curve::options::Ends;
use crate::reference::curve::Definition;
use crate::reference::quaternion::{exponential, logarithm, multiply, rotated};
use crate::reference::segment::{Basis, Segment, knots};
use crate::reference::track::ReferenceTrack;
use crate::reference::two_keys::with_frozen_ends;

/// The cumulative cubic B-spline.
pub(crate) const B_SPLINE: Definition = Definition::new("b-spline", |track, ends| {
    with_frozen_ends(track, ends, |i| b_spline(track, ends, i))
});

fn b_spline(track: &ReferenceTrack, ends: Ends, i: usize) -> Segment {
    let last = track.last() - 1;
    let step = |i: usize| logarithm(track.difference(i));
    let basis = Basis::Knots(knots(&track.times, ends, i));
    // The step beyond the first interval or, `at_end`, beyond the last.
    let outer_step = |at_end: bool| {
        // The outermost interval, its neighbour, the parameter of the end, and the factor that belongs to the outer
        // step.
        let (outermost, next, t, outer) = match at_end {
            false => (0, 1, 0.0, 0),
            true => (last, last.saturating_sub(1), 1.0, 2),
        };
        let solved = if at_end { third } else { first };
        match ends {
            _ if last == 0 => step(0),
            // In a loop, the step beyond an end is the step at the other end.
            Ends::Loop => step(last - outermost),
            Ends::Parabolic => parabola(track, outermost, next),
            Ends::Natural => {
                // Only two factors have a second derivative at the end. At a natural end, the sum of these two terms is
                // 0.
                let second = basis.second_derivatives(t);
                step(outermost) * (-second[1] / second[outer])
            }
            Ends::Clamped { start, end } => {
                let rate = if at_end { end } else { start };
                solved(basis, rate * track.step(outermost) / 2.0, step(outermost))
            }
            Ends::Secant => solved(basis, step(outermost), step(outermost)),
            Ends::Frozen => step(outermost),
        }
    };
    let before = if i > 0 {
        step(i - 1)
    } else {
        outer_step(false)
    };
    let after = if i < last {
        step(i + 1)
    } else {
        outer_step(true)
    };
    Segment::Product {
        base: multiply(track.keys[i], exponential(-before)),
        w: [before, step(i), after],
        basis,
    }
}

/// The step outside an end, on the parabola through the three keys there; it is as long as the interval at the end.
fn parabola(track: &ReferenceTrack, end: usize, next: usize) -> DVec3 {
    let rate = |i: usize| logarithm(track.difference(i)) / track.step(i);
    let (h, next_h) = (track.step(end), track.step(next));
    let second_difference = (rate(next) - rate(end)) / (h + next_h);
    (rate(end) - second_difference * 2.0 * h) * h
}

/// `w₁` such that the curve starts with `rate = exp(-w₂ B₂) w₁ B₁' exp(w₂ B₂) + w₂ B₂'`.
fn first(basis: Basis, rate: DVec3, step: DVec3) -> DVec3 {
    let (values, slopes) = (basis.values(0.0), basis.derivatives(0.0));
    rotated(rate - step * slopes[1], exponential(step * values[1])) / slopes[0]
}

/// `w₃` such that the curve ends with `rate = exp(-w₃ B₃) w₂ B₂' exp(w₃ B₃) + w₃ B₃'`.
fn third(basis: Basis, rate: DVec3, step: DVec3) -> DVec3 {
    let (values, slopes) = (basis.values(1.0), basis.derivatives(1.0));
    let mut w = step;
    for _ in 0..200 {
        w = (rate - rotated(step * slopes[1], exponential(-w * values[2]))) / slopes[2];
    }
    w
}
