//! The shaders' arithmetic. Written by `cargo run -p tumble-shaders` from the shaders: change those.

use crate::math::quaternion::cross3;
use crate::math::quaternion::dot as dot4;
use crate::math::quaternion::dot3;
use crate::math::quaternion::product;
use crate::shader::*;
use crate::simd::lanes::{Choice, Number};

#[derive(Debug, Clone, Copy)]
pub(crate) struct FromIdentity<N> {
    pub(crate) vector: [N; 3],
    pub(crate) cosm1: N,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct MatrixRows<N> {
    pub(crate) first: [N; 3],
    pub(crate) second: [N; 3],
    pub(crate) third: [N; 3],
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct SmallAngleCubic<N: Choice> {
    pub(crate) powers: [[N; 4]; 7],
    pub(crate) is_valid: N::Flags,
}

/// Components below 2^-64 in magnitude become +0.
#[inline(always)]
pub(crate) fn canonical<N: Number>(q: N) -> N {
    q.zero_below(f32::from_bits(TINY_BITS))
}

/// 0 where the magnitude is below 2^-50.
#[inline(always)]
pub(crate) fn flushed<N: Number>(x: N) -> N {
    x.zero_below(f32::from_bits(FLUSHED_BITS))
}

#[inline(always)]
pub(crate) fn flushed4<N: Number>(q: [N; 4]) -> [N; 4] {
    [flushed(q[0]), flushed(q[1]), flushed(q[2]), flushed(q[3])]
}

#[inline(always)]
pub(crate) fn magnitude(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0x7fffffff)
}

/// 1/x for x > 0.
#[inline(always)]
pub(crate) fn reciprocal<N: Number>(x: N) -> N {
    let seed = x.guess(RECIPROCAL_SEED, 0);
    let first = seed * (N::all(2.0) - x * seed);
    let second = first * (N::all(2.0) - x * first);
    let third = second * (N::all(2.0) - x * second);
    third * (N::all(2.0) - x * third)
}

/// 1/√x for x > 0; large at 0.
#[inline(always)]
pub(crate) fn reciprocal_root<N: Number>(x: N) -> N {
    let seed = x.guess(ROOT_SEED, 1);
    let half = N::all(0.5) * x;
    let first = seed * (N::all(1.5) - half * seed * seed);
    let second = first * (N::all(1.5) - half * first * first);
    second * (N::all(1.5) - half * second * second)
}

#[inline(always)]
pub(crate) fn root<N: Number>(x: N) -> N {
    let near = x * reciprocal_root(x);
    near + (x - near * near) * (N::all(0.5) * reciprocal_root(x))
}

/// The angle of the point (along, up), neither of which is negative, from 0 to pi/2; 0 for (0, 0).
#[inline(always)]
pub(crate) fn acute_arc_tangent(up: f32, along: f32) -> f32 {
    let steep = up > along;
    let large = if steep { up } else { along };
    let small = if steep { along } else { up };
    let divisor = if large == 0.0 { 1.0 } else { large };
    let inverse = reciprocal(divisor);
    let near = small * inverse;
    let t = near + (small - near * divisor) * inverse;
    let z = t * t;
    let high = (((ARC_8 * z + ARC_7) * z + ARC_6) * z + ARC_5) * z + ARC_4;
    let tail = (((high * z + ARC_3) * z + ARC_2) * z + ARC_1) * z + ARC_0;
    let flat = tail * (z * t) + t;
    if steep {
        HALF_PI - flat + HALF_PI_LOW
    } else {
        flat
    }
}

/// The angle of the point (x, y), from -pi to pi; 0 for (0, 0).
#[inline(always)]
pub(crate) fn arc_tangent(y: f32, x: f32) -> f32 {
    let acute = acute_arc_tangent(magnitude(y), magnitude(x));
    let obtuse = if x < 0.0 { PI - acute + PI_LOW } else { acute };
    if y < 0.0 { -obtuse } else { obtuse }
}

/// Sine (x) and cosine (y).
#[inline(always)]
pub(crate) fn sine_cosine<N: Number>(angle: N) -> (N, N) {
    let sines = sine_cosm1(angle, angle * angle);
    (sines.0, sines.1 + N::all(1.0))
}

/// x sin(a)/a and cos(a) - 1, for an angle |a| <= pi/2 that is given by its square z.
#[inline(always)]
pub(crate) fn sine_cosm1<N: Number>(x: N, z: N) -> (N, N) {
    let sine_tail =
        ((N::all(SINE_9) * z + N::all(SINE_7)) * z + N::all(SINE_5)) * z + N::all(SINE_3);
    let sine = sine_tail * (z * x) + x;
    let cosine_tail = (((N::all(COSINE_10) * z + N::all(COSINE_8)) * z + N::all(COSINE_6)) * z
        + N::all(COSINE_4))
        * z
        + N::all(COSINE_2);
    let cosm1 = cosine_tail * z;
    (sine, cosm1)
}

#[inline(always)]
pub(crate) fn sine_cosm1_quarter<N: Number>(x: N, z: N) -> (N, N) {
    sine_cosm1_quarter_end(sine_cosm1_quarter_begin(x, z))
}

/// [`sine_cosm1_quarter`] up to its cut.
#[derive(Clone, Copy)]
pub(crate) struct SineCosm1QuarterBegun<N> {
    pub(crate) x: N,
    pub(crate) z: N,
    pub(crate) sine_tail: N,
    pub(crate) zx: N,
    pub(crate) cosine_tail: N,
}

/// The part of [`sine_cosm1_quarter`] before its cut.
#[inline(always)]
pub(crate) fn sine_cosm1_quarter_begin<N: Number>(x: N, z: N) -> SineCosm1QuarterBegun<N> {
    let zz = z * z;
    let sine_low = N::all(QUARTER_SINE_5) * z + N::all(QUARTER_SINE_3);
    let sine_tail = N::all(QUARTER_SINE_7) * zz + sine_low;
    let zx = z * x;
    let cosine_low = N::all(QUARTER_COSINE_4) * z + N::all(QUARTER_COSINE_2);
    let cosine_high = N::all(QUARTER_COSINE_8) * z + N::all(QUARTER_COSINE_6);
    let cosine_tail = cosine_high * zz + cosine_low;
    SineCosm1QuarterBegun {
        x,
        z,
        sine_tail,
        zx,
        cosine_tail,
    }
}

/// The part of [`sine_cosm1_quarter`] after its cut.
#[inline(always)]
pub(crate) fn sine_cosm1_quarter_end<N: Number>(begun: SineCosm1QuarterBegun<N>) -> (N, N) {
    let SineCosm1QuarterBegun {
        x,
        z,
        sine_tail,
        zx,
        cosine_tail,
    } = begun;
    let sine = sine_tail * zx + x;
    let cosm1 = cosine_tail * z;
    (sine, cosm1)
}

#[inline(always)]
pub(crate) fn norm_squared<N: Number>(q: [N; 4]) -> N {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
}

/// q / |q| for |q| well away from 0.
#[inline(always)]
pub(crate) fn normalised<N: Number>(q: [N; 4]) -> [N; 4] {
    let number_1 = reciprocal_root(dot4(q, q));
    [
        q[0] * number_1,
        q[1] * number_1,
        q[2] * number_1,
        q[3] * number_1,
    ]
}

/// q v q*, for a unit quaternion.
#[inline(always)]
pub(crate) fn rotated<N: Number>(q: [N; 4], v: [N; 3]) -> [N; 3] {
    let once = [
        q[1] * v[2] - q[2] * v[1],
        q[2] * v[0] - q[0] * v[2],
        q[0] * v[1] - q[1] * v[0],
    ];
    let twice = [once[0] + once[0], once[1] + once[1], once[2] + once[2]];
    let again = [
        q[1] * twice[2] - q[2] * twice[1],
        q[2] * twice[0] - q[0] * twice[2],
        q[0] * twice[1] - q[1] * twice[0],
    ];
    [
        v[0] + twice[0] * q[3] + again[0],
        v[1] + twice[1] * q[3] + again[1],
        v[2] + twice[2] * q[3] + again[2],
    ]
}

/// Slerp about the middle of the arc, the shorter way, for t from 0 to 1.
#[inline(always)]
pub(crate) fn slerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    let near = if dot4(a, b) < 0.0 {
        [-b[0], -b[1], -b[2], -b[3]]
    } else {
        b
    };
    let sum = [
        a[0] + near[0],
        a[1] + near[1],
        a[2] + near[2],
        a[3] + near[3],
    ];
    let difference = flushed4([
        near[0] - a[0],
        near[1] - a[1],
        near[2] - a[2],
        near[3] - a[3],
    ]);
    let square = dot4(difference, difference);
    let whole = dot4(sum, sum);
    let half = arc_tangent(root(square), root(whole));
    let sines = sine_cosine((t + t - 1.0) * half);
    let number_1 = if square == 0.0 {
        0.0
    } else {
        reciprocal_root(square)
    };
    let partner = [
        difference[0] * number_1,
        difference[1] * number_1,
        difference[2] * number_1,
        difference[3] * number_1,
    ];
    let number_2 = reciprocal_root(whole);
    [
        sum[0] * number_2 * sines.1 + partner[0] * sines.0,
        sum[1] * number_2 * sines.1 + partner[1] * sines.0,
        sum[2] * number_2 * sines.1 + partner[2] * sines.0,
        sum[3] * number_2 * sines.1 + partner[3] * sines.0,
    ]
}

/// Slerp whose ends are the bits of a and b themselves.
#[inline(always)]
pub(crate) fn over(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    if t == 0.0 {
        a
    } else if t == 1.0 {
        b
    } else {
        slerp(a, b, t)
    }
}

/// The coefficients are those of 1, s, s², … s¹⁰. Neighbouring powers are added in pairs (Estrin's
/// scheme), which makes short chains of operations instead of one long one. The constant comes
/// last: what is added to it is small, and so are the roundings of what is added.
#[inline(always)]
pub(crate) fn polynomial<N: Number>(c: [N; 11], s: N) -> N {
    polynomial_end(c, polynomial_begin(s))
}

/// [`polynomial`] up to its cut.
#[derive(Clone, Copy)]
pub(crate) struct PolynomialBegun<N> {
    pub(crate) s: N,
    pub(crate) z: N,
    pub(crate) zz: N,
}

/// The part of [`polynomial`] before its cut.
#[inline(always)]
pub(crate) fn polynomial_begin<N: Number>(s: N) -> PolynomialBegun<N> {
    let z = s * s;
    let zz = z * z;
    PolynomialBegun { s, z, zz }
}

/// The part of [`polynomial`] after its cut.
#[inline(always)]
pub(crate) fn polynomial_end<N: Number>(c: [N; 11], begun: PolynomialBegun<N>) -> N {
    let PolynomialBegun { s, z, zz } = begun;
    let third = c[3] * s + c[2];
    let fifth = c[5] * s + c[4];
    let seventh = c[7] * s + c[6];
    let ninth = c[9] * s + c[8];
    let high = (c[10] * z + ninth) * zz + (seventh * z + fifth);
    c[0] + (high * zz + (third * z + c[1] * s))
}

#[inline(always)]
pub(crate) fn arc_between<N: Number>(start: [N; 4], end: [N; 4]) -> ([N; 4], [N; 4]) {
    let half = [
        (start[0] + end[0]) * N::all(0.5),
        (start[1] + end[1]) * N::all(0.5),
        (start[2] + end[2]) * N::all(0.5),
        (start[3] + end[3]) * N::all(0.5),
    ];
    let difference = [
        end[0] - start[0],
        end[1] - start[1],
        end[2] - start[2],
        end[3] - start[3],
    ];
    let x = norm_squared(difference) * N::all(0.25);
    let xx = x * x;
    let secant_7 = N::all(SECANT_8) * x + N::all(SECANT_7);
    let secant_5 = N::all(SECANT_6) * x + N::all(SECANT_5);
    let secant_3 = N::all(SECANT_4) * x + N::all(SECANT_3);
    let secant_1 = N::all(SECANT_2) * x + N::all(SECANT_1);
    let secant_high = (N::all(SECANT_9) * xx + secant_7) * xx + secant_5;
    let secant = ((secant_high * xx + secant_3) * xx + secant_1) * x;
    let sine_7 = N::all(ARC_SINE_8) * x + N::all(ARC_SINE_7);
    let sine_5 = N::all(ARC_SINE_6) * x + N::all(ARC_SINE_5);
    let sine_3 = N::all(ARC_SINE_4) * x + N::all(ARC_SINE_3);
    let sine_1 = N::all(ARC_SINE_2) * x + N::all(ARC_SINE_1);
    let arc_sine = (((sine_7 * xx + sine_5) * xx + sine_3) * xx + sine_1) * x;
    (
        [
            canonical(half[0] * secant + half[0]),
            canonical(half[1] * secant + half[1]),
            canonical(half[2] * secant + half[2]),
            canonical(half[3] * secant + half[3]),
        ],
        [
            canonical(difference[0] * arc_sine + difference[0]),
            canonical(difference[1] * arc_sine + difference[1]),
            canonical(difference[2] * arc_sine + difference[2]),
            canonical(difference[3] * arc_sine + difference[3]),
        ],
    )
}

/// The bits of each component as a half, for |component| < 2.
#[inline(always)]
pub(crate) fn to_half(value: f32) -> u32 {
    let bits = value.to_bits();
    let sign = (bits >> 16) & 0x8000;
    let magnitude = bits & 0x7fffffff;
    let odd = (magnitude >> 13) & 1;
    let normal = magnitude
        .wrapping_add(0xfff)
        .wrapping_add(odd)
        .wrapping_sub(0x38000000)
        >> 13;
    let small = (f32::from_bits(magnitude) + 0.5)
        .to_bits()
        .wrapping_sub(0x3f000000);
    sign | (if magnitude < LEAST_NORMAL {
        small
    } else {
        normal
    })
}

/// As `to_half`, for values of any magnitude.
#[inline(always)]
pub(crate) fn to_any_half(value: f32) -> u32 {
    let bits = value.to_bits();
    let large = bits & 0x7fffffff >= HALF_OVERFLOW;
    let sign = (bits >> 16) & 0x8000;
    let small = if large { 0.0 } else { value };
    if large { sign | 0x7c00 } else { to_half(small) }
}

/// The whole number of each component, for |component| < 1 + 2^-16.
#[inline(always)]
pub(crate) fn to_snorm(value: f32) -> u32 {
    (value * 32767.0 + 12582912.0).to_bits() & 0xffff
}

#[inline(always)]
pub(crate) fn matrix_rows(rotation: [f32; 4], detail: u32) -> MatrixRows<f32> {
    let mut rows = MatrixRows {
        first: [0.0; 3],
        second: [0.0; 3],
        third: [0.0; 3],
    };
    let v = [rotation[0], rotation[1], rotation[2]];
    let w = if detail == 1 {
        -rotation[3]
    } else {
        rotation[3]
    };
    let double = [v[0] + v[0], v[1] + v[1], v[2] + v[2]];
    let xx = v[0] * double[0];
    let yy = v[1] * double[1];
    let zz = v[2] * double[2];
    let xy = v[0] * double[1];
    let yz = v[1] * double[2];
    let zx = v[2] * double[0];
    let wx = w * double[0];
    let wy = w * double[1];
    let wz = w * double[2];
    rows.first = [1.0 - (yy + zz), xy - wz, zx + wy];
    rows.second = [xy + wz, 1.0 - (xx + zz), yz - wx];
    rows.third = [zx - wy, yz + wx, 1.0 - (xx + yy)];
    rows
}

#[inline(always)]
pub(crate) fn axis_angle(rotation: [f32; 4]) -> [f32; 4] {
    let x = flushed(rotation[0]);
    let y = flushed(rotation[1]);
    let z = flushed(rotation[2]);
    let square = x * x + y * y + z * z;
    let scale = reciprocal_root(square);
    let angle = arc_tangent(root(square), flushed(rotation[3])) * 114.59156;
    let axis_and_angle = [x * scale, y * scale, z * scale, angle];
    if square == 0.0 {
        [1.0, 0.0, 0.0, angle]
    } else {
        axis_and_angle
    }
}

/// An angle brought into -pi to pi.
#[inline(always)]
pub(crate) fn wrapped(angle: f32) -> f32 {
    let low = if angle < -3.1415927 {
        angle + 6.2831855 + -1.7484555e-7
    } else {
        angle
    };
    if low > PI {
        low - 6.2831855 - -1.7484555e-7
    } else {
        low
    }
}

#[inline(always)]
pub(crate) fn euler(rotation: [f32; 4], detail: u32) -> [f32; 3] {
    let symmetric = detail & SYMMETRIC != 0;
    let intrinsic = detail & INTRINSIC != 0;
    let sign = if detail & NEGATIVE != 0 { -1.0 } else { 1.0 };
    let w = rotation[3];
    let i = rotation[(detail & 3) as usize];
    let j = rotation[((detail >> 2) & 3) as usize];
    let k = rotation[((detail >> 4) & 3) as usize] * sign;
    let a = flushed(if symmetric { w } else { w - j });
    let b = flushed(if symmetric { i } else { i + k });
    let c = flushed(if symmetric { j } else { j + w });
    let d = flushed(if symmetric { k } else { k - i });
    let sine = root(c * c + d * d);
    let cosine = root(a * a + b * b);
    let half_sum = arc_tangent(b, a);
    let half_difference = arc_tangent(d, c);
    let closed = sine < GIMBAL;
    let open = cosine < GIMBAL;
    let locked = closed || open;
    let sum = half_sum + half_difference;
    let difference = half_sum - half_difference;
    let opposite = if intrinsic {
        half_difference
    } else {
        -half_difference
    };
    let together = 2.0 * (if closed { half_sum } else { opposite });
    let third_sign = if symmetric { 1.0 } else { sign };
    let outer = if locked {
        together
    } else if intrinsic {
        sum * third_sign
    } else {
        difference
    };
    let inner = if locked {
        0.0
    } else if intrinsic {
        difference
    } else {
        sum * third_sign
    };
    let first = if locked && intrinsic {
        outer * third_sign
    } else {
        outer
    };
    let whole = 2.0 * acute_arc_tangent(sine, cosine);
    let second = if symmetric {
        whole
    } else {
        whole - HALF_PI - HALF_PI_LOW
    };
    [
        wrapped(first) * DEGREES,
        second * DEGREES,
        wrapped(inner) * DEGREES,
    ]
}

/// A rotation, and then that of half a rotation vector; 0, which is no rotation, where that is too long.
/// One Newton step takes back what rounding does to the length; without a rotation every bit stays.
#[inline(always)]
pub(crate) fn rotated_by(q: [f32; 4], v: [f32; 4]) -> [f32; 4] {
    let half = flushed4(v);
    let square = half[0] * half[0] + half[1] * half[1] + half[2] * half[2];
    let long = square > LONGEST_ANGLE_SQUARE;
    let z = if long { 0.0 } else { square };
    let sines = sine_cosm1(1.0, z);
    let more = product(
        q,
        [
            half[0] * sines.0,
            half[1] * sines.0,
            half[2] * sines.0,
            sines.1,
        ],
    );
    let sum = [
        q[0] + more[0],
        q[1] + more[1],
        q[2] + more[2],
        q[3] + more[3],
    ];
    let number_1 = 1.5 - 0.5 * dot4(sum, sum);
    let unit = [
        sum[0] * number_1,
        sum[1] * number_1,
        sum[2] * number_1,
        sum[3] * number_1,
    ];
    if long {
        [0.0, 0.0, 0.0, 0.0]
    } else if square == 0.0 {
        q
    } else {
        unit
    }
}

/// A cubic about the middle of its span.
#[inline(always)]
pub(crate) fn cubic<N: Number>(c0: N, c1: N, c2: N, c3: N, s: N) -> N {
    let z = s * s;
    c0 + ((c3 * s + c2) * z + c1 * s)
}

/// Turns a base on by what a layer differs from its reference: base (reference⁻¹ layer)^weight.
#[inline(always)]
pub(crate) fn rotation_added(
    base: [f32; 4],
    layer: [f32; 4],
    reference: [f32; 4],
    weight: f32,
) -> [f32; 4] {
    let inverse = [-reference[0], -reference[1], -reference[2], reference[3]];
    let weighted = slerp([0.0, 0.0, 0.0, 1.0], product(inverse, layer), weight);
    let vector_1 = normalised(product(base, weighted));
    [
        canonical(vector_1[0]),
        canonical(vector_1[1]),
        canonical(vector_1[2]),
        canonical(vector_1[3]),
    ]
}

/// A rotation, a translation or a scale under the next layer. For scales `reference` holds reciprocals.
#[inline(always)]
pub(crate) fn laid_over(
    kind: u32,
    is_additive: bool,
    below: [f32; 4],
    layer: [f32; 4],
    reference: [f32; 4],
    weight: f32,
) -> [f32; 4] {
    if kind == ROTATION {
        if is_additive {
            return rotation_added(below, layer, reference, weight);
        }
        let vector_1 = over(below, layer, weight);
        return [
            canonical(vector_1[0]),
            canonical(vector_1[1]),
            canonical(vector_1[2]),
            canonical(vector_1[3]),
        ];
    }
    if !is_additive {
        let vector_2 = if weight == 1.0 {
            layer
        } else {
            [
                below[0] + (layer[0] - below[0]) * weight,
                below[1] + (layer[1] - below[1]) * weight,
                below[2] + (layer[2] - below[2]) * weight,
                below[3] + (layer[3] - below[3]) * weight,
            ]
        };
        return [
            canonical(vector_2[0]),
            canonical(vector_2[1]),
            canonical(vector_2[2]),
            canonical(vector_2[3]),
        ];
    }
    if kind == TRANSLATION {
        return [
            canonical(below[0] + (layer[0] - reference[0]) * weight),
            canonical(below[1] + (layer[1] - reference[1]) * weight),
            canonical(below[2] + (layer[2] - reference[2]) * weight),
            canonical(below[3] + (layer[3] - reference[3]) * weight),
        ];
    }
    [
        canonical(below[0] + below[0] * ((layer[0] * reference[0] - 1.0) * weight)),
        canonical(below[1] + below[1] * ((layer[1] * reference[1] - 1.0) * weight)),
        canonical(below[2] + below[2] * ((layer[2] * reference[2] - 1.0) * weight)),
        canonical(below[3] + below[3] * ((layer[3] * reference[3] - 1.0) * weight)),
    ]
}

/// The vector part of a⁻¹ (a + chord), the step from a to its next key.
#[inline(always)]
pub(crate) fn step_vector<N: Number>(a: [N; 4], chord: [N; 4]) -> [N; 3] {
    [
        a[3] * chord[0] - chord[3] * a[0] - (a[1] * chord[2] - a[2] * chord[1]),
        a[3] * chord[1] - chord[3] * a[1] - (a[2] * chord[0] - a[0] * chord[2]),
        a[3] * chord[2] - chord[3] * a[2] - (a[0] * chord[1] - a[1] * chord[0]),
    ]
}

/// The logarithm of a small rotation by its vector part, whose length is the sine.
#[inline(always)]
pub(crate) fn small_log<N: Number>(v: [N; 3]) -> [N; 3] {
    let x = dot3(v, v);
    let tail = ((N::all(LOG_4) * x + N::all(LOG_3)) * x + N::all(LOG_2)) * x + N::all(LOG_1);
    let number_1 = tail * x;
    [
        v[0] * number_1 + v[0],
        v[1] * number_1 + v[1],
        v[2] * number_1 + v[2],
    ]
}

/// The exponential of a small half-rotation vector.
#[inline(always)]
pub(crate) fn small_exp<N: Number>(v: [N; 3]) -> FromIdentity<N> {
    let x = dot3(v, v);
    let sinc = (N::all(SINC_2) * x + N::all(SINC_1)) * x;
    FromIdentity {
        vector: [v[0] * sinc + v[0], v[1] * sinc + v[1], v[2] * sinc + v[2]],
        cosm1: (N::all(COSM1_2) * x + N::all(COSM1_1)) * x,
    }
}

/// The Hamilton product a b.
#[inline(always)]
pub(crate) fn composed<N: Number>(a: FromIdentity<N>, b: FromIdentity<N>) -> FromIdentity<N> {
    let vector_1 = cross3(a.vector, b.vector);
    FromIdentity {
        vector: [
            a.vector[0]
                + b.vector[0]
                + (a.vector[0] * b.cosm1 + b.vector[0] * a.cosm1)
                + vector_1[0],
            a.vector[1]
                + b.vector[1]
                + (a.vector[1] * b.cosm1 + b.vector[1] * a.cosm1)
                + vector_1[1],
            a.vector[2]
                + b.vector[2]
                + (a.vector[2] * b.cosm1 + b.vector[2] * a.cosm1)
                + vector_1[2],
        ],
        cosm1: a.cosm1 + b.cosm1 + a.cosm1 * b.cosm1 - dot3(a.vector, b.vector),
    }
}

/// r⁻¹ v r.
#[inline(always)]
pub(crate) fn inverse_rotated<N: Number>(v: [N; 3], r: FromIdentity<N>) -> [N; 3] {
    let once = cross3(r.vector, v);
    let twice = [once[0] + once[0], once[1] + once[1], once[2] + once[2]];
    let vector_1 = cross3(r.vector, twice);
    [
        v[0] - (twice[0] * r.cosm1 + twice[0]) + vector_1[0],
        v[1] - (twice[1] * r.cosm1 + twice[1]) + vector_1[1],
        v[2] - (twice[2] * r.cosm1 + twice[2]) + vector_1[2],
    ]
}

/// The Hamilton product of m and \[v, w].
#[inline(always)]
pub(crate) fn canonical_product<N: Number>(m: [N; 4], v: [N; 3], w: N) -> [N; 4] {
    [
        canonical(m[3] * v[0] + m[0] * w + m[1] * v[2] - m[2] * v[1]),
        canonical(m[3] * v[1] - m[0] * v[2] + m[1] * w + m[2] * v[0]),
        canonical(m[3] * v[2] + m[0] * v[1] - m[1] * v[0] + m[2] * w),
        canonical(m[3] * w - m[0] * v[0] - m[1] * v[1] - m[2] * v[2]),
    ]
}

/// The curve between `start` and `end`. Each of the four keys has the sign that is nearer to the
/// key before it.
#[inline(always)]
pub(crate) fn small_angle_cubic<N: Choice>(
    before: [N; 4],
    start: [N; 4],
    end: [N; 4],
    after: [N; 4],
    first: (N, N, N, N),
    last: (N, N, N, N),
) -> SmallAngleCubic<N> {
    let chord_before = [
        start[0] - before[0],
        start[1] - before[1],
        start[2] - before[2],
        start[3] - before[3],
    ];
    let chord = [
        end[0] - start[0],
        end[1] - start[1],
        end[2] - start[2],
        end[3] - start[3],
    ];
    let chord_after = [
        after[0] - end[0],
        after[1] - end[1],
        after[2] - end[2],
        after[3] - end[3],
    ];
    let step = step_vector(start, chord);
    let log_before = small_log(step_vector(before, chord_before));
    let log = small_log(step);
    let log_after = small_log(step_vector(end, chord_after));
    let first_left = [
        log_before[0] * first.0,
        log_before[1] * first.0,
        log_before[2] * first.0,
    ];
    let first_right = [log[0] * first.1, log[1] * first.1, log[2] * first.1];
    let last_left = [log[0] * last.0, log[1] * last.0, log[2] * last.0];
    let last_right = [
        log_after[0] * last.1,
        log_after[1] * last.1,
        log_after[2] * last.1,
    ];
    let first_tangent = small_log(composed(small_exp(first_left), small_exp(first_right)).vector);
    let last_tangent = small_log(composed(small_exp(last_left), small_exp(last_right)).vector);
    let outgoing = [
        first_tangent[0] * first.2,
        first_tangent[1] * first.2,
        first_tangent[2] * first.2,
    ];
    let number_1 = N::all(THIRD) - last.2;
    let incoming = [
        last_tangent[0] * number_1,
        last_tangent[1] * number_1,
        last_tangent[2] * number_1,
    ];
    let parabola = [
        log[0] * N::all(TWO_THIRDS),
        log[1] * N::all(TWO_THIRDS),
        log[2] * N::all(TWO_THIRDS),
    ];
    let number_2 = first.3.equals(N::all(KEY_AT_END));
    let w1 = [
        N::choose(number_2, parabola[0] - incoming[0], outgoing[0]),
        N::choose(number_2, parabola[1] - incoming[1], outgoing[1]),
        N::choose(number_2, parabola[2] - incoming[2], outgoing[2]),
    ];
    let number_3 = last.3.equals(N::all(KEY_AT_END));
    let v3 = [
        N::choose(number_3, parabola[0] - outgoing[0], incoming[0]),
        N::choose(number_3, parabola[1] - outgoing[1], incoming[1]),
        N::choose(number_3, parabola[2] - outgoing[2], incoming[2]),
    ];
    let whole = FromIdentity {
        vector: step,
        cosm1: norm_squared(chord) * N::all(-0.5),
    };
    let without_first = composed(small_exp([-w1[0], -w1[1], -w1[2]]), whole);
    let w2 = small_log(composed(without_first, small_exp([-v3[0], -v3[1], -v3[2]])).vector);
    let squared_extent = dot3(w1, w1) + dot3(w2, w2) + dot3(v3, v3);
    let third_step = small_exp([
        v3[0] * N::all(0.125),
        v3[1] * N::all(0.125),
        v3[2] * N::all(0.125),
    ]);
    let second_step = composed(
        small_exp([
            w2[0] * N::all(0.5),
            w2[1] * N::all(0.5),
            w2[2] * N::all(0.5),
        ]),
        third_step,
    );
    let all_steps = composed(
        small_exp([
            w1[0] * N::all(0.875),
            w1[1] * N::all(0.875),
            w1[2] * N::all(0.875),
        ]),
        second_step,
    );
    let vector_4 = canonical_product(start, all_steps.vector, all_steps.cosm1);
    let m = [
        vector_4[0] + start[0],
        vector_4[1] + start[1],
        vector_4[2] + start[2],
        vector_4[3] + start[3],
    ];
    let v1 = inverse_rotated(w1, second_step);
    let v2 = inverse_rotated(w2, third_step);
    let outer = [v1[0] + v3[0], v1[1] + v3[1], v1[2] + v3[2]];
    let a = [
        outer[0] * N::all(0.75) + v2[0] * N::all(1.5),
        outer[1] * N::all(0.75) + v2[1] * N::all(1.5),
        outer[2] * N::all(0.75) + v2[2] * N::all(1.5),
    ];
    let b = [
        (v3[0] - v1[0]) * N::all(1.5),
        (v3[1] - v1[1]) * N::all(1.5),
        (v3[2] - v1[2]) * N::all(1.5),
    ];
    let c = [
        outer[0] - (v2[0] + v2[0]),
        outer[1] - (v2[1] + v2[1]),
        outer[2] - (v2[2] + v2[2]),
    ];
    let x12 = cross3(v1, v2);
    let x23 = cross3(v2, v3);
    let x13 = cross3(v1, v3);
    let even = [x12[0] + x23[0], x12[1] + x23[1], x12[2] + x23[2]];
    let odd = [x12[0] - x23[0], x12[1] - x23[1], x12[2] - x23[2]];
    let n1 = dot3(v1, v1);
    let n2 = dot3(v2, v2);
    let n3 = dot3(v3, v3);
    let d12 = dot3(v1, v2);
    let d13 = dot3(v1, v3);
    let d23 = dot3(v2, v3);
    let outward = n1 + n3;
    let difference = n1 - n3;
    let volume = dot3(v1, x23);
    let number_5 =
        n1 * N::all(B_111_1) + n2 * N::all(B_122_1) + n3 * N::all(B_133_1) - d23 * N::all(B_123_1);
    let number_6 =
        n3 * N::all(B_111_1) + n2 * N::all(B_122_1) + n1 * N::all(B_133_1) - d12 * N::all(B_123_1);
    let number_7 = outward * N::all(B_211_1) + n2 * N::all(B_222_1) + d13 * N::all(B_123_1);
    let f1 = [
        v1[0] * number_5 + v3[0] * number_6 + v2[0] * number_7,
        v1[1] * number_5 + v3[1] * number_6 + v2[1] * number_7,
        v1[2] * number_5 + v3[2] * number_6 + v2[2] * number_7,
    ];
    let number_8 = n1 * N::all(B_111_2) + n2 * N::all(B_122_2) + n3 * N::all(B_133_2);
    let number_9 = n3 * N::all(B_111_2) + n2 * N::all(B_122_2) + n1 * N::all(B_133_2);
    let number_10 = difference * N::all(B_211_2);
    let f2 = [
        v1[0] * number_8 - v3[0] * number_9 + v2[0] * number_10,
        v1[1] * number_8 - v3[1] * number_9 + v2[1] * number_10,
        v1[2] * number_8 - v3[2] * number_9 + v2[2] * number_10,
    ];
    let number_11 =
        n1 * N::all(B_111_3) + n2 * N::all(B_122_3) + n3 * N::all(B_133_3) - d23 * N::all(B_123_3);
    let number_12 =
        n3 * N::all(B_111_3) + n2 * N::all(B_122_3) + n1 * N::all(B_133_3) - d12 * N::all(B_123_3);
    let number_13 = outward * N::all(B_211_3) + n2 * N::all(B_222_3) + d13 * N::all(B_123_3);
    let f3 = [
        v1[0] * number_11 + v3[0] * number_12 + v2[0] * number_13,
        v1[1] * number_11 + v3[1] * number_12 + v2[1] * number_13,
        v1[2] * number_11 + v3[2] * number_12 + v2[2] * number_13,
    ];
    let number_14 = n1 * N::all(B_111_4) + n2 * N::all(B_122_4) + n3 * N::all(B_133_4);
    let number_15 = n3 * N::all(B_111_4) + n2 * N::all(B_122_4) + n1 * N::all(B_133_4);
    let number_16 = difference * N::all(B_211_4);
    let f4 = [
        v1[0] * number_14 - v3[0] * number_15 + v2[0] * number_16,
        v1[1] * number_14 - v3[1] * number_15 + v2[1] * number_16,
        v1[2] * number_14 - v3[2] * number_15 + v2[2] * number_16,
    ];
    let number_17 =
        n1 * N::all(B_111_5) + n2 * N::all(B_122_5) + n3 * N::all(B_133_5) - d23 * N::all(B_123_5);
    let number_18 =
        n3 * N::all(B_111_5) + n2 * N::all(B_122_5) + n1 * N::all(B_133_5) - d12 * N::all(B_123_5);
    let number_19 = outward * N::all(B_211_5) + n2 * N::all(B_222_5) + d13 * N::all(B_123_5);
    let f5 = [
        v1[0] * number_17 + v3[0] * number_18 + v2[0] * number_19,
        v1[1] * number_17 + v3[1] * number_18 + v2[1] * number_19,
        v1[2] * number_17 + v3[2] * number_18 + v2[2] * number_19,
    ];
    let number_20 = n1 * N::all(B_111_6) + n2 * N::all(B_122_6) + n3 * N::all(B_133_6);
    let number_21 = n3 * N::all(B_111_6) + n2 * N::all(B_122_6) + n1 * N::all(B_133_6);
    let number_22 = difference * N::all(B_211_6);
    let f6 = [
        v1[0] * number_20 - v3[0] * number_21 + v2[0] * number_22,
        v1[1] * number_20 - v3[1] * number_21 + v2[1] * number_22,
        v1[2] * number_20 - v3[2] * number_21 + v2[2] * number_22,
    ];
    SmallAngleCubic {
        powers: [
            [
                canonical(m[0]),
                canonical(m[1]),
                canonical(m[2]),
                canonical(m[3]),
            ],
            canonical_product(
                m,
                [a[0] + f1[0], a[1] + f1[1], a[2] + f1[2]],
                -(volume * N::all(B_123_1)),
            ),
            canonical_product(
                m,
                [
                    b[0] + (even[0] * N::all(1.125) + x13[0] * N::all(0.5625) + f2[0]),
                    b[1] + (even[1] * N::all(1.125) + x13[1] * N::all(0.5625) + f2[1]),
                    b[2] + (even[2] * N::all(1.125) + x13[2] * N::all(0.5625) + f2[2]),
                ],
                dot3(a, a) * N::all(-0.5),
            ),
            canonical_product(
                m,
                [
                    c[0] + (odd[0] * N::all(-2.25) + f3[0]),
                    c[1] + (odd[1] * N::all(-2.25) + f3[1]),
                    c[2] + (odd[2] * N::all(-2.25) + f3[2]),
                ],
                -dot3(a, b) - volume * N::all(B_123_3),
            ),
            canonical_product(
                m,
                [
                    x13[0] * N::all(-0.75) + f4[0],
                    x13[1] * N::all(-0.75) + f4[1],
                    x13[2] * N::all(-0.75) + f4[2],
                ],
                dot3(b, b) * N::all(-0.5) - dot3(a, c),
            ),
            canonical_product(
                m,
                [
                    odd[0] * N::all(3.0) + f5[0],
                    odd[1] * N::all(3.0) + f5[1],
                    odd[2] * N::all(3.0) + f5[2],
                ],
                -dot3(b, c) - volume * N::all(B_123_5),
            ),
            canonical_product(
                m,
                [
                    x13[0] - (even[0] + even[0]) + f6[0],
                    x13[1] - (even[1] + even[1]) + f6[1],
                    x13[2] - (even[2] + even[2]) + f6[2],
                ],
                dot3(c, c) * N::all(-0.5),
            ),
        ],
        is_valid: squared_extent.at_most(N::all(SMALL_SQUARED_EXTENT))
            & norm_squared(chord_before).at_most(N::all(LONGEST_STEP))
            & norm_squared(chord).at_most(N::all(LONGEST_STEP))
            & norm_squared(chord_after).at_most(N::all(LONGEST_STEP))
            & dot3(first_left, first_left).at_most(N::all(LONGEST_TANGENT_PART))
            & dot3(first_right, first_right).at_most(N::all(LONGEST_TANGENT_PART))
            & dot3(last_left, last_left).at_most(N::all(LONGEST_TANGENT_PART))
            & dot3(last_right, last_right).at_most(N::all(LONGEST_TANGENT_PART))
            & !first.3.equals(N::all(KEY_UNKNOWN))
            & !last.3.equals(N::all(KEY_UNKNOWN)),
    }
}

/// The rotation by an angle, up to 8192 rad in magnitude, about a unit axis.
#[inline(always)]
pub(crate) fn rotation_about<N: Choice>(axis: [N; 3], angle: N) -> [N; 4] {
    let half = angle * N::all(0.5);
    let shifted = half * N::all(QUARTERS_PER_RADIAN) + N::all(WHOLE_SHIFT);
    let whole = shifted - N::all(WHOLE_SHIFT);
    let rest =
        half - whole * N::all(QUARTER_1) - whole * N::all(QUARTER_2) - whole * N::all(QUARTER_3);
    let sines = sine_cosine(rest);
    let sign = N::choose(shifted.has_bits(2), N::all(-1.0), N::all(1.0));
    let sine = N::choose(shifted.has_bits(1), sines.1, sines.0) * sign;
    let cosine = N::choose(shifted.has_bits(1), -sines.0, sines.1) * sign;
    [axis[0] * sine, axis[1] * sine, axis[2] * sine, cosine]
}
