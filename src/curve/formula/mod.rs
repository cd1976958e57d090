//! Formulas: the curve between two keys, in f64, as a function of the parameter from 0 to 1. A
//! formula takes up to [`NUMBERS`] numbers; its file says what they are.
//!
//! Kernels do not evaluate formulas: they evaluate the polynomials that are fitted to
//! them, the same form for all.

pub(crate) mod de_casteljau;
pub(crate) mod hermite;
pub(crate) mod product;
pub(crate) mod rotation_vector;
pub(crate) mod squad;

use crate::math::dual::Scalar;
use crate::math::quaternion::{dot, exp_by, square};

/// How many numbers a formula may take.
pub(crate) const NUMBERS: usize = 25;

/// The numbers of one curve.
pub(crate) type Numbers = [f64; NUMBERS];

/// A curve of rotations.
pub(crate) trait Formula: 'static {
    /// The rotation at `t`. Implementations are `#[inline(always)]` and without branches. If `t` is
    /// a vector, the numbers are vectors too.
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4];
}

/// The quaternion that starts at a place among the numbers.
#[inline(always)]
fn quaternion<S: Scalar>(numbers: &[S::Constant; NUMBERS], place: usize) -> [S; 4] {
    [
        S::constant(numbers[place]),
        S::constant(numbers[place + 1]),
        S::constant(numbers[place + 2]),
        S::constant(numbers[place + 3]),
    ]
}

/// The vector that starts at a place among the numbers, times `k`.
#[inline(always)]
fn vector<S: Scalar>(numbers: &[S::Constant; NUMBERS], place: usize, k: S) -> [S; 3] {
    [
        S::constant(numbers[place]) * k,
        S::constant(numbers[place + 1]) * k,
        S::constant(numbers[place + 2]) * k,
    ]
}

/// The exponential of a half-rotation vector.
#[inline(always)]
fn exp<S: Scalar>(a: [S; 3]) -> [S; 4] {
    exp_by(a, square(a).waves())
}

/// `q / |q|`, whatever the length.
#[inline(always)]
fn normalised<S: Scalar>(q: [S; 4]) -> [S; 4] {
    let scale = dot(q, q).reciprocal_root();
    [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale]
}

/// `a u + b v`.
#[inline(always)]
fn weighted<S: Scalar>(a: [S; 4], u: S, b: [S; 4], v: S) -> [S; 4] {
    [
        a[0] * u + b[0] * v,
        a[1] * u + b[1] * v,
        a[2] * u + b[2] * v,
        a[3] * u + b[3] * v,
    ]
}

/// Slerp on the arc that the signs give: `sin((1-t)θ)/sin θ a + sin(tθ)/sin θ b` (Shoemake 1985),
/// up to a factor that normalising removes. Its ends may depend on time too.
///
/// The sines are written `x sinc(x²)`, and the square of the angle is a smooth function of the
/// chord between the ends, so that small angles are no special case.
#[inline(always)]
fn slerp<S: Scalar>(a: [S; 4], b: [S; 4], t: S) -> [S; 4] {
    let minus = S::all(-1.0);
    let difference = weighted(b, S::all(1.0), a, minus);
    let chord = dot(difference, difference) * S::all(0.25);
    let square = chord.arc_square();
    let rest = S::all(1.0) - t;
    let (to_b, _) = (t * t * square).waves();
    let (to_a, _) = (rest * rest * square).waves();
    normalised(weighted(a, rest * to_a, b, t * to_b))
}
