//! Twin of `shaders/evaluate_polynomial.wgsl`: the same names, the same order.

use super::evaluate::Evaluate;
use crate::segment::PolynomialSegment;

impl Evaluate for PolynomialSegment {
    #[inline(always)]
    fn evaluate(&self, s: f32) -> [f32; 4] {
        let segment = self;
        let z = s * s;
        let step = |sum: [f32; 4], power: usize| -> [f32; 4] {
            std::array::from_fn(|i| sum[i] * z + segment.coefficients[power][i])
        };
        let mut even = segment.coefficients[10];
        let mut odd = segment.coefficients[9];
        even = step(even, 8);
        odd = step(odd, 7);
        even = step(even, 6);
        odd = step(odd, 5);
        even = step(even, 4);
        odd = step(odd, 3);
        even = step(even, 2);
        odd = step(odd, 1);
        even = step(even, 0);
        std::array::from_fn(|i| odd[i] * s + even[i])
    }
}

/// One component of it.
#[inline(always)]
pub(super) fn evaluate_component(coefficients: &[f32; 11], s: f32) -> f32 {
    let z = s * s;
    let step = |sum: f32, power: usize| sum * z + coefficients[power];
    let mut even = coefficients[10];
    let mut odd = coefficients[9];
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
