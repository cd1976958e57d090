//! The rotation, the angular velocity and the angular acceleration of one track at any
//! time.

use glam::{DQuat, DVec3, Quat};

use crate::curve::options::{Ends, Path};
use crate::reference::b_spline::b_spline;
use crate::reference::c2;
use crate::reference::pace::Pace;
use crate::reference::quaternion::{exponential, invert, logarithm, multiply};
use crate::reference::segment::{Basis, Segment};
use crate::reference::tangents::Track;
use crate::tracks::key_data::Tcb;
use crate::tracks::set as tracks;

/// The kinds of textbook curves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Keys that are held.
    Step,
    /// Straight lines between keys, normalised.
    Nlerp,
    /// Great arcs between keys.
    Slerp,
    /// Bézier curves, their control rotations the bisectors.
    Shoemake,
    /// Bézier curves, their control rotations half way to the bisectors.
    Shoemake2,
    /// Bézier curves, their control rotations a third of the way to the bisectors.
    Shoemake1985,
    /// Spherical quadrangles.
    Squad,
    /// Cumulative cubic with tangents from the neighbouring keys.
    CatmullRom,
    /// Cumulative cubic with tangents of the parabola through three keys.
    BesselOverhauser,
    /// Bézier curves with the mean of the logarithms of the slopes.
    BesselOverhauserMean,
    /// Cumulative cubic B-spline.
    BSpline,
    /// Cumulative cubic with given velocities.
    Hermite,
    /// Bézier curves with tension, continuity and bias.
    KochanekBartels,
    /// Cubics in the components, with given tangents, normalised.
    GltfCubic,
    /// Cubic rotation vectors with continuous angular acceleration.
    C2,
}

/// One track's curve.
pub struct Curve {
    track: Track,
    segments: Vec<Segment>,
    /// Its arc lengths, if it is run through at constant speed.
    pace: Option<Pace>,
}

impl Curve {
    /// The curve through (or near) `keys` at `times` (seconds), which carry nothing
    /// beside their rotations. Keys are taken as unit quaternions: normalised in f64. A
    /// track that [`Ends::Loop`] closes must repeat its first key at its end.
    #[must_use]
    pub fn new(kind: Kind, path: Path, ends: Ends, times: &[f64], keys: &[Quat]) -> Self {
        Self::build(kind, ends, Track::new(path, times, keys))
    }

    /// The curve of a track with all the data of its keys. `tcb` holds for every key if the track
    /// has none of its own.
    pub(crate) fn of_track(
        kind: Kind,
        path: Path,
        ends: Ends,
        tcb: Tcb,
        track: tracks::Track<'_>,
    ) -> Self {
        let path = match kind {
            Kind::GltfCubic => Path::AsAuthored,
            _ => path,
        };
        let mut own = Track::new(path, track.times, track.keys);
        own.velocities = track.velocities.to_vec();
        own.tangents = track.tangents.to_vec();
        own.tcb = match track.tcb {
            [] => vec![tcb; track.keys.len()],
            given => given.to_vec(),
        };
        Self::build(kind, ends, own)
    }

    /// The same curve, run through at one angular speed; a curve of held keys stays as it is.
    pub(crate) fn at_constant_speed(mut self) -> Self {
        let pace = Pace::new(&self.segments);
        self.pace = (pace.total() > 0.0).then_some(pace);
        self
    }

    fn build(kind: Kind, ends: Ends, track: Track) -> Self {
        let velocities = match kind {
            Kind::C2 => c2::velocities(&track, ends),
            _ => Vec::new(),
        };
        let segments = (0..track.last())
            .map(|i| segment(&track, kind, ends, i, &velocities))
            .collect();
        Self {
            track,
            segments,
            pace: None,
        }
    }

    /// The rotation at a time in seconds; before the first key and after the last
    /// it holds the end values.
    #[must_use]
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

    /// The angular velocity in the body frame, radians per second; zero outside the
    /// keys. At a key it is that of the later segment.
    #[must_use]
    pub fn velocity(&self, time: f64) -> DVec3 {
        let Some((i, t)) = self.inside(time) else {
            return DVec3::ZERO;
        };
        match &self.pace {
            Some(pace) => {
                // A segment may start or end at rest, without a direction: that next to it is
                // taken.
                let moving = t.clamp(1e-6, 1.0 - 1e-6);
                let direction = self.segments[i].velocity(moving).normalize_or_zero();
                direction * (pace.total() / self.duration())
            }
            None => self.segment_velocity(i, t),
        }
    }

    /// The angular acceleration in the body frame, radians per second squared; zero
    /// outside the keys. At a key it is that of the later segment.
    #[must_use]
    pub fn acceleration(&self, time: f64) -> DVec3 {
        let Some((i, t)) = self.inside(time) else {
            return DVec3::ZERO;
        };
        let Some(pace) = &self.pace else {
            return self.segment_acceleration(i, t);
        };
        // At constant speed only the direction of the velocity changes.
        let speed = pace.total() / self.duration();
        let (velocity, bend) = (
            self.segments[i].velocity(t),
            self.segments[i].acceleration(t),
        );
        let direction = velocity.normalize_or_zero();
        let rate = speed / velocity.length();
        (bend - direction * bend.dot(direction)) * rate * rate
    }

    /// The angular velocity at parameter `t` of segment `i`; both sides of a key
    /// can be asked for.
    #[must_use]
    pub fn segment_velocity(&self, i: usize, t: f64) -> DVec3 {
        self.segments[i].velocity(t) / self.track.step(i)
    }

    /// As [`Curve::segment_velocity`], the angular acceleration.
    #[must_use]
    pub fn segment_acceleration(&self, i: usize, t: f64) -> DVec3 {
        self.segments[i].acceleration(t) / self.track.step(i).powi(2)
    }

    fn inside(&self, time: f64) -> Option<(usize, f64)> {
        let times = &self.track.times;
        let last = self.track.last();
        (last > 0 && (times[0]..=times[last]).contains(&time)).then(|| self.locate(time))
    }

    /// Seconds from the first key to the last.
    fn duration(&self) -> f64 {
        self.track.times[self.track.last()] - self.track.times[0]
    }

    fn locate(&self, time: f64) -> (usize, f64) {
        let times = &self.track.times;
        if let Some(pace) = &self.pace {
            let part = (time - times[0]) / self.duration();
            return pace.place(&self.segments, part.clamp(0.0, 1.0));
        }
        let after = times.partition_point(|&key| key <= time);
        let i = after.saturating_sub(1).min(self.track.last() - 1);
        (i, (time - times[i]) / self.track.step(i))
    }
}

fn segment(track: &Track, kind: Kind, ends: Ends, i: usize, velocities: &[DVec3]) -> Segment {
    let last = track.last() - 1;
    let at_end = i == 0 || i == last;
    let (from, to) = (track.keys[i], track.keys[i + 1]);
    match kind {
        Kind::Step => Segment::Hold(from),
        Kind::Slerp => Segment::Arc(from, to),
        Kind::Nlerp => Segment::Line(from, to),
        Kind::GltfCubic => {
            let tangent = |key: usize, side: usize| match track.tangents.get(key) {
                Some(both) => both[side].as_dquat() * track.step(i),
                None => DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0),
            };
            Segment::Cubic([from, tangent(i, 1), tangent(i + 1, 0), to])
        }
        Kind::Hermite => {
            let handle = |key: usize| {
                let velocity = track.velocities.get(key).copied().unwrap_or_default();
                velocity / 2.0 * track.step(i) / 3.0
            };
            cumulative(track, i, handle(i), handle(i + 1))
        }
        _ if ends == Ends::Frozen && at_end && last > 0 => Segment::Hold(from),
        _ if last == 0 && kind != Kind::BSpline => Segment::Arc(from, to),
        Kind::BSpline => b_spline(track, ends, i),
        Kind::C2 => c2::segment(track, velocities, i),
        _ => by_handles(track, kind, ends, i),
    }
}

/// A curve whose control rotations are `q, q exp(out), r exp(-in), r`.
fn by_handles(track: &Track, kind: Kind, ends: Ends, i: usize) -> Segment {
    let last = track.last() - 1;
    let closed = ends == Ends::Loop;
    let out = (closed || i > 0).then(|| track.handles(kind, i).1);
    let incoming = (closed || i < last).then(|| track.handles(kind, i + 1).0);
    let (q, r) = (track.keys[i], track.keys[i + 1]);
    let whole = logarithm(track.difference(i));
    // Half of the rotation vector that an end's angular velocity gives over the interval.
    let half_turn = |start: bool| match ends {
        Ends::Secant => Some(whole),
        Ends::Clamped { start: w, .. } if start => Some(w / 2.0 * track.step(i)),
        Ends::Clamped { end: w, .. } => Some(w / 2.0 * track.step(i)),
        _ => None,
    };
    let (out, incoming) = match (out, incoming) {
        (None, Some(incoming)) => {
            let rest = || {
                let b = multiply(r, exponential(-incoming));
                logarithm(multiply(invert(q), b))
            };
            (
                end_handle(kind, ends, whole, incoming, half_turn(true), rest),
                incoming,
            )
        }
        (Some(out), None) => {
            let rest = || {
                let a = multiply(q, exponential(out));
                logarithm(multiply(invert(a), r))
            };
            (
                out,
                end_handle(kind, ends, whole, out, half_turn(false), rest),
            )
        }
        (out, incoming) => (out.unwrap_or_default(), incoming.unwrap_or_default()),
    };
    if matches!(kind, Kind::CatmullRom | Kind::BesselOverhauser) {
        return cumulative(track, i, out, incoming);
    }
    let controls = [
        q,
        multiply(q, exponential(out)),
        multiply(r, exponential(-incoming)),
        r,
    ];
    match kind {
        Kind::Squad => Segment::Squad(controls),
        _ => Segment::Bezier(controls),
    }
}

/// The handle of the key at an end of the track; `other` is the handle at the other end of its
/// interval.
fn end_handle(
    kind: Kind,
    ends: Ends,
    whole: DVec3,
    other: DVec3,
    half_turn: Option<DVec3>,
    rest: impl Fn() -> DVec3,
) -> DVec3 {
    match (kind, half_turn) {
        // A squad starts with log(q0⁻¹ q1) + 2 log(q0⁻¹ s0).
        (Kind::Squad, Some(turn)) => (turn - whole) / 2.0,
        (_, Some(turn)) => turn / 3.0,
        (Kind::Squad, None) if ends == Ends::Natural => -other / 2.0,
        (Kind::Squad, None) => -other,
        _ if ends == Ends::Natural => rest() / 2.0,
        (Kind::Shoemake, None) => 2.0 * whole - other,
        (Kind::Shoemake2, None) => whole - other,
        _ => 2.0 / 3.0 * whole - other,
    }
}

fn cumulative(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> Segment {
    let a = multiply(track.keys[i], exponential(out));
    let b = multiply(track.keys[i + 1], exponential(-incoming));
    Segment::Product {
        base: track.keys[i],
        w: [out, logarithm(multiply(invert(a), b)), incoming],
        basis: Basis::Bernstein,
    }
}
