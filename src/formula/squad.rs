//! Spherical quadrangle interpolation (Shoemake 1987):
//! `slerp(slerp(q0, q1; t), slerp(s0, s1; t); 2t(1-t))`.
//!
//! Numbers: `q0`, `s0`, `s1`, `q1`. The arcs are those that the signs give.

use super::{Formula, Numbers, quaternion, slerp};
use crate::scalar::Scalar;

pub(crate) struct Squad;

impl Formula for Squad {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &Numbers, t: S) -> [S; 4] {
        let along = slerp(quaternion(numbers, 0), quaternion(numbers, 12), t);
        let beside = slerp(quaternion(numbers, 4), quaternion(numbers, 8), t);
        let weight = S::constant(2.0) * t * (S::constant(1.0) - t);
        slerp(along, beside, weight)
    }
}
