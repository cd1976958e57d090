//! The shortest arcs between keys as they are stored, in vector lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use crate::branchless::{dot, unit};
use crate::cpu::{Lanes, Number, arc, middle_and_tangent};
use crate::method::Path;
use crate::segment::ArcSegment;

/// Arcs worked out together.
pub(crate) const LANES: usize = 64;

/// A component of each quaternion in turn.
pub(crate) type Components = [[f32; LANES]; 4];

/// What f32 makes of the inner product of two keys is within 1e-6 of it: beyond this its
/// sign is not in doubt.
const IN_DOUBT: f32 = 1e-5;

/// Arcs, components side by side.
pub(crate) struct ArcLanes {
    pub(crate) middles: Components,
    pub(crate) tangents: Components,
}

impl Default for ArcLanes {
    fn default() -> Self {
        Self {
            middles: [[0.0; LANES]; 4],
            tangents: [[0.0; LANES]; 4],
        }
    }
}

/// The arcs between the first `count` pairs of keys.
#[inline(always)]
pub(crate) fn arcs<L: Lanes>(
    from: &[[f32; 4]; LANES],
    to: &[[f32; 4]; LANES],
    count: usize,
) -> ArcLanes {
    let mut lanes = ArcLanes::default();
    for j in (0..count).step_by(L::COUNT) {
        let (start, end) = (L::load_rotations(&from[j..]), L::load_rotations(&to[j..]));
        let vector = arc_in_lanes(start, end);
        for c in 0..4 {
            vector.middle[c].store(&mut lanes.middles[c][j..j + L::COUNT]);
            vector.tangent[c].store(&mut lanes.tangents[c][j..j + L::COUNT]);
        }
        if vector.any_in_doubt {
            for lane in j..j + L::COUNT {
                let (arc, _) = arc_anyhow(from[lane], to[lane]);
                for c in 0..4 {
                    lanes.middles[c][lane] = arc.middle[c];
                    lanes.tangents[c][lane] = arc.tangent[c];
                }
            }
        }
    }
    lanes
}

/// Lanes to work out for so many: whole vectors, or those left over would be done one by
/// one.
#[inline(always)]
pub(crate) fn whole(count: usize) -> usize {
    count.next_multiple_of(16).min(LANES)
}

/// Arcs, a lane to each.
pub(crate) struct LaneArcs<L> {
    pub(crate) middle: [L; 4],
    pub(crate) tangent: [L; 4],
    /// -1 where the second key's sign is turned.
    pub(crate) flip: L,
    /// Whether f32 leaves it in doubt for any which arc it is: [`arc_anyhow`] knows.
    pub(crate) any_in_doubt: bool,
}

/// The arcs between as many pairs of keys as a vector has lanes.
#[inline(always)]
pub(crate) fn arc_in_lanes<L: Lanes>(from: [L; 4], to: [L; 4]) -> LaneArcs<L> {
    let dot = inner(from, to);
    let flip = dot.sign();
    let end = [to[0] * flip, to[1] * flip, to[2] * flip, to[3] * flip];
    let (middle, tangent) = middle_and_tangent(from, end);
    LaneArcs {
        middle,
        tangent,
        flip,
        any_in_doubt: dot.any_within(IN_DOUBT),
    }
}

/// The inner product in f32.
#[inline(always)]
fn inner<N: Number>(a: [N; 4], b: [N; 4]) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// The arc between two keys, and the second one's sign; in f64 where they are nearly half a
/// turn apart.
#[inline(never)]
pub(crate) fn arc_anyhow(from: [f32; 4], to: [f32; 4]) -> (ArcSegment, f32) {
    let flip = flip(from, to);
    (arc(from, to.map(|c| c * flip)), flip)
}

/// -1 where the shortest path from one key to the other turns the second one's sign.
#[inline]
pub(crate) fn flip(from: [f32; 4], to: [f32; 4]) -> f32 {
    let inner = inner(from, to);
    let turns = if inner.abs() <= IN_DOUBT {
        dot(unit(from), unit(to)) < Path::Shortest.flips_below()
    } else {
        inner < 0.0
    };
    if turns { -1.0 } else { 1.0 }
}

/// Whether the second key's sign is turned, or in doubt.
#[inline(always)]
pub(crate) fn may_turn(from: [f32; 4], to: [f32; 4]) -> bool {
    inner(from, to) <= IN_DOUBT
}

/// Whether the sign of any key after the first of some is turned, or in doubt.
#[inline(always)]
pub(crate) fn any_turns<L: Lanes>(keys: &[[f32; 4]]) -> bool {
    let mut first = 0;
    while first + L::COUNT < keys.len() {
        if L::inner(&keys[first..], &keys[first + 1..]).any_at_most(IN_DOUBT) {
            return true;
        }
        first += L::COUNT;
    }
    let rest = keys[first..].windows(2);
    rest.into_iter().any(|pair| may_turn(pair[0], pair[1]))
}

impl ArcLanes {
    /// The squares of the arcs' angles in R⁴.
    #[inline(always)]
    pub(crate) fn squares(&self) -> [f32; LANES] {
        let [x, y, z, w] = &self.tangents;
        let mut squares = [0.0; LANES];
        for j in 0..LANES {
            squares[j] = x[j] * x[j] + y[j] * y[j] + z[j] * z[j] + w[j] * w[j];
        }
        squares
    }
}
