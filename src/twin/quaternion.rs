//! Twin of `shaders/math/quaternion.wgsl`: the same names, the same order. The twins of its `product`
//! and `dot4` are [`product`](crate::math::quaternion::product) and [`dot`].

use crate::math::quaternion::{cross3, dot, sum};
use crate::simd::lanes::Number;
use crate::twin::arc_tangent::{arc_tangent, flushed, reciprocal_root, root};
use crate::twin::sine_cosine::sine_cosine;

#[inline(always)]
pub(crate) fn rotated(q: [f32; 4], v: [f32; 3]) -> [f32; 3] {
    let axis = [q[0], q[1], q[2]];
    let across = cross3(axis, v);
    let twice = sum(across, across);
    let again = cross3(axis, twice);
    std::array::from_fn(|c| v[c] + twice[c] * q[3] + again[c])
}

#[inline(always)]
pub(crate) fn normalised<N: Number>(q: [N; 4]) -> [N; 4] {
    let scale = reciprocal_root(dot(q, q));
    // Written out: closures are not always inlined.
    [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale]
}

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

/// The function of the shader; its parts are separate functions for blocks of rotations
/// ([`lay_over`](crate::crowd::lay_over)).
#[inline(always)]
pub(crate) fn slerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    let (sum, difference) = chord(a, b);
    let square = dot(difference, difference);
    let whole = dot(sum, sum);
    let half = arc_tangent(root(square), root(whole));
    let sine_and_cosine = sine_cosine((t + t - 1.0) * half);
    let inverse = if square == 0.0 {
        0.0
    } else {
        reciprocal_root(square)
    };
    along(
        sum,
        difference,
        (reciprocal_root(whole), inverse),
        sine_and_cosine,
    )
}

#[inline(always)]
pub(crate) fn over(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    let inner = if t == 1.0 { b } else { slerp(a, b, t) };
    if t == 0.0 { a } else { inner }
}
