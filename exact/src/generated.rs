//! Written by `cargo run -p tumble-shaders` from the shaders: change those.

#![allow(clippy::approx_constant)] // The shaders write pi in two parts.

use crate::functions::Number;

pub(crate) const ARC_0: f32 = -0.3333333;
pub(crate) const ARC_1: f32 = 0.1999974;
pub(crate) const ARC_2: f32 = -0.14278568;
pub(crate) const ARC_3: f32 = 0.110337645;
pub(crate) const ARC_4: f32 = -0.0865688;
pub(crate) const ARC_5: f32 = 0.06250169;
pub(crate) const ARC_6: f32 = -0.03587154;
pub(crate) const ARC_7: f32 = 0.013507771;
pub(crate) const ARC_8: f32 = -0.0023869972;
pub(crate) const COSINE_10: f32 = -2.620902e-7;
pub(crate) const COSINE_2: f32 = -0.5;
pub(crate) const COSINE_4: f32 = 0.041666657;
pub(crate) const COSINE_6: f32 = -0.0013888585;
pub(crate) const COSINE_8: f32 = 2.477018e-5;
pub(crate) const FLUSHED_BITS: u32 = 645922816;
pub(crate) const HALF_PI: f32 = 1.5707964;
pub(crate) const HALF_PI_LOW: f32 = -4.371139e-8;
pub(crate) const PI: f32 = 3.1415927;
pub(crate) const PI_LOW: f32 = -8.742278e-8;
pub(crate) const RECIPROCAL_SEED: u32 = 2129859015;
pub(crate) const ROOT_SEED: u32 = 1597463007;
pub(crate) const SINE_3: f32 = -0.16666657;
pub(crate) const SINE_5: f32 = 0.008333009;
pub(crate) const SINE_7: f32 = -0.00019806049;
pub(crate) const SINE_9: f32 = 2.5989254e-6;

/// 0 where the magnitude is below 2^-50.
#[inline(always)]
pub(crate) fn flushed<N: Number>(x: N) -> N {
    x.zero_below(f32::from_bits(FLUSHED_BITS))
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
