//! Quaternion algebra, of `shaders/math/quaternion.wgsl`. Its `product` and `dot4` are
//! [`product`](crate::math::quaternion::product) and [`dot`], which f64 shares. [`chord`] and [`along`] are parts of
//! [`slerp`](crate::twin::functions::slerp) in the same order of operations, for blocks of rotations ([`lay_over`](crate::crowd::lay_over)).

use crate::math::quaternion::dot;
use crate::simd::lanes::Number;
use crate::twin::functions::flushed;
pub(crate) use crate::twin::functions::{normalised, over, rotated};

/// The sum of two rotations, and the difference from the first to the nearer sign of the second.
#[inline(always)]
pub(crate) fn chord<N: Number>(a: [N; 4], b: [N; 4]) -> ([N; 4], [N; 4]) {
    let sign = dot(a, b).sign();
    let near = [b[0] * sign, b[1] * sign, b[2] * sign, b[3] * sign];
    let sum = [
        a[0] + near[0],
        a[1] + near[1],
        a[2] + near[2],
        a[3] + near[3],
    ];
    let difference = [
        flushed(near[0] - a[0]),
        flushed(near[1] - a[1]),
        flushed(near[2] - a[2]),
        flushed(near[3] - a[3]),
    ];
    (sum, difference)
}

/// The rotation at an angle from the middle of a chord, for the angle's sine and cosine and the inverse lengths of
/// the sum and of the difference.
#[inline(always)]
pub(crate) fn along<N: Number>(
    sum: [N; 4],
    difference: [N; 4],
    (to_unit, inverse): (N, N),
    sine_and_cosine: (N, N),
) -> [N; 4] {
    [
        sum[0] * to_unit * sine_and_cosine.1 + difference[0] * inverse * sine_and_cosine.0,
        sum[1] * to_unit * sine_and_cosine.1 + difference[1] * inverse * sine_and_cosine.0,
        sum[2] * to_unit * sine_and_cosine.1 + difference[2] * inverse * sine_and_cosine.0,
        sum[3] * to_unit * sine_and_cosine.1 + difference[3] * inverse * sine_and_cosine.0,
    ]
}
