//! Twin of `shaders/evaluate_polynomial.wgsl`: the same names, the same order.

use super::evaluate::{BLOCK, Evaluate, RoomFor};
use crate::segment::PolynomialSegment;

impl Evaluate for PolynomialSegment {
    type Room = RoomFor<BLOCK>;

    #[inline(always)]
    fn evaluate(&self, _: f32, s: f32) -> [f32; 4] {
        let segment = self;
        std::array::from_fn(|i| component(|power| segment.coefficients[power][i], s))
    }
}

/// One component of a rotation, whose coefficients are asked for by their power.
#[inline(always)]
pub(super) fn component(coefficient: impl Fn(usize) -> f32, s: f32) -> f32 {
    let z = s * s;
    let step = |sum: f32, power: usize| sum * z + coefficient(power);
    let mut even = coefficient(10);
    let mut odd = coefficient(9);
    even = step(even, 8);
    odd = step(odd, 7);
    even = step(even, 6);
    odd = step(odd, 5);
    even = step(even, 4);
    odd = step(odd, 3);
    even = step(even, 2);
    odd = step(odd, 1);
    even = step(even, 0);
    odd * s + even
}
