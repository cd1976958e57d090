//! Curves that depend only on two keys, with their tangents and velocities.

use glam::DQuat;

use crate::curve::options::Ends;
use crate::reference::curve::Definition;
use crate::reference::quaternion::{nlerp, normalise};
use crate::reference::segment::{Segment, cumulative, hermite};
use crate::reference::track::ReferenceTrack;

/// The definitions of this file.
pub(super) const DEFINITIONS: &[Definition] = &[STEP, NLERP, SLERP, HERMITE, GLTF_CUBIC];

/// Steps: the previous key.
pub(crate) const STEP: Definition = Definition::new("step", |track, _| {
    each(track, |i| Segment::Constant(track.keys[i]))
});

/// Straight lines between keys, normalised.
pub(crate) const NLERP: Definition = Definition::new("nlerp", |track, _| {
    let line = |[from, to, ..]: [DQuat; 4], t| nlerp(from, to, t);
    each(track, |i| {
        Segment::Between(
            line,
            [
                track.keys[i],
                track.keys[i + 1],
                DQuat::IDENTITY,
                DQuat::IDENTITY,
            ],
        )
    })
});

/// Great arcs between keys.
pub(crate) const SLERP: Definition = Definition::new("slerp", |track, _| {
    each(track, |i| Segment::Arc(track.keys[i], track.keys[i + 1]))
});

/// A cumulative cubic with the keys' velocities.
pub(crate) const HERMITE: Definition = Definition::new("hermite", |track, _| {
    each(track, |i| {
        let handle = |key: usize| {
            let velocity = track.velocities.get(key).copied().unwrap_or_default();
            velocity / 2.0 * track.step(i) / 3.0
        };
        cumulative(track, i, handle(i), handle(i + 1))
    })
});

/// Cubics in the components, with the keys' tangents, normalised.
pub(crate) const GLTF_CUBIC: Definition = Definition::new("gltf-cubic", |track, _| {
    each(track, |i| {
        let tangent = |key: usize, side: usize| match track.tangents.get(key) {
            Some(both) => both[side].as_dquat() * track.step(i),
            None => DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        };
        let (from, to) = (track.keys[i], track.keys[i + 1]);
        Segment::Between(cubic, [from, tangent(i, 1), tangent(i + 1, 0), to])
    })
});

/// Hermite's cubic in each component, from keys and tangents `p0 m0 m1 p1`, normalised (glTF 2.0, appendix C.5). The
/// tangents are multiplied by the interval's length.
fn cubic([p0, m0, m1, p1]: [DQuat; 4], t: f64) -> DQuat {
    let [from, out, to, incoming] = hermite(t);
    normalise(p0 * from + m0 * out + p1 * to + m1 * incoming)
}

/// The curves of all intervals.
pub(crate) fn each(track: &ReferenceTrack, curve: impl Fn(usize) -> Segment) -> Vec<Segment> {
    (0..track.last()).map(curve).collect()
}

/// The curves of all intervals; with [`Ends::Frozen`] the first and the last are constant.
pub(crate) fn with_frozen_ends(
    track: &ReferenceTrack,
    ends: Ends,
    curve: impl Fn(usize) -> Segment,
) -> Vec<Segment> {
    each(track, |i| {
        let last = track.last() - 1;
        if ends == Ends::Frozen && last > 0 && (i == 0 || i == last) {
            return Segment::Constant(track.keys[i]);
        }
        curve(i)
    })
}

/// As [`with_frozen_ends`]; a track of only two keys is an arc.
pub(crate) fn smooth(
    track: &ReferenceTrack,
    ends: Ends,
    curve: impl Fn(usize) -> Segment,
) -> Vec<Segment> {
    with_frozen_ends(track, ends, |i| match track.last() {
        1 => Segment::Arc(track.keys[0], track.keys[1]),
        _ => curve(i),
    })
}
