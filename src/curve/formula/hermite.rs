//! Curves in the four components: straight lines, and the cubics of glTF.

use crate::curve::formula::{Formula, NUMBERS, normalised, quaternion, weighted};
use crate::math::dual::Scalar;

/// `((1-t) q0 + t q1) / |…|`. Numbers: `q0`, two quaternions that are not used, `q1`.
pub(crate) struct Linear;

impl Formula for Linear {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let rest = S::all(1.0) - t;
        normalised(weighted(
            quaternion(numbers, 0),
            rest,
            quaternion(numbers, 12),
            t,
        ))
    }
}

/// A straight line, not normalised. Numbers: its value at 0, and its slope.
pub(crate) struct Line;

impl Formula for Line {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let start = quaternion(numbers, 0);
        weighted(start, S::all(1.0), quaternion(numbers, 4), t)
    }
}

/// `((2t³-3t²+1) q0 + (t³-2t²+t) m0 + (3t²-2t³) q1 + (t³-t²) m1) / |…|`.
///
/// Numbers: `q0`, `m0`, `m1`, `q1`; the tangents are multiplied by the interval's length.
pub(crate) struct Hermite;

impl Formula for Hermite {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let one = S::all(1.0);
        let rest = one - t;
        let two = S::all(2.0);
        let start = (one + two * t) * rest * rest;
        let end = t * t * (S::all(3.0) - two * t);
        let leaving = t * rest * rest;
        let arriving = t * t * (t - one);
        let keys = weighted(quaternion(numbers, 0), start, quaternion(numbers, 12), end);
        let tangents = weighted(
            quaternion(numbers, 4),
            leaving,
            quaternion(numbers, 8),
            arriving,
        );
        normalised(weighted(keys, one, tangents, one))
    }
}
