//! Twin of `shaders/evaluate_polynomial.wgsl`: the same names, the same order.

use glam::Vec4;

use super::evaluate::{COARSE, Evaluate, is_coarse};
use super::lanes::{Lanes, Number};
use crate::segment::PolynomialSegment;

impl Evaluate for PolynomialSegment {
    #[inline(always)]
    fn evaluate<L: Lanes>(&self, _: L, s: L) -> [L; 4] {
        // Written out: closures are not always inlined.
        macro_rules! component {
            ($c:literal, $($power:literal)+) => {
                polynomial([$(L::all(self.coefficients[$power][$c])),+], s)
            };
        }
        // A component at a time: with all four in a vector, coefficients need fewer
        // registers, but more than there are.
        L::transposed([
            component!(0, 0 1 2 3 4 5 6 7 8 9 10),
            component!(1, 0 1 2 3 4 5 6 7 8 9 10),
            component!(2, 0 1 2 3 4 5 6 7 8 9 10),
            component!(3, 0 1 2 3 4 5 6 7 8 9 10),
        ])
    }

    #[inline(always)]
    fn at(&self, s: f32) -> Vec4 {
        polynomial(self.coefficients.map(Vec4::from_array), Vec4::splat(s))
    }

    #[inline(always)]
    fn is_canonical(&self) -> bool {
        is_coarse(self.coefficients[0]) || self.is_coarse_or_zero()
    }
}

impl PolynomialSegment {
    /// As [`Evaluate::is_canonical`], where some middle is small.
    #[inline(never)]
    fn is_coarse_or_zero(&self) -> bool {
        let is_zero = |c: usize| {
            self.coefficients
                .iter()
                .all(|power| power[c].to_bits() == 0)
        };
        (0..4).all(|c| self.coefficients[0][c].abs() >= COARSE || is_zero(c))
    }
}

/// By the coefficients of 1, s, s², … s¹⁰.
#[inline(always)]
pub(super) fn polynomial<N: Number>(c: [N; 11], s: N) -> N {
    let z = s * s;
    let zz = z * z;
    let even_low = c[4] * z + c[2];
    let even_high = c[8] * z + c[6];
    let even = (c[10] * zz + even_high) * zz + even_low;
    let odd_low = c[3] * z + c[1];
    let odd_high = c[7] * z + c[5];
    let odd = (c[9] * zz + odd_high) * zz + odd_low;
    c[0] + (odd * s + even * z)
}
