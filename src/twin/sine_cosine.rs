//! Twin of `shaders/math/sine_cosine.wgsl`: the same names, the same order.

use crate::shader::*;
use crate::simd::lanes::Number;

/// Sine and cosine for |angle| <= pi/2.
#[inline(always)]
pub(crate) fn sine_cosine<N: Number>(angle: N) -> (N, N) {
    let (sine, cosine_minus_one) = sine_cosm1(angle, angle * angle);
    (sine, cosine_minus_one + N::all(1.0))
}

/// `x sin(a)/a` and `cos(a) - 1` for an angle |a| <= pi/2 with the square `z`. With
/// `x = a` the first is the sine.
#[inline(always)]
pub(crate) fn sine_cosm1<N: Number>(x: N, z: N) -> (N, N) {
    let sine_high = (N::all(SINE_9) * z + N::all(SINE_7)) * z + N::all(SINE_5);
    let sine = (sine_high * z + N::all(SINE_3)) * (z * x) + x;
    let cosine_high = (N::all(COSINE_10) * z + N::all(COSINE_8)) * z + N::all(COSINE_6);
    let cosine_tail = (cosine_high * z + N::all(COSINE_4)) * z + N::all(COSINE_2);
    (sine, cosine_tail * z)
}

/// The same for |a| <= pi/4.
#[inline(always)]
pub(crate) fn sine_cosm1_quarter<N: Number>(x: N, z: N) -> (N, N) {
    quarter_halves(x, z).sine_cosm1()
}

/// Intermediate results of [`sine_cosm1_quarter`].
#[derive(Clone, Copy)]
pub(crate) struct QuarterHalves<N> {
    x: N,
    z: N,
    zx: N,
    sine_tail: N,
    cosine_tail: N,
}

/// The first half of [`sine_cosm1_quarter`], for the same `x` and `z`.
#[inline(always)]
pub(crate) fn quarter_halves<N: Number>(x: N, z: N) -> QuarterHalves<N> {
    let zz = z * z;
    let sine_low = N::all(QUARTER_SINE_5) * z + N::all(QUARTER_SINE_3);
    let cosine_low = N::all(QUARTER_COSINE_4) * z + N::all(QUARTER_COSINE_2);
    let cosine_high = N::all(QUARTER_COSINE_8) * z + N::all(QUARTER_COSINE_6);
    QuarterHalves {
        x,
        z,
        zx: z * x,
        sine_tail: N::all(QUARTER_SINE_7) * zz + sine_low,
        cosine_tail: cosine_high * zz + cosine_low,
    }
}

impl<N: Number> QuarterHalves<N> {
    #[inline(always)]
    pub(crate) fn sine_cosm1(self) -> (N, N) {
        let sine = self.sine_tail * self.zx + self.x;
        (sine, self.cosine_tail * self.z)
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    /// Catches a wrong digit in a coefficient, which bit equality alone would not:
    /// both twins read the same one.
    #[test]
    fn sine_and_cosine_are_as_accurate_as_stated() {
        let short: fn(f32) -> (f32, f32) = |angle| {
            let (sine, cosine_minus_one) = sine_cosm1_quarter(angle, angle * angle);
            (sine, cosine_minus_one + 1.0)
        };
        for (range, bound, pair) in [(FRAC_PI_4, 7e-8, short), (FRAC_PI_2, 1.2e-7, sine_cosine)] {
            let mut worst = 0.0f64;
            for i in -100_000..=100_000 {
                let angle = i as f32 * (range / 100_000.0);
                let (sine, cosine) = pair(angle);
                let exact = f64::from(angle).sin_cos();
                worst = worst.max((f64::from(sine) - exact.0).abs());
                worst = worst.max((f64::from(cosine) - exact.1).abs());
            }
            assert!(worst < bound, "{worst} over ±{range}");
        }
    }
}
