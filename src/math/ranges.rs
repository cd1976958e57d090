//! Exponentials, logarithms, sines and cosines in the principal range (half-angles up to pi/2), computed by polynomials
//! only; and exponentials and logarithms over the full range, for all other angles.

use std::f64::consts::FRAC_PI_2;

use crate::math::quaternion::{
    Quaternion, Real, Vector, exp, exp_by, log, log_near, log_toward, scaled, square,
};

/// The exponentials and logarithms in a method's rule. There are two implementations: [`PrincipalRange`] for the
/// principal range, in vector lanes, and [`FullRange`] for the full range, for single lanes outside it. Therefore a
/// lane's result depends only on its numbers.
pub(crate) trait Algebra {
    /// f64, or a vector of them.
    type Number: Real;
    /// [`exp`]: the quaternion whose logarithm is `a`.
    fn exp(&mut self, a: [Self::Number; 3]) -> [Self::Number; 4];
    /// [`log`]: the principal logarithm of `q`.
    fn log(&mut self, q: [Self::Number; 4]) -> [Self::Number; 3];
    /// [`log_toward`]: as `log`, with the direction `axis` where `q` = -1 has none.
    fn log_toward(&mut self, q: [Self::Number; 4], axis: [Self::Number; 3]) -> [Self::Number; 3];
    /// [`log_near`]: the branch of the logarithm of `q` that is nearest to `near`.
    fn log_near(&mut self, q: [Self::Number; 4], near: [Self::Number; 3]) -> [Self::Number; 3];
    /// The logarithm of a step between keys; `near` is the one that [`PrincipalRange`] gave.
    fn log_of_step(
        &mut self,
        step: [Self::Number; 4],
        near: [Self::Number; 3],
    ) -> [Self::Number; 3];
}

/// The full range, with square roots, divisions and range reductions.
pub(crate) struct FullRange;

impl Algebra for FullRange {
    type Number = f64;

    #[inline(always)]
    fn exp(&mut self, a: Vector) -> Quaternion {
        exp(a)
    }

    #[inline(always)]
    fn log(&mut self, q: Quaternion) -> Vector {
        log(q)
    }

    #[inline(always)]
    fn log_toward(&mut self, q: Quaternion, axis: Vector) -> Vector {
        log_toward(q, axis)
    }

    #[inline(always)]
    fn log_near(&mut self, q: Quaternion, near: Vector) -> Vector {
        log_near(q, near)
    }

    // `near` is not used, because its error is up to 1e-12, and a long tangent multiplies the error of this logarithm.
    #[inline(always)]
    fn log_of_step(&mut self, step: Quaternion, _: Vector) -> Vector {
        log(step)
    }
}

/// The principal range: half-angles up to pi/2, by polynomials alone, within 1e-12.
pub(crate) struct PrincipalRange<R> {
    /// 0 as long as every argument was in the principal range, else 1.
    pub(crate) doubt: R,
}

/// `sin(x)/x` and `cos(x)` by polynomials in x².
pub(crate) struct Waves<const N: usize> {
    /// The largest x² for which they are valid.
    pub(crate) limit: f64,
    /// The coefficients of `(sin(x)/x - 1) / x²` in powers of x²; from Chebyshev nodes.
    sinc: [f64; N],
    /// The coefficients of `(cos(x) - 1) / x²` in powers of x².
    cosine: [f64; N],
}

/// For angles up to pi/2, within 1e-14.
pub(crate) const LONG_WAVES: Waves<8> = Waves {
    limit: FRAC_PI_2 * FRAC_PI_2,
    sinc: [
        -0.16666666666666666,
        0.008333333333333316,
        -0.00019841269841254974,
        2.7557319219163234e-06,
        -2.5052107616996182e-08,
        1.6058977312464087e-10,
        -7.643970296798572e-13,
        2.7314447669863995e-15,
    ],
    cosine: [
        -0.5,
        0.04166666666666634,
        -0.0013888888888860709,
        2.4801587292446213e-05,
        -2.755731776732053e-07,
        2.0876630867422994e-09,
        -1.1464689885720029e-11,
        4.6276759850181716e-14,
    ],
};

/// For angles up to 1/2, within 3e-12: for numbers that are rounded to f32.
pub(crate) const SHORT_WAVES: Waves<4> = Waves {
    limit: 0.25,
    sinc: [
        -0.16666666666590457,
        0.008333333235781787,
        -0.00019841074685369954,
        2.743233430893218e-06,
    ],
    cosine: [
        -0.499999999991622,
        0.04166666559421515,
        -0.0013888674329962797,
        2.466415894289239e-05,
    ],
};

/// For squared angles up to 5/4, within 7e-9; up to 1/2 within 3e-9.
pub(crate) const MEDIUM_WAVES: Waves<4> = Waves {
    limit: 1.25,
    sinc: [
        -0.1666666661964308,
        0.008333321292269242,
        -0.0001983644687633356,
        2.693786858624223e-06,
    ],
    cosine: [
        -0.4999999948424723,
        0.04166653459468085,
        -0.001388359752363535,
        2.412155240317313e-05,
    ],
};

/// Coefficients of `(x / sin(x) - 1) / u` in powers of u = 1 - cos(x), 0 <= u <= 1: an angle from
/// its sine without an arc function. From Chebyshev nodes, within 2e-13.
const ANGLE_BY_SINE: [f64; 16] = [
    0.33333333333323145,
    0.13333333338545655,
    0.05714285273367023,
    0.025396972243716957,
    0.011541454567945548,
    0.005354794564180442,
    0.002303232007023121,
    0.0020294613243775988,
    -0.002299261701744184,
    0.007084543299936568,
    -0.01167216603593313,
    0.014729870371061547,
    -0.012790174455014925,
    0.007523633800038208,
    -0.0026627390137634916,
    0.0004471863705142663,
];

/// Coefficients of `(x²/(4v) - 1) / v` in powers of v = sin²(x/2), 0 <= v <= 1/2; from
/// Chebyshev nodes, within 2e-14.
const ARC_SQUARE: [f64; 16] = [
    0.3333333333333248,
    0.17777777778646958,
    0.11428571281491674,
    0.0812699392744085,
    0.06156464672038421,
    0.04878479785200423,
    0.038802305491039815,
    0.04249007813202197,
    -0.03286201942043849,
    0.3178655219003784,
    -0.995493633787061,
    2.55548525027655,
    -4.432709056716552,
    5.255149819411587,
    -3.7386429057520805,
    1.276311607352811,
];

/// `1 + x (c₀ + c₁ x + …)`, four coefficients at a time, so that the chain of dependent operations
/// is a quarter as long. The number of coefficients is a multiple of four.
#[inline(always)]
pub(crate) fn one_plus<R: Real, const N: usize>(c: &[f64; N], x: R) -> R {
    let square = x * x;
    let fourth = square * square;
    let mut sum = R::all(0.0);
    for i in (0..N / 4).rev() {
        let low = R::all(c[4 * i + 1]) * x + R::all(c[4 * i]);
        let high = R::all(c[4 * i + 3]) * x + R::all(c[4 * i + 2]);
        sum = sum * fourth + (high * square + low);
    }
    sum * x + R::all(1.0)
}

impl<const N: usize> Waves<N> {
    /// `sin(x)/x` and `cos(x)` by `x²`.
    #[inline(always)]
    pub(crate) fn of<R: Real>(&self, square: R) -> (R, R) {
        (one_plus(&self.sinc, square), one_plus(&self.cosine, square))
    }
}

/// `sin(x)/x` and `cos(x)` by `x²`, which is at most (pi/2)²; else NaN.
#[inline(always)]
pub(crate) fn near_waves<R: Real>(square: R) -> (R, R) {
    let doubt = near_or_nan(square, LONG_WAVES.limit);
    let (sinc, cosine) = LONG_WAVES.of(square);
    (sinc + doubt, cosine + doubt)
}

/// `x²` by `sin²(x/2)`, which is at most 1/2; else NaN.
#[inline(always)]
pub(crate) fn near_arc_square<R: Real>(v: R) -> R {
    R::all(4.0) * v * one_plus(&ARC_SQUARE, v) + near_or_nan(v, 0.5)
}

/// 0 up to a limit, else NaN.
#[inline(always)]
fn near_or_nan<R: Real>(value: R, limit: f64) -> R {
    value.up_to(R::all(limit), R::all(0.0), R::all(f64::NAN))
}

impl<R: Real> PrincipalRange<R> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { doubt: R::all(0.0) }
    }

    #[inline(always)]
    fn check(&mut self, value: R, limit: f64) {
        // If the value is NaN, the doubt is set, too.
        self.doubt = value.up_to(R::all(limit), self.doubt, R::all(1.0));
    }
}

impl<R: Real> Algebra for PrincipalRange<R> {
    type Number = R;

    #[inline(always)]
    fn exp(&mut self, a: [R; 3]) -> [R; 4] {
        let z = square(a);
        self.check(z, LONG_WAVES.limit);
        exp_by(a, LONG_WAVES.of(z))
    }

    #[inline(always)]
    fn log(&mut self, q: [R; 4]) -> [R; 3] {
        let u = R::all(1.0) - q[3];
        self.check(u, 1.0);
        scaled([q[0], q[1], q[2]], one_plus(&ANGLE_BY_SINE, u))
    }

    #[inline(always)]
    fn log_toward(&mut self, q: [R; 4], _: [R; 3]) -> [R; 3] {
        self.log(q)
    }

    #[inline(always)]
    fn log_near(&mut self, q: [R; 4], near: [R; 3]) -> [R; 3] {
        // If `near` is shorter than this, the principal branch is the nearest one.
        self.check(square(near), 1.5 * 1.5);
        self.log(q)
    }

    #[inline(always)]
    fn log_of_step(&mut self, _: [R; 4], near: [R; 3]) -> [R; 3] {
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quaternion::{length, sum};

    /// Catches a wrong digit in a polynomial, and one used beyond its range.
    #[test]
    fn near_waves_and_squares_are_those_of_libm_or_nan() {
        for i in 0..=20_000 {
            let x = f64::from(i) * 1e-4;
            let ((sinc, cosine), square) = (near_waves(x * x), near_arc_square(v_of(x)));
            if x > FRAC_PI_2 {
                assert!(sinc.is_nan() && cosine.is_nan(), "{x}");
                assert!(x < 1.571 || square.is_nan(), "{x}");
                continue;
            }
            assert!((sinc * x - libm::sin(x)).abs() < 2e-14, "{x}");
            assert!((cosine - libm::cos(x)).abs() < 2e-14, "{x}");
            assert!(x > 1.57 || (square - x * x).abs() <= 5e-14 * x * x, "{x}");
        }
        assert!(near_waves(f64::NAN).0.is_nan() && near_arc_square(f64::NAN).is_nan());
    }

    fn v_of(x: f64) -> f64 {
        libm::sin(x / 2.0) * libm::sin(x / 2.0)
    }

    /// Catches a wrong digit in a polynomial.
    #[test]
    fn short_and_medium_waves_are_those_of_libm() {
        assert_near(&SHORT_WAVES, |_| [3e-12; 2]);
        assert_near(&MEDIUM_WAVES, |square| {
            [1e-9, if square <= 0.5 { 3e-9 } else { 7e-9 }]
        });
    }

    /// Asserts that sine and cosine are within these bounds up to the limit.
    fn assert_near<const N: usize>(waves: &Waves<N>, within: fn(f64) -> [f64; 2]) {
        for i in 0..=10_000 {
            let square = waves.limit * f64::from(i) / 10_000.0;
            let (x, (sinc, cosine)) = (libm::sqrt(square), waves.of(square));
            let [of_sine, of_cosine] = within(square);
            assert!((sinc * x - libm::sin(x)).abs() < of_sine, "{x}");
            assert!((cosine - libm::cos(x)).abs() < of_cosine, "{x}");
        }
    }

    /// Catches a wrong digit in a polynomial, and one used beyond its range.
    #[test]
    fn principal_range_is_full_range_or_says_that_it_does_not_hold() {
        let direction = scaled([1.0, 2.0, -2.0], 1.0 / 3.0);
        for i in 0..=20_000 {
            let angle = f64::from(i) * 1e-4;
            let a = scaled(direction, angle);
            let mut near = PrincipalRange::new();
            let (q, back) = (near.exp(a), near.log(exp(a)));
            assert_eq!(near.doubt == 0.0, angle <= FRAC_PI_2, "{angle}");
            if near.doubt == 0.0 {
                let error = (0..4).map(|c| (q[c] - exp(a)[c]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-14, "{angle}: {error}");
                let error = length(sum(back, scaled(a, -1.0)));
                assert!(error <= 1e-12 * angle, "{angle}: {error}");
            }
        }
        let mut near = PrincipalRange::new();
        near.exp([f64::NAN; 3]);
        near.exp([0.0; 3]);
        assert_eq!(near.doubt, 1.0);
    }
}
