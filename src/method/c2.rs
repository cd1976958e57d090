//! The interpolating spline with continuous angular acceleration.

use std::f64::consts::PI;
use std::ops::Range;

use glam::{DMat3, DVec3};

use crate::curve::options::Ends;
use crate::fit::double::intervals::{Intervals, Stretch, at, squared_extent};
use crate::fit::double::shape::Shape;
use crate::math::quaternion::{self, Vector, log, scaled, sine_cosine, sum};
use crate::method::ends::End;
use crate::method::interpolation::Interpolation;
use crate::method::{Continuity, Cost, Curves, Given, Keys, Method, Smooth, USUAL};
use crate::reference;
use crate::tracks::set::Track;
use crate::tracks::signs::Signs;

/// The curve of `SciPy`'s `RotationSpline`: the rotation vector from each key is a cubic,
/// and the angular velocities at the keys are such that the angular acceleration is
/// continuous. Every key moves all of the curve, less and less with distance.
///
/// Backwards in time it is another curve: a rotation vector that is a cubic as seen from one key is
/// no cubic as seen from the next.
///
/// The velocities are those of a system of equations that is not linear. It is solved for keys at any
/// times, where steps are up to two radians, and mostly beyond; where no solution is found, only the
/// velocity is continuous, and
/// [`Interpolation::warnings`](crate::method::interpolation::Interpolation::warnings) says so. Beside a
/// short interval the curve of a long one is as fast as that of the short one, and so goes round many
/// times, as any spline of this kind does; [`BESSEL_OVERHAUSER`](crate::method::BESSEL_OVERHAUSER) does
/// not.
pub const C2: Method = Method {
    name: "c2",
    summary: "continuous angular acceleration through keys at any times",
    formula: "q(t) = q_i exp(θ(t)/2), θ cubic, θ(0) = 0, θ(1) = 2 log(q_i⁻¹ q_{i+1}), angular velocity and acceleration continuous",
    source: "Mayorov 2019, Smooth attitude interpolation (SciPy's RotationSpline)",
    continuity: Continuity::C2,
    continuity_on_even_keys: Continuity::C2,
    keeps_constant_velocity: Keys::Any,
    symmetric: false,
    ends: Ends::Secant,
    cost: Cost::new(1100.0, 3.2),
    reference: reference::c2::C2,
    curves: &CURVES,
    ..USUAL
};

static CURVES: Curves = Curves::Smooth(
    Smooth::new(Shape::ROTATION_VECTOR, curves).with(Given::Velocities(velocities, jumps)),
);

fn curves(intervals: &mut Intervals, stretches: &[Stretch], _: Ends) {
    for lane in stretches.iter().flat_map(Stretch::lanes) {
        let half = 0.5 * intervals.durations[lane].max(SHORTEST);
        let ([x, y, z, _], [u, v, w, _]) = (
            at(&intervals.outward, lane),
            at(&intervals.inward, lane + 1),
        );
        let log = at(&intervals.logs, lane);
        let turn = Turn::new(DVec3::from_array(scaled(log, 2.0)));
        // Half of θ' at both ends, per unit of the parameter.
        let start = scaled([x, y, z], half);
        let end = scaled((turn.to_rate * DVec3::new(u, v, w)).to_array(), half);
        let both = sum(start, end);
        let second = sum(
            scaled(log, 3.0),
            sum(scaled(start, -1.0), scaled(both, -1.0)),
        );
        let third = sum(both, scaled(log, -2.0));
        intervals.set_numbers(lane, 0, &intervals.key(lane));
        intervals.set_numbers(lane, 4, [start, second, third].as_flattened());
        intervals.squared_extents[lane] = squared_extent([start, second, third]);
    }
}

/// The number of keys whose velocities are solved together. Where the track continues beyond such
/// a window, [`MARGIN`] more keys are added to the equations: the influence of a key fades to a
/// quarter from key to key.
const WINDOW: usize = 1024;
const MARGIN: usize = 64;

/// The angular velocities at the keys of some intervals. They do not depend on which intervals are
/// asked for together, because windows always start at multiples of [`WINDOW`].
fn velocities(
    track: Track,
    signs: Signs<'_>,
    intervals: Range<usize>,
    interpolation: &Interpolation,
) -> Vec<Vector> {
    let (first, end) = (intervals.start, intervals.end + 1);
    let windows = (first / WINDOW * WINDOW..end).step_by(WINDOW);
    let own = |window: usize| {
        let keys = first.max(window)..end.min(window + WINDOW);
        let solved = Window::new(track, signs, window, interpolation);
        keys.map(move |key| solved.at(key))
    };
    windows.flat_map(own).collect()
}

/// The keys of a track at which the angular acceleration jumps, because no velocities were found with
/// which it is continuous.
fn jumps(track: Track, signs: Signs<'_>, interpolation: &Interpolation) -> Vec<usize> {
    let last = track.keys.len().saturating_sub(1);
    let windows = (0..=last).step_by(WINDOW);
    let first = usize::from(!matches!(interpolation.ends, Ends::Loop));
    let own = |window: usize| {
        let solved = Window::new(track, signs, window, interpolation);
        (window.max(first)..last.min(window + WINDOW))
            .filter(move |&key| !solved.is_continuous(key))
    };
    match last {
        0 | 1 => Vec::new(),
        _ => windows.flat_map(own).collect(),
    }
}

/// A window of keys with their velocities.
struct Window {
    /// The first of them; below 0 in a copy of a closed track before it.
    first: isize,
    velocities: Vec<DVec3>,
    /// Which keys have an equation without its bend.
    is_straight: Vec<bool>,
}

impl Window {
    /// The window that starts at a multiple of [`WINDOW`], and its margins.
    fn new(track: Track, signs: Signs<'_>, start: usize, interpolation: &Interpolation) -> Self {
        let window = start as isize - MARGIN as isize..(start + WINDOW + MARGIN) as isize;
        let all = track.keys.len() as isize - 1;
        let closed = matches!(interpolation.ends, Ends::Loop) && all > 1;
        let (first, last) = if closed {
            (window.start, window.end)
        } else {
            (window.start.max(0), window.end.min(all))
        };
        let steps: Vec<Step> = (first..last)
            .map(|i| Step::new(track, signs, i.rem_euclid(all.max(1)) as usize))
            .collect();
        // Two keys are joined by slerp, whatever the ends.
        let end_at = |at_end: bool, end: End| match at_end && all > 1 {
            true => end,
            false => End::Secant,
        };
        let [start, end] = interpolation.ends.both();
        let start = end_at(!closed && first == 0, start);
        let end = end_at(!closed && last == all, end);
        let (velocities, is_straight) = Spline::new(&steps, [start, end]).solve();
        Self {
            first,
            velocities,
            is_straight,
        }
    }

    fn at(&self, key: usize) -> Vector {
        self.velocities[(key as isize - self.first) as usize].to_array()
    }

    fn is_continuous(&self, key: usize) -> bool {
        !self.is_straight[(key as isize - self.first) as usize]
    }
}

/// The shortest duration in seconds; a shorter interval counts as this long, so that its rates
/// stay finite.
const SHORTEST: f64 = 1e-150;

/// One interval of a track.
struct Step {
    /// Its length, seconds.
    duration: f64,
    turn: Turn,
    /// The factors of [`Step::bend`].
    factors: [f64; 3],
}

impl Step {
    fn new(track: Track, signs: Signs<'_>, i: usize) -> Self {
        let key = |key: usize| {
            let sign = signs.sign(key);
            quaternion::unit(track.keys[key].to_array().map(|component| component * sign))
        };
        let step = quaternion::step(key(i), key(i + 1));
        let vector = DVec3::from_array(scaled(log(step), 2.0));
        Self {
            duration: (track.times[i + 1] - track.times[i]).max(SHORTEST),
            turn: Turn::new(vector),
            factors: factors(vector),
        }
    }

    /// The angular velocity of slerp, in radians per second.
    fn secant(&self) -> DVec3 {
        self.turn.vector / self.duration
    }

    /// The bend at its end: the part of the angular acceleration there that is quadratic in the
    /// velocity.
    fn bend(&self, velocity: DVec3) -> DVec3 {
        let (vector, rate) = (self.turn.vector, self.turn.to_rate * velocity);
        let [k1, k2, k3] = self.factors;
        let across = vector.cross(rate);
        (across * k1 + vector.cross(across) * k2) * vector.dot(rate) + rate.cross(across) * k3
    }

    /// The derivative of [`Step::bend`] by the velocity.
    fn bend_slope(&self, velocity: DVec3) -> DMat3 {
        let (vector, rate) = (self.turn.vector, self.turn.to_rate * velocity);
        let [k1, k2, k3] = self.factors;
        let along = vector.dot(rate);
        let across = vector.cross(rate);
        let cross = skew(vector);
        let by_along = outer(across * k1 + vector.cross(across) * k2, vector);
        let by_across = (cross * k1 + cross * cross * k2) * along;
        // rate × (vector × rate) = vector (rate · rate) - rate (rate · vector)
        let triple = outer(vector, rate * 2.0) - outer(rate, vector) - DMat3::IDENTITY * along;
        (by_along + by_across + triple * k3) * self.turn.to_rate
    }
}

/// The factors of [`Step::bend`] for a rotation vector.
fn factors(vector: DVec3) -> [f64; 3] {
    let square = vector.dot(vector);
    let angle = square.sqrt();
    if angle > 0.2 {
        let (sine, cosine) = sine_cosine(angle);
        [
            (2.0 - 2.0 * cosine - angle * sine) / (square * square),
            (3.0 * sine - 2.0 * angle - angle * cosine) / (square * square * angle),
            (angle - sine) / (square * angle),
        ]
    } else {
        let fourth = square * square;
        [
            1.0 / 12.0 - square / 180.0 + fourth / 6_720.0,
            -1.0 / 60.0 + square / 1_260.0 - fourth / 60_480.0,
            1.0 / 6.0 - square / 120.0 + fourth / 5_040.0,
        ]
    }
}

/// `a bᵀ`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// A rotation vector, with the matrices between its rate of change and the angular velocity.
struct Turn {
    vector: DVec3,
    /// From the angular velocity at its end to the vector's rate of change, and back.
    to_rate: DMat3,
    from_rate: DMat3,
}

impl Turn {
    fn new(vector: DVec3) -> Self {
        let square = vector.dot(vector);
        let angle = square.sqrt();
        let (sine, cosine) = sine_cosine(angle);
        let (half_sine, half_cosine) = sine_cosine(0.5 * angle);
        let (k, k1, k2) = if angle > 0.05 {
            (
                (1.0 - 0.5 * angle * half_cosine / half_sine) / square,
                (1.0 - cosine) / square,
                (angle - sine) / (square * angle),
            )
        } else {
            (
                1.0 / 12.0 + square / 720.0 + square * square / 30_240.0,
                0.5 - square / 24.0 + square * square / 720.0,
                1.0 / 6.0 - square / 120.0 + square * square / 5_040.0,
            )
        };
        let cross = skew(vector);
        let twice = cross * cross;
        Self {
            vector,
            to_rate: DMat3::IDENTITY + cross * 0.5 + twice * k,
            from_rate: DMat3::IDENTITY - cross * k1 + twice * k2,
        }
    }
}

/// The matrix of `v ×`.
fn skew(v: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, v.z, -v.y),
        DVec3::new(-v.z, 0.0, v.x),
        DVec3::new(v.y, -v.x, 0.0),
    )
}

/// The equations for the velocities: three for each key, with its own velocity and those of its
/// neighbours as unknowns. But for [`Step::bend`], which depends on the key's own velocity alone, they
/// are linear.
///
/// They are solved by Newton's iteration from the solution without bends; each of its steps is a block
/// tridiagonal system. How strong a bend is depends on the turn in the *shorter* of the two intervals
/// beside a key, so that the iteration does not mind how unevenly keys are spaced: below two radians a
/// step it takes three to six rounds. Beyond, it may fail; then bends are brought in little by little.
struct Spline<'a> {
    steps: &'a [Step],
    /// The 3×3 blocks below and above the diagonal; the blocks on it are these numbers times 1.
    lower: Vec<DMat3>,
    upper: Vec<DMat3>,
    diagonal: Vec<f64>,
    /// The right sides.
    given: Vec<DVec3>,
    /// The factor of the bend in each equation, that of the step before the key.
    scales: Vec<f64>,
    /// About how large a velocity each is: residuals count relative to it.
    sizes: Vec<f64>,
}

/// Newton's steps from the solution without bends; then for each part of the bends that is added, and
/// for all parts together.
const DIRECT: usize = 16;
const EACH_PART: usize = 8;
const ALL_PARTS: usize = 128;
/// Bends are brought in by a quarter at first, and at least by this.
const FIRST_PART: f64 = 0.25;
const LEAST_PART: f64 = 1.0 / 256.0;
/// A step of Newton's is shortened to this part of it at least.
const LEAST_STEP: f64 = 1.0 / 64.0;
/// After a whole step that changed no velocity by more than this part of its size, what is left is
/// its square.
const CONVERGED: f64 = 1e-8;
/// A sum of squared residuals that is rounding, for each equation.
const ROUNDING: f64 = 1e-24;

impl<'a> Spline<'a> {
    fn new(steps: &'a [Step], [start, end]: [End; 2]) -> Self {
        let keys = steps.len() + 1;
        let mut spline = Self {
            steps,
            lower: vec![DMat3::ZERO; keys],
            upper: vec![DMat3::ZERO; keys],
            diagonal: vec![1.0; keys],
            given: vec![DVec3::ZERO; keys],
            scales: vec![0.0; keys],
            sizes: Vec::new(),
        };
        if let ([first, ..], [.., last]) = (steps, steps) {
            let given = |end: End, step: &Step, next: Option<&Step>| match (end, next) {
                (End::Clamped(half), _) => Some(DVec3::from_array(half) * 2.0),
                (End::Secant, _) | (_, None) => Some(step.secant()),
                // The parabola through three keys, in logarithms.
                (End::Parabolic, Some(next)) => {
                    let bend = (next.secant() - step.secant()) * step.duration;
                    Some(step.secant() - bend / (step.duration + next.duration))
                }
                (End::Natural, Some(_)) => None,
            };
            match given(start, first, steps.get(1)) {
                Some(velocity) => spline.given[0] = velocity,
                None => {
                    spline.diagonal[0] = 2.0;
                    spline.upper[0] = first.turn.to_rate;
                    spline.given[0] = first.secant() * 3.0;
                }
            }
            let before_last = steps.len().checked_sub(2).map(|i| &steps[i]);
            match given(end, last, before_last) {
                Some(velocity) => spline.given[keys - 1] = velocity,
                None => {
                    spline.diagonal[keys - 1] = 4.0;
                    spline.lower[keys - 1] = last.turn.from_rate * 2.0;
                    spline.given[keys - 1] = last.secant() * 6.0;
                    spline.scales[keys - 1] = last.duration;
                }
            }
        }
        for (i, pair) in (1..).zip(steps.windows(2)) {
            let (h, next_h) = (pair[0].duration, pair[1].duration);
            // The equation is divided by 1/h + 1/next_h, so that no number overflows.
            let (left, right) = (next_h / (h + next_h), h / (h + next_h));
            spline.lower[i] = pair[0].turn.from_rate * (2.0 * left);
            spline.upper[i] = pair[1].turn.to_rate * (2.0 * right);
            spline.diagonal[i] = 4.0;
            spline.given[i] = pair[0].secant() * (6.0 * left) + pair[1].secant() * (6.0 * right);
            spline.scales[i] = left * h;
        }
        spline
    }

    /// The velocities, and for each key whether its equation was solved without its bend.
    fn solve(mut self) -> (Vec<DVec3>, Vec<bool>) {
        let keys = self.given.len();
        let straight = self.elimination(None, &self.given);
        let of_steps = |i: usize| self.steps.get(i).map_or(0.0, |step| step.secant().length());
        self.sizes = (0..keys)
            .map(|i| of_steps(i.wrapping_sub(1)) + of_steps(i) + straight[i].length() + 1e-200)
            .collect();
        if self.scales.iter().all(|&scale| scale == 0.0) {
            return (straight, vec![false; keys]);
        }
        if let Some(velocities) = self.solve_from(&straight) {
            return (velocities, vec![false; keys]);
        }
        // With the long way round, as authored, there may be no solution: without these bends, else
        // without any.
        let is_long = |i: usize| {
            let before = i.checked_sub(1).map(|before| &self.steps[before]);
            before.is_some_and(|step| step.turn.vector.length() > PI)
        };
        let is_straight: Vec<bool> = (0..keys).map(is_long).collect();
        if is_straight.contains(&true) {
            for (scale, &is_straight) in self.scales.iter_mut().zip(&is_straight) {
                *scale = if is_straight { 0.0 } else { *scale };
            }
            if let Some(velocities) = self.solve_from(&straight) {
                return (velocities, is_straight);
            }
        }
        (straight, vec![true; keys])
    }

    /// The solution that goes on from the one without bends.
    fn solve_from(&self, straight: &[DVec3]) -> Option<Vec<DVec3>> {
        let (found, _) = self.newton(straight, 1.0, DIRECT);
        if found.is_some() {
            return found;
        }
        let mut velocities = straight.to_vec();
        let (mut part, mut more, mut taken) = (0.0, FIRST_PART, 0);
        while taken < ALL_PARTS && more >= LEAST_PART {
            let next = if part + more < 1.0 { part + more } else { 1.0 };
            let (found, steps) = self.newton(&velocities, next, EACH_PART);
            taken += steps;
            match found {
                Some(found) if next == 1.0 => return Some(found),
                Some(found) => (velocities, part, more) = (found, next, 2.0 * more),
                None => more *= 0.5,
            }
        }
        None
    }

    /// Newton's iteration for the equations with this part of their bends, and how many steps it took;
    /// none where it does not converge.
    fn newton(&self, from: &[DVec3], part: f64, most: usize) -> (Option<Vec<DVec3>>, usize) {
        let mut velocities = from.to_vec();
        let (mut residuals, mut sum) = self.residuals(&velocities, part);
        for taken in 1..=most {
            let changes = self.elimination(Some((&velocities, part)), &residuals);
            let mut step = 1.0;
            let next = loop {
                let changed = velocities.iter().zip(&changes);
                let next: Vec<DVec3> = changed.map(|(own, change)| *own - *change * step).collect();
                let (after, smaller) = self.residuals(&next, part);
                // Not a number is not accepted.
                if smaller <= (1.0 - 0.5 * step) * sum || smaller <= ROUNDING * next.len() as f64 {
                    (residuals, sum) = (after, smaller);
                    break next;
                }
                step *= 0.5;
                if step < LEAST_STEP {
                    return (None, taken);
                }
            };
            velocities = next;
            let is_small = |(change, size): (&DVec3, &f64)| change.length() <= CONVERGED * size;
            if step == 1.0 && changes.iter().zip(&self.sizes).all(is_small) {
                return (Some(velocities), taken);
            }
        }
        (None, most)
    }

    /// What is left of each equation, and the sum of its squares relative to the sizes.
    fn residuals(&self, velocities: &[DVec3], part: f64) -> (Vec<DVec3>, f64) {
        let mut sum = 0.0;
        let residual = |i: usize| {
            let mut own = velocities[i] * self.diagonal[i] - self.given[i];
            if i > 0 {
                own += self.lower[i] * velocities[i - 1];
                if self.scales[i] != 0.0 {
                    own += self.steps[i - 1].bend(velocities[i]) * (part * self.scales[i]);
                }
            }
            if let Some(&next) = velocities.get(i + 1) {
                own += self.upper[i] * next;
            }
            let relative = own / self.sizes[i];
            sum += relative.dot(relative);
            own
        };
        let residuals = (0..velocities.len()).map(residual).collect();
        (residuals, sum)
    }

    /// Solves the linear equations for these right sides by elimination from the first key on; with the
    /// derivatives of that part of the bends at some velocities.
    fn elimination(&self, bends: Option<(&[DVec3], f64)>, sides: &[DVec3]) -> Vec<DVec3> {
        let keys = sides.len();
        // What is above the diagonal, and the right sides, after elimination.
        let mut above: Vec<DMat3> = Vec::with_capacity(keys);
        let mut found: Vec<DVec3> = Vec::with_capacity(keys);
        for i in 0..keys {
            let mut own = DMat3::IDENTITY * self.diagonal[i];
            let mut side = sides[i];
            if let (Some((velocities, part)), true) = (bends, self.scales[i] != 0.0) {
                own += self.steps[i - 1].bend_slope(velocities[i]) * (part * self.scales[i]);
            }
            if i > 0 {
                own -= self.lower[i] * above[i - 1];
                side -= self.lower[i] * found[i - 1];
            }
            let inverse = own.inverse();
            above.push(inverse * self.upper[i]);
            found.push(inverse * side);
        }
        for i in (0..keys.saturating_sub(1)).rev() {
            let next = found[i + 1];
            found[i] -= above[i] * next;
        }
        found
    }
}
