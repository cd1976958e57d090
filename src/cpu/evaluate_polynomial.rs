//! Twin of `shaders/evaluate_polynomial.wgsl`: the same names, the same order.

use super::evaluate::{BLOCK, Evaluate, RoomFor};
use crate::segment::PolynomialSegment;

impl Evaluate for PolynomialSegment {
    type Room = RoomFor<BLOCK>;

    #[inline(always)]
    fn evaluate(&self, _: f32, s: f32) -> [f32; 4] {
        // Written out: closures are not always inlined.
        let c = &self.coefficients;
        let z = s * s;
        let (mut even, mut odd) = (c[10], c[9]);
        macro_rules! step {
            ($sum:ident, $power:literal) => {
                $sum = [
                    $sum[0] * z + c[$power][0],
                    $sum[1] * z + c[$power][1],
                    $sum[2] * z + c[$power][2],
                    $sum[3] * z + c[$power][3],
                ];
            };
        }
        step!(even, 8);
        step!(odd, 7);
        step!(even, 6);
        step!(odd, 5);
        step!(even, 4);
        step!(odd, 3);
        step!(even, 2);
        step!(odd, 1);
        step!(even, 0);
        [
            odd[0] * s + even[0],
            odd[1] * s + even[1],
            odd[2] * s + even[2],
            odd[3] * s + even[3],
        ]
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
