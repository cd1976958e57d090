//! The interpolating spline with continuous angular acceleration.

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
/// Where it would pass a key faster than one turn per interval, as at a short interval beside a
/// long one, and where no solution is found, only its velocity is continuous;
/// [`Interpolation::warnings`](crate::method::interpolation::Interpolation::warnings) says at which keys.
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
        let from = window as isize - MARGIN as isize;
        let to = (window + WINDOW + MARGIN) as isize;
        let (first_solved, solved) = solve(track, signs, from..to, interpolation);
        keys.map(move |key| solved.velocities[(key as isize - first_solved) as usize].to_array())
    };
    windows.flat_map(own).collect()
}

/// The keys of a track at which the angular acceleration jumps.
fn jumps(track: Track, signs: Signs<'_>, interpolation: &Interpolation) -> Vec<usize> {
    let last = track.keys.len().saturating_sub(1);
    if last < 2 {
        return Vec::new();
    }
    let first = usize::from(!matches!(interpolation.ends, Ends::Loop));
    let windows = (0..=last).step_by(WINDOW);
    let of_window = |window: usize| {
        let (from, to) = (window as isize - MARGIN as isize, window + WINDOW + MARGIN);
        let (first_solved, solved) = solve(track, signs, from..to as isize, interpolation);
        (window.max(first)..last.min(window + WINDOW))
            .filter(move |&key| solved.jumps[(key as isize - first_solved) as usize])
    };
    windows.flat_map(of_window).collect()
}

/// The velocities at the keys of a window, and at which of them the acceleration jumps.
struct Solved {
    velocities: Vec<DVec3>,
    jumps: Vec<bool>,
}

/// The velocities at a window of keys, and the place of the window's first key.
fn solve(
    track: Track,
    signs: Signs<'_>,
    window: Range<isize>,
    interpolation: &Interpolation,
) -> (isize, Solved) {
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
    (first, Spline::new(&steps, [start, end]).solve())
}

/// The shortest duration in seconds; a shorter interval counts as this long, so that its rates
/// stay finite.
const SHORTEST: f64 = 1e-150;

/// One interval of a track.
struct Step {
    /// Its length, seconds.
    duration: f64,
    turn: Turn,
}

impl Step {
    fn new(track: Track, signs: Signs<'_>, i: usize) -> Self {
        let key = |key: usize| {
            let sign = signs.sign(key);
            quaternion::unit(track.keys[key].to_array().map(|component| component * sign))
        };
        let step = quaternion::step(key(i), key(i + 1));
        Self {
            duration: (track.times[i + 1] - track.times[i]).max(SHORTEST),
            turn: Turn::new(DVec3::from_array(scaled(log(step), 2.0))),
        }
    }

    /// The angular velocity of slerp, in radians per second.
    fn secant(&self) -> DVec3 {
        self.turn.vector / self.duration
    }
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

    /// The part of the angular acceleration that is quadratic in the vector's rate of change.
    fn bend(&self, rate: DVec3) -> DVec3 {
        let square = self.vector.dot(self.vector);
        let angle = square.sqrt();
        let (sine, cosine) = sine_cosine(angle);
        let (k1, k2, k3) = if angle > 0.2 {
            (
                (2.0 - 2.0 * cosine - angle * sine) / (square * square),
                (3.0 * sine - 2.0 * angle - angle * cosine) / (square * square * angle),
                (angle - sine) / (square * angle),
            )
        } else {
            let fourth = square * square;
            (
                1.0 / 12.0 - square / 180.0 + fourth / 6_720.0,
                -1.0 / 60.0 + square / 1_260.0 - fourth / 60_480.0,
                1.0 / 6.0 - square / 120.0 + fourth / 5_040.0,
            )
        };
        let across = self.vector.cross(rate);
        let along = self.vector.dot(rate);
        (across * k1 + self.vector.cross(across) * k2) * along + rate.cross(across) * k3
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
/// neighbours as unknowns. They are linear except for [`Turn::bend`], which is iterated.
struct Spline<'a> {
    steps: &'a [Step],
    /// The 3×3 blocks below and above the diagonal, and the inverses of the diagonal blocks after
    /// elimination from the first key on.
    lower: Vec<DMat3>,
    upper: Vec<DMat3>,
    inverse: Vec<DMat3>,
    /// The right sides without the bends, and the factor of the bend in each equation.
    given: Vec<DVec3>,
    scales: Vec<f64>,
    /// The equations that contain the bend of the step before their key.
    bent: Range<usize>,
}

/// The largest rate in radians per interval. Where a key is passed faster, its equation omits the
/// bend, and the acceleration is not continuous there. With the bend there may be no solution, or
/// none that iteration finds.
const FASTEST: f64 = std::f64::consts::TAU;

/// The most iterations; a dozen suffice where steps are below a right angle.
const SWEEPS: usize = 100;

/// After a last round that changed no velocity by more than this part of it, the acceleration counts as
/// continuous.
const SETTLED: f64 = 1e-9;

impl<'a> Spline<'a> {
    fn new(steps: &'a [Step], [start, end]: [End; 2]) -> Self {
        let keys = steps.len() + 1;
        let mut spline = Self {
            steps,
            lower: vec![DMat3::ZERO; keys],
            upper: vec![DMat3::ZERO; keys],
            inverse: vec![DMat3::IDENTITY; keys],
            given: vec![DVec3::ZERO; keys],
            scales: vec![0.0; keys],
            bent: 1..keys,
        };
        let mut diagonal = vec![DMat3::IDENTITY; keys];
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
                    diagonal[0] = DMat3::IDENTITY * 2.0;
                    spline.upper[0] = first.turn.to_rate;
                    spline.given[0] = first.secant() * 3.0;
                }
            }
            let before_last = steps.len().checked_sub(2).map(|i| &steps[i]);
            match given(end, last, before_last) {
                Some(velocity) => {
                    spline.given[keys - 1] = velocity;
                    spline.bent = 1..keys - 1;
                }
                None => {
                    diagonal[keys - 1] = DMat3::IDENTITY * 4.0;
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
            diagonal[i] = DMat3::IDENTITY * 4.0;
            spline.given[i] = pair[0].secant() * (6.0 * left) + pair[1].secant() * (6.0 * right);
            spline.scales[i] = left * h;
        }
        spline.inverse[0] = diagonal[0].inverse();
        for (i, &own) in diagonal.iter().enumerate().skip(1) {
            let above = spline.inverse[i - 1] * spline.upper[i - 1];
            spline.inverse[i] = (own - spline.lower[i] * above).inverse();
        }
        spline
    }

    fn solve(&self) -> Solved {
        let mut velocities = self.given.clone();
        self.sweep(self.given.clone(), &mut velocities);
        let rate = |i: usize, velocity: DVec3| self.steps[i - 1].turn.to_rate * velocity;
        let fast = |&i: &usize| {
            let turn = rate(i, velocities[i]) * self.steps[i - 1].duration;
            turn.length() <= FASTEST
        };
        let bent: Vec<usize> = self.bent.clone().filter(fast).collect();
        let plain = velocities.clone();
        let mut converged = false;
        for _ in 0..SWEEPS {
            let mut sides = self.given.clone();
            for &i in &bent {
                let bend = self.steps[i - 1].turn.bend(rate(i, velocities[i]));
                sides[i] -= bend * self.scales[i];
            }
            let change = self.sweep(sides, &mut velocities);
            converged = change < SETTLED;
            if change < 1e-14 {
                break;
            }
        }
        // If the iteration diverges, the bends are omitted everywhere.
        let is_finite = velocities.iter().all(|velocity| velocity.is_finite());
        let mut jumps = vec![false; velocities.len()];
        jumps[self.bent.clone()].fill(true);
        if converged && is_finite {
            bent.iter().for_each(|&i| jumps[i] = false);
        }
        Solved {
            velocities: if is_finite { velocities } else { plain },
            jumps,
        }
    }

    /// Solves for these right sides, and returns the largest relative change of a velocity.
    fn sweep(&self, mut sides: Vec<DVec3>, velocities: &mut [DVec3]) -> f64 {
        for i in 0..sides.len() {
            let above = match i {
                0 => DVec3::ZERO,
                _ => self.lower[i] * sides[i - 1],
            };
            sides[i] = self.inverse[i] * (sides[i] - above);
        }
        let mut change = 0.0f64;
        for i in (0..sides.len()).rev() {
            let below = match velocities.get(i + 1) {
                Some(&below) => self.inverse[i] * (self.upper[i] * below),
                None => DVec3::ZERO,
            };
            let velocity = sides[i] - below;
            let moved = (velocity - velocities[i]).length() / (1e-30 + velocity.length());
            change = change.max(moved);
            velocities[i] = velocity;
        }
        change
    }
}
