//! The shortest arcs between keys as they are stored, in vector lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use crate::shader::ArcSegment;
use crate::simd::lanes::Lanes;
use crate::tracks::signs::IN_DOUBT;
use crate::tracks::signs::flip;
use crate::tracks::signs::inner;
use crate::twin::arc_between::arc_between;
use crate::twin::arc_between::middle_and_tangent;

/// Arcs worked out together.
pub(crate) const LANES: usize = 64;

/// A component of each quaternion in turn.
pub(crate) type Components = [[f32; LANES]; 4];

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

/// The arc between two keys, and the second one's sign; in f64 where they are nearly half a
/// turn apart.
#[inline(never)]
pub(crate) fn arc_anyhow(from: [f32; 4], to: [f32; 4]) -> (ArcSegment, f32) {
    let flip = flip(from, to);
    (arc_between(from, to.map(|c| c * flip)), flip)
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
