//! A cubic in the rotation vector from a key: `base · exp(v₁ t + v₂ t² + v₃ t³)`.
//!
//! Numbers: the base and the three half-rotation vectors.

use crate::curve::formula::{Formula, NUMBERS, exp, quaternion, vector};
use crate::math::dual::Scalar;
use crate::math::quaternion::product;

pub(crate) struct RotationVector;

impl Formula for RotationVector {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let square = t * t;
        let first = vector(numbers, 4, t);
        let second = vector(numbers, 7, square);
        let third = vector(numbers, 10, square * t);
        let sum = [
            first[0] + second[0] + third[0],
            first[1] + second[1] + third[1],
            first[2] + second[2] + third[2],
        ];
        product(quaternion(numbers, 0), exp(sum))
    }
}
