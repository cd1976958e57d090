//! A straight line in the four components, not normalised. Numbers: its value at 0, and its slope.

use crate::curve::formula::{Formula, NUMBERS, quaternion, weighted};
use crate::math::dual::Scalar;

pub(crate) struct Line;

impl Formula for Line {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let start = quaternion(numbers, 0);
        weighted(start, S::all(1.0), quaternion(numbers, 4), t)
    }
}
