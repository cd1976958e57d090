//! The interpolating spline with continuous angular acceleration.

use std::ops::Range;

use glam::{DMat3, DVec3};

use crate::curve::formula::RotationVectorNumbers;
use crate::curve::options::Ends;
use crate::fit::block::{Intervals, TrackStretch, at, squared_extent};
use crate::fit::exact::shape::ROTATION_VECTOR;
use crate::math::quaternion::{self, Vector, log, scaled, sine_cosine, sum};
use crate::method::ends::EndCondition;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::method::{
    Continuity, Cost, CurveKind, Keys, Method, MethodInput, SmoothCurves, defaults,
};
use crate::threads::stop;
use crate::tracks::set::Track;
use crate::tracks::signs::Signs;

/// The curve of `SciPy`'s `RotationSpline`: the rotation vector relative to each key is a cubic in time, and the
/// angular velocities at the keys make the angular acceleration continuous. Every key influences the whole curve,
/// less with distance.
///
/// The equations for the velocities are nonlinear and may have several solutions. The quadratic terms, called
/// *bends*, are increased from zero, where the equations are linear, to their full size; the curve is the solution
/// that follows continuously.
///
/// Some bends are omitted: where a key is passed so fast that the curve would make hundreds of rotations in an
/// interval, and where no such solution is found. Next to steps of more than 200°, which are possible with
/// [`KeySigns::AsAuthored`](crate::curve::options::KeySigns::AsAuthored), no equations are solved. In these cases
/// only the velocity is continuous;
/// [`Interpolation::warnings`](crate::method::interpolation::Interpolation::warnings) lists the keys.
///
/// With reversed time the curve is different, because a rotation vector that is a cubic relative to one key is not a
/// cubic relative to the next.
pub const C2: Method = Method {
    name: "c2",
    summary: "continuous angular acceleration through keys at any spacing (W014 if impossible)",
    formula: "q(t) = q_i exp(θ(t)/2), θ cubic, θ(0) = 0, θ(1) = 2 log(q_i⁻¹ q_{i+1}), angular velocity and acceleration continuous",
    source: "Mayorov 2019, Smooth attitude interpolation (SciPy's RotationSpline)",
    continuity: Continuity::C2,
    continuity_on_even_keys: Continuity::C2,
    keeps_constant_velocity: Keys::Any,
    symmetric: false,
    ends: Ends::Secant,
    cost: Cost::new(1100.0, 3.2),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves::new(&ROTATION_VECTOR, curves).with(
    MethodInput::Velocities {
        solve: velocities,
        jumps,
    },
));

fn curves(intervals: &mut Intervals, stretches: &[TrackStretch], _: Ends) {
    for lane in stretches.iter().flat_map(TrackStretch::lanes) {
        let half = 0.5 * intervals.durations[lane].max(SHORTEST);
        let ([x, y, z, _], [u, v, w, _]) = (
            at(&intervals.outward, lane),
            at(&intervals.inward, lane + 1),
        );
        let log = at(&intervals.logs, lane);
        let chart = Chart::new(DVec3::from_array(scaled(log, 2.0)));
        // Half of θ' at both ends, per unit of the parameter.
        let start = scaled([x, y, z], half);
        let end = scaled((chart.to_rate * DVec3::new(u, v, w)).to_array(), half);
        let both = sum(start, end);
        let second = sum(
            scaled(log, 3.0),
            sum(scaled(start, -1.0), scaled(both, -1.0)),
        );
        let third = sum(both, scaled(log, -2.0));
        let numbers = RotationVectorNumbers {
            base: intervals.key(lane),
            linear: start,
            quadratic: second,
            cubic: third,
        };
        intervals.set_curve(lane, numbers);
        intervals.squared_extents[lane] = squared_extent([start, second, third]);
    }
}

/// The number of keys whose velocities are solved together. If the track continues outside such a window, [`MARGIN`]
/// more keys are added to the equations: the influence of a key decreases to a quarter from key to key.
const WINDOW: usize = 1024;
const MARGIN: usize = 64;

/// The angular velocities at the keys of some intervals. They do not depend on which intervals are requested
/// together, because windows start at multiples of [`WINDOW`].
fn velocities(
    track: Track,
    signs: Signs<'_>,
    intervals: Range<usize>,
    interpolation: &Interpolation,
) -> Vec<Vector> {
    let (first, end) = (intervals.start, intervals.end + 1);
    let windows = (first / WINDOW * WINDOW..end).step_by(WINDOW);
    let in_window = |window: usize| {
        let keys = first.max(window)..end.min(window + WINDOW);
        let from = window as isize - MARGIN as isize;
        let to = (window + WINDOW + MARGIN) as isize;
        let (first_solved, solved) = solve(track, signs, from..to, interpolation);
        keys.map(move |key| solved[(key as isize - first_solved) as usize].to_array())
    };
    // If the work was stopped, the caller notices it after this function has returned.
    let windows = windows.take_while(|_| !stop::is_stopped());
    windows.flat_map(in_window).collect()
}

/// The smallest jump of the acceleration that is reported, relative to the terms of its key's equation.
const JUMP: f64 = 1e-9;

/// The keys of a track at which the angular acceleration of the final curve jumps.
fn jumps(track: Track, signs: Signs<'_>, interpolation: &Interpolation) -> Vec<usize> {
    let last = track.keys.len().saturating_sub(1);
    if last < 2 {
        return Vec::new();
    }
    let velocities: Vec<DVec3> = velocities(track, signs, 0..last, interpolation)
        .into_iter()
        .map(DVec3::from_array)
        .collect();
    if velocities.len() <= last {
        return Vec::new(); // the work was stopped
    }
    let is_closed = matches!(interpolation.ends, Ends::Loop);
    let mut before = Step::new(track, signs, if is_closed { last - 1 } else { 0 });
    let mut jumps = Vec::new();
    for key in usize::from(!is_closed)..last {
        let after = Step::new(track, signs, key);
        let equation = KeyEquation::between(&before, &after);
        let previous = if key == 0 { last - 1 } else { key - 1 };
        let nearby = [previous, key, key + 1].map(|key| velocities[key]);
        let bend = before.bend(nearby[1]) * equation.bend_scale;
        // If a number is NaN, the comparison is false, so that this counts as a jump.
        let is_continuous =
            (equation.residual(nearby) + bend).length() <= JUMP * equation.size(nearby);
        if !is_continuous {
            jumps.push(key);
        }
        before = after;
    }
    jumps
}

/// The velocities at the keys of a window, and the index of the window's first key. The index is negative in the copy
/// of a closed track that precedes it.
fn solve(
    track: Track,
    signs: Signs<'_>,
    window: Range<isize>,
    interpolation: &Interpolation,
) -> (isize, Vec<DVec3>) {
    let all = track.keys.len() as isize - 1;
    let closed = matches!(interpolation.ends, Ends::Loop) && all > 1;
    let (first, last) = if closed {
        (window.start, window.end.min(all + MARGIN as isize))
    } else {
        (window.start.max(0), window.end.min(all))
    };
    let steps: Vec<Step> = (first..last)
        .map(|i| Step::new(track, signs, i.rem_euclid(all.max(1)) as usize))
        .collect();
    // Two keys are joined by slerp, whatever the ends.
    let end_at = |at_end: bool, end: EndCondition| {
        if at_end && all > 1 {
            end
        } else {
            EndCondition::Secant
        }
    };
    let [start, end] = EndCondition::both(interpolation.ends);
    let start = end_at(!closed && first == 0, start);
    let end = end_at(!closed && last == all, end);
    (first, Spline::new(&steps, [start, end]).solve())
}

/// The shortest duration in seconds. Shorter intervals count as this long, so that their rates stay finite.
const SHORTEST: f64 = 1e-150;

/// The longest step in radians next to which equations are solved. Up to this length, each equation has more weight on
/// the velocity at its key than on those at its neighbours. Shortest paths are at most pi. Next to steps of nearly
/// 360°, the solutions of the linear equations grow without bound from key to key.
const LONGEST: f64 = 3.5;

/// One interval of a track.
struct Step {
    /// Its length in seconds.
    duration: f64,
    chart: Chart,
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
            chart: Chart::new(vector),
            factors: bend_factors(vector),
        }
    }

    /// Whether the step is so long that the linear equations next to it may have no solution.
    fn is_long(&self) -> bool {
        self.chart.vector.dot(self.chart.vector) > LONGEST * LONGEST
    }

    /// The angular velocity of slerp, in radians per second.
    fn secant(&self) -> DVec3 {
        self.chart.vector / self.duration
    }

    /// The bend: the part of the angular acceleration at the interval's end that is quadratic in the
    /// angular velocity there.
    fn bend(&self, velocity: DVec3) -> DVec3 {
        let (vector, rate) = (self.chart.vector, self.chart.to_rate * velocity);
        let [k1, k2, k3] = self.factors;
        let across = vector.cross(rate);
        (across * k1 + vector.cross(across) * k2) * vector.dot(rate) + rate.cross(across) * k3
    }

    /// The derivative of [`Step::bend`] by the velocity.
    fn bend_slope(&self, velocity: DVec3) -> DMat3 {
        let (vector, rate) = (self.chart.vector, self.chart.to_rate * velocity);
        let [k1, k2, k3] = self.factors;
        let along = vector.dot(rate);
        let across = vector.cross(rate);
        let by_along = outer(across * k1 + vector.cross(across) * k2, vector);
        // v × (v × r) = v (v · r) - r (v · v), and r × (v × r) = v (r · r) - r (r · v).
        let twice = outer(vector, vector) - DMat3::from_diagonal(DVec3::splat(vector.dot(vector)));
        let by_across = (skew(vector) * k1 + twice * k2) * along;
        let triple = outer(vector, rate * 2.0)
            - outer(rate, vector)
            - DMat3::from_diagonal(DVec3::splat(along));
        (by_along + by_across + triple * k3) * self.chart.to_rate
    }
}

/// The factors of [`Step::bend`] for a rotation vector: Mayorov's formulas, or their series for small angles.
fn bend_factors(vector: DVec3) -> [f64; 3] {
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

/// A rotation vector, with the matrices between its rate of change and the angular velocity.
struct Chart {
    vector: DVec3,
    /// The matrix from the angular velocity at the interval's end to the vector's rate of change, and its inverse.
    to_rate: DMat3,
    from_rate: DMat3,
}

impl Chart {
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

/// `a bᵀ`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The three equations of a key. The unknowns are the velocities at the previous key, at this key and at the next
/// key: `lower·before + diagonal velocity + upper·behind + bend_scale bend(velocity) = right`.
struct KeyEquation {
    lower: DMat3,
    diagonal: f64,
    upper: DMat3,
    right: DVec3,
    /// The factor of the bend of the interval before the key; 0 if the velocity is fixed.
    bend_scale: f64,
}

impl KeyEquation {
    /// The equation of a key whose velocity is fixed.
    fn set_to(velocity: DVec3) -> Self {
        Self {
            lower: DMat3::ZERO,
            diagonal: 1.0,
            upper: DMat3::ZERO,
            right: velocity,
            bend_scale: 0.0,
        }
    }

    /// The equation of an inner key: [`KeyEquation::between`]. Next to a step that is too long, the velocity is the
    /// mean of the secants instead, as for Bessel's parabola.
    fn inner(before: &Step, after: &Step) -> Self {
        if before.is_long() || after.is_long() {
            let weight = after.duration / (before.duration + after.duration);
            return Self::set_to(before.secant() * weight + after.secant() * (1.0 - weight));
        }
        Self::between(before, after)
    }

    /// The equation for zero acceleration at the start of a track.
    fn natural_start(step: &Step) -> Self {
        if step.is_long() {
            return Self::set_to(step.secant());
        }
        Self {
            diagonal: 2.0,
            upper: step.chart.to_rate,
            ..Self::set_to(step.secant() * 3.0)
        }
    }

    /// The equation for zero acceleration at the end of a track.
    fn natural_end(step: &Step) -> Self {
        if step.is_long() {
            return Self::set_to(step.secant());
        }
        Self {
            lower: step.chart.from_rate * 2.0,
            diagonal: 4.0,
            bend_scale: step.duration,
            ..Self::set_to(step.secant() * 6.0)
        }
    }

    /// The equation for equal accelerations on both sides of a key, divided by `1/h + 1/next_h` so that no number
    /// overflows.
    fn between(before: &Step, after: &Step) -> Self {
        let (h, next_h) = (before.duration, after.duration);
        let (left, right) = (next_h / (h + next_h), h / (h + next_h));
        Self {
            lower: before.chart.from_rate * (2.0 * left),
            diagonal: 4.0,
            upper: after.chart.to_rate * (2.0 * right),
            right: before.secant() * (6.0 * left) + after.secant() * (6.0 * right),
            bend_scale: left * h,
        }
    }

    /// The residual of the equation without its bend.
    fn residual(&self, [before, velocity, behind]: [DVec3; 3]) -> DVec3 {
        self.lower * before + velocity * self.diagonal + self.upper * behind - self.right
    }

    /// The magnitude of the equation's terms in radians per second.
    fn size(&self, [before, velocity, behind]: [DVec3; 3]) -> f64 {
        let beside = (self.lower * before).length() + (self.upper * behind).length();
        velocity.length() + (beside + self.right.length()) / self.diagonal
    }
}

/// The equations for the velocities. Except for [`Step::bend`], which depends on the velocity at one key only, they
/// are linear.
///
/// They are solved by Newton's iteration, which starts at the solution of the linear equations and solves a block
/// tridiagonal system in each step. Each step must be at most half as long as the previous one. Then the iteration
/// stays near the solution that it approaches, and rounding does not decide which solution is found. If a step is
/// longer, the bends are increased in parts: the first part is a quarter; a part is doubled after a success and
/// halved after a failure. With less than two radians between keys, three to six Newton steps are enough for any key
/// times.
struct Spline<'a> {
    steps: &'a [Step],
    equations: Vec<KeyEquation>,
}

/// The limit of a bend's strength: the angle of the step before the key, times the rate of its rotation vector there
/// in radians per interval, times the weight of the interval. `SciPy` converges up to about 5. At 1000 the curve
/// makes a hundred rotations in an interval, and the solutions are close to each other.
const STRONGEST: f64 = 1024.0;
/// The minimum angle for the strength: with an almost zero angle, a curve may rotate thousands of times.
const SMALLEST_ANGLE: f64 = 0.1;
/// If no solution is found, only bends up to half the strength are used, and so on down to this strength.
const WEAKEST: f64 = 0.5;

/// The bends are first used in full, then increased in parts, which start at this size.
const FIRST_PART: f64 = 0.25;
const LEAST_PART: f64 = 1.0 / 1024.0;

/// The maximum numbers of Newton steps: for one part of the bends, and in total.
const STEPS_FOR_PART: usize = 32;
const ALL_STEPS: usize = 1024;

/// The maximum ratio of the lengths of consecutive steps; steps below [`ROUNDING`] may be due to rounding.
const CONTRACTION: f64 = 0.5;
const ROUNDING: f64 = 1e-10;
/// The iteration ends after a step that changed each velocity by at most this fraction of its size: the remaining
/// error is about the square of it.
const CONVERGED: f64 = 1e-8;
const NOTHING: f64 = 1e-15;

impl<'a> Spline<'a> {
    fn new(steps: &'a [Step], [start, end]: [EndCondition; 2]) -> Self {
        let set_velocity = |end: EndCondition, step: &Step, next: Option<&Step>| match (end, next) {
            (EndCondition::Clamped(half), _) => Some(DVec3::from_array(half) * 2.0),
            (EndCondition::Secant, _) | (_, None) => Some(step.secant()),
            // The parabola through three keys, in logarithms.
            (EndCondition::Parabolic, Some(next)) => {
                let bend = (next.secant() - step.secant()) * step.duration;
                Some(step.secant() - bend / (step.duration + next.duration))
            }
            (EndCondition::Natural, Some(_)) => None,
        };
        let mut equations = Vec::with_capacity(steps.len() + 1);
        if let [first, ..] = steps {
            equations.push(match set_velocity(start, first, steps.get(1)) {
                Some(velocity) => KeyEquation::set_to(velocity),
                None => KeyEquation::natural_start(first),
            });
        }
        let inner = steps
            .windows(2)
            .map(|pair| KeyEquation::inner(&pair[0], &pair[1]));
        equations.extend(inner);
        if let [.., last] = steps {
            let before_last = steps.len().checked_sub(2).map(|i| &steps[i]);
            equations.push(match set_velocity(end, last, before_last) {
                Some(velocity) => KeyEquation::set_to(velocity),
                None => KeyEquation::natural_end(last),
            });
        }
        if equations.is_empty() {
            equations.push(KeyEquation::set_to(DVec3::ZERO));
        }
        Self { steps, equations }
    }

    fn solve(&self) -> Vec<DVec3> {
        let keys = self.equations.len();
        let mut newton = Newton {
            spline: self,
            bend_scales: vec![0.0; keys],
            sizes: Vec::new(),
            above: vec![DMat3::ZERO; keys],
            changes: vec![DVec3::ZERO; keys],
            steps_left: ALL_STEPS,
        };
        newton.eliminate(&vec![DVec3::ZERO; keys], 0.0);
        let linear: Vec<DVec3> = newton.changes.iter().map(|&change| -change).collect();
        newton.sizes = (self.equations.iter().enumerate())
            .map(|(key, equation)| equation.size(around(&linear, key)) + 1e-200)
            .collect();
        let strengths: Vec<f64> = (0..keys).map(|key| self.strength(key, &linear)).collect();
        let mut strongest = STRONGEST;
        while strongest >= WEAKEST {
            for (key, scale) in newton.bend_scales.iter_mut().enumerate() {
                let counts = strengths[key] <= strongest;
                *scale = if counts {
                    self.equations[key].bend_scale
                } else {
                    0.0
                };
            }
            if let Some(velocities) = newton.with_bends(&linear) {
                return velocities;
            }
            strongest *= 0.5;
        }
        linear
    }

    /// The strength of the bend at a key ([`STRONGEST`]).
    fn strength(&self, key: usize, velocities: &[DVec3]) -> f64 {
        match self.equations[key].bend_scale {
            0.0 => 0.0,
            scale => {
                let chart = &self.steps[key - 1].chart;
                let angle = chart.vector.length();
                let angle = if angle > SMALLEST_ANGLE {
                    angle
                } else {
                    SMALLEST_ANGLE
                };
                scale * angle * (chart.to_rate * velocities[key]).length()
            }
        }
    }
}

/// The velocities at the previous key, at this key and at the next key; 0 outside the window.
fn around(velocities: &[DVec3], key: usize) -> [DVec3; 3] {
    let at = |key: usize| velocities.get(key).copied().unwrap_or(DVec3::ZERO);
    [at(key.wrapping_sub(1)), velocities[key], at(key + 1)]
}

/// Newton's iteration for the equations of a spline.
struct Newton<'a> {
    spline: &'a Spline<'a>,
    /// The factors of the bends; 0 where a bend is omitted.
    bend_scales: Vec<f64>,
    /// The magnitudes of the equations' terms, with which changes are compared.
    sizes: Vec<f64>,
    /// The blocks above the diagonal after elimination, and the solution.
    above: Vec<DMat3>,
    changes: Vec<DVec3>,
    steps_left: usize,
}

impl Newton<'_> {
    /// The solution that follows continuously from that of the linear equations as the bends are increased.
    fn with_bends(&mut self, linear: &[DVec3]) -> Option<Vec<DVec3>> {
        let mut velocities = linear.to_vec();
        let (mut part, mut more) = (0.0, 1.0);
        while more >= LEAST_PART && self.steps_left > 0 {
            let next = if part + more < 1.0 { part + more } else { 1.0 };
            let mut found = velocities.clone();
            if self.converges(&mut found, next) {
                if next == 1.0 {
                    return Some(found);
                }
                (velocities, part, more) = (found, next, 2.0 * more);
            } else {
                more *= if more == 1.0 { FIRST_PART } else { 0.5 };
            }
        }
        None
    }

    /// Iterates from these velocities to the solution with this fraction of the bends.
    fn converges(&mut self, velocities: &mut [DVec3], part: f64) -> bool {
        let mut previous = f64::INFINITY;
        for _ in 0..STEPS_FOR_PART.min(self.steps_left) {
            self.steps_left -= 1;
            self.eliminate(velocities, part);
            let mut largest = 0.0;
            for ((velocity, &change), size) in
                velocities.iter_mut().zip(&self.changes).zip(&self.sizes)
            {
                let relative = change.length() / size;
                if !relative.is_finite() {
                    return false;
                }
                largest = if relative > largest {
                    relative
                } else {
                    largest
                };
                *velocity -= change;
            }
            if largest > CONTRACTION * previous && largest > ROUNDING {
                return false;
            }
            // Newton's iteration converges quadratically: the quotient of a step and the square of the step before it
            // stays the same.
            let rest = largest * largest * (largest / (previous * previous));
            if largest <= CONVERGED && (rest <= NOTHING || previous <= CONVERGED) {
                return true;
            }
            previous = largest;
        }
        false
    }

    /// Solves the equations, linearised at these velocities, for the velocities' errors, by elimination from the
    /// first key on.
    fn eliminate(&mut self, velocities: &[DVec3], part: f64) {
        for (key, equation) in self.spline.equations.iter().enumerate() {
            let velocity = velocities[key];
            let mut diagonal = DMat3::from_diagonal(DVec3::splat(equation.diagonal));
            let mut residual = equation.residual(around(velocities, key));
            let scale = part * self.bend_scales[key];
            if scale != 0.0 {
                let step = &self.spline.steps[key - 1];
                diagonal += step.bend_slope(velocity) * scale;
                residual += step.bend(velocity) * scale;
            }
            if key > 0 {
                diagonal -= equation.lower * self.above[key - 1];
                residual -= equation.lower * self.changes[key - 1];
            }
            let inverse = diagonal.inverse();
            self.above[key] = inverse * equation.upper;
            self.changes[key] = inverse * residual;
        }
        for key in (0..self.changes.len() - 1).rev() {
            let behind = self.changes[key + 1];
            self.changes[key] -= self.above[key] * behind;
        }
    }
}
