//! Arcs between keys as they are stored, in vector lanes.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use crate::branchless::{angle_by_sine, dot, norm, unit};
use crate::cpu::arc;
use crate::method::Path;
use crate::numeric::{canonical, round_f32};
use crate::segment::ArcSegment;

/// Arcs worked out together.
pub(crate) const LANES: usize = 64;

/// A component of each quaternion in turn.
pub(crate) type Components = [[f32; LANES]; 4];

/// What f32 makes of the inner product of two keys is within 1e-6 of it: beyond this its
/// sign is not in doubt.
pub(crate) const IN_DOUBT: f32 = 1e-5;

/// Arcs, components side by side.
pub(crate) struct ArcLanes {
    pub(crate) middles: Components,
    pub(crate) tangents: Components,
    /// -1 where the second key's sign is turned.
    pub(crate) flips: [f32; LANES],
    /// The first lane that has no path between its keys.
    pub(crate) refused: Option<usize>,
}

impl Default for ArcLanes {
    fn default() -> Self {
        Self {
            middles: [[0.0; LANES]; 4],
            tangents: [[0.0; LANES]; 4],
            flips: [1.0; LANES],
            refused: None,
        }
    }
}

/// The arcs between the first `count` pairs of keys.
#[inline(always)]
pub(crate) fn arcs(
    from: &[[f32; 4]; LANES],
    to: &[[f32; 4]; LANES],
    count: usize,
    path: Path,
) -> ArcLanes {
    // Arrays of its own: the compiler must see that they do not overlap.
    let [mut mx, mut my, mut mz, mut mw] = [[0.0; LANES]; 4];
    let [mut tx, mut ty, mut tz, mut tw] = [[0.0; LANES]; 4];
    let (mut flips, mut certain) = ([1.0; LANES], [1.0; LANES]);
    let mut doubtful = 0;
    for j in 0..whole(count) {
        let near = near_arc(from[j], to[j], path);
        [mx[j], my[j], mz[j], mw[j]] = near.arc.middle;
        [tx[j], ty[j], tz[j], tw[j]] = near.arc.tangent;
        flips[j] = near.flip;
        certain[j] = near.certain;
        doubtful += u32::from(near.certain <= IN_DOUBT);
    }
    let mut lanes = ArcLanes {
        middles: [mx, my, mz, mw],
        tangents: [tx, ty, tz, tw],
        flips,
        refused: None,
    };
    if doubtful > 0 {
        for lane in (0..count).filter(|&lane| certain[lane] <= IN_DOUBT) {
            let any = any_arc(from[lane], to[lane], path);
            if any.is_refused {
                lanes.refused = lanes.refused.or(Some(lane));
            }
            lanes.flips[lane] = any.flip;
            for c in 0..4 {
                lanes.middles[c][lane] = any.arc.middle[c];
                lanes.tangents[c][lane] = any.arc.tangent[c];
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

/// An arc that holds where nothing is in doubt.
pub(crate) struct NearArc {
    pub(crate) arc: ArcSegment,
    /// -1 where the second key's sign is turned.
    pub(crate) flip: f32,
    /// It is in doubt where this is not above [`IN_DOUBT`].
    pub(crate) certain: f32,
}

/// The arc between two keys, in lanes.
#[inline(always)]
pub(crate) fn near_arc(from: [f32; 4], to: [f32; 4], path: Path) -> NearArc {
    let dot = from[0] * to[0] + from[1] * to[1] + from[2] * to[2] + from[3] * to[3];
    let flip = if dot < 0.0 { -1.0 } else { 1.0 };
    let turns = path == Path::Shortest;
    NearArc {
        arc: arc(
            from,
            [to[0] * flip, to[1] * flip, to[2] * flip, to[3] * flip],
        ),
        flip,
        certain: if turns { dot.abs() } else { dot },
    }
}

/// -1 where the path from one key to the other turns the second one's sign.
#[inline]
pub(crate) fn flip(from: [f32; 4], to: [f32; 4], path: Path) -> f32 {
    let near = near_arc(from, to, path);
    if near.certain > IN_DOUBT {
        near.flip
    } else {
        any_arc(from, to, path).flip
    }
}

/// An arc between any keys.
pub(crate) struct AnyArc {
    pub(crate) arc: ArcSegment,
    pub(crate) flip: f32,
    /// There is no path between the keys.
    pub(crate) is_refused: bool,
}

/// The arc between keys that are nearly pi/2 apart in R⁴, or farther and joined all the
/// same.
#[inline(never)]
pub(crate) fn any_arc(from: [f32; 4], to: [f32; 4], path: Path) -> AnyArc {
    let dot = inner_product(from, to);
    let flip = if dot < path.flips_below() { -1.0 } else { 1.0 };
    let to = to.map(|c| c * flip);
    AnyArc {
        arc: if dot * f64::from(flip) < -f64::from(IN_DOUBT) {
            wide_arc(from, to)
        } else {
            arc(from, to)
        },
        flip,
        is_refused: path.refuses(dot),
    }
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

/// The inner product of two keys as stored.
pub(crate) fn inner_product(from: [f32; 4], to: [f32; 4]) -> f64 {
    dot(unit(from), unit(to))
}

/// The arc between two keys that are more than pi/2 apart in R⁴, in f64.
fn wide_arc(from: [f32; 4], to: [f32; 4]) -> ArcSegment {
    let (a, b) = (unit(from), unit(to));
    let sum = [b[0] + a[0], b[1] + a[1], b[2] + a[2], b[3] + a[3]];
    // 2 cos of half the angle between them.
    let cosine = norm(sum);
    let lengthening = angle_by_sine(1.0 - 0.5 * cosine);
    ArcSegment {
        middle: sum.map(|c| canonical(round_f32(c / cosine))),
        tangent: std::array::from_fn(|i| canonical(round_f32((b[i] - a[i]) * lengthening))),
    }
}
