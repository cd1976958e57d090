//! The cumulative uniform cubic B-spline.

use super::basis::B_SPLINE as BASIS;
use super::{Cubics, Curves, Ends, Form, Method};
use crate::branchless::{Vector, exp, product, scaled, sum};
use crate::cpu::in_lanes;
use crate::prepare::{BetweenNeighbours, Intervals, Stretch};
use crate::reference;

/// The cumulative cubic B-spline: the smoothest, but it only nears its keys. The
/// key times must be even for the curve to be smooth in time.
pub const B_SPLINE: Method = Method {
    name: "b-spline",
    summary: "continuous angular acceleration; passes near its keys, not through them",
    formula: "q(t) = q_{i-1} Π exp(C_j(t) log(q_{i+j-2}⁻¹ q_{i+j-1})), j = 1, 2, 3",
    source: "Kim, Kim, Shin 1995, A general construction scheme for unit quaternion curves",
    continuity: "C2 (uniform keys)",
    interpolates: false,
    form: Form::Polynomial,
    reference: reference::Kind::BSpline,
    curves: Curves::Cubics(Cubics {
        basis: &BASIS,
        curves,
    }),
};

fn curves(intervals: &mut Intervals, stretches: &[Stretch], ends: Ends) {
    for stretch in stretches {
        if matches!(ends, Ends::Loop) && stretch.all > 1 {
            continue; // the neighbours are those across the seam
        }
        let alone = stretch.all == 1;
        let (first, last) = (stretch.first(), stretch.last());
        let before = first.map(|lane| (lane - 1, before_first(intervals, lane, ends, alone)));
        let after = last.map(|lane| (lane + 1, after_last(intervals, lane, ends, alone)));
        for (lane, log) in [before, after].into_iter().flatten() {
            intervals.set_log(lane, log);
        }
    }
    in_lanes(&mut BetweenNeighbours(intervals));
}

/// The logarithm that continues the curve before the first interval.
fn before_first(intervals: &Intervals, lane: usize, ends: Ends, alone: bool) -> Vector {
    let own = intervals.log(lane);
    match ends {
        _ if alone => own, // two keys: constant velocity
        Ends::Parabolic => sum(scaled(own, 2.0), scaled(intervals.log(lane + 1), -1.0)),
        Ends::Clamped { start, .. } => {
            // B₁' = B₂' = 1/2 and B₂ = 1/6 at t = 0.
            let target = scaled(start.to_array(), intervals.duration(lane));
            rotate(scaled(own, 1.0 / 6.0), sum(target, scaled(own, -1.0)))
        }
        Ends::Natural | Ends::Loop | Ends::Frozen => own,
    }
}

/// The logarithm that continues the curve behind the last interval.
fn after_last(intervals: &Intervals, lane: usize, ends: Ends, alone: bool) -> Vector {
    let own = intervals.log(lane);
    match ends {
        _ if alone => own,
        Ends::Parabolic => sum(scaled(own, 2.0), scaled(intervals.log(lane - 1), -1.0)),
        Ends::Clamped { end, .. } => {
            // B₂' = B₃' = 1/2 and B₃ = 1/6 at t = 1: the unknown also turns the frame.
            let target = scaled(end.to_array(), intervals.duration(lane));
            let start = sum(target, scaled(own, -1.0));
            (0..END_ITERATIONS).fold(start, |step, _| {
                let turned = rotate(scaled(step, -1.0 / 6.0), own);
                sum(target, scaled(turned, -1.0))
            })
        }
        Ends::Natural | Ends::Loop | Ends::Frozen => own,
    }
}

/// Each iteration shrinks the error by a third of the step's half-angle or more.
const END_ITERATIONS: usize = 48;

/// `exp(a) v exp(-a)`.
fn rotate(a: Vector, v: Vector) -> Vector {
    let turned = product(exp(a), [v[0], v[1], v[2], 0.0]);
    let [x, y, z, _] = product(turned, exp(scaled(a, -1.0)));
    [x, y, z]
}
