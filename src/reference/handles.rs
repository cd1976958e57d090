//! Cubic methods that say where the handles of a key are: the incoming and the outgoing one, with
//! control rotations `q_i exp(-in)` and `q_i exp(out)`.

use glam::{DQuat, DVec3};

use crate::curve::options::Ends;
use crate::reference::curve::Definition;
use crate::reference::given::smooth;
use crate::reference::quaternion::{
    exponential, inner, invert, logarithm, logarithm_or, multiply, normalise, slerp,
};
use crate::reference::segment::{Basis, Segment};
use crate::reference::track::Track;
use crate::tracks::key_data::Tcb;

/// A cumulative cubic with tangents from the neighbouring keys.
pub(crate) const CATMULL_ROM: Definition = Definition::new(segments::<CatmullRom>);
/// A cumulative cubic with tangents of the parabola through three keys.
pub(crate) const BESSEL_OVERHAUSER: Definition = Definition::new(segments::<BesselOverhauser>);
/// Bézier curves with the mean of the logarithms of the slopes.
pub(crate) const BESSEL_OVERHAUSER_MEAN: Definition = Definition::new(segments::<Mean>);
/// Bézier curves with tension, continuity and bias.
pub(crate) const KOCHANEK_BARTELS: Definition = Definition::new(segments::<KochanekBartels>);
/// Spherical quadrangles.
pub(crate) const SQUAD: Definition = Definition::new(segments::<Squad>);
/// Bézier curves, their control rotations the bisectors.
pub(crate) const SHOEMAKE: Definition = Definition::new(segments::<Shoemake>);
/// Bézier curves, their control rotations half way to the bisectors.
pub(crate) const SHOEMAKE_2: Definition = Definition::new(segments::<Shoemake2>);
/// Bézier curves, their control rotations a third of the way to the bisectors.
pub(crate) const SHOEMAKE_1985: Definition = Definition::new(segments::<Shoemake1985>);

/// What one method says of handles.
trait Handles {
    /// The incoming and the outgoing handle of the key between two intervals.
    fn inner(track: &Track, key: usize, sides: &Sides) -> (DVec3, DVec3);

    /// The handle of an end of the track whose interval turns by `whole`, where `other` is the
    /// handle at the other end of the interval.
    fn parabolic(whole: DVec3, other: DVec3) -> DVec3 {
        2.0 / 3.0 * whole - other
    }

    /// The same for ends without angular acceleration; `rest` is what is left of the interval
    /// without the other handle.
    fn natural(rest: DVec3, _other: DVec3) -> DVec3 {
        rest / 2.0
    }

    /// The same for an end that turns as if by `turn` in the whole interval.
    fn turning(turn: DVec3, _whole: DVec3) -> DVec3 {
        turn / 3.0
    }

    /// The curve of an interval with these handles.
    fn segment(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> Segment {
        Segment::Bezier(controls(track, i, out, incoming))
    }
}

/// The intervals before and after a key: what they turn by, its logarithms and their times.
struct Sides {
    before: DQuat,
    after: DQuat,
    l: DVec3,
    r: DVec3,
    h_before: f64,
    h_after: f64,
    both: f64,
}

impl Sides {
    fn new(track: &Track, key: usize) -> Self {
        let (before, h_before) = track.side(key, true);
        let (after, h_after) = track.side(key, false);
        Self {
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

struct CatmullRom;

impl Handles for CatmullRom {
    fn inner(_: &Track, _: usize, sides: &Sides) -> (DVec3, DVec3) {
        let sum = sides.l + sides.r;
        let sixth = logarithm_or(multiply(sides.before, sides.after), sum) / 6.0;
        (sixth, sixth)
    }

    fn segment(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> Segment {
        cumulative(track, i, out, incoming)
    }
}

struct BesselOverhauser;

impl Handles for BesselOverhauser {
    fn inner(_: &Track, _: usize, sides: &Sides) -> (DVec3, DVec3) {
        let (before, after) = (sides.h_before, sides.h_after);
        let (left, right) = (sides.l * (after / before), sides.r * (before / after));
        let product = multiply(exponential(left), exponential(right));
        let tangent = nearest_branch(product, left + right) / sides.both;
        (tangent * (before / 3.0), tangent * (after / 3.0))
    }

    fn segment(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> Segment {
        cumulative(track, i, out, incoming)
    }
}

struct Mean;

impl Handles for Mean {
    fn inner(_: &Track, _: usize, sides: &Sides) -> (DVec3, DVec3) {
        let (before, after) = (sides.h_before, sides.h_after);
        let mean = (sides.l * (after / before) + sides.r * (before / after)) / sides.both;
        (mean * (before / 3.0), mean * (after / 3.0))
    }
}

struct KochanekBartels;

impl Handles for KochanekBartels {
    fn inner(track: &Track, key: usize, sides: &Sides) -> (DVec3, DVec3) {
        let Tcb {
            tension,
            continuity,
            bias,
        } = track.tcb[key];
        let (before, after) = (sides.h_before, sides.h_after);
        let tight = 1.0 - tension;
        // The names are those of Geier's documentation of `splines`.
        let a = tight * (1.0 + continuity) * (1.0 + bias);
        let b = tight * (1.0 - continuity) * (1.0 - bias);
        let c = tight * (1.0 - continuity) * (1.0 + bias);
        let d = tight * (1.0 + continuity) * (1.0 - bias);
        let (rate_in, rate_out) = (sides.l / before, sides.r / after);
        let mean = |u: f64, v: f64| (u * after * rate_in + v * before * rate_out) / sides.both;
        (mean(c, d) * before / 3.0, mean(a, b) * after / 3.0)
    }
}

struct Squad;

impl Handles for Squad {
    fn inner(_: &Track, _: usize, &Sides { l, r, .. }: &Sides) -> (DVec3, DVec3) {
        ((r - l) / 4.0, (l - r) / 4.0)
    }

    fn parabolic(_: DVec3, other: DVec3) -> DVec3 {
        -other
    }

    fn natural(_: DVec3, other: DVec3) -> DVec3 {
        -other / 2.0
    }

    /// A squad starts with `log(q0⁻¹ q1) + 2 log(q0⁻¹ s0)`.
    fn turning(turn: DVec3, whole: DVec3) -> DVec3 {
        (turn - whole) / 2.0
    }

    fn segment(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> Segment {
        Segment::Squad(controls(track, i, out, incoming))
    }
}

struct Shoemake;

impl Handles for Shoemake {
    fn inner(track: &Track, key: usize, sides: &Sides) -> (DVec3, DVec3) {
        shoemake(track.keys[key], sides, |_, bisector| bisector)
    }

    fn parabolic(whole: DVec3, other: DVec3) -> DVec3 {
        2.0 * whole - other
    }
}

struct Shoemake2;

impl Handles for Shoemake2 {
    fn inner(track: &Track, key: usize, sides: &Sides) -> (DVec3, DVec3) {
        shoemake(track.keys[key], sides, |q, bisector| bisect(q, bisector, q))
    }

    fn parabolic(whole: DVec3, other: DVec3) -> DVec3 {
        whole - other
    }
}

struct Shoemake1985;

impl Handles for Shoemake1985 {
    fn inner(track: &Track, key: usize, sides: &Sides) -> (DVec3, DVec3) {
        shoemake(track.keys[key], sides, |q, bisector| {
            slerp(q, bisector, 1.0 / 3.0)
        })
    }
}

/// Handles whose outgoing control rotation `place` finds between the key `q` and the bisector of
/// its neighbours.
fn shoemake(q: DQuat, sides: &Sides, place: impl Fn(DQuat, DQuat) -> DQuat) -> (DVec3, DVec3) {
    let (p, next) = (multiply(q, invert(sides.before)), multiply(q, sides.after));
    let a = place(q, bisect(double(p, q), next, q));
    let b = double(a, q);
    let to = |control: DQuat| logarithm(multiply(invert(q), control));
    (-to(b), to(a))
}

/// The curves of a track by a method's handles.
fn segments<H: Handles>(track: &Track, ends: Ends) -> Vec<Segment> {
    smooth(track, ends, |i| {
        let [out, incoming] = both_handles::<H>(track, ends, i);
        H::segment(track, i, out, incoming)
    })
}

/// The handles of an interval: outgoing from its first key, incoming to its second.
fn both_handles<H: Handles>(track: &Track, ends: Ends, i: usize) -> [DVec3; 2] {
    let last = track.last() - 1;
    let closed = ends == Ends::Loop;
    let handles = |key: usize| H::inner(track, key, &Sides::new(track, key));
    let out = (closed || i > 0).then(|| handles(i).1);
    let incoming = (closed || i < last).then(|| handles(i + 1).0);
    let (q, r) = (track.keys[i], track.keys[i + 1]);
    let whole = logarithm(track.difference(i));
    let at_end = |other: DVec3, clamped: Option<DVec3>, rest: DQuat| match (ends, clamped) {
        (Ends::Secant, _) => H::turning(whole, whole),
        // Half of the angle that the end turns by in the whole interval.
        (_, Some(velocity)) => H::turning(velocity / 2.0 * track.step(i), whole),
        (Ends::Natural, None) => H::natural(logarithm(rest), other),
        _ => H::parabolic(whole, other),
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

/// The control rotations `q, q exp(out), r exp(-in), r`.
fn controls(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> [DQuat; 4] {
    let (q, r) = (track.keys[i], track.keys[i + 1]);
    [
        q,
        multiply(q, exponential(out)),
        multiply(r, exponential(-incoming)),
        r,
    ]
}

/// The cumulative cubic with these handles.
pub(crate) fn cumulative(track: &Track, i: usize, out: DVec3, incoming: DVec3) -> Segment {
    let a = multiply(track.keys[i], exponential(out));
    let b = multiply(track.keys[i + 1], exponential(-incoming));
    Segment::Product {
        base: track.keys[i],
        w: [out, logarithm(multiply(invert(a), b)), incoming],
        basis: Basis::Bernstein,
    }
}

/// `2 (p·q) q - p`: as far beyond `q` as `p` is before it (Shoemake 1985).
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

/// The logarithm of `q` nearest to `target` among all of its branches.
fn nearest_branch(q: DQuat, target: DVec3) -> DVec3 {
    let principal = logarithm_or(q, target);
    let axis = match principal.length() {
        length if length > 1e-9 => principal / length,
        _ => target.normalize_or_zero(),
    };
    let nearest = (target - principal).dot(axis) / std::f64::consts::TAU;
    principal + axis * (nearest.round() * std::f64::consts::TAU)
}
