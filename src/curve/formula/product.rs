//! Cubics in cumulative form (Kim, Kim, Shin 1995):
//! `base · exp(v₁ B₁(t)) · exp(v₂ B₂(t)) · exp(v₃ B₃(t))`.
//!
//! Numbers: the base, the three half-rotation vectors, and for each of the three
//! cumulative basis functions the coefficients of 1, t, t², t³.

use crate::curve::formula::{Formula, NUMBERS, Numbers, exp, quaternion, vector};
use crate::math::dual::Scalar;
use crate::math::quaternion::product;

pub(crate) struct Product;

impl Product {
    pub(crate) const VECTORS: usize = 4;
    pub(crate) const BASIS: usize = 13;

    /// The cumulative Bernstein basis, `1-(1-t)³`, `t²(3-2t)`, `t³`.
    pub(crate) const BERNSTEIN: [[f64; 4]; 3] = [
        [0.0, 3.0, -3.0, 1.0],
        [0.0, 0.0, 3.0, -2.0],
        [0.0, 0.0, 0.0, 1.0],
    ];

    /// The numbers of a curve with that basis; base and vectors are still 0.
    pub(crate) const WITH_BERNSTEIN: Numbers = {
        let mut numbers = [0.0; NUMBERS];
        let (_, basis) = numbers.split_at_mut(Self::BASIS);
        basis.copy_from_slice(Self::BERNSTEIN.as_flattened());
        numbers
    };
}

impl Formula for Product {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let factor = |j: usize| {
            let [c0, c1, c2, c3] = quaternion::<S>(numbers, Self::BASIS + 4 * j);
            let weight = ((c3 * t + c2) * t + c1) * t + c0;
            exp(vector(numbers, Self::VECTORS + 3 * j, weight))
        };
        let first = product(quaternion(numbers, 0), factor(0));
        product(product(first, factor(1)), factor(2))
    }
}
