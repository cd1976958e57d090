//! Formulas: the curve between two keys, in f64, as a function of the parameter from 0 to 1. A formula takes up to
//! [`NUMBERS`] numbers, which its documentation lists.
//!
//! Kernels do not evaluate formulas. They evaluate polynomials of one form that are fitted to the formulas.

use crate::curve::options::{Axes, Quantity};
use crate::math::dual::{Dual, Scalar};
use crate::math::quaternion::{
    Quaternion, Real, Vector, dot, exp_by, product, rotated, square, step, sum,
};

/// How many numbers a formula may take.
pub(crate) const NUMBERS: usize = 25;

/// The numbers of one curve.
pub(crate) type FormulaNumbers = [f64; NUMBERS];

/// The numbers of a [`RotationVector`] curve.
#[derive(Default)]
pub(crate) struct RotationVectorNumbers {
    pub(crate) base: Quaternion,
    /// The half-rotation vectors that are multiplied by t, t² and t³.
    pub(crate) linear: Vector,
    pub(crate) quadratic: Vector,
    pub(crate) cubic: Vector,
}

impl From<RotationVectorNumbers> for FormulaNumbers {
    fn from(numbers: RotationVectorNumbers) -> Self {
        let RotationVectorNumbers {
            base,
            linear,
            quadratic,
            cubic,
        } = numbers;
        in_order([&base[..], &linear, &quadratic, &cubic])
    }
}

/// The numbers of [`DeCasteljau`]'s curves and of many others: the keys at both ends, and the control rotations or
/// tangents between them, as four consecutive quaternions.
#[derive(Default)]
pub(crate) struct ControlNumbers {
    pub(crate) start: Quaternion,
    pub(crate) after_start: Quaternion,
    pub(crate) before_end: Quaternion,
    pub(crate) end: Quaternion,
}

impl From<ControlNumbers> for FormulaNumbers {
    fn from(numbers: ControlNumbers) -> Self {
        let ControlNumbers {
            start,
            after_start,
            before_end,
            end,
        } = numbers;
        in_order([&start[..], &after_start, &before_end, &end])
    }
}

/// The numbers of a [`StraightLine`].
pub(crate) struct LineNumbers {
    pub(crate) start: [f64; 4],
    pub(crate) slope: [f64; 4],
}

impl From<LineNumbers> for FormulaNumbers {
    fn from(LineNumbers { start, slope }: LineNumbers) -> Self {
        in_order([&start[..], &slope])
    }
}

/// Consecutive numbers, followed by zeros.
fn in_order<const PARTS: usize>(parts: [&[f64]; PARTS]) -> FormulaNumbers {
    let mut numbers = [0.0; NUMBERS];
    for (number, &part) in numbers.iter_mut().zip(parts.into_iter().flatten()) {
        *number = part;
    }
    numbers
}

/// A curve of rotations.
pub(crate) trait Formula: 'static {
    /// The rotation at `t`. Implementations are `#[inline(always)]` and without branches. If `t` is
    /// a vector, the numbers are vectors too.
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4];
}

/// The quaternion that starts at an offset among the numbers.
#[inline(always)]
pub(crate) fn quaternion<S: Scalar>(numbers: &[S::Constant; NUMBERS], offset: usize) -> [S; 4] {
    [
        S::constant(numbers[offset]),
        S::constant(numbers[offset + 1]),
        S::constant(numbers[offset + 2]),
        S::constant(numbers[offset + 3]),
    ]
}

/// The vector that starts at an offset among the numbers, times `k`.
#[inline(always)]
pub(crate) fn vector<S: Scalar>(numbers: &[S::Constant; NUMBERS], offset: usize, k: S) -> [S; 3] {
    [
        S::constant(numbers[offset]) * k,
        S::constant(numbers[offset + 1]) * k,
        S::constant(numbers[offset + 2]) * k,
    ]
}

/// The exponential of a half-rotation vector.
#[inline(always)]
pub(crate) fn exp<S: Scalar>(a: [S; 3]) -> [S; 4] {
    exp_by(a, square(a).waves())
}

/// `q / |q|`, for any length.
#[inline(always)]
pub(crate) fn normalised<S: Scalar>(q: [S; 4]) -> [S; 4] {
    let scale = dot(q, q).reciprocal_root();
    [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale]
}

/// `a u + b v`.
#[inline(always)]
pub(crate) fn weighted<S: Scalar>(a: [S; 4], u: S, b: [S; 4], v: S) -> [S; 4] {
    [
        a[0] * u + b[0] * v,
        a[1] * u + b[1] * v,
        a[2] * u + b[2] * v,
        a[3] * u + b[3] * v,
    ]
}

/// Slerp on the arc that the signs define: `sin((1-t)θ)/sin θ a + sin(tθ)/sin θ b` (Shoemake 1985), up to a factor
/// that normalising removes. Its ends may depend on time too.
///
/// The sines are written `x sinc(x²)`, and the square of the angle is a smooth function of the
/// chord between the ends, so that small angles are no special case.
#[inline(always)]
pub(crate) fn slerp<S: Scalar>(a: [S; 4], b: [S; 4], t: S) -> [S; 4] {
    let minus = S::all(-1.0);
    let difference = weighted(b, S::all(1.0), a, minus);
    let chord = dot(difference, difference) * S::all(0.25);
    let square = chord.arc_square();
    let rest = S::all(1.0) - t;
    let (to_b, _) = (t * t * square).waves();
    let (to_a, _) = (rest * rest * square).waves();
    normalised(weighted(a, rest * to_a, b, t * to_b))
}

/// Cubics in cumulative form (Kim, Kim, Shin 1995):
/// `base · exp(v₁ B₁(t)) · exp(v₂ B₂(t)) · exp(v₃ B₃(t))`.
///
/// Numbers: the base, the three half-rotation vectors, and for each of the three
/// cumulative basis functions the coefficients of 1, t, t², t³.
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

    /// The `j`th exponential. This is not a closure, because closures are not always inlined.
    #[inline(always)]
    fn factor<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S, j: usize) -> [S; 4] {
        let [c0, c1, c2, c3] = quaternion::<S>(numbers, Self::BASIS + 4 * j);
        let weight = ((c3 * t + c2) * t + c1) * t + c0;
        exp(vector(numbers, Self::VECTORS + 3 * j, weight))
    }

    /// The numbers of a curve with that basis; base and vectors are still 0.
    pub(crate) const WITH_BERNSTEIN: FormulaNumbers = {
        let mut numbers = [0.0; NUMBERS];
        let (_, basis) = numbers.split_at_mut(Self::BASIS);
        basis.copy_from_slice(Self::BERNSTEIN.as_flattened());
        numbers
    };
}

impl Formula for Product {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let first = product(quaternion(numbers, 0), Self::factor(numbers, t, 0));
        let both = product(first, Self::factor(numbers, t, 1));
        product(both, Self::factor(numbers, t, 2))
    }
}

/// A cubic in the rotation vector from a key: `base · exp(v₁ t + v₂ t² + v₃ t³)`.
///
/// Numbers: the base and the three half-rotation vectors.
pub(crate) struct RotationVector;

impl RotationVector {
    /// Where [`RotationVectorNumbers::linear`] starts.
    pub(crate) const LINEAR: usize = 4;
}

impl Formula for RotationVector {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let square = t * t;
        let first = vector(numbers, Self::LINEAR, t);
        let second = vector(numbers, 7, square);
        let third = vector(numbers, 10, square * t);
        product(quaternion(numbers, 0), exp(sum(sum(first, second), third)))
    }
}

/// Bézier curves of rotations (Shoemake 1985): de Casteljau's construction with slerps.
///
/// Numbers: the four control rotations. Their signs define the arcs between them. Unlike in flat space, the two
/// halves into which the construction divides such a curve are not parts of it.
pub(crate) struct DeCasteljau;

impl Formula for DeCasteljau {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let (q0, a) = (quaternion(numbers, 0), quaternion(numbers, 4));
        let (b, q1) = (quaternion(numbers, 8), quaternion(numbers, 12));
        let middle = slerp(a, b, t);
        let left = slerp(slerp(q0, a, t), middle, t);
        let right = slerp(middle, slerp(b, q1, t), t);
        slerp(left, right, t)
    }
}

/// A straight line, not normalised. Numbers: its value at 0, and its slope.
pub(crate) struct StraightLine;

impl Formula for StraightLine {
    #[inline(always)]
    fn rotation<S: Scalar>(numbers: &[S::Constant; NUMBERS], t: S) -> [S; 4] {
        let start = quaternion(numbers, 0);
        weighted(start, S::all(1.0), quaternion(numbers, 4), t)
    }
}

/// The requested quantity of a rotation and its derivatives by the parameter; `rate` is the parameter's change per
/// second. The result is a quaternion, or a vector followed by 0.
#[inline(always)]
pub(crate) fn quantity_value<R: Real>(
    quantity: Quantity,
    rotation: [Dual<R>; 4],
    rate: R,
) -> [R; 4] {
    let at = rotation.map(|dual| dual.value);
    let (derivative, scale, axes) = match quantity {
        Quantity::Rotation => return at,
        Quantity::Velocity(axes) => (rotation.map(|dual| dual.first), rate, axes),
        Quantity::Acceleration(axes) => (rotation.map(|dual| dual.second), rate * rate, axes),
    };
    // ω = 2 q⁻¹ q', and its derivative is the vector part of 2 q⁻¹ q''.
    let [x, y, z, _] = step(at, derivative);
    // Not a closure, because closures are not always inlined.
    let twice = R::all(2.0) * scale;
    let body = [clamped(twice * x), clamped(twice * y), clamped(twice * z)];
    let [x, y, z] = match axes {
        Axes::Body => body,
        // Accelerations are rotated in the same way, because the additional term ω × ω is 0.
        Axes::Parent => rotated(at, body),
    };
    [x, y, z, R::all(0.0)]
}

/// Limits a number to the range of f32, which velocities between keys at almost the same time would exceed. NaN stays
/// NaN.
#[inline(always)]
pub(crate) fn clamped<R: Real>(x: R) -> R {
    let largest = 0.25 * f64::from(f32::MAX);
    let [low, high] = [-largest, largest].map(R::all);
    let raised = low.up_to(x, x, x.up_to(low, low, x));
    high.up_to(raised, high, raised)
}
