//! Exponentials and logarithms in f32 vector lanes, and rows of f32 numbers.

use crate::fit::block::{ROW_LEN, widened};
use crate::math::quaternion::{Real as _, exp_by, scaled, square, sum};
use crate::math::ranges::MEDIUM_WAVES;
use crate::simd::lanes::{Lanes, Number};
use crate::twin::sine_cosine::{sine_cosm1, sine_cosm1_quarter};
use crate::twin::small_angle::FromIdentity;

/// One f32 for each lane of a block.
pub(crate) type RowF32 = [f32; ROW_LEN];

/// The coefficients of `(x / sin(x) - 1) / u` in powers of u = 1 - cos(x): [`LOG`] for u up to
/// 1/2, [`LONG_LOG`] up to 1. From Chebyshev nodes, within 3.5e-8.
pub(crate) const LOG: [f32; 6] = [
    0.333_333_28,
    0.133_339_27,
    0.057_006_53,
    0.026_519_666,
    0.007_495_316,
    0.011_555_838,
];
pub(crate) const LONG_LOG: [f32; 10] = [
    0.333_333_34,
    0.133_334_32,
    0.057_110_59,
    0.025_800_379,
    0.009_014_793,
    0.014_275_147,
    -0.016_298_994,
    0.024_591_85,
    -0.015_747_076,
    0.005_381_98,
];

/// The exponential of a half-rotation vector up to pi/4, as its difference from the identity.
#[inline(always)]
pub(crate) fn short_exp<N: Number>(v: [N; 3]) -> FromIdentity<N> {
    exp_from_identity(v, sine_cosm1_quarter(N::all(1.0), square(v)))
}

/// The same for half-angles up to pi/2.
#[inline(always)]
pub(crate) fn long_exp<N: Number>(v: [N; 3]) -> FromIdentity<N> {
    exp_from_identity(v, sine_cosm1(N::all(1.0), square(v)))
}

/// As [`exp_by`], with the cosine minus one.
#[inline(always)]
fn exp_from_identity<N: Number>(v: [N; 3], (sinc, cosm1): (N, N)) -> FromIdentity<N> {
    FromIdentity {
        vector: scaled(v, sinc),
        cosm1,
    }
}

/// The exponential of `times` a vector, in f64: within 7e-9 for squared lengths up to
/// the limit of [`MEDIUM_WAVES`].
#[inline(always)]
pub(crate) fn medium_exp<L: Lanes>(v: [L; 3], times: f32) -> [L::Doubles; 4] {
    let vector = scaled(widened(v), L::Doubles::all(f64::from(times)));
    exp_by(vector, MEDIUM_WAVES.of(square(vector)))
}

/// The logarithm, by [`LOG`] or [`LONG_LOG`], each within its range.
#[inline(always)]
pub(crate) fn log<N: Number, const COUNT: usize>(
    rotation: FromIdentity<N>,
    coefficients: &[f32; COUNT],
) -> [N; 3] {
    let u = -rotation.cosm1;
    let square = u * u;
    let mut tail = N::all(0.0);
    for i in (0..COUNT / 2).rev() {
        let pair = N::all(coefficients[2 * i + 1]) * u + N::all(coefficients[2 * i]);
        tail = tail * square + pair;
    }
    sum(scaled(rotation.vector, tail * u), rotation.vector)
}

#[inline(always)]
pub(crate) fn load3<L: Lanes>([x, y, z]: &[RowF32; 3], lane: usize) -> [L; 3] {
    [
        L::load(&x[lane..]),
        L::load(&y[lane..]),
        L::load(&z[lane..]),
    ]
}

#[inline(always)]
pub(crate) fn store<L: Lanes>([x, y, z]: &mut [RowF32; 3], lane: usize, vector: [L; 3]) {
    vector[0].store(&mut x[lane..lane + L::COUNT]);
    vector[1].store(&mut y[lane..lane + L::COUNT]);
    vector[2].store(&mut z[lane..lane + L::COUNT]);
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// `x / sin(x)` by 1 - cos(x).
    pub(crate) fn longer(u: f64) -> f64 {
        let angle = 2.0 * libm::asin(libm::sqrt(u / 2.0));
        angle / libm::sin(angle)
    }

    /// Asserts that `1 + x (c₀ + c₁ x + …)` is within `bound` of `exact` for x up to `end`.
    pub(crate) fn assert_near(coefficients: &[f64], end: f64, exact: fn(f64) -> f64, bound: f64) {
        for i in 1..=10_000 {
            let x = f64::from(i) * end / 10_000.0;
            let tail = coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
            let error = (tail * x + 1.0 - exact(x)).abs();
            assert!(error <= bound, "{coefficients:?} at {x}: {error}");
        }
    }

    /// Catches a wrong digit in a coefficient.
    #[test]
    fn logarithms_are_those_of_libm() {
        assert_near(&LOG.map(f64::from), 0.5, longer, 3.5e-8);
        assert_near(&LONG_LOG.map(f64::from), 1.0, longer, 3.5e-8);
    }
}
