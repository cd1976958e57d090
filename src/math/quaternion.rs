//! Quaternion algebra in f64 without branches, calls or tables, so that loops over arrays become vector instructions.
//! Only addition, subtraction, multiplication, division and square root are used, each rounded once according to IEEE
//! 754, so that every machine and every vector width gives the same bits.
//!
//! Quaternions are plain arrays, `x y z w`: glam's types would keep such a loop scalar. Functions
//! that are generic over [`Real`] also take vectors of f64. The products of vectors of `shaders/math/vector.wgsl` are
//! here, too: f64 shares them.

use std::f64::consts::{FRAC_2_PI, PI, TAU};
use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::{DQuat, Quat};

use crate::math::canonical::{SHIFT, nearest_whole, round_f32};

/// A number, or a vector of numbers, that can be added, subtracted and multiplied.
pub(crate) trait Arithmetic:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
}

impl<N> Arithmetic for N where N: Copy + Add<Output = N> + Sub<Output = N> + Mul<Output = N> {}

/// An f64, or a vector of f64, on whose lanes every function works separately.
pub(crate) trait Real: Arithmetic + Neg<Output = Self> + Div<Output = Self> {
    /// The same in every lane.
    fn all(value: f64) -> Self;

    /// The square root.
    fn root(self) -> Self;

    /// The smaller of two numbers; `other` if either is NaN. `larger` likewise.
    fn smaller(self, other: Self) -> Self;
    fn larger(self, other: Self) -> Self;

    /// `then` if the number is at most `limit`, else `otherwise`, also if either is NaN.
    fn up_to(self, limit: Self, then: Self, otherwise: Self) -> Self;
}

/// A number whose lanes can be taken one by one, for functions over the full range.
pub(crate) trait FullRange: Real {
    /// Both results of a function in every lane.
    fn each(self, function: impl Fn(f64) -> (f64, f64)) -> (Self, Self);
}

impl FullRange for f64 {
    #[inline(always)]
    fn each(self, function: impl Fn(f64) -> (f64, f64)) -> (Self, Self) {
        function(self)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn all(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn up_to(self, limit: Self, then: Self, otherwise: Self) -> Self {
        if self <= limit { then } else { otherwise }
    }
}

/// `x y z w`.
pub(crate) type Quaternion = [f64; 4];
/// Half of a rotation vector, unless stated otherwise.
pub(crate) type Vector = [f64; 3];

/// The inner product of vectors.
#[inline(always)]
pub(crate) fn dot3<N: Arithmetic>(a: [N; 3], b: [N; 3]) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`.
#[inline(always)]
pub(crate) fn cross3<N: Arithmetic>(a: [N; 3], b: [N; 3]) -> [N; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// `|v|²`.
#[inline(always)]
pub(crate) fn square<N: Arithmetic>(v: [N; 3]) -> N {
    dot3(v, v)
}

/// The inner product in R⁴.
#[inline(always)]
pub(crate) fn dot<N: Arithmetic>(a: [N; 4], b: [N; 4]) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// `|v|`.
#[inline(always)]
pub(crate) fn length(v: Vector) -> f64 {
    square(v).sqrt()
}

/// `k v`.
#[inline(always)]
pub(crate) fn scaled<N: Arithmetic>(v: [N; 3], k: N) -> [N; 3] {
    [v[0] * k, v[1] * k, v[2] * k]
}

/// `a + b`.
#[inline(always)]
pub(crate) fn sum<N: Arithmetic>(a: [N; 3], b: [N; 3]) -> [N; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[inline(always)]
pub(crate) fn minus<N: Arithmetic>(a: [N; 3], b: [N; 3]) -> [N; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a / b` for positive numbers, limited to 1e150: tangents between keys at almost the same time have no meaning, but
/// stay finite.
#[inline(always)]
pub(crate) fn ratio<R: Real>(a: R, b: R) -> R {
    (a / b).smaller(R::all(1e150))
}

/// The Hamilton product `a b`.
#[inline(always)]
pub(crate) fn product<N: Arithmetic>(a: [N; 4], b: [N; 4]) -> [N; 4] {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// The product `a v` of a quaternion and a vector: [`product`] without the terms that are 0.
#[inline(always)]
pub(crate) fn product_with_vector<N>(a: [N; 4], v: [N; 3]) -> [N; 4]
where
    N: Arithmetic + Neg<Output = N>,
{
    [
        a[3] * v[0] + a[1] * v[2] - a[2] * v[1],
        a[3] * v[1] - a[0] * v[2] + a[2] * v[0],
        a[3] * v[2] + a[0] * v[1] - a[1] * v[0],
        -a[0] * v[0] - a[1] * v[1] - a[2] * v[2],
    ]
}

/// The conjugate, which is the inverse of a unit quaternion.
#[inline(always)]
pub(crate) fn conjugate<N: Neg<Output = N>>([x, y, z, w]: [N; 4]) -> [N; 4] {
    [-x, -y, -z, w]
}

/// `a⁻¹ b` for unit quaternions.
#[inline(always)]
pub(crate) fn step<N: Arithmetic + Neg<Output = N>>(a: [N; 4], b: [N; 4]) -> [N; 4] {
    product(conjugate(a), b)
}

/// `q v q⁻¹` for a unit quaternion, by two products. Kernels use fewer operations, as in the twin `rotated`, which
/// rounds differently.
#[inline(always)]
pub(crate) fn rotated<R: Real>(q: [R; 4], [x, y, z]: [R; 3]) -> [R; 3] {
    let [a, b, c, _] = product(product(q, [x, y, z, R::all(0.0)]), conjugate(q));
    [a, b, c]
}

/// A key in f64, normalised. Two Newton steps are enough for a key that is unit within the rounding of f32.
#[inline(always)]
pub(crate) fn unit(key: [f32; 4]) -> Quaternion {
    let q = [
        f64::from(key[0]),
        f64::from(key[1]),
        f64::from(key[2]),
        f64::from(key[3]),
    ];
    normalised(q)
}

/// As [`unit()`], for components that are in f64 already.
#[inline(always)]
pub(crate) fn normalised<R: Real>(q: [R; 4]) -> [R; 4] {
    let square = dot(q, q);
    let (half, three_halves) = (R::all(0.5), R::all(1.5));
    let first = three_halves - half * square;
    let scale = first * (three_halves - half * square * first * first);
    [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale]
}

/// The unit quaternion nearest to `q`, in f32.
pub(crate) fn unit_f32(q: DQuat) -> Quat {
    let q = q.to_array();
    let norm = dot(q, q).sqrt();
    Quat::from_array(q.map(|component| round_f32(component / norm)))
}

/// Rounds each component to f32, `x y z w`.
#[inline(always)]
pub(crate) fn round_quat(q: Quaternion) -> [f32; 4] {
    q.map(round_f32)
}

/// pi/2 as a sum of parts of 24 bits, so that a part times a whole number below 2^29 is exact.
const HALF_PI: [f64; 4] = [
    1.570_796_251_296_997,
    7.549789415861596e-8,
    5.390302529957765e-15,
    3.2820035428735005e-22,
];

/// Sine and cosine, within 2e-16 for arguments of up to 8e8 radians. For larger arguments the results are wrong.
/// Coefficients: fdlibm (Sun Microsystems, 1993), `k_sin.c` and `k_cos.c`.
#[inline(always)]
pub(crate) fn sine_cosine(x: f64) -> (f64, f64) {
    // The whole number nearest to x / (pi/2); its last bits are the quadrant.
    let shifted = x * FRAC_2_PI + SHIFT;
    let whole = shifted - SHIFT;
    let quadrant = shifted.to_bits();
    let r =
        (((x - whole * HALF_PI[0]) - whole * HALF_PI[1]) - whole * HALF_PI[2]) - whole * HALF_PI[3];
    let r = if r.abs() < 1.0 { r } else { 0.0 };
    let z = r * r;
    let sine_tail = ((((1.589_690_995_211_55e-10 * z - 2.505_076_025_340_686_3e-8) * z
        + 2.755_731_370_707_006_8e-6)
        * z
        - 1.984_126_982_985_795e-4)
        * z
        + 8.333_333_333_322_49e-3)
        * z
        - 1.666_666_666_666_663_2e-1;
    let sine = r + r * (z * sine_tail);
    let cosine_tail = ((((-1.135_964_755_778_819_5e-11 * z + 2.087_572_321_298_175e-9) * z
        - 2.755_731_435_139_066_3e-7)
        * z
        + 2.480_158_728_947_673e-5)
        * z
        - 1.388_888_888_887_411e-3)
        * z
        + 4.166_666_666_666_66e-2;
    let cosine = 1.0 - (0.5 * z - z * z * cosine_tail);
    let odd = quadrant & 1 == 1;
    let (s, c) = if odd { (cosine, sine) } else { (sine, cosine) };
    let sine_sign = (quadrant & 2) << 62;
    let cosine_sign = (quadrant.wrapping_add(1) & 2) << 62;
    (
        f64::from_bits(s.to_bits() ^ sine_sign),
        f64::from_bits(c.to_bits() ^ cosine_sign),
    )
}

/// Coefficients of `(atan(t)/t - 1) / t²` in powers of t², for 0 <= t <= tan(pi/8);
/// from Chebyshev nodes, within 1e-17 of it.
const ARC_TANGENT: [f64; 11] = [
    -0.3333333333333333,
    0.19999999999995519,
    -0.14285714284666184,
    0.11111111015227572,
    -0.09090904576954117,
    0.07692183163650894,
    -0.06664511064599371,
    0.05858145587628202,
    -0.050854323376990765,
    0.0392311556198723,
    -0.01917627151752634,
];

/// The arc tangent of `t`, 0 <= t <= 1, within 5e-16 of it, relative.
#[inline(always)]
pub(crate) fn arc_tangent(t: f64) -> f64 {
    // The angle is twice the arc tangent of half of it, because the polynomial is more exact for half the angle. The
    // exactness matters: long tangents of a curve multiply an angle's error.
    let half = t / (1.0 + (1.0 + t * t).sqrt());
    let z = half * half;
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10] = ARC_TANGENT;
    let high = ((((c10 * z + c9) * z + c8) * z + c7) * z + c6) * z + c5;
    let tail = ((((high * z + c4) * z + c3) * z + c2) * z + c1) * z + c0;
    2.0 * (half + half * (z * tail))
}

/// `sin(x)/x` and `cos(x)` by `x²`, over the full range. The polynomials of
/// [`ranges`](crate::math::ranges) hold for smaller angles.
#[inline(always)]
pub(crate) fn full_waves(square: f64) -> (f64, f64) {
    let angle = square.sqrt();
    let (sine, cosine) = sine_cosine(angle);
    // sin(x)/x is 1 to f64 rounding below 1e-9.
    (if angle > 1e-9 { sine / angle } else { 1.0 }, cosine)
}

/// The exponential `[cos |a|; sin |a| a/|a|]` of a half-rotation vector, given `sin |a| / |a|` and
/// `cos |a|`, which are functions of [`square`]`(a)`.
#[inline(always)]
pub(crate) fn exp_by<N: Arithmetic>(a: [N; 3], (sinc, cosine): (N, N)) -> [N; 4] {
    let [x, y, z] = scaled(a, sinc);
    [x, y, z, cosine]
}

/// The exponential of a half-rotation vector, over the full range.
#[inline(always)]
pub(crate) fn exp(a: Vector) -> Quaternion {
    exp_by(a, full_waves(square(a)))
}

/// The rotation about an axis, a unit vector, by an angle in degrees.
pub(crate) fn about([x, y, z]: Vector, degrees: f64) -> Quaternion {
    let (sine, cosine) = sine_cosine(0.5 * degrees.to_radians());
    [x * sine, y * sine, z * sine, cosine]
}

/// The logarithm of a unit quaternion: half of the rotation vector, of length at most pi. It is computed by the arc
/// tangent, because the arc cosine would lose half of the digits of a small angle.
#[inline(always)]
pub(crate) fn log(q: Quaternion) -> Vector {
    log_toward(q, [1.0, 0.0, 0.0])
}

/// As [`log`]; `axis` is the direction if the quaternion has none (at -1, where a vector of length pi in every
/// direction is a logarithm).
#[inline(always)]
pub(crate) fn log_toward(q: Quaternion, axis: Vector) -> Vector {
    let v = [q[0], q[1], q[2]];
    let sine = length(v);
    let half = arc_tangent(sine / (1.0 + q[3].abs()));
    let angle = if q[3] < 0.0 {
        PI - 2.0 * half
    } else {
        2.0 * half
    };
    let scale = if sine > 0.0 { angle / sine } else { 0.0 };
    let axis_length = length(axis);
    let at_minus_one = sine == 0.0 && q[3] < 0.0 && axis_length > 0.0;
    let toward = if at_minus_one { PI / axis_length } else { 0.0 };
    sum(scaled(v, scale), scaled(axis, toward))
}

/// The branch of the logarithm of `q` that lies nearest to `near`: with `p` the
/// principal one, `p + 2 pi k p/|p|` for the best whole `k`.
#[inline(always)]
pub(crate) fn log_near(q: Quaternion, near: Vector) -> Vector {
    let principal = log_toward(q, near);
    let angle = length(principal);
    let near_length = length(near);
    // If the principal logarithm is almost zero it has no axis, and its branches lie along `near`.
    let has_axis = angle > 1e-9;
    let inverse = if has_axis { 1.0 / angle } else { 0.0 };
    let to_near = if !has_axis && near_length > PI {
        1.0 / near_length
    } else {
        0.0
    };
    let axis = sum(scaled(principal, inverse), scaled(near, to_near));
    let revolutions = nearest_whole((dot3(axis, near) - angle) / TAU);
    sum(principal, scaled(axis, revolutions * TAU))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a wrong digit in a coefficient or in a part of pi/2.
    #[test]
    fn sine_and_cosine_are_those_of_libm() {
        for i in 0..200_000 {
            let x = f64::from(i) * f64::from(i) * 0.019_1;
            let (sine, cosine) = sine_cosine(x);
            let (expected_sine, expected_cosine) = libm::sincos(x);
            assert!((sine - expected_sine).abs() < 2.5e-16, "{x}");
            assert!((cosine - expected_cosine).abs() < 2.5e-16, "{x}");
        }
        for x in [1e12, 1e300, f64::INFINITY, f64::NAN] {
            let (sine, cosine) = sine_cosine(x);
            assert!((sine * sine + cosine * cosine - 1.0).abs() < 1e-15, "{x}");
        }
    }

    #[test]
    fn the_arc_tangent_is_that_of_libm() {
        for i in 0..=100_000 {
            let t = f64::from(i) / 100_000.0;
            assert!((arc_tangent(t) - libm::atan(t)).abs() <= 5e-16 * t, "{t}");
        }
    }

    #[test]
    fn exp_undoes_log_on_every_branch() {
        let direction = scaled([2.0, -1.0, 0.5], 1.0 / length([2.0, -1.0, 0.5]));
        let distance = |a: Vector, b: Vector| length(sum(a, scaled(b, -1.0)));
        for angle in [0.0, 1e-12, 1e-5, 0.4, 1.5, 3.0, 3.1] {
            let v = scaled(direction, angle);
            let q = exp(v);
            assert!(distance(log(q), v) < 1e-9, "{angle}");
            for revolutions in [-2.0, 1.0, 3.0] {
                let vector = scaled(direction, angle + revolutions * TAU);
                let branch = log_near(q, vector);
                assert!(
                    distance(branch, vector) < 1e-6,
                    "{angle} {revolutions} {branch:?}"
                );
            }
        }
        assert_eq!(log([0.0, 0.0, 0.0, -1.0]), [PI, 0.0, 0.0]);
        assert_eq!(log([0.0, 0.0, 0.0, 1.0]), [0.0; 3]);
    }
}
