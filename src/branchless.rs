//! Quaternion algebra in f64 without branches, calls or tables: in a loop over
//! arrays all of it becomes vector instructions. Only addition, subtraction,
//! multiplication, division and square root, each rounded once as IEEE 754 says, so
//! that every machine and every vector width gives the same bits.
//!
//! Plain arrays, `x y z w`: a vector type would keep such a loop scalar.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI, TAU};

use crate::numeric::nearest_whole;

/// `x y z w`.
pub(crate) type Quaternion = [f64; 4];
/// Half of a rotation vector, unless said otherwise.
pub(crate) type Vector = [f64; 3];

/// The inner product in R⁴.
#[inline(always)]
pub(crate) fn dot(a: Quaternion, b: Quaternion) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// `|v|`.
#[inline(always)]
pub(crate) fn length(v: Vector) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// `k v`.
#[inline(always)]
pub(crate) fn scaled(v: Vector, k: f64) -> Vector {
    [v[0] * k, v[1] * k, v[2] * k]
}

/// `a + b`.
#[inline(always)]
pub(crate) fn sum(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a / b` for positive numbers, at most 1e150: between keys that are next to nothing
/// apart tangents are meaningless, but they stay numbers.
#[inline(always)]
pub(crate) fn ratio(a: f64, b: f64) -> f64 {
    let ratio = a / b;
    if ratio < 1e150 { ratio } else { 1e150 }
}

/// The Hamilton product `a b`.
#[inline(always)]
pub(crate) fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// `a⁻¹ b` for unit quaternions.
#[inline(always)]
pub(crate) fn step(a: Quaternion, b: Quaternion) -> Quaternion {
    product([-a[0], -a[1], -a[2], a[3]], b)
}

/// A key in f64, normalised: two steps of Newton's, from keys that are unit to f32.
#[inline(always)]
pub(crate) fn unit(key: [f32; 4]) -> Quaternion {
    let q = [
        f64::from(key[0]),
        f64::from(key[1]),
        f64::from(key[2]),
        f64::from(key[3]),
    ];
    let square = dot(q, q);
    let first = 1.5 - 0.5 * square;
    let scale = first * (1.5 - 0.5 * square * first * first);
    [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale]
}

/// pi/2 in parts of 24 bits: a whole number below 2^29 times each is exact.
const HALF_PI: [f64; 4] = [
    1.570_796_251_296_997,
    7.549789415861596e-8,
    5.390302529957765e-15,
    3.2820035428735005e-22,
];

/// Sine and cosine, within 2e-16 up to 8e8 radians; beyond, some pair of them.
/// Coefficients: fdlibm (Sun Microsystems, 1993), `k_sin.c` and `k_cos.c`.
#[inline(always)]
pub(crate) fn sine_cosine(x: f64) -> (f64, f64) {
    // The whole part of x / (pi/2), and in the last bits its quadrant.
    const SHIFT: f64 = 1.5 * (1u64 << 52) as f64;
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
    // That of half the angle, twice: a wild tangent multiplies an angle's error.
    let half = t / (1.0 + (1.0 + t * t).sqrt());
    let z = half * half;
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10] = ARC_TANGENT;
    let high = ((((c10 * z + c9) * z + c8) * z + c7) * z + c6) * z + c5;
    let tail = ((((high * z + c4) * z + c3) * z + c2) * z + c1) * z + c0;
    2.0 * (half + half * (z * tail))
}

/// The exponential of a half-rotation vector: `[cos |a|; sin |a| a/|a|]`.
#[inline(always)]
pub(crate) fn exp(a: Vector) -> Quaternion {
    let angle = length(a);
    let (sine, cosine) = sine_cosine(angle);
    // sin(x)/x is 1 to f64 rounding below 1e-9.
    let sinc = if angle > 1e-9 { sine / angle } else { 1.0 };
    [sinc * a[0], sinc * a[1], sinc * a[2], cosine]
}

/// The logarithm of a unit quaternion, HALF of the rotation vector, of length at
/// most pi. By the arc tangent, not by the arc cosine: the latter loses half of the
/// digits of a small angle.
#[inline(always)]
pub(crate) fn log(q: Quaternion) -> Vector {
    log_toward(q, [1.0, 0.0, 0.0])
}

/// As [`log`]; `axis` gives the direction where the quaternion has none (at -1,
/// where every direction is a logarithm of length pi).
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
    let own = length(principal);
    let far = length(near);
    // A principal logarithm of (almost) nothing still has branches along `near`.
    let has_axis = own > 1e-9;
    let to_own = if has_axis { 1.0 / own } else { 0.0 };
    let to_near = if !has_axis && far > PI {
        1.0 / far
    } else {
        0.0
    };
    let axis = sum(scaled(principal, to_own), scaled(near, to_near));
    let along = axis[0] * near[0] + axis[1] * near[1] + axis[2] * near[2];
    let turns = nearest_whole((along - own) / TAU);
    sum(principal, scaled(axis, turns * TAU))
}

/// The exponentials and logarithms that a method's rule is made of. Two of them:
/// [`Near`] for vector lanes, and [`Anywhere`] for the lanes where it does not hold,
/// so that a lane's result depends on nothing but its own numbers.
pub(crate) trait Algebra {
    /// See [`exp`].
    fn exp(&mut self, a: Vector) -> Quaternion;
    /// See [`log`].
    fn log(&mut self, q: Quaternion) -> Vector;
    /// See [`log_toward`].
    fn log_toward(&mut self, q: Quaternion, axis: Vector) -> Vector;
    /// See [`log_near`].
    fn log_near(&mut self, q: Quaternion, near: Vector) -> Vector;
    /// The logarithm of a step, of which `near` is [`Near`]'s.
    fn log_of_step(&mut self, step: Quaternion, near: Vector) -> Vector;
}

/// Everything, at its price: square roots, divisions and a range reduction for each.
pub(crate) struct Anywhere;

impl Algebra for Anywhere {
    fn exp(&mut self, a: Vector) -> Quaternion {
        exp(a)
    }

    fn log(&mut self, q: Quaternion) -> Vector {
        log(q)
    }

    fn log_toward(&mut self, q: Quaternion, axis: Vector) -> Vector {
        log_toward(q, axis)
    }

    fn log_near(&mut self, q: Quaternion, near: Vector) -> Vector {
        log_near(q, near)
    }

    // A wild tangent multiplies the error of a step's logarithm.
    fn log_of_step(&mut self, step: Quaternion, _: Vector) -> Vector {
        log(step)
    }
}

/// Half-angles up to pi/2, by polynomials alone: within 1e-12.
pub(crate) struct Near {
    /// 1 as long as every argument was within the range, else 0.
    pub(crate) holds: f64,
}

/// Coefficients of `(sin(x)/x - 1) / x²` and of `(cos(x) - 1) / x²` in powers of x²,
/// for x² up to (pi/2)²; from Chebyshev nodes, within 1e-14.
const SINC: [f64; 8] = [
    -0.16666666666666666,
    0.008333333333333316,
    -0.00019841269841254974,
    2.7557319219163234e-06,
    -2.5052107616996182e-08,
    1.6058977312464087e-10,
    -7.643970296798572e-13,
    2.7314447669863995e-15,
];
const COSINE: [f64; 8] = [
    -0.5,
    0.04166666666666634,
    -0.0013888888888860709,
    2.4801587292446213e-05,
    -2.755731776732053e-07,
    2.0876630867422994e-09,
    -1.1464689885720029e-11,
    4.6276759850181716e-14,
];

/// Coefficients of `(x / sin(x) - 1) / u` in powers of u = 1 - cos(x), 0 <= u <= 1;
/// from Chebyshev nodes, within 2e-13.
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

/// `1 + x (c₀ + c₁ x + …)`, four coefficients at a time: a chain of a quarter as many
/// operations. Their number is a multiple of four.
#[inline(always)]
fn one_plus<const N: usize>(c: &[f64; N], x: f64) -> f64 {
    let square = x * x;
    let fourth = square * square;
    let mut sum = 0.0;
    for i in (0..N / 4).rev() {
        let low = c[4 * i + 1] * x + c[4 * i];
        let high = c[4 * i + 3] * x + c[4 * i + 2];
        sum = sum * fourth + (high * square + low);
    }
    sum * x + 1.0
}

/// `x / sin(x)` for `u = 1 - cos(x)`, 0 <= x <= pi/2: an angle from its sine without
/// an arc function.
#[inline(always)]
pub(crate) fn angle_by_sine(u: f64) -> f64 {
    one_plus(&ANGLE_BY_SINE, u)
}

/// `sin(x)/x` and `cos(x)` by `x²`, which is at most (pi/2)²; else NaN.
#[inline(always)]
pub(crate) fn near_waves(square: f64) -> (f64, f64) {
    let doubt = near_or_nan(square, FRAC_PI_2 * FRAC_PI_2);
    let (sinc, cosine) = (one_plus(&SINC, square), one_plus(&COSINE, square));
    (sinc + doubt, cosine + doubt)
}

/// `x²` by `sin²(x/2)`, which is at most 1/2; else NaN.
#[inline(always)]
pub(crate) fn near_arc_square(v: f64) -> f64 {
    4.0 * v * one_plus(&ARC_SQUARE, v) + near_or_nan(v, 0.5)
}

/// 0 up to a limit, else NaN.
#[inline(always)]
fn near_or_nan(value: f64, limit: f64) -> f64 {
    if value <= limit { 0.0 } else { f64::NAN }
}

impl Near {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { holds: 1.0 }
    }

    #[inline(always)]
    fn check(&mut self, value: f64, limit: f64) {
        // Written so that NaN does not pass.
        self.holds = if value <= limit { self.holds } else { 0.0 };
    }
}

impl Algebra for Near {
    #[inline(always)]
    fn exp(&mut self, a: Vector) -> Quaternion {
        let z = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
        self.check(z, FRAC_PI_2 * FRAC_PI_2);
        let sinc = one_plus(&SINC, z);
        let cosine = one_plus(&COSINE, z);
        [sinc * a[0], sinc * a[1], sinc * a[2], cosine]
    }

    #[inline(always)]
    fn log(&mut self, q: Quaternion) -> Vector {
        let u = 1.0 - q[3];
        self.check(u, 1.0);
        scaled([q[0], q[1], q[2]], angle_by_sine(u))
    }

    #[inline(always)]
    fn log_toward(&mut self, q: Quaternion, _: Vector) -> Vector {
        self.log(q)
    }

    #[inline(always)]
    fn log_near(&mut self, q: Quaternion, near: Vector) -> Vector {
        // No other branch is nearer.
        let z = near[0] * near[0] + near[1] * near[1] + near[2] * near[2];
        self.check(z, 1.5 * 1.5);
        self.log(q)
    }

    #[inline(always)]
    fn log_of_step(&mut self, _: Quaternion, near: Vector) -> Vector {
        near
    }
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

    #[test]
    fn exp_undoes_log_on_every_branch() {
        let direction = scaled([2.0, -1.0, 0.5], 1.0 / length([2.0, -1.0, 0.5]));
        let distance = |a: Vector, b: Vector| length(sum(a, scaled(b, -1.0)));
        for angle in [0.0, 1e-12, 1e-5, 0.4, 1.5, 3.0, 3.1] {
            let v = scaled(direction, angle);
            let q = exp(v);
            assert!(distance(log(q), v) < 1e-9, "{angle}");
            for turns in [-2.0, 1.0, 3.0] {
                let far = scaled(direction, angle + turns * TAU);
                let branch = log_near(q, far);
                assert!(distance(branch, far) < 1e-6, "{angle} {turns} {branch:?}");
            }
        }
        assert_eq!(log([0.0, 0.0, 0.0, -1.0]), [PI, 0.0, 0.0]);
        assert_eq!(log([0.0, 0.0, 0.0, 1.0]), [0.0; 3]);
    }

    /// Catches a wrong digit in a polynomial, and one used beyond its range.
    #[test]
    fn near_is_anywhere_or_says_that_it_does_not_hold() {
        let direction = scaled([1.0, 2.0, -2.0], 1.0 / 3.0);
        for i in 0..=20_000 {
            let angle = f64::from(i) * 1e-4;
            let a = scaled(direction, angle);
            let mut near = Near::new();
            let (q, back) = (near.exp(a), near.log(exp(a)));
            assert_eq!(near.holds == 1.0, angle <= FRAC_PI_2, "{angle}");
            if near.holds == 1.0 {
                let error = (0..4).map(|c| (q[c] - exp(a)[c]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-14, "{angle}: {error}");
                let error = length(sum(back, scaled(a, -1.0)));
                assert!(error <= 1e-12 * angle, "{angle}: {error}");
            }
        }
        let mut near = Near::new();
        near.exp([f64::NAN; 3]);
        near.exp([0.0; 3]);
        assert_eq!(near.holds, 0.0);
    }
}
