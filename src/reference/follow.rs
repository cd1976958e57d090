//! Bodies that follow paths: the rotation-minimising frame by its differential equation, the fixed
//! frame and Frenet's by their definitions.

use std::fmt;

use glam::{DMat3, DQuat, DVec3};

use crate::reference::pace::{bisected, gauss};
use crate::reference::quaternion::exponential;
use crate::reference::vector::{VectorCurve, hermite};

/// Steps of an interval: the error of Runge and Kutta's method of fourth order is below 1e-11 where
/// the direction turns by a few radians.
const STEPS: usize = 512;

/// Which way a body on a path faces.
#[derive(Debug, Clone)]
pub enum Heading {
    /// Along the path.
    Tangent,
    /// To the point this far ahead along the path.
    Ahead(f64),
    /// To a point.
    At(DVec3),
}

/// How the body is turned about its direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frame {
    /// It never turns about its direction.
    Minimal,
    /// Its y axis is as near to the upward direction as it can be.
    Fixed,
    /// Its y axis is opposite to the path's principal normal, or along it: whichever is nearer to
    /// that of the moment before.
    Frenet,
}

/// When a body is where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Travel {
    /// As the keys say.
    Keys,
    /// At one speed.
    Constant,
    /// The speed grows from 0 over the first part of the time and falls to 0 over the last.
    Eased(f64, f64),
}

/// A body that follows a curve whose direction nowhere jumps within an interval.
#[derive(Debug, Clone)]
pub struct Follower {
    /// Its path.
    pub curve: VectorCurve,
    /// Which way it faces.
    pub heading: Heading,
    /// Its turn about this direction.
    pub frame: Frame,
    /// The upward direction at the start.
    pub up: DVec3,
    /// Upward directions at keys; may be empty.
    pub ups: Vec<Option<DVec3>>,
    /// Whether the path is closed, and what its frame is off after one round is spread over it.
    pub spread: bool,
    /// When it is where.
    pub travel: Travel,
}

/// A follower with all that takes a walk along its path.
pub struct Followed<'a> {
    own: &'a Follower,
    /// Position, velocity and second derivative on each interval.
    curves: Vec<Box<dyn Fn(f64) -> [DVec3; 3] + 'a>>,
    /// The y axis of the frame that does not turn, and the length, at every step of every interval.
    ups: Vec<DVec3>,
    lengths: Vec<f64>,
    /// Rolls to add, by length: (length, angle, slope).
    rolls: Vec<[f64; 3]>,
    /// By how much the frame was off after one round, or at the last given up, radians.
    pub left_over: f64,
}

impl Follower {
    /// Walks along the path.
    #[must_use]
    pub fn walk(&self) -> Followed<'_> {
        let intervals = self.curve.keys.len() - 1;
        let mut walk = Followed {
            own: self,
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
            walk.way(0, 0.0).0,
        );
        let mut keys = vec![(0.0, 0.0)];
        for i in 0..intervals {
            if i > 0 {
                let (before, after) = (walk.way(i - 1, 1.0).0, walk.way(i, 0.0).0);
                up = DQuat::from_rotation_arc(before, after) * up;
            }
            if let (Some(Some(given)), true) = (self.ups.get(i), i > 0) {
                walk.give(&mut keys, i * STEPS, up, *given, walk.way(i, 0.0).0);
            }
            for step in 0..STEPS {
                walk.ups.push(up);
                let [from, to] = [step, step + 1].map(|step| step as f64 / STEPS as f64);
                up = walk.carried(i, from, to, up);
            }
        }
        let last = walk.way(intervals - 1, 1.0).0;
        if let Some(Some(given)) = self.ups.get(intervals) {
            walk.give(&mut keys, intervals * STEPS, up, *given, last);
        }
        walk.ups.push(up);
        if self.spread {
            let start = walk.way(0, 0.0).0;
            let arrived = DQuat::from_rotation_arc(last, start) * up;
            walk.give(&mut keys, intervals * STEPS, arrived, walk.ups[0], start);
        }
        walk.left_over = -keys[keys.len() - 1].1;
        walk.rolls = slopes(&keys);
        walk
    }
}

impl fmt::Debug for Followed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Followed")
            .field("own", &self.own)
            .field("left_over", &self.left_over)
            .finish_non_exhaustive()
    }
}

impl Followed<'_> {
    fn speed(&self, i: usize, t: f64) -> f64 {
        self.curves[i](t)[1].length()
    }

    /// The length of the path.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// Position and rotation at a time: the rotation takes z forward and y up.
    #[must_use]
    pub fn pose(&self, time: f64) -> (DVec3, DQuat) {
        let (i, t) = self.place(time);
        let (forward, _) = self.way(i, t);
        let up = match self.own.frame {
            Frame::Fixed => across(self.own.up, forward),
            Frame::Minimal => {
                let (step, from) = step_at(t);
                let up = self.carried(i, from, t, self.ups[i * STEPS + step]);
                exponential(forward * (0.5 * self.roll(self.length_at(i, t)))) * up
            }
            Frame::Frenet => self.frenet(i, t),
        };
        let up = across(up, forward);
        let axes = DMat3::from_cols(up.cross(forward), up, forward);
        (self.curves[i](t)[0], DQuat::from_mat3(&axes))
    }

    /// The interval and its parameter at a time.
    fn place(&self, time: f64) -> (usize, f64) {
        let times = &self.own.curve.times;
        let last = times.len() - 2;
        let time = time.clamp(times[0], times[last + 1]);
        let x = (time - times[0]) / (times[last + 1] - times[0]);
        let part = match self.own.travel {
            Travel::Keys => {
                let i = (times.partition_point(|&key| key <= time) - 1).min(last);
                return (i, (time - times[i]) / (times[i + 1] - times[i]));
            }
            Travel::Constant => x,
            Travel::Eased(a, b) => eased(a, b, x),
        };
        self.place_of(part * self.length())
    }

    /// The interval and its parameter where a length is reached, by bisection.
    fn place_of(&self, length: f64) -> (usize, f64) {
        let after = self.lengths.partition_point(|&own| own <= length);
        let step = (after - 1).min(self.lengths.len() - 2);
        let i = step / STEPS;
        let from = (step % STEPS) as f64 / STEPS as f64;
        let is_before = |t: f64| self.length_at(i, t) < length;
        (i, bisected(from, from + 1.0 / STEPS as f64, is_before))
    }

    /// The length up to a place.
    fn length_at(&self, i: usize, t: f64) -> f64 {
        let (step, from) = step_at(t);
        self.lengths[i * STEPS + step] + gauss(|t| self.speed(i, t), from, t)
    }

    /// The direction, and its derivative by the interval's parameter.
    fn way(&self, i: usize, t: f64) -> (DVec3, DVec3) {
        let [place, velocity, bend] = self.curves[i](t);
        let (to, change) = match self.own.heading {
            Heading::Tangent => (velocity, bend),
            Heading::At(point) => (point - place, -velocity),
            Heading::Ahead(distance) => {
                let target = self.length_at(i, t) + distance;
                let (end, tangent) = self.at_length(target);
                (end - place, tangent * velocity.length() - velocity)
            }
        };
        let forward = to.normalize();
        (
            forward,
            (change - forward * forward.dot(change)) / to.length(),
        )
    }

    /// The point and the tangent at a length; beyond an open path's end straight on.
    fn at_length(&self, length: f64) -> (DVec3, DVec3) {
        let whole = self.length();
        let length = if self.own.spread {
            length % whole
        } else {
            length
        };
        let (i, t) = self.place_of(length);
        let [place, velocity, _] = self.curves[i](t);
        let tangent = velocity.normalize();
        (place + tangent * (length - whole).max(0.0), tangent)
    }

    /// Carries an axis across the direction along it: `y' = -(y·w') w`, by Runge and Kutta's method.
    fn carried(&self, i: usize, from: f64, to: f64, up: DVec3) -> DVec3 {
        let h = to - from;
        let slope = |t: f64, up: DVec3| {
            let (forward, change) = self.way(i, t);
            -forward * up.dot(change)
        };
        let k1 = slope(from, up);
        let k2 = slope(from + h / 2.0, up + k1 * (h / 2.0));
        let k3 = slope(from + h / 2.0, up + k2 * (h / 2.0));
        let k4 = slope(to, up + k3 * h);
        across(
            up + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0),
            self.way(i, to).0,
        )
    }

    /// Adds the roll that turns `up` into the given one, nearest to the one before.
    fn give(&self, keys: &mut Vec<(f64, f64)>, step: usize, up: DVec3, given: DVec3, way: DVec3) {
        let given = across(given, way);
        let angle = libm::atan2(way.dot(up.cross(given)), up.dot(given));
        let before = keys[keys.len() - 1].1;
        let turn = std::f64::consts::TAU;
        let own = angle + turn * ((before - angle) / turn).round();
        let place = (self.lengths[step], own);
        match keys.last_mut() {
            Some(key) if key.0 == place.0 => *key = place,
            _ => keys.push(place),
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

    /// `w × u` with `u = P' × P'' / |…|`, with the sign that continues that of the start.
    fn frenet(&self, i: usize, t: f64) -> DVec3 {
        let raw = |i: usize, t: f64| {
            let [_, velocity, bend] = self.curves[i](t);
            velocity
                .normalize()
                .cross(velocity.cross(bend))
                .normalize_or_zero()
        };
        let steps = |i: usize, t: f64| {
            // A little inside, as the second derivative jumps at keys and vanishes at inflections.
            let at = move |step: usize| (step as f64 + 1e-6) / STEPS as f64;
            (0..=step_at(t).0).map(move |step| (i, at(step)))
        };
        let before = (0..i).flat_map(|i| steps(i, 1.0).chain([(i, 1.0 - 1e-9)]));
        let mut last = raw(0, 1e-9);
        for (i, t) in before.chain(steps(i, t)).chain([(i, t)]) {
            let own = raw(i, t);
            last = if own.dot(last) < 0.0 { -own } else { own };
        }
        last
    }
}

/// The step of an interval with a parameter, and where it starts.
fn step_at(t: f64) -> (usize, f64) {
    let step = ((t * STEPS as f64) as usize).min(STEPS - 1);
    (step, step as f64 / STEPS as f64)
}

/// Smoothstep speed up over the part `a` of the time, constant, and down over the part `b`.
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

/// The part of `up` across a direction, of unit length.
fn across(up: DVec3, way: DVec3) -> DVec3 {
    let own = up - way * way.dot(up);
    if own.length() > 1e-6 * up.length() {
        return own.normalize();
    }
    let magnitude = way.abs();
    let axis = if magnitude.x <= magnitude.y && magnitude.x <= magnitude.z {
        DVec3::X
    } else if magnitude.y <= magnitude.z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    (axis - way * way.dot(axis)).normalize()
}

/// Bessel and Overhauser's slopes at points (place, value), with parabolas at the ends.
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
    let row = |(i, &(place, value)): (usize, &(f64, f64))| [place, value, slope(i)];
    points.iter().enumerate().map(row).collect()
}
