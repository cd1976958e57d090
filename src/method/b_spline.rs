//! The cumulative cubic B-spline, with the key times as knots.

use crate::curve::options::Ends;
use crate::fit::block::{Intervals, TrackStretch, at, put};
use crate::fit::exact::handles::BetweenNeighbours;
use crate::fit::exact::shape::PRODUCT;
use crate::math::quaternion::{Vector, exp, ratio, rotated, scaled, sum};
use crate::method::ends::EndCondition;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::method::{
    Continuity, Cost, CurveKind, Keys, Method, MethodInput, SmoothCurves, defaults,
};
use crate::simd::dispatch::in_lanes;
use crate::tracks::set::Track;

/// The cumulative cubic B-spline: the smoothest method; its curve passes near its keys and not through them.
///
/// Its knots are the key times, which may be uneven. Before the first key and after the last one, the knots continue
/// with the length of the interval there.
pub const B_SPLINE: Method = Method {
    name: "b-spline",
    summary: "continuous angular acceleration; passes near its keys, not through them",
    formula: "q(t) = q_{i-1} Π exp(C_j(t) log(q_{i+j-2}⁻¹ q_{i+j-1})), j = 1, 2, 3, with C_j the sums of the last basis functions",
    source: "Kim, Kim, Shin 1995, A general construction scheme for unit quaternion curves; de Boor 1972",
    continuity: Continuity::C2,
    continuity_on_even_keys: Continuity::C2,
    keeps_constant_velocity: Keys::Even,
    interpolates: false,
    symmetric: false,
    cost: Cost::new(220.0, 3.0),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind =
    CurveKind::Smooth(SmoothCurves::new(&PRODUCT, curves).with(MethodInput::Numbers(spacing)));

/// The durations of the two intervals before this one and of the two after it, in units of this interval's duration.
fn spacing(track: Track, interval: usize, interpolation: &Interpolation) -> [[f64; 4]; 2] {
    let closed = matches!(interpolation.ends, Ends::Loop);
    [neighbours(track.times, interval, closed), [0.0; 4]]
}

/// As [`spacing`], for keys at these times; in a closed curve the last interval is a neighbour of the first.
pub(crate) fn neighbours(times: &[f64], interval: usize, closed: bool) -> [f64; 4] {
    let last = times.len() as isize - 2;
    let duration = |offset: isize| {
        let i = interval as isize + offset;
        let i = if closed {
            i.rem_euclid(last + 1)
        } else {
            i.clamp(0, last)
        } as usize;
        times[i + 1] - times[i]
    };
    let length = duration(0);
    [-2, -1, 1, 2].map(|offset| ratio(duration(offset), length))
}

/// Coefficients of 1, t, t², t³ in the three cumulative basis functions of an interval of length 1, for the lengths
/// of the two intervals before it and of the two after it.
pub(crate) fn basis([before_that, before, after, after_that]: [f64; 4]) -> [[f64; 4]; 3] {
    let first = 1.0 / ((1.0 + before) * (1.0 + before + before_that));
    let third = 1.0 / ((1.0 + after) * (1.0 + after + after_that));
    let all = 1.0 + before + after;
    let second = 1.0 / ((1.0 + before) * all);
    let (c0, c1, c2) = (
        before * before * second,
        3.0 * before * second,
        3.0 * second,
    );
    let at_end = 1.0 - after * after / ((1.0 + after) * all);
    [
        [1.0 - first, 3.0 * first, -3.0 * first, first],
        [c0, c1, c2, at_end - c0 - c1 - c2],
        [0.0, 0.0, 0.0, third],
    ]
}

fn curves(intervals: &mut Intervals, stretches: &[TrackStretch], ends: Ends) {
    let [start, end] = EndCondition::both(ends);
    for stretch in stretches {
        if matches!(ends, Ends::Loop) && stretch.track_intervals > 1 {
            continue; // the context already has the neighbours across the seam
        }
        // Two keys rotate at constant velocity. With frozen ends the outer intervals do not move, so any continuation
        // gives the same curve.
        let repeats_interval = stretch.track_intervals == 1 || matches!(ends, Ends::Frozen);
        let before = |lane| {
            if repeats_interval {
                (lane - 1, at(&intervals.logs, lane))
            } else {
                (lane - 1, before_first(intervals, lane, start))
            }
        };
        let after = |lane| {
            if repeats_interval {
                (lane + 1, at(&intervals.logs, lane))
            } else {
                (lane + 1, after_last(intervals, lane, end))
            }
        };
        let (before, after) = (stretch.first().map(before), stretch.last().map(after));
        for (lane, log) in [before, after].into_iter().flatten() {
            put(&mut intervals.logs, lane, log);
        }
    }
    in_lanes(&mut BetweenNeighbours(intervals));
    for lane in stretches.iter().flat_map(TrackStretch::lanes) {
        let basis = basis(at(&intervals.outward, lane));
        intervals.set_basis(lane, basis);
    }
}

/// The logarithm that continues the curve before the first interval.
fn before_first(intervals: &Intervals, lane: usize, end: EndCondition) -> Vector {
    let log = at(&intervals.logs, lane);
    let [[_, slope1, ..], [value2, slope2, bend2, _], _] = basis(at(&intervals.outward, lane));
    let end_step = match end {
        EndCondition::Parabolic => return extrapolated(intervals, lane, lane + 1),
        // B₁'' = -2 B₁' at t = 0.
        EndCondition::Natural => return scaled(log, bend2 / slope1),
        EndCondition::Secant => log,
        EndCondition::Clamped(half) => scaled(half, intervals.durations[lane]),
    };
    let rest = sum(end_step, scaled(log, -slope2));
    rotated(exp(scaled(log, value2)), scaled(rest, 1.0 / slope1))
}

/// The logarithm that continues the curve after the last interval.
fn after_last(intervals: &Intervals, lane: usize, end: EndCondition) -> Vector {
    let log = at(&intervals.logs, lane);
    let [_, [_, c1, c2, c3], [.., value3]] = basis(at(&intervals.outward, lane));
    let slope3 = 3.0 * value3;
    let end_step = match end {
        EndCondition::Parabolic => return extrapolated(intervals, lane, lane - 1),
        EndCondition::Natural => return scaled(log, -(c2 + 3.0 * c3) / slope3),
        EndCondition::Secant => log,
        EndCondition::Clamped(half) => scaled(half, intervals.durations[lane]),
    };
    // The unknown step occurs on both sides of the equation, because it also rotates the slope of this interval.
    // Therefore the equation is solved by fixed-point iteration.
    let interval_slope = c1 + 2.0 * c2 + 3.0 * c3;
    (0..END_ITERATIONS).fold(log, |step, _| {
        let rotated_log = rotated(exp(scaled(step, -value3)), log);
        let rest = sum(end_step, scaled(rotated_log, -interval_slope));
        scaled(rest, 1.0 / slope3)
    })
}

/// The logarithm for one more interval of the parabola through the three keys at an end.
fn extrapolated(intervals: &Intervals, lane: usize, next: usize) -> Vector {
    let (log, other) = (at(&intervals.logs, lane), at(&intervals.logs, next));
    let (h, next_h) = (intervals.durations[lane], intervals.durations[next]);
    let change = sum(scaled(other, ratio(h, next_h)), scaled(log, -1.0));
    sum(log, scaled(change, -2.0 / (1.0 + ratio(next_h, h))))
}

/// Each iteration reduces the error by at least a fifth, and usually by more than half.
const END_ITERATIONS: usize = 120;
