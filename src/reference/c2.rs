//! The spline with continuous angular acceleration: between keys a cubic in the
//! rotation vector, its velocities at the keys found by relaxation.

use glam::{DMat3, DQuat, DVec3};

use crate::curve::options::Ends;
use crate::reference::curve::Definition;
use crate::reference::given::smooth;
use crate::reference::quaternion::{exponential, from_parts, invert, logarithm, multiply, vector};
use crate::reference::segment::Segment;
use crate::reference::track::Track;

/// Cubic rotation vectors with continuous angular acceleration.
pub(crate) const C2: Definition = Definition::new(|track, ends| {
    let velocities = velocities(track, ends);
    smooth(track, ends, |i| Segment::RotationVector {
        base: track.keys[i],
        powers: Interval::new(track, i).cubic(&velocities, i).powers,
    })
});

/// The angular velocities at the keys (rad/s, body frame) that make the angular acceleration
/// continuous. Each in turn is changed so that it is continuous at its key, until nothing changes
/// any more.
fn velocities(track: &Track, ends: Ends) -> Vec<DVec3> {
    let last = track.last();
    let secant = |i: usize| 2.0 * logarithm(track.difference(i)) / track.step(i);
    if last < 2 {
        // Two keys are joined by an arc, and one has no curve.
        return vec![DVec3::ZERO; last + 1];
    }
    let mut velocities: Vec<DVec3> = (0..=last).map(|key| secant(key.min(last - 1))).collect();
    let parabola = |end: usize, next: usize| {
        let (h, next_h) = (track.step(end), track.step(next));
        let inner = (secant(next) * h + secant(end) * next_h) / (h + next_h);
        2.0 * secant(end) - inner
    };
    match ends {
        Ends::Clamped { start, end } => (velocities[0], velocities[last]) = (start, end),
        Ends::Parabolic | Ends::Frozen => {
            velocities[0] = parabola(0, 1);
            velocities[last] = parabola(last - 1, last - 2);
        }
        Ends::Natural | Ends::Secant | Ends::Loop => {}
    }
    let intervals: Vec<Interval> = (0..last).map(|i| Interval::new(track, i)).collect();
    relax(&intervals, ends, &mut velocities, &vec![false; last + 1]);
    // The nonlinear part of the acceleration is left out at keys where the curve is faster than a
    // full turn per interval: there the equations with it may have no solution.
    let bent: Vec<bool> = (0..=last)
        .map(|key| {
            let before = if key == 0 { last - 1 } else { key - 1 };
            let end = intervals[before].cubic(&velocities, before).slope(1.0);
            end.length() <= std::f64::consts::TAU
        })
        .collect();
    relax(&intervals, ends, &mut velocities, &bent);
    velocities
}

fn relax(intervals: &[Interval], ends: Ends, velocities: &mut [DVec3], bent: &[bool]) {
    let last = intervals.len();
    for _ in 0..1000 {
        let mut change = 0.0f64;
        for key in 0..=last {
            let (before, after) = match (key, ends) {
                (0, Ends::Natural) => (None, Some(0)),
                (0, Ends::Loop) => (Some(last - 1), Some(0)),
                (key, Ends::Natural) if key == last => (Some(last - 1), None),
                (key, Ends::Loop) if key == last => {
                    velocities[last] = velocities[0];
                    continue;
                }
                (key, _) if key == 0 || key == last => continue,
                _ => (Some(key - 1), Some(key)),
            };
            let (mut excess, mut stiffness) = (DVec3::ZERO, 0.0);
            for (i, t, is_bent, sign) in [(before, 1.0, bent[key], 1.0), (after, 0.0, true, -1.0)] {
                let Some(i) = i else { continue };
                let h = intervals[i].duration;
                let cubic = intervals[i].cubic(velocities, i);
                excess += cubic.acceleration(t, is_bent) / (h * h) * sign;
                stiffness += 4.0 / h;
            }
            let step = excess / stiffness;
            velocities[key] -= step;
            change = change.max(step.length() / (1e-30 + velocities[key].length()));
        }
        if change < 1e-14 {
            break;
        }
    }
}

/// The constants of an interval, which do not depend on the velocities.
struct Interval {
    /// Half of the rotation vector from its first key to its last.
    whole: DVec3,
    /// From the angular velocity at the last key to that vector's rate of change.
    to_rate: DMat3,
    duration: f64,
}

impl Interval {
    fn new(track: &Track, i: usize) -> Self {
        let whole = logarithm(track.difference(i));
        Self {
            whole,
            to_rate: rates(whole).inverse(),
            duration: track.step(i),
        }
    }

    fn cubic(&self, velocities: &[DVec3], i: usize) -> Cubic {
        let half = self.duration / 2.0;
        let start = velocities[i] * half;
        let end = self.to_rate * (velocities[i + 1] * half);
        Cubic {
            powers: [
                start,
                3.0 * self.whole - 2.0 * start - end,
                start + end - 2.0 * self.whole,
            ],
        }
    }
}

/// Half of a rotation vector as a cubic in `t`.
struct Cubic {
    powers: [DVec3; 3],
}

impl Cubic {
    /// The derivative of the rotation vector.
    fn slope(&self, t: f64) -> DVec3 {
        let [a, b, c] = self.powers;
        2.0 * (a + b * (2.0 * t) + c * (3.0 * t * t))
    }

    /// Twice `vec(e⁻¹ e'')` for the exponential `e` of the cubic. If `bent` is false, only the part
    /// that is linear in the velocities.
    fn acceleration(&self, t: f64, bent: bool) -> DVec3 {
        let [a, b, c] = self.powers;
        let v = a * t + b * (t * t) + c * (t * t * t);
        let v1 = a + b * (2.0 * t) + c * (3.0 * t * t);
        let v2 = 2.0 * b + c * (6.0 * t);
        if !bent {
            return 2.0 * (rates(v) * v2);
        }
        // e = [C; S v], with C and S functions of z = v·v.
        let (s, k, slope) = waves(v.dot(v));
        let (z1, z2) = (2.0 * v.dot(v1), 2.0 * (v1.dot(v1) + v.dot(v2)));
        // S' = k/2, C' = -S/2.
        let (s1, s2) = (0.5 * k * z1, 0.5 * (k * z2 + slope * z1 * z1));
        let c2 = -0.5 * (s * z2 + 0.5 * k * z1 * z1);
        let second = from_parts(c2, v * s2 + v1 * (2.0 * s1) + v2 * s);
        2.0 * vector(multiply(invert(exponential(v)), second))
    }
}

/// With `z = x²`: `S = sin(x)/x`, `k = (cos(x) - S)/z`, and the derivative of `k` by `z`.
fn waves(z: f64) -> (f64, f64, f64) {
    let x = z.sqrt();
    if x < 0.1 {
        let s = 1.0 - z / 6.0 + z * z / 120.0 - z * z * z / 5040.0;
        let k = -1.0 / 3.0 + z / 30.0 - z * z / 840.0 + z * z * z / 45_360.0;
        let slope = 1.0 / 30.0 - z / 420.0 + z * z / 15_120.0;
        return (s, k, slope);
    }
    let s = x.sin() / x;
    let k = (x.cos() - s) / z;
    (s, k, -(s + 3.0 * k) / (2.0 * z))
}

/// From the rate of change of half a rotation vector to half of the angular velocity in
/// the body frame: a column for each axis.
fn rates(v: DVec3) -> DMat3 {
    let (s, k, _) = waves(v.dot(v));
    let column = |axis: DVec3| {
        let along = v.dot(axis);
        let slope: DQuat = from_parts(-s * along, v * (k * along) + axis * s);
        vector(multiply(invert(exponential(v)), slope))
    };
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}
