//! Bodies that follow paths: the rotation-minimising frame by its differential equation, the fixed
//! frame and Frenet's by their definitions.

use std::fmt;

use glam::{DMat3, DQuat, DVec3};

use crate::reference::curve_lengths::{bisected, gauss};
use crate::reference::quaternion::exponential;
use crate::reference::segment::hermite;
use crate::reference::vector::VectorCurve;

/// The number of steps of an interval: the error of the Runge-Kutta method of fourth order is below 1e-11 if the
/// direction rotates by a few radians.
const STEPS: usize = 512;

/// The direction in which a body on a path faces.
#[derive(Debug, Clone)]
pub enum FollowerDirection {
    /// Along the path.
    Tangent,
    /// To the point at this distance ahead along the path.
    Ahead(f64),
    /// To a point.
    At(DVec3),
}

/// The rotation of the body about its direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FollowerFrame {
    /// The body does not rotate about its direction.
    Minimal,
    /// Its y axis is as near to the upward direction as possible.
    Fixed,
    /// Its y axis is along the path's principal normal or opposite to it: opposite at the start, then continuous.
    Frenet,
}

/// The speed of a body on its path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FollowerSpeed {
    /// According to the key times.
    Keys,
    /// Constant.
    Constant,
    /// The speed increases from 0 over the first fraction of the time and decreases to 0 over the last fraction.
    Eased(f64, f64),
}

/// A body that follows a curve whose direction does not jump within an interval.
#[derive(Debug, Clone)]
pub struct Follower {
    /// The path.
    pub curve: VectorCurve,
    /// The direction in which it faces.
    pub heading: FollowerDirection,
    /// The rotation about this direction.
    pub frame: FollowerFrame,
    /// The upward direction at the start.
    pub up: DVec3,
    /// Upward directions at keys; may be empty.
    pub ups: Vec<Option<DVec3>>,
    /// Whether the roll that the frame has gained after one round of a closed path is removed, evenly over the path.
    pub spread: bool,
    /// The speed on the path.
    pub travel: FollowerSpeed,
}

/// A follower with precomputed data along its path.
pub struct FollowerWalk<'a> {
    follower: &'a Follower,
    /// Position, velocity and second derivative on each interval.
    curves: Vec<Box<dyn Fn(f64) -> [DVec3; 3] + 'a>>,
    /// The y axis of the frame without roll, at every step of every interval.
    ups: Vec<DVec3>,
    lengths: Vec<f64>,
    /// Rolls to add, by length: (length, angle, slope).
    rolls: Vec<[f64; 3]>,
    /// The roll of the frame in radians: after one round, or relative to the last upward direction of a key.
    pub left_over: f64,
}

impl Follower {
    /// Precomputes the data along the path.
    #[must_use]
    pub fn walk(&self) -> FollowerWalk<'_> {
        let intervals = self.curve.keys.len() - 1;
        let mut walk = FollowerWalk {
            follower: self,
            curves: (0..intervals).map(|i| self.curve.interval(i)).collect(),
            ups: Vec::new(),
            lengths: vec![0.0],
            rolls: Vec::new(),
            left_over: 0.0,
        };
        for step in 0..intervals * STEPS {
            let (i, t) = (step / STEPS, (step % STEPS) as f64 / STEPS as f64);
            let length =
                walk.lengths[step] + gauss(|t| walk.speed(i, t), t, t + 1.0 / STEPS as f64);
            walk.lengths.push(length);
        }
        let mut up = across(
            self.ups.first().copied().flatten().unwrap_or(self.up),
            walk.direction(0, 0.0).0,
        );
        let mut keys = vec![(0.0, 0.0)];
        for i in 0..intervals {
            if i > 0 {
                let (before, after) = (walk.direction(i - 1, 1.0).0, walk.direction(i, 0.0).0);
                up = DQuat::from_rotation_arc(before, after) * up;
            }
            if let (Some(Some(requested)), true) = (self.ups.get(i), i > 0) {
                walk.add_roll(
                    &mut keys,
                    i * STEPS,
                    up,
                    *requested,
                    walk.direction(i, 0.0).0,
                );
            }
            for step in 0..STEPS {
                walk.ups.push(up);
                let [from, to] = [step, step + 1].map(|step| step as f64 / STEPS as f64);
                up = walk.carried(i, from, to, up);
            }
        }
        let last = walk.direction(intervals - 1, 1.0).0;
        if let Some(Some(requested)) = self.ups.get(intervals) {
            walk.add_roll(&mut keys, intervals * STEPS, up, *requested, last);
        }
        walk.ups.push(up);
        if self.spread {
            let start = walk.direction(0, 0.0).0;
            let arrived = DQuat::from_rotation_arc(last, start) * up;
            walk.add_roll(&mut keys, intervals * STEPS, arrived, walk.ups[0], start);
        }
        walk.left_over = -keys[keys.len() - 1].1;
        walk.rolls = slopes(&keys);
        walk
    }
}

impl fmt::Debug for FollowerWalk<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FollowerWalk")
            .field("follower", &self.follower)
            .field("left_over", &self.left_over)
            .finish_non_exhaustive()
    }
}

impl FollowerWalk<'_> {
    fn speed(&self, i: usize, t: f64) -> f64 {
        self.curves[i](t)[1].length()
    }

    /// The length of the path.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// Position and rotation at a time in seconds. The rotation maps z to the forward direction and y to the upward
    /// direction.
    #[must_use]
    pub fn pose(&self, time: f64) -> (DVec3, DQuat) {
        let (i, t) = self.locate(time);
        let (forward, _) = self.direction(i, t);
        let up = match self.follower.frame {
            FollowerFrame::Fixed => across(self.follower.up, forward),
            FollowerFrame::Minimal => {
                let (step, from) = step_at(t);
                let up = self.carried(i, from, t, self.ups[i * STEPS + step]);
                exponential(forward * (0.5 * self.roll(self.length_at(i, t)))) * up
            }
            FollowerFrame::Frenet => self.frenet(i, t),
        };
        let up = across(up, forward);
        let axes = DMat3::from_cols(up.cross(forward), up, forward);
        (self.curves[i](t)[0], DQuat::from_mat3(&axes))
    }

    /// The interval and its parameter at a time.
    fn locate(&self, time: f64) -> (usize, f64) {
        let times = &self.follower.curve.times;
        let last = times.len() - 2;
        let time = time.clamp(times[0], times[last + 1]);
        let x = (time - times[0]) / (times[last + 1] - times[0]);
        let part = match self.follower.travel {
            FollowerSpeed::Keys => {
                let i = (times.partition_point(|&key| key <= time) - 1).min(last);
                return (i, (time - times[i]) / (times[i + 1] - times[i]));
            }
            FollowerSpeed::Constant => x,
            FollowerSpeed::Eased(a, b) => eased(a, b, x),
        };
        self.locate_length(part * self.length())
    }

    /// The interval and its parameter at a length, by bisection.
    fn locate_length(&self, length: f64) -> (usize, f64) {
        let after = self.lengths.partition_point(|&end| end <= length);
        let step = (after - 1).min(self.lengths.len() - 2);
        let i = step / STEPS;
        let from = (step % STEPS) as f64 / STEPS as f64;
        let is_before = |t: f64| self.length_at(i, t) < length;
        (i, bisected(from, from + 1.0 / STEPS as f64, is_before))
    }

    /// The length up to a parameter of an interval.
    fn length_at(&self, i: usize, t: f64) -> f64 {
        let (step, from) = step_at(t);
        self.lengths[i * STEPS + step] + gauss(|t| self.speed(i, t), from, t)
    }

    /// The direction, and its derivative by the interval's parameter.
    fn direction(&self, i: usize, t: f64) -> (DVec3, DVec3) {
        let [position, velocity, bend] = self.curves[i](t);
        let (to, change) = match self.follower.heading {
            FollowerDirection::Tangent => (velocity, bend),
            FollowerDirection::At(point) => (point - position, -velocity),
            FollowerDirection::Ahead(distance) => {
                let target = self.length_at(i, t) + distance;
                let (end, tangent) = self.at_length(target);
                (end - position, tangent * velocity.length() - velocity)
            }
        };
        let forward = to.normalize();
        (
            forward,
            (change - forward * forward.dot(change)) / to.length(),
        )
    }

    /// The point and the tangent at a length. After the end of an open path, the path continues straight.
    fn at_length(&self, length: f64) -> (DVec3, DVec3) {
        let whole = self.length();
        let length = if self.follower.spread {
            length % whole
        } else {
            length
        };
        let (i, t) = self.locate_length(length);
        let [point, velocity, _] = self.curves[i](t);
        let tangent = velocity.normalize();
        (point + tangent * (length - whole).max(0.0), tangent)
    }

    /// Transports an axis orthogonal to the direction along the path: `y' = -(y·w') w`, by the Runge-Kutta method.
    fn carried(&self, i: usize, from: f64, to: f64, up: DVec3) -> DVec3 {
        let h = to - from;
        let slope = |t: f64, up: DVec3| {
            let (forward, change) = self.direction(i, t);
            -forward * up.dot(change)
        };
        let k1 = slope(from, up);
        let k2 = slope(from + h / 2.0, up + k1 * (h / 2.0));
        let k3 = slope(from + h / 2.0, up + k2 * (h / 2.0));
        let k4 = slope(to, up + k3 * h);
        across(
            up + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0),
            self.direction(i, to).0,
        )
    }

    /// Adds the roll that rotates `up` to the requested direction, nearest to the previous roll.
    fn add_roll(
        &self,
        keys: &mut Vec<(f64, f64)>,
        step: usize,
        up: DVec3,
        requested: DVec3,
        direction: DVec3,
    ) {
        let target = across(requested, direction);
        let angle = libm::atan2(direction.dot(up.cross(target)), up.dot(target));
        let before = keys[keys.len() - 1].1;
        let full_circle = std::f64::consts::TAU;
        let unwrapped = angle + full_circle * ((before - angle) / full_circle).round();
        let point = (self.lengths[step], unwrapped);
        match keys.last_mut() {
            Some(key) if key.0 == point.0 => *key = point,
            _ => keys.push(point),
        }
    }

    fn roll(&self, length: f64) -> f64 {
        let after = self.rolls.partition_point(|key| key[0] <= length).max(1);
        let [a, p, m] = self.rolls[after - 1];
        let Some(&[b, q, n]) = self.rolls.get(after) else {
            return p;
        };
        let h = b - a;
        let [from, out, to, incoming] = hermite((length - a) / h);
        p * from + q * to + h * (m * out + n * incoming)
    }

    /// `w × u` with `u = P' × P'' / |…|`, with the sign that continues the one at the start.
    fn frenet(&self, i: usize, t: f64) -> DVec3 {
        let raw = |i: usize, t: f64| {
            let [_, velocity, bend] = self.curves[i](t);
            velocity
                .normalize()
                .cross(velocity.cross(bend))
                .normalize_or_zero()
        };
        let steps = |i: usize, t: f64| {
            // Slightly inside the interval, because the second derivative jumps at keys and is 0 at inflections.
            let at = move |step: usize| (step as f64 + 1e-6) / STEPS as f64;
            (0..=step_at(t).0).map(move |step| (i, at(step)))
        };
        let before = (0..i).flat_map(|i| steps(i, 1.0).chain([(i, 1.0 - 1e-9)]));
        let mut last = raw(0, 1e-9);
        for (i, t) in before.chain(steps(i, t)).chain([(i, t)]) {
            let side = raw(i, t);
            last = if side.dot(last) < 0.0 { -side } else { side };
        }
        last
    }
}

/// The step of an interval that contains a parameter, and the parameter at its start.
fn step_at(t: f64) -> (usize, f64) {
    let step = ((t * STEPS as f64) as usize).min(STEPS - 1);
    (step, step as f64 / STEPS as f64)
}

/// The fraction of the length at the fraction `x` of the time: the speed increases as smoothstep over the fraction
/// `a` of the time, is constant, and decreases over the fraction `b`.
#[must_use]
pub fn eased(a: f64, b: f64, x: f64) -> f64 {
    let top = 2.0 / (2.0 - a - b);
    let rise = |part: f64, x: f64| {
        let y = x / part;
        top * part * (y * y * y - y * y * y * y / 2.0)
    };
    if x < a {
        rise(a, x)
    } else if x > 1.0 - b {
        1.0 - rise(b, 1.0 - x)
    } else {
        top * (x - a / 2.0)
    }
}

/// The component of `up` orthogonal to a direction, normalised.
fn across(up: DVec3, direction: DVec3) -> DVec3 {
    let part = up - direction * direction.dot(up);
    if part.length() > 1e-6 * up.length() {
        return part.normalize();
    }
    let magnitude = direction.abs();
    let axis = if magnitude.x <= magnitude.y && magnitude.x <= magnitude.z {
        DVec3::X
    } else if magnitude.y <= magnitude.z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    (axis - direction * direction.dot(axis)).normalize()
}

/// Bessel and Overhauser's slopes at points (position, value), with parabolas at the ends.
fn slopes(points: &[(f64, f64)]) -> Vec<[f64; 3]> {
    let last = points.len() - 1;
    let secant = |i: usize| (points[i + 1].1 - points[i].1) / (points[i + 1].0 - points[i].0);
    let inner = |i: usize| {
        let (l, r) = (points[i].0 - points[i - 1].0, points[i + 1].0 - points[i].0);
        (secant(i - 1) * r + secant(i) * l) / (l + r)
    };
    let slope = |i: usize| match i {
        _ if last == 0 => 0.0,
        _ if last == 1 => secant(0),
        0 => 2.0 * secant(0) - inner(1),
        i if i == last => 2.0 * secant(last - 1) - inner(last - 1),
        i => inner(i),
    };
    let row = |(i, &(position, value)): (usize, &(f64, f64))| [position, value, slope(i)];
    points.iter().enumerate().map(row).collect()
}
