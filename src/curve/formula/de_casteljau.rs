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
        let (q0, a) = (quaternion(numbers, 0), quaternion(numbers, 4));
        let (b, q1) = (quaternion(numbers, 8), quaternion(numbers, 12));
        let middle = slerp(a, b, t);
        let left = slerp(slerp(q0, a, t), middle, t);
        let right = slerp(middle, slerp(b, q1, t), t);
        slerp(left, right, t)
    }
}
