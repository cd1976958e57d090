//! The curves of translations, scales and scalars: a Hermite cubic in each component for each key interval.

use glam::DVec3;

use crate::curve::options::Ends;
use crate::math::quaternion::ratio;
use crate::method::b_spline;
use crate::method::vector_method::VectorMethod;
use crate::tracks::set::vectors::VectorTrack;

/// A cubic that is defined by its values and slopes at its ends, per unit of a parameter from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VectorCubic {
    pub(crate) start: DVec3,
    pub(crate) leaving: DVec3,
    pub(crate) arriving: DVec3,
    pub(crate) end: DVec3,
}

impl VectorCubic {
    /// The coefficients of 1, t, t², t³.
    pub(crate) fn powers(&self) -> [DVec3; 4] {
        let rise = self.end - self.start;
        [
            self.start,
            self.leaving,
            rise * 3.0 - self.leaving * 2.0 - self.arriving,
            self.leaving + self.arriving - rise * 2.0,
        ]
    }

    /// The derivative per second of a curve that lasts `duration` seconds.
    pub(crate) fn derivative(&self, duration: f64) -> Self {
        let (rise, rate) = (self.end - self.start, ratio(1.0, duration));
        Self {
            start: self.leaving * rate,
            leaving: (rise * 6.0 - self.leaving * 4.0 - self.arriving * 2.0) * rate,
            arriving: (self.leaving * 2.0 + self.arriving * 4.0 - rise * 6.0) * rate,
            end: self.arriving * rate,
        }
    }
}

/// The curves of a track's intervals.
pub(crate) struct VectorCurves<'a> {
    track: &'a VectorTrack,
    method: VectorMethod,
    ends: Ends,
    /// The slopes at all keys, units per second, for methods in which they depend on all keys.
    slopes: Vec<DVec3>,
}

impl<'a> VectorCurves<'a> {
    pub(crate) fn new(track: &'a VectorTrack, method: VectorMethod, ends: Ends) -> Self {
        let mut curves = Self {
            track,
            method,
            ends,
            slopes: Vec::new(),
        };
        if method == VectorMethod::C2 && track.keys.len() > 2 {
            curves.slopes = curves.c2_slopes();
        }
        curves
    }

    /// Whether an interval has the constant value of its first key.
    pub(crate) fn is_held(&self, i: usize) -> bool {
        let last = self.track.keys.len() - 1;
        let at_end = last > 1 && (i == 0 || i + 1 == last);
        let is_frozen = self.ends == Ends::Frozen && self.use_neighbours() && at_end;
        self.method == VectorMethod::Step || is_frozen
    }

    fn use_neighbours(&self) -> bool {
        use VectorMethod::{BSpline, BesselOverhauser, C2, CatmullRom};
        matches!(self.method, CatmullRom | BesselOverhauser | C2 | BSpline)
    }

    fn key(&self, i: usize) -> DVec3 {
        self.track.keys[i].as_dvec3()
    }

    fn rise(&self, i: usize) -> DVec3 {
        self.key(i + 1) - self.key(i)
    }

    /// The time from key `i` to the next in seconds.
    pub(crate) fn duration(&self, i: usize) -> f64 {
        self.track.times[i + 1] - self.track.times[i]
    }

    fn secant(&self, i: usize) -> DVec3 {
        self.rise(i) * ratio(1.0, self.duration(i))
    }

    /// The curve of an interval.
    pub(crate) fn of(&self, i: usize) -> VectorCubic {
        let is_held = self.is_held(i);
        if !is_held && self.method == VectorMethod::BSpline && self.track.keys.len() > 2 {
            return self.b_spline(i);
        }
        let [leaving, arriving] = if is_held {
            [DVec3::ZERO; 2]
        } else {
            self.slopes_of(i)
        };
        VectorCubic {
            start: self.key(i),
            leaving,
            arriving,
            end: self.key(if is_held { i } else { i + 1 }),
        }
    }

    /// The slopes of interval `i` at its first and its last key, per unit of its parameter.
    fn slopes_of(&self, i: usize) -> [DVec3; 2] {
        let last = self.track.keys.len() - 2;
        let (rise, duration) = (self.rise(i), self.duration(i));
        if self.method == VectorMethod::GltfCubic {
            let tangent = |key: usize, side: usize| match self.track.tangents.get(key) {
                Some(both) => both[side].as_dvec3() * duration,
                None => DVec3::ZERO,
            };
            return [tangent(i, 1), tangent(i + 1, 0)];
        }
        if !self.use_neighbours() || last == 0 {
            return [rise; 2];
        }
        if let [first, second, ..] = self.slopes.get(i..).unwrap_or_default() {
            return [*first * duration, *second * duration];
        }
        let closed = self.ends == Ends::Loop;
        let before = i.checked_sub(1).or(closed.then_some(last));
        let after = (i < last).then_some(i + 1).or(closed.then_some(0));
        let leaving = before.map(|before| self.at_key(before, i, duration));
        let arriving = after.map(|after| self.at_key(i, after, duration));
        match (leaving, arriving) {
            (None, Some(arriving)) => [self.at_end(rise, arriving), arriving],
            (Some(leaving), None) => [leaving, self.at_end(rise, leaving)],
            (leaving, arriving) => [leaving.unwrap_or(rise), arriving.unwrap_or(rise)],
        }
    }

    /// The slope at the key between two intervals, per unit of the parameter of an interval that
    /// lasts `duration` seconds.
    fn at_key(&self, before: usize, after: usize, duration: f64) -> DVec3 {
        let (left, right) = (self.rise(before), self.rise(after));
        if self.method == VectorMethod::CatmullRom {
            return (left + right) * 0.5;
        }
        let (h, next_h) = (self.duration(before), self.duration(after));
        let rate = (left * ratio(next_h, h) + right * ratio(h, next_h)) * ratio(1.0, h + next_h);
        rate * duration
    }

    fn at_end(&self, rise: DVec3, other: DVec3) -> DVec3 {
        match self.ends {
            Ends::Natural => rise * 1.5 - other * 0.5,
            Ends::Clamped { .. } => DVec3::ZERO,
            Ends::Secant => rise,
            Ends::Parabolic | Ends::Loop | Ends::Frozen => rise * 2.0 - other,
        }
    }

    /// The slopes at the keys, units per second, that make the second derivative continuous: `r v₋ + 2 v + l v₊ = 3
    /// (r d₋ + l d₊)` at each inner key. Here l and r are the fractions of the intervals before and after it in their
    /// sum, and d their secants.
    fn c2_slopes(&self) -> Vec<DVec3> {
        let last = self.track.keys.len() - 1;
        // The equation at the key between two intervals: the coefficients before, on and after the diagonal, and the
        // right side.
        let inner = |before: usize, after: usize| {
            let (h, next_h) = (self.duration(before), self.duration(after));
            let (l, r) = (ratio(h, h + next_h), ratio(next_h, h + next_h));
            let side = (self.secant(before) * r + self.secant(after) * l) * 3.0;
            SlopeEquation([r, 2.0, l], side)
        };
        let mut equations: Vec<SlopeEquation> = (1..last).map(|i| inner(i - 1, i)).collect();
        if self.ends == Ends::Loop {
            equations.insert(0, inner(last - 1, 0));
            return cyclic(equations);
        }
        let at_end = |secant: DVec3| match self.ends {
            Ends::Natural => (2.0, 1.0, secant * 3.0),
            Ends::Secant => (1.0, 0.0, secant),
            Ends::Clamped { .. } => (1.0, 0.0, DVec3::ZERO),
            Ends::Parabolic | Ends::Loop | Ends::Frozen => (1.0, 1.0, secant * 2.0),
        };
        let (diagonal, next, side) = at_end(self.secant(0));
        equations.insert(0, SlopeEquation([0.0, diagonal, next], side));
        let (diagonal, next, side) = at_end(self.secant(last - 1));
        equations.push(SlopeEquation([next, diagonal, 0.0], side));
        solved(&equations)
    }

    /// Interval `i` of the cubic B-spline in cumulative form, as for rotations: the basis and the steps outside the
    /// ends are the same, with sums instead of products.
    fn b_spline(&self, i: usize) -> VectorCubic {
        let last = self.track.keys.len() - 2;
        let closed = self.ends == Ends::Loop;
        let rise = self.rise(i);
        let basis = b_spline::basis(b_spline::neighbours(&self.track.times, i, closed));
        let [
            [_, slope1, ..],
            [_, slope2, bend2, cube2],
            [_, _, _, value3],
        ] = basis;
        // The step outside an end. `bend` and `inner_slope` belong to the second and the first derivative of this
        // interval's basis function at the end, `slope` to the first derivative of the outer step's basis function.
        let outside = |bend: f64, inner_slope: f64, slope: f64, next: usize| match self.ends {
            Ends::Natural => rise * (bend / slope),
            Ends::Clamped { .. } => rise * (-inner_slope / slope),
            Ends::Secant => rise * ((1.0 - inner_slope) / slope),
            _ => self.extrapolated(i, next),
        };
        let before = match i.checked_sub(1).or(closed.then_some(last)) {
            Some(before) => self.rise(before),
            None => outside(bend2, slope2, slope1, i + 1),
        };
        let after = match (i < last).then_some(i + 1).or(closed.then_some(0)) {
            Some(after) => self.rise(after),
            None => {
                let inner_slope = slope2 + 2.0 * bend2 + 3.0 * cube2;
                outside(-(bend2 + 3.0 * cube2), inner_slope, 3.0 * value3, i - 1)
            }
        };
        let mut powers = [DVec3::ZERO; 4];
        for (weights, step) in basis.iter().zip([before, rise, after]) {
            for (power, weight) in powers.iter_mut().zip(weights) {
                *power += step * *weight;
            }
        }
        powers[0] += self.key(i) - before;
        let [start, c1, c2, c3] = powers;
        VectorCubic {
            start,
            leaving: c1,
            arriving: c1 + c2 * 2.0 + c3 * 3.0,
            end: start + c1 + c2 + c3,
        }
    }

    /// One more step of the parabola through the three keys at an end.
    fn extrapolated(&self, interval: usize, next: usize) -> DVec3 {
        let (h, next_h) = (self.duration(interval), self.duration(next));
        let change = self.rise(next) * ratio(h, next_h) - self.rise(interval);
        self.rise(interval) - change * (2.0 / (1.0 + ratio(next_h, h)))
    }
}

/// An equation of the system: the coefficients before the diagonal, on it and after it, and the right side.
#[derive(Clone, Copy)]
struct SlopeEquation([f64; 3], DVec3);

/// Solves a system without corner elements, by elimination from the first equation on.
fn solved(equations: &[SlopeEquation]) -> Vec<DVec3> {
    let mut above = Vec::with_capacity(equations.len());
    let mut values: Vec<DVec3> = Vec::with_capacity(equations.len());
    for &SlopeEquation([below, diagonal, next], side) in equations {
        let (factor, value) = match (above.last(), values.last()) {
            (Some(&before), Some(&value)) => (diagonal - below * before, side - value * below),
            _ => (diagonal, side),
        };
        above.push(next / factor);
        values.push(value / factor);
    }
    for i in (1..values.len()).rev() {
        let after = values[i];
        values[i - 1] -= after * above[i - 1];
    }
    values
}

/// Solves a cyclic system, in which the first equation follows the last, and appends the first unknown at the end
/// (Sherman and Morrison 1950).
fn cyclic(mut equations: Vec<SlopeEquation>) -> Vec<DVec3> {
    let last = equations.len() - 1;
    let (corner, other) = (equations[0].0[0], equations[last].0[2]);
    let gamma = -equations[0].0[1];
    equations[0].0[1] -= gamma;
    equations[last].0[1] -= other * corner / gamma;
    let values = solved(&equations);
    for equation in &mut equations {
        equation.1 = DVec3::ZERO;
    }
    equations[0].1 = DVec3::splat(gamma);
    equations[last].1 += DVec3::splat(other);
    let share = solved(&equations);
    let ratio = corner / gamma;
    let factor = (values[0] + values[last] * ratio) / (1.0 + share[0].x + share[last].x * ratio);
    let of = |(value, share): (&DVec3, &DVec3)| *value - factor * share.x;
    let mut all: Vec<DVec3> = values.iter().zip(&share).map(of).collect();
    all.push(all[0]);
    all
}
