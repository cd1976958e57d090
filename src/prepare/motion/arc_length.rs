//! Arc length: curves that are run through at constant speed.

use crate::math::dual::Jet;
use crate::math::quaternion::{length, step};
use crate::prepare::double::curve::Curve;

/// Parts whose lengths are kept.
const PARTS: usize = 8;

/// Slower than this part of its mean speed a curve is at rest, or just leaves it.
const SLOW: f64 = 1e-4;

/// Of the parameter: a curve that starts from rest has turned by a billionth of its length
/// there, and its direction is known to seven digits.
const NEXT_TO_REST: f64 = 1e-5;

/// Points and weights of Gauss and Legendre of degree 9, from -1 to 1.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// How far a curve has turned at each eighth of its parameter, radians.
#[derive(Debug)]
pub(crate) struct Pace {
    lengths: [f64; PARTS + 1],
}

impl Pace {
    pub(crate) fn new(curve: &Curve) -> Self {
        let mut lengths = [0.0; PARTS + 1];
        for part in 0..PARTS {
            let [from, to] = [part, part + 1].map(|part| part as f64 / PARTS as f64);
            lengths[part + 1] = lengths[part] + turned(curve, from, to);
        }
        Self { lengths }
    }

    /// How far the whole curve turns, radians.
    pub(crate) fn total(&self) -> f64 {
        self.lengths[PARTS]
    }

    /// The curve's own parameter where it has turned by that part of its length, with its
    /// derivatives by that part.
    pub(crate) fn parameter(&self, curve: &Curve, part: f64) -> Jet {
        let mut u = self.place(curve, part * self.total());
        let (mut velocity, mut acceleration) = rates(curve, u);
        if length(velocity) < SLOW * self.total() {
            // Where it starts from rest it has no direction; next to there it has.
            u = u.clamp(NEXT_TO_REST, 1.0 - NEXT_TO_REST);
            (velocity, acceleration) = rates(curve, u);
        }
        let speed = length(velocity).max(1e-12);
        let first = self.total() / speed;
        let along: f64 = velocity.iter().zip(acceleration).map(|(v, a)| v * a).sum();
        Jet {
            value: u,
            first,
            // |ω| u' is constant.
            second: -along * (first / speed) * (first / speed),
        }
    }

    /// Where the curve has turned by so much: Newton's way, within the part that holds it.
    fn place(&self, curve: &Curve, target: f64) -> f64 {
        let part = self.lengths.partition_point(|&length| length <= target);
        let part = part.saturating_sub(1).min(PARTS - 1);
        let [mut low, mut high] = [part, part + 1].map(|part| part as f64 / PARTS as f64);
        let (from, rest) = (low, target - self.lengths[part]);
        let whole = self.lengths[part + 1] - self.lengths[part];
        if whole <= 0.0 {
            return from;
        }
        let mut u = from + (high - low) * (rest / whole).clamp(0.0, 1.0);
        let mut excess = turned(curve, from, u) - rest;
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
            // A short step needs no refinement.
            excess += if step.abs() < 1e-3 {
                gauss(curve, u, next)
            } else {
                turned(curve, u, next)
            };
            u = next;
        }
        u
    }
}

/// By how much it turns between two parameters, radians: halved until halves agree.
fn turned(curve: &Curve, from: f64, to: f64) -> f64 {
    refined(curve, from, to, gauss(curve, from, to), FINEST)
}

/// Halvings at most: where a curve all but stops, its speed has a corner.
const FINEST: u32 = 8;

fn refined(curve: &Curve, from: f64, to: f64, whole: f64, halvings: u32) -> f64 {
    let middle = 0.5 * (from + to);
    let halves = [gauss(curve, from, middle), gauss(curve, middle, to)];
    let sum = halves[0] + halves[1];
    if halvings == 0 || (sum - whole).abs() <= 1e-13 * (1.0 + sum) {
        return sum;
    }
    refined(curve, from, middle, halves[0], halvings - 1)
        + refined(curve, middle, to, halves[1], halvings - 1)
}

fn gauss(curve: &Curve, from: f64, to: f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let speed = |&(at, weight): &(f64, f64)| {
        let (velocity, _) = rates(curve, middle + half * at);
        weight * length(velocity)
    };
    half * GAUSS.iter().map(speed).sum::<f64>()
}

/// Angular velocity and acceleration by the parameter.
fn rates(curve: &Curve, u: f64) -> ([f64; 3], [f64; 3]) {
    let rotation = curve.moving(Jet::parameter(u));
    let at = rotation.map(|jet| jet.value);
    let twice = |derivative: [f64; 4]| {
        let [x, y, z, _] = step(at, derivative);
        [2.0 * x, 2.0 * y, 2.0 * z]
    };
    (
        twice(rotation.map(|jet| jet.first)),
        twice(rotation.map(|jet| jet.second)),
    )
}
