//! The rotation and the angular velocity of one track at any time.

use glam::{DQuat, DVec3, Quat};

use super::quaternion::{exponential, invert, logarithm, multiply, slerp, vector};
use super::tangents::Track;
use crate::method::{Ends, Path};

/// Which textbook curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Great arcs between keys.
    Slerp,
    /// Cumulative cubic with tangents from the neighbouring keys.
    CatmullRom,
    /// Cumulative cubic with tangents of the parabola through three keys.
    BesselOverhauser,
    /// Cumulative uniform cubic B-spline.
    BSpline,
}

/// One track's curve.
pub struct Curve {
    track: Track,
    segments: Vec<Segment>,
}

/// The curve between two keys.
#[derive(Clone, Copy)]
enum Segment {
    Hold(DQuat),
    Arc(DQuat, DQuat),
    /// `base Π exp(w_j B_j(t))` (Kim, Kim, Shin 1995).
    Product {
        base: DQuat,
        w: [DVec3; 3],
        basis: Basis,
    },
}

#[derive(Clone, Copy)]
enum Basis {
    Bernstein,
    BSpline,
}

impl Basis {
    fn values(self, t: f64) -> [f64; 3] {
        match self {
            Self::Bernstein => [1.0 - (1.0 - t).powi(3), t * t * (3.0 - 2.0 * t), t * t * t],
            Self::BSpline => [
                (5.0 + 3.0 * t - 3.0 * t * t + t * t * t) / 6.0,
                (1.0 + 3.0 * t + 3.0 * t * t - 2.0 * t * t * t) / 6.0,
                t * t * t / 6.0,
            ],
        }
    }

    fn derivatives(self, t: f64) -> [f64; 3] {
        match self {
            Self::Bernstein => [
                3.0 * (1.0 - t) * (1.0 - t),
                6.0 * t * (1.0 - t),
                3.0 * t * t,
            ],
            Self::BSpline => [0.5 * (1.0 - t) * (1.0 - t), 0.5 + t - t * t, 0.5 * t * t],
        }
    }
}

impl Curve {
    /// The curve through (or near) `keys` at `times` (seconds). Keys are taken as
    /// unit quaternions: normalised in f64. A track that [`Ends::Loop`] closes must
    /// repeat its first key at its end.
    pub fn new(kind: Kind, path: Path, ends: Ends, times: &[f64], keys: &[Quat]) -> Self {
        let track = Track::new(path, times, keys);
        let segments = (0..track.last())
            .map(|i| segment(&track, kind, ends, i))
            .collect();
        Self { track, segments }
    }

    /// The rotation at a time in seconds; before the first key and after the last
    /// it holds the end values.
    pub fn rotation(&self, time: f64) -> DQuat {
        let last = self.track.last();
        if last == 0 {
            return self.track.keys[0];
        }
        if time >= self.track.times[last] {
            return match self.segments[last - 1] {
                Segment::Hold(_) => self.track.keys[last],
                segment => segment.rotation(1.0),
            };
        }
        let (i, t) = self.locate(time.max(self.track.times[0]));
        self.segments[i].rotation(t)
    }

    /// The angular velocity in the body frame, radians per second, by the product
    /// rule; zero outside the keys. At a key it is that of the later segment.
    pub fn velocity(&self, time: f64) -> DVec3 {
        let times = &self.track.times;
        if self.track.last() == 0 || time < times[0] || time > times[self.track.last()] {
            return DVec3::ZERO;
        }
        let (i, t) = self.locate(time);
        self.segments[i].velocity(t) / self.track.step(i)
    }

    /// The angular velocity at parameter `t` of segment `i`; both sides of a key
    /// can be asked for.
    pub fn segment_velocity(&self, i: usize, t: f64) -> DVec3 {
        self.segments[i].velocity(t) / self.track.step(i)
    }

    fn locate(&self, time: f64) -> (usize, f64) {
        let times = &self.track.times;
        let after = times.partition_point(|&key| key <= time);
        let i = after.saturating_sub(1).min(self.track.last() - 1);
        (i, (time - times[i]) / self.track.step(i))
    }
}

impl Segment {
    fn rotation(self, t: f64) -> DQuat {
        match self {
            Self::Hold(key) => key,
            Self::Arc(from, to) => slerp(from, to, t),
            Self::Product { base, w, basis } => {
                let b = basis.values(t);
                (0..3).fold(base, |q, j| multiply(q, exponential(w[j] * b[j])))
            }
        }
    }

    /// Twice the derivative of `t`, in the body frame.
    fn velocity(self, t: f64) -> DVec3 {
        match self {
            Self::Hold(_) => DVec3::ZERO,
            Self::Arc(from, to) => 2.0 * logarithm(multiply(invert(from), to)),
            Self::Product { w, basis, .. } => {
                let (b, slopes) = (basis.values(t), basis.derivatives(t));
                (0..3).fold(DVec3::ZERO, |velocity, j| {
                    let factor = exponential(w[j] * b[j]);
                    let moved = DQuat::from_xyzw(velocity.x, velocity.y, velocity.z, 0.0);
                    let seen = multiply(multiply(invert(factor), moved), factor);
                    vector(seen) + 2.0 * w[j] * slopes[j]
                })
            }
        }
    }
}

fn segment(track: &Track, kind: Kind, ends: Ends, i: usize) -> Segment {
    let last = track.last() - 1;
    let at_end = i == 0 || i == last;
    if kind == Kind::Slerp || last == 0 {
        Segment::Arc(track.keys[i], track.keys[i + 1])
    } else if ends == Ends::Frozen && at_end {
        Segment::Hold(track.keys[i])
    } else if kind == Kind::BSpline {
        b_spline(track, ends, i)
    } else {
        handles(track, kind, ends, i)
    }
}

/// An interpolating cubic: control rotations `q, q exp(out), r exp(-in), r`.
fn handles(track: &Track, kind: Kind, ends: Ends, i: usize) -> Segment {
    let last = track.last() - 1;
    let closed = ends == Ends::Loop;
    let out = (closed || i > 0).then(|| track.handles(kind, i).1);
    let incoming = (closed || i < last).then(|| track.handles(kind, i + 1).0);
    let (q, r) = (track.keys[i], track.keys[i + 1]);
    let whole = logarithm(track.difference(i));
    let w = match (out, incoming, ends) {
        (Some(out), Some(incoming), _) => between(track, i, out, incoming),
        (None, Some(incoming), Ends::Natural) => {
            let b = multiply(r, exponential(-incoming));
            let half = logarithm(multiply(invert(q), b)) / 2.0;
            [half, half, incoming]
        }
        (Some(out), None, Ends::Natural) => {
            let a = multiply(q, exponential(out));
            let half = logarithm(multiply(invert(a), r)) / 2.0;
            [out, half, half]
        }
        (None, Some(incoming), Ends::Clamped { start, .. }) => {
            between(track, i, start / 2.0 * track.step(i) / 3.0, incoming)
        }
        (Some(out), None, Ends::Clamped { end, .. }) => {
            between(track, i, out, end / 2.0 * track.step(i) / 3.0)
        }
        (None, Some(incoming), _) => {
            between(track, i, (2.0 * whole - 3.0 * incoming) / 3.0, incoming)
        }
        (Some(out), None, _) => between(track, i, out, (2.0 * whole - 3.0 * out) / 3.0),
        (None, None, _) => [whole / 3.0; 3],
    };
    Segment::Product {
        base: q,
        w,
        basis: Basis::Bernstein,
    }
}

fn between(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> [DVec3; 3] {
    let a = multiply(track.keys[i], exponential(out));
    let b = multiply(track.keys[i + 1], exponential(-incoming));
    [out, logarithm(multiply(invert(a), b)), incoming]
}

/// `exp(by) v exp(-by)`.
fn turned(v: DVec3, by: DVec3) -> DVec3 {
    let v = DQuat::from_xyzw(v.x, v.y, v.z, 0.0);
    vector(multiply(multiply(exponential(by), v), exponential(-by)))
}

fn b_spline(track: &Track, ends: Ends, i: usize) -> Segment {
    let last = track.last() - 1;
    let step = |i: usize| logarithm(track.difference(i));
    let before = match ends {
        _ if i > 0 => step(i - 1),
        Ends::Loop => step(last),
        // ω h = exp(-w₂/6) w₁ exp(w₂/6) + w₂ at t = 0, solved for w₁.
        Ends::Clamped { start, .. } => turned(start * track.step(0) - step(0), step(0) / 6.0),
        Ends::Parabolic => 2.0 * step(0) - step(1),
        _ => step(0),
    };
    let after = match ends {
        _ if i < last => step(i + 1),
        Ends::Loop => step(0),
        // ω h = exp(-w₃/6) w₂ exp(w₃/6) + w₃ at t = 1: w₃ by iteration.
        Ends::Clamped { end, .. } => {
            let mut w = DVec3::ZERO;
            for _ in 0..60 {
                w = end * track.step(last) - turned(step(last), -w / 6.0);
            }
            w
        }
        Ends::Parabolic => 2.0 * step(last) - step(last - 1),
        _ => step(last),
    };
    let base = multiply(track.keys[i], exponential(-before));
    Segment::Product {
        base,
        w: [before, step(i), after],
        basis: Basis::BSpline,
    }
}
