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
        let mut points = [
            quaternion(numbers, 0),
            quaternion(numbers, 12),
            quaternion(numbers, 4),
            quaternion(numbers, 8),
        ];
        let weight = S::all(2.0) * t * (S::all(1.0) - t);
        // One slerp in a loop is compiled once.
        for (from, to, along) in [(0, 1, t), (2, 3, t), (0, 2, weight)] {
            points[from] = slerp(points[from], points[to], along);
        }
        points[0]
    }
}
