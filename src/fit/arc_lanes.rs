//! Arcs between pairs of keys in vector lanes. The second key of each pair has the sign that is
//! nearer to the first.

use crate::simd::lanes::Lanes;
use crate::twin::arc_between::arc_between;

/// The most arcs that are computed together.
pub(crate) const LANES: usize = 64;

/// The number of lanes to compute for `count` arcs, rounded up to whole vectors: the lanes of a
/// partly filled vector would be computed one by one.
#[inline(always)]
pub(crate) fn whole(count: usize) -> usize {
    count.next_multiple_of(16).min(LANES)
}

/// Quaternions as a structure of arrays: x of every lane, then y, z and w.
pub(crate) type Components = [[f32; LANES]; 4];

/// Arcs by the rotation at their middle and their tangent there.
pub(crate) struct ArcLanes {
    pub(crate) middles: Components,
    pub(crate) tangents: Components,
}

/// The arcs between the first `count` pairs of keys.
#[inline(always)]
pub(crate) fn arcs<L: Lanes>(
    from: &[[f32; 4]; LANES],
    to: &[[f32; 4]; LANES],
    count: usize,
) -> ArcLanes {
    let mut lanes = ArcLanes {
        middles: [[0.0; LANES]; 4],
        tangents: [[0.0; LANES]; 4],
    };
    for j in (0..count).step_by(L::COUNT) {
        let (start, end) = (L::load_rotations(&from[j..]), L::load_rotations(&to[j..]));
        let (middle, tangent) = arc_between(start, end);
        for c in 0..4 {
            middle[c].store(&mut lanes.middles[c][j..j + L::COUNT]);
            tangent[c].store(&mut lanes.tangents[c][j..j + L::COUNT]);
        }
    }
    lanes
}

impl ArcLanes {
    /// The squares of the arcs' angles in R⁴.
    // The compiler vectorises this loop over lanes, which indexes several arrays at once.
    #[allow(clippy::needless_range_loop)]
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
