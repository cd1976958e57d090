//! The shortest arcs between keys as they are stored, in vector lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use crate::branchless::{dot, unit};
use crate::cpu::arc;
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
    /// -1 where the second key's sign is turned.
    pub(crate) flips: [f32; LANES],
}

impl Default for ArcLanes {
    fn default() -> Self {
        Self {
            middles: [[0.0; LANES]; 4],
            tangents: [[0.0; LANES]; 4],
            flips: [1.0; LANES],
        }
    }
}

/// The arcs between the first `count` pairs of keys.
#[inline(always)]
pub(crate) fn arcs(from: &[[f32; 4]; LANES], to: &[[f32; 4]; LANES], count: usize) -> ArcLanes {
    // Arrays of its own: the compiler must see that they do not overlap.
    let [mut mx, mut my, mut mz, mut mw] = [[0.0; LANES]; 4];
    let [mut tx, mut ty, mut tz, mut tw] = [[0.0; LANES]; 4];
    let (mut flips, mut certain) = ([1.0; LANES], [1.0; LANES]);
    let mut doubtful = 0;
    for j in 0..whole(count) {
        let lane = arc_in_lanes(from[j], to[j]);
        [mx[j], my[j], mz[j], mw[j]] = lane.arc.middle;
        [tx[j], ty[j], tz[j], tw[j]] = lane.arc.tangent;
        flips[j] = lane.flip;
        certain[j] = lane.certain;
        doubtful += u32::from(lane.is_in_doubt());
    }
    let mut lanes = ArcLanes {
        middles: [mx, my, mz, mw],
        tangents: [tx, ty, tz, tw],
        flips,
    };
    if doubtful > 0 {
        for lane in (0..count).filter(|&lane| certain[lane] <= IN_DOUBT) {
            let (arc, flip) = arc_in_doubt(from[lane], to[lane]);
            lanes.flips[lane] = flip;
            for c in 0..4 {
                lanes.middles[c][lane] = arc.middle[c];
                lanes.tangents[c][lane] = arc.tangent[c];
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

/// An arc, unless it is in doubt which.
pub(crate) struct LaneArc {
    pub(crate) arc: ArcSegment,
    /// -1 where the second key's sign is turned.
    pub(crate) flip: f32,
    /// How far the keys are from a right angle.
    certain: f32,
}

impl LaneArc {
    #[inline(always)]
    pub(crate) fn is_in_doubt(&self) -> bool {
        self.certain <= IN_DOUBT
    }
}

/// The arc between two keys, for lanes.
#[inline(always)]
pub(crate) fn arc_in_lanes(from: [f32; 4], to: [f32; 4]) -> LaneArc {
    let dot = inner(from, to);
    let flip = if dot < 0.0 { -1.0 } else { 1.0 };
    LaneArc {
        arc: arc(
            from,
            [to[0] * flip, to[1] * flip, to[2] * flip, to[3] * flip],
        ),
        flip,
        certain: dot.abs(),
    }
}

/// The inner product in f32.
#[inline(always)]
fn inner(a: [f32; 4], b: [f32; 4]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// The arc between two keys that are nearly half a turn apart, and its second key's sign.
#[inline(never)]
pub(crate) fn arc_in_doubt(from: [f32; 4], to: [f32; 4]) -> (ArcSegment, f32) {
    let turns = dot(unit(from), unit(to)) < Path::Shortest.flips_below();
    let flip = if turns { -1.0 } else { 1.0 };
    (arc(from, to.map(|c| c * flip)), flip)
}

/// -1 where the shortest path from one key to the other turns the second one's sign.
#[inline]
pub(crate) fn flip(from: [f32; 4], to: [f32; 4]) -> f32 {
    let dot = inner(from, to);
    if dot.abs() <= IN_DOUBT {
        arc_in_doubt(from, to).1
    } else if dot < 0.0 {
        -1.0
    } else {
        1.0
    }
}

/// Whether the second key's sign is turned, or in doubt.
#[inline(always)]
pub(crate) fn may_turn(from: [f32; 4], to: [f32; 4]) -> bool {
    inner(from, to) <= IN_DOUBT
}

/// Whether the sign of any key after the first of some is turned, or in doubt.
#[inline(always)]
pub(crate) fn any_turns(keys: &[[f32; 4]]) -> bool {
    let intervals = keys.len().saturating_sub(1);
    let (from, to) = (&keys[..intervals], &keys[keys.len() - intervals..]);
    let mut turns = 0;
    for j in 0..intervals {
        turns |= u32::from(may_turn(from[j], to[j]));
    }
    turns != 0
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
