//! Arc lengths of curves, for constant speed.

use crate::math::dual::Dual;
use crate::math::quadrature::{gauss, integral};
use crate::math::quaternion::{length, step};

/// The number of equal parts of a curve's parameter; the arc length up to each is stored.
const PARTS: usize = 8;

/// A curve that is slower than this fraction of its mean speed counts as at rest.
const SLOW: f64 = 1e-4;

/// The distance in the parameter from a point of rest at which the direction is computed. At this distance, a curve
/// that starts from rest has rotated by a billionth of its length, and its direction is known to seven digits.
const NEXT_TO_REST: f64 = 1e-5;

/// The maximum distance outside its interval to which a curve is followed, as a fraction of the interval.
const FARTHEST_OUTSIDE: f64 = 0.25;

/// A curve: its rotation as a function of the parameter, in dual numbers.
pub(crate) trait Moving: Fn(Dual) -> [Dual; 4] {}

impl<F: Fn(Dual) -> [Dual; 4]> Moving for F {}

/// The angle in radians that a curve has covered at each eighth of its parameter.
#[derive(Debug)]
pub(crate) struct ArcLengths {
    lengths: [f64; PARTS + 1],
    /// The fractions of the length at the start and the end of the curve's interval: 0 and 1, except for large times,
    /// where the exact start and end are between two numbers of f64.
    ends: [f64; 2],
}

impl ArcLengths {
    pub(crate) fn new(curve: &impl Moving) -> Self {
        let mut lengths = [0.0; PARTS + 1];
        for part in 0..PARTS {
            let [from, to] = [part, part + 1].map(|part| part as f64 / PARTS as f64);
            lengths[part + 1] = lengths[part] + arc_length_between(curve, from, to);
        }
        Self {
            lengths,
            ends: [0.0, 1.0],
        }
    }

    /// Sets the fractions of the length at the start and the end of the interval.
    pub(crate) fn set_ends(&mut self, ends: [f64; 2]) {
        self.ends = ends;
    }

    /// The angle of the whole curve in radians.
    pub(crate) fn total(&self) -> f64 {
        self.lengths[PARTS]
    }

    /// The parameter of the curve at `t`, which runs from 0 to 1 over the interval, with the first two derivatives by
    /// `t`.
    pub(crate) fn parameter(&self, curve: &impl Moving, t: f64) -> Dual {
        let [from, to] = self.ends;
        let mut u = self.parameter_at(curve, (from + (to - from) * t) * self.total());
        let (mut velocity, mut acceleration) = rates(curve, u);
        if length(velocity) < SLOW * self.total() {
            // A curve at rest has no direction, so it is taken slightly inside the interval.
            u = u.clamp(NEXT_TO_REST, 1.0 - NEXT_TO_REST);
            (velocity, acceleration) = rates(curve, u);
        }
        let speed = length(velocity).max(1e-12);
        let first = (to - from) * self.total() / speed;
        let along: f64 = velocity.iter().zip(acceleration).map(|(v, a)| v * a).sum();
        // |ω| u' is constant, so its derivative is 0.
        Dual::new(u, first, -along * (first / speed) * (first / speed))
    }

    /// The parameter at which the curve has covered `target` radians: Newton's method, or bisection if Newton's
    /// method leaves the part that contains it.
    fn parameter_at(&self, curve: &impl Moving, target: f64) -> f64 {
        let part = self.lengths.partition_point(|&length| length <= target);
        let part = part.saturating_sub(1).min(PARTS - 1);
        let [mut low, mut high] = [part, part + 1].map(|part| part as f64 / PARTS as f64);
        let (from, rest) = (low, target - self.lengths[part]);
        let whole = self.lengths[part + 1] - self.lengths[part];
        if whole <= 0.0 {
            return from;
        }
        let mut u = from + (high - low) * (rest / whole).clamp(0.0, 1.0);
        if rest < 0.0 {
            low -= FARTHEST_OUTSIDE;
        } else if rest > whole {
            high += FARTHEST_OUTSIDE;
        }
        let mut excess = arc_length_between(curve, from, u) - rest;
        for _ in 0..40 {
            if excess > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let (velocity, _) = rates(curve, u);
            let newton = u - excess / length(velocity).max(1e-12);
            let next = if (low..=high).contains(&newton) {
                newton
            } else {
                0.5 * (low + high)
            };
            let step = next - u;
            if step.abs() <= 1e-14 {
                return next;
            }
            // One quadrature is exact enough for a short step.
            excess += if step.abs() < 1e-3 {
                gauss(&speed(curve), u, next)
            } else {
                arc_length_between(curve, u, next)
            };
            u = next;
        }
        u
    }
}

/// The arc length in radians between two parameters.
fn arc_length_between(curve: &impl Moving, from: f64, to: f64) -> f64 {
    let differ = |whole: f64, sum: f64| {
        let agree = (sum - whole).abs() <= 1e-13 * (1.0 + sum);
        !agree
    };
    integral(&speed(curve), from, to, FINEST, &differ)
}

/// The maximum number of halvings, which are needed where a curve almost stops, because its speed has a corner there.
const FINEST: u32 = 8;

/// The angular speed by the parameter.
fn speed(curve: &impl Moving) -> impl Fn(f64) -> f64 {
    move |u| length(rates(curve, u).0)
}

/// Angular velocity and acceleration at `u`, per unit of the parameter.
fn rates(curve: &impl Moving, u: f64) -> ([f64; 3], [f64; 3]) {
    let rotation = curve(Dual::parameter(u));
    let at = rotation.map(|dual| dual.value);
    let twice = |derivative: [f64; 4]| {
        let [x, y, z, _] = step(at, derivative);
        [2.0 * x, 2.0 * y, 2.0 * z]
    };
    (
        twice(rotation.map(|dual| dual.first)),
        twice(rotation.map(|dual| dual.second)),
    )
}
