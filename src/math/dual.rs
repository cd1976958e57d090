//! The number types with which a curve's formula can be evaluated: f64 over the full range of angles, polynomials in
//! the principal range, or dual numbers with two derivatives. Each formula is written once, for all of them.

use crate::math::operators::operators;
use crate::math::quaternion::{Arithmetic, FullRange, Real, arc_tangent, full_waves};
use crate::math::ranges::{near_arc_square, near_waves};

/// A number that depends on the curve's parameter.
pub(crate) trait Scalar: Arithmetic {
    /// A number that does not depend on it: f64, or a vector of f64.
    type Constant: Real;
    /// Makes a number of a constant.
    fn constant(value: Self::Constant) -> Self;
    /// Makes a number of the same constant in every lane.
    #[inline(always)]
    fn all(value: f64) -> Self {
        Self::constant(Self::Constant::all(value))
    }

    /// `sin(x)/x` and `cos(x)`, given `x²`: both are smooth functions of it, also at 0.
    fn waves(self) -> (Self, Self);
    /// `x²`, given `sin²(x/2)`, for `x` up to pi.
    fn arc_square(self) -> Self;
    /// `1/√x`, for `x > 0`.
    fn reciprocal_root(self) -> Self;
}

impl Scalar for f64 {
    type Constant = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn waves(self) -> (f64, f64) {
        full_waves(self)
    }

    #[inline(always)]
    fn arc_square(self) -> f64 {
        let rest = if self < 1.0 { 1.0 - self } else { 0.0 };
        let is_greater = self > rest;
        let (small, large) = if is_greater {
            (rest, self)
        } else {
            (self, rest)
        };
        let half = arc_tangent((small / large).sqrt());
        let angle = if is_greater {
            std::f64::consts::PI - 2.0 * half
        } else {
            2.0 * half
        };
        angle * angle
    }

    #[inline(always)]
    fn reciprocal_root(self) -> f64 {
        reciprocal_root(self)
    }
}

/// `1/√x`, limited to 1e150, so that the values of degenerate curves are finite.
#[inline(always)]
fn reciprocal_root<R: Real>(x: R) -> R {
    R::all(1.0) / x.root().larger(R::all(1e-150))
}

/// A number for the principal range: angles up to pi/2, by polynomials alone, without a range
/// reduction, a root or a division for each. A longer angle makes the result NaN.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near<R>(pub(crate) R);

operators! {
    [R: Real] Near<R>, a, b:
    Add add => Self(a.0 + b.0);
    Sub sub => Self(a.0 - b.0);
    Mul mul => Self(a.0 * b.0);
}

impl<R: Real> Scalar for Near<R> {
    type Constant = R;

    #[inline(always)]
    fn constant(value: R) -> Self {
        Self(value)
    }

    #[inline(always)]
    fn waves(self) -> (Self, Self) {
        let (sinc, cosine) = near_waves(self.0);
        (Self(sinc), Self(cosine))
    }

    #[inline(always)]
    fn arc_square(self) -> Self {
        Self(near_arc_square(self.0))
    }

    #[inline(always)]
    fn reciprocal_root(self) -> Self {
        Self(reciprocal_root(self.0))
    }
}

/// A dual number of second order: a value with its first and second derivative. In each lane of a vector it is the
/// same as a single number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Dual<R = f64> {
    pub(crate) value: R,
    pub(crate) first: R,
    pub(crate) second: R,
}

impl<R> Dual<R> {
    pub(crate) const fn new(value: R, first: R, second: R) -> Self {
        Self {
            value,
            first,
            second,
        }
    }
}

impl<R: Real> Dual<R> {
    /// The parameter itself, whose first derivative is 1.
    #[inline(always)]
    pub(crate) fn parameter(value: R) -> Self {
        Self::new(value, R::all(1.0), R::all(0.0))
    }

    /// A function of this number by the chain rule, given the function's value and derivatives.
    #[inline(always)]
    fn chain(self, [value, first, second]: [R; 3]) -> Self {
        let bend = second * self.first * self.first + first * self.second;
        Self::new(value, first * self.first, bend)
    }
}

operators! {
    [R: Real] Dual<R>, a, b:
    Add add => Self::new(a.value + b.value, a.first + b.first, a.second + b.second);
    Sub sub => Self::new(a.value - b.value, a.first - b.first, a.second - b.second);
    Mul mul => Self::new(
        a.value * b.value,
        a.first * b.value + a.value * b.first,
        a.second * b.value + R::all(2.0) * (a.first * b.first) + a.value * b.second,
    );
}

/// How many coefficients a power series has.
const TERMS: usize = 12;

/// The coefficients of `sin(x)/x` in powers of `x²`.
const SINC: [f64; TERMS] = {
    let mut coefficients = [1.0; TERMS];
    let mut k = 1;
    while k < TERMS {
        let k_th = (2 * k * (2 * k + 1)) as f64;
        coefficients[k] = -coefficients[k - 1] / k_th;
        k += 1;
    }
    coefficients
};

/// The coefficients of `4 asin²(√u)` in powers of `u`: asin²(x) = ½ Σ (2x)²ⁿ / (n² binomial(2n, n)).
const ARC_SQUARES: [f64; TERMS] = {
    let mut coefficients = [0.0; TERMS];
    let (mut term, mut k) = (2.0, 1);
    while k < TERMS {
        let n = k as f64;
        term *= 4.0 * n / (2.0 * (2.0 * n - 1.0));
        coefficients[k] = term / (n * n);
        k += 1;
    }
    coefficients
};

/// The first two derivatives of a power series at `x`.
#[inline(always)]
fn derivatives<R: Real>(coefficients: &[f64; TERMS], x: R) -> [R; 2] {
    let mut sums = [R::all(0.0); 3];
    for &c in coefficients.iter().rev() {
        sums[2] = sums[2] * x + R::all(2.0) * sums[1];
        sums[1] = sums[1] * x + sums[0];
        sums[0] = sums[0] * x + R::all(c);
    }
    [sums[1], sums[2]]
}

/// `above` from a limit on, `below` under it.
#[inline(always)]
fn divided_at<R: Real>(limit: f64, x: R, above: [R; 2], below: [R; 2]) -> [R; 2] {
    let limit = R::all(limit);
    [
        limit.up_to(x, above[0], below[0]),
        limit.up_to(x, above[1], below[1]),
    ]
}

impl<R: FullRange> Scalar for Dual<R> {
    type Constant = R;

    #[inline(always)]
    fn constant(value: R) -> Self {
        Self::new(value, R::all(0.0), R::all(0.0))
    }

    #[inline(always)]
    fn waves(self) -> (Self, Self) {
        let z = self.value;
        let (sinc, cosine) = z.each(full_waves);
        // With S = sin(x)/x, C = cos(x) and derivatives by z = x²: `S' = (C - S)/2z`,
        // `4z S'' + 6 S' + S = 0` and `C' = -S/2`. For small z the differences lose their digits,
        // and a power series is used.
        let first = (cosine - sinc) / (R::all(2.0) * z);
        let second = -(R::all(6.0) * first + sinc) / (R::all(4.0) * z);
        let [first, second] = divided_at(0.5, z, [first, second], derivatives(&SINC, z));
        let minus_half = R::all(-0.5);
        (
            self.chain([sinc, first, second]),
            self.chain([cosine, minus_half * sinc, minus_half * first]),
        )
    }

    #[inline(always)]
    fn arc_square(self) -> Self {
        let u = self.value;
        let (square, _) = u.each(|u| (u.arc_square(), 0.0));
        // The result A = 4 asin²(√u) satisfies u(1-u) A'' + (1/2 - u) A' = 2. Towards u = 1 the derivatives
        // grow without limit; a fit to such values is refused.
        let rest = u * (R::all(1.0) - u).larger(R::all(1e-30));
        let first = R::all(2.0) * (square / rest).root();
        let second = (R::all(2.0) - (R::all(0.5) - u) * first) / rest;
        let [first, second] = divided_at(0.02, u, [first, second], derivatives(&ARC_SQUARES, u));
        self.chain([square, first, second])
    }

    #[inline(always)]
    fn reciprocal_root(self) -> Self {
        let root = reciprocal_root(self.value);
        let cube = root * root * root;
        let second = R::all(0.75) * cube * root * root;
        self.chain([root, R::all(-0.5) * cube, second])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong derivative, and a series that is used too far from 0.
    #[test]
    fn derivatives_are_those_of_the_values() {
        type Function = (fn(Dual) -> Dual, fn(f64) -> f64);
        let functions: [Function; 4] = [
            (|x| x.waves().0, |x| x.waves().0),
            (|x| x.waves().1, |x| x.waves().1),
            (Dual::arc_square, f64::arc_square),
            (Dual::reciprocal_root, f64::reciprocal_root),
        ];
        for (index, (of_jet, of_number)) in functions.into_iter().enumerate() {
            for i in 1..99 {
                let x = f64::from(i) * 0.01 * if index < 2 { 9.0 } else { 1.0 };
                let h = 1e-3 * x.min(if index == 2 { 1.0 - x } else { 1.0 });
                let at = |k: f64| of_number(x + k * h);
                let first = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
                let second = (16.0 * (at(1.0) + at(-1.0)) - (at(2.0) + at(-2.0)) - 30.0 * at(0.0))
                    / (12.0 * h * h);
                let dual = of_jet(Dual::parameter(x));
                assert_eq!(dual.value, of_number(x));
                let near = |a: f64, b: f64, within: f64| (a - b).abs() <= within * (1.0 + a.abs());
                assert!(
                    near(dual.first, first, 1e-9),
                    "{index} {x} {dual:?} {first}"
                );
                let within = 1e-15 / (h * h) + 1e-8;
                assert!(
                    near(dual.second, second, within),
                    "{index} {x} {dual:?} {second}"
                );
            }
        }
        let still = Dual::constant(0.0);
        assert_eq!(still.waves().0.value, 1.0);
        assert_eq!(Dual::parameter(0.0).arc_square().first, 4.0);
    }
}
