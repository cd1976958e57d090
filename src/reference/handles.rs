//! Cubic methods that are defined by handles: each key has an incoming and an outgoing handle, with control rotations
//! `q_i exp(-in)` and `q_i exp(out)`.

use glam::{DQuat, DVec3};

use crate::curve::options::Ends;
use crate::reference::curve::Definition;
use crate::reference::quaternion::{
    exponential, inner, invert, logarithm, logarithm_or, multiply, normalise, slerp, squad,
};
use crate::reference::segment::{Segment, cumulative};
use crate::reference::track::ReferenceTrack;
use crate::reference::two_keys::smooth;
use crate::tracks::set::key_data::Tcb;

/// The definitions of this file.
pub(super) const DEFINITIONS: &[Definition] = &[
    CATMULL_ROM,
    BESSEL_OVERHAUSER,
    BESSEL_OVERHAUSER_MEAN,
    KOCHANEK_BARTELS,
    SQUAD,
    SHOEMAKE,
    SHOEMAKE_2,
    SHOEMAKE_1985,
];

/// The rule by which a method computes the handles of its curves.
#[derive(Clone, Copy)]
pub(crate) struct HandleRule {
    /// The incoming and the outgoing handle of a key between two intervals.
    inner: fn(&Sides) -> (DVec3, DVec3),
    /// The handle at an end of the track with the parabolic end condition. The interval there rotates by `whole`, and
    /// `other` is the handle at its other end.
    parabolic: fn(whole: DVec3, other: DVec3) -> DVec3,
    /// The handle at an end without angular acceleration; `rest` is the rotation of the interval without the other
    /// handle.
    natural: fn(rest: DVec3, other: DVec3) -> DVec3,
    /// The handle at an end with a specified velocity, which would rotate by `rate` in the interval that rotates by
    /// `whole`.
    by_rate: fn(rate: DVec3, whole: DVec3) -> DVec3,
    /// The curve of an interval with an outgoing and an incoming handle.
    segment: fn(&ReferenceTrack, usize, DVec3, DVec3) -> Segment,
}

impl HandleRule {
    /// The rules of methods with Bézier curves.
    const fn bezier(inner: fn(&Sides) -> (DVec3, DVec3)) -> Self {
        Self {
            inner,
            parabolic: |whole, other| 2.0 / 3.0 * whole - other,
            natural: |rest, _| rest / 2.0,
            by_rate: |rate, _| rate / 3.0,
            segment: |track, i, out, incoming| {
                Segment::Between(bezier, controls(track, i, out, incoming))
            },
        }
    }

    /// The rules of methods with cumulative cubics.
    const fn cumulative(inner: fn(&Sides) -> (DVec3, DVec3)) -> Self {
        Self {
            segment: cumulative,
            ..Self::bezier(inner)
        }
    }

    /// The curves of a track.
    pub(crate) fn segments(&self, track: &ReferenceTrack, ends: Ends) -> Vec<Segment> {
        smooth(track, ends, |i| {
            let [out, incoming] = self.of_interval(track, ends, i);
            (self.segment)(track, i, out, incoming)
        })
    }

    /// The handles of an interval: outgoing at its first key, incoming at its second.
    fn of_interval(&self, track: &ReferenceTrack, ends: Ends, i: usize) -> [DVec3; 2] {
        let last = track.last() - 1;
        let closed = ends == Ends::Loop;
        let handles = |key: usize| (self.inner)(&Sides::new(track, key));
        let out = (closed || i > 0).then(|| handles(i).1);
        let incoming = (closed || i < last).then(|| handles(i + 1).0);
        let (q, r) = (track.keys[i], track.keys[i + 1]);
        let whole = logarithm(track.difference(i));
        let at_end = |other: DVec3, clamped: Option<DVec3>, rest: DQuat| match (ends, clamped) {
            (Ends::Secant, _) => (self.by_rate)(whole, whole),
            // Half of the angle by which the velocity at the end rotates in the whole interval.
            (_, Some(velocity)) => (self.by_rate)(velocity / 2.0 * track.step(i), whole),
            (Ends::Natural, None) => (self.natural)(logarithm(rest), other),
            _ => (self.parabolic)(whole, other),
        };
        let (start, end) = match ends {
            Ends::Clamped { start, end } => (Some(start), Some(end)),
            _ => (None, None),
        };
        match (out, incoming) {
            (None, Some(incoming)) => {
                let rest = multiply(invert(q), multiply(r, exponential(-incoming)));
                [at_end(incoming, start, rest), incoming]
            }
            (Some(out), None) => {
                let rest = multiply(invert(multiply(q, exponential(out))), r);
                [out, at_end(out, end, rest)]
            }
            (out, incoming) => [out.unwrap_or_default(), incoming.unwrap_or_default()],
        }
    }
}

/// A key between two intervals: the rotations of the intervals, their logarithms and their durations.
pub(crate) struct Sides {
    key: DQuat,
    tcb: Tcb,
    before: DQuat,
    after: DQuat,
    l: DVec3,
    r: DVec3,
    h_before: f64,
    h_after: f64,
    both: f64,
}

impl Sides {
    fn new(track: &ReferenceTrack, key: usize) -> Self {
        let (before, h_before) = track.side(key, true);
        let (after, h_after) = track.side(key, false);
        Self {
            key: track.keys[key],
            tcb: track.tcb[key],
            before,
            after,
            l: logarithm(before),
            r: logarithm(after),
            h_before,
            h_after,
            both: h_before + h_after,
        }
    }
}

/// A definition whose curves follow from a [`HandleRule`]. This is a macro, because a function pointer cannot capture
/// the rule.
macro_rules! by_handles {
    ($method:literal, $handles:expr) => {
        Definition::new($method, |track, ends| $handles.segments(track, ends))
    };
}

/// A cumulative cubic with tangents from the neighbouring keys.
pub(crate) const CATMULL_ROM: Definition = by_handles!(
    "catmull-rom",
    HandleRule::cumulative(|sides| {
        let sum = sides.l + sides.r;
        let sixth = logarithm_or(multiply(sides.before, sides.after), sum) / 6.0;
        (sixth, sixth)
    })
);

/// A cumulative cubic with tangents of the parabola through three keys.
pub(crate) const BESSEL_OVERHAUSER: Definition = by_handles!(
    "bessel-overhauser",
    HandleRule::cumulative(|sides| {
        let (before, after) = (sides.h_before, sides.h_after);
        let (left, right) = (sides.l * (after / before), sides.r * (before / after));
        let product = multiply(exponential(left), exponential(right));
        let tangent = nearest_branch(product, left + right) / sides.both;
        (tangent * (before / 3.0), tangent * (after / 3.0))
    })
);

/// Bézier curves with the mean of the logarithms of the slopes.
pub(crate) const BESSEL_OVERHAUSER_MEAN: Definition = by_handles!(
    "bessel-overhauser-mean",
    HandleRule::bezier(|sides| {
        let (before, after) = (sides.h_before, sides.h_after);
        let mean = (sides.l * (after / before) + sides.r * (before / after)) / sides.both;
        (mean * (before / 3.0), mean * (after / 3.0))
    })
);

/// Bézier curves with tension, continuity and bias.
pub(crate) const KOCHANEK_BARTELS: Definition = by_handles!(
    "kochanek-bartels",
    HandleRule::bezier(|sides| {
        let Tcb {
            tension,
            continuity,
            bias,
        } = sides.tcb;
        let (before, after) = (sides.h_before, sides.h_after);
        let tight = 1.0 - tension;
        // The names of the variables are those in Geier's documentation of the Python package `splines`.
        let a = tight * (1.0 + continuity) * (1.0 + bias);
        let b = tight * (1.0 - continuity) * (1.0 - bias);
        let c = tight * (1.0 - continuity) * (1.0 + bias);
        let d = tight * (1.0 + continuity) * (1.0 - bias);
        let (rate_in, rate_out) = (sides.l / before, sides.r / after);
        let mean = |u: f64, v: f64| (u * after * rate_in + v * before * rate_out) / sides.both;
        (mean(c, d) * before / 3.0, mean(a, b) * after / 3.0)
    })
);

/// Spherical quadrangles. One starts with `log(q0⁻¹ q1) + 2 log(q0⁻¹ s0)`.
pub(crate) const SQUAD: Definition = by_handles!(
    "squad",
    HandleRule {
        inner: |&Sides { l, r, .. }| ((r - l) / 4.0, (l - r) / 4.0),
        parabolic: |_, other| -other,
        natural: |_, other| -other / 2.0,
        by_rate: |rate, whole| (rate - whole) / 2.0,
        segment: |track, i, out, incoming| Segment::Between(
            squad,
            controls(track, i, out, incoming)
        ),
    }
);

/// Bézier curves whose control rotations are the bisectors.
pub(crate) const SHOEMAKE: Definition = by_handles!(
    "shoemake",
    HandleRule {
        parabolic: |whole, other| {
            let handle: DVec3 = 2.0 * whole - other;
            // Opposite quaternions are the same rotation and determine no arc between them, so the handle is the
            // rotation itself.
            match (handle.length_squared() - std::f64::consts::PI * std::f64::consts::PI).abs()
                < 1e-5
            {
                true => whole,
                false => handle,
            }
        },
        ..HandleRule::bezier(|sides| shoemake(sides, |_, bisector| bisector))
    }
);

/// Bézier curves whose control rotations are half-way to the bisectors.
pub(crate) const SHOEMAKE_2: Definition = by_handles!(
    "shoemake-2",
    HandleRule {
        parabolic: |whole, other| whole - other,
        ..HandleRule::bezier(|sides| shoemake(sides, |q, bisector| bisect(q, bisector, q)))
    }
);

/// Bézier curves whose control rotations are at a third of the arcs to the bisectors.
pub(crate) const SHOEMAKE_1985: Definition = by_handles!(
    "shoemake-1985",
    HandleRule::bezier(|sides| { shoemake(sides, |q, bisector| slerp(q, bisector, 1.0 / 3.0)) })
);

/// Handles whose outgoing control rotation `control_of` computes from the key and the bisector of its neighbours.
fn shoemake(sides: &Sides, control_of: impl Fn(DQuat, DQuat) -> DQuat) -> (DVec3, DVec3) {
    let q = sides.key;
    let (p, next) = (multiply(q, invert(sides.before)), multiply(q, sides.after));
    let a = control_of(q, bisect(double(p, q), next, q));
    let b = double(a, q);
    let to = |control: DQuat| logarithm(multiply(invert(q), control));
    (-to(b), to(a))
}

/// De Casteljau's construction on the sphere (Shoemake 1985).
fn bezier([q0, a, b, q1]: [DQuat; 4], t: f64) -> DQuat {
    let (first, second, third) = (slerp(q0, a, t), slerp(a, b, t), slerp(b, q1, t));
    slerp(slerp(first, second, t), slerp(second, third, t), t)
}

/// The control rotations `q, q exp(out), r exp(-in), r`.
fn controls(track: &ReferenceTrack, i: usize, out: DVec3, incoming: DVec3) -> [DQuat; 4] {
    let (q, r) = (track.keys[i], track.keys[i + 1]);
    [
        q,
        multiply(q, exponential(out)),
        multiply(r, exponential(-incoming)),
        r,
    ]
}

/// `2 (p·q) q - p`, such that `q` is half-way from `p` to it (Shoemake 1985).
fn double(p: DQuat, q: DQuat) -> DQuat {
    q * (2.0 * inner(p, q)) - p
}

/// `(p + q)/|p + q|`; `or` if the sum is almost zero.
fn bisect(p: DQuat, q: DQuat, or: DQuat) -> DQuat {
    let sum = p + q;
    if inner(sum, sum).sqrt() > 1e-12 {
        normalise(sum)
    } else {
        or
    }
}

/// The logarithm of `q`, of all its branches, that is nearest to `target`.
fn nearest_branch(q: DQuat, target: DVec3) -> DVec3 {
    let principal = logarithm_or(q, target);
    let axis = match principal.length() {
        length if length > 1e-9 => principal / length,
        _ => target.normalize_or_zero(),
    };
    let nearest = (target - principal).dot(axis) / std::f64::consts::TAU;
    principal + axis * (nearest.round() * std::f64::consts::TAU)
}
