//! Bézier curves of rotations (Shoemake 1985): de Casteljau's construction with slerps.
//!
//! Numbers: the four control rotations. The arcs between them are those that their signs give.
//! Unlike in flat space, the two halves into which the construction cuts such a curve are not parts
//! of it.

use crate::curve::formula::{Formula, NUMBERS, quaternion, slerp};
use crate::math::dual::Scalar;

pub(crate) struct DeCasteljau;

impl Formula for DeCasteljau {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let mut points = [
            quaternion(numbers, 0),
            quaternion(numbers, 4),
            quaternion(numbers, 8),
            quaternion(numbers, 12),
        ];
        // One slerp in a loop is compiled once; six beside each other were a tenth of the engine's code.
        for left in [3, 2, 1] {
            for point in 0..left {
                points[point] = slerp(points[point], points[point + 1], t);
            }
        }
        points[0]
    }
}
