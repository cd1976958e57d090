//! Arcs between keys that have the sign nearer to each other, in vector lanes.

use crate::simd::lanes::Lanes;
use crate::twin::arc_between::arc_between;

/// Arcs worked out together.
pub(crate) const LANES: usize = 64;

/// Lanes to work out for so many arcs: whole vectors, or those left over would be done one by
/// one.
#[inline(always)]
pub(crate) fn whole(count: usize) -> usize {
    count.next_multiple_of(16).min(LANES)
}

/// A component of each quaternion in turn.
pub(crate) type Components = [[f32; LANES]; 4];

/// Arcs, components side by side.
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
    // A loop over lanes that the compiler makes vectors of indexes many arrays at once.
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
