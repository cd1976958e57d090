//! Spherical quadrangle interpolation (Shoemake 1987):
//! `slerp(slerp(q0, q1; t), slerp(s0, s1; t); 2t(1-t))`.
//!
//! Numbers: `q0`, `s0`, `s1`, `q1`. The arcs are those that the signs give.

use crate::curve::formula::{Formula, NUMBERS, quaternion, slerp};
use crate::math::dual::Scalar;

pub(crate) struct Squad;

impl Formula for Squad {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let along = slerp(quaternion(numbers, 0), quaternion(numbers, 12), t);
        let beside = slerp(quaternion(numbers, 4), quaternion(numbers, 8), t);
        let weight = S::all(2.0) * t * (S::all(1.0) - t);
        slerp(along, beside, weight)
    }
}
