//! Twin of `shaders/math/quaternion.wgsl`: the same names, the same order. The twins of its `product`
//! and `dot4` are [`product`](crate::math::quaternion::product) and [`dot`].

use crate::math::quaternion::{cross3, dot, sum};
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
pub(crate) fn normalised(q: [f32; 4]) -> [f32; 4] {
    let scale = reciprocal_root(dot(q, q));
    q.map(|c| c * scale)
}

/// The sum of two rotations, and what leads from the first to the nearer sign of the second.
#[inline(always)]
pub(crate) fn chord(a: [f32; 4], b: [f32; 4]) -> ([f32; 4], [f32; 4]) {
    let near = if dot(a, b) < 0.0 { b.map(|c| -c) } else { b };
    let sum: [f32; 4] = std::array::from_fn(|c| a[c] + near[c]);
    (sum, std::array::from_fn(|c| flushed(near[c] - a[c])))
}

/// 0 for 0.
#[inline(always)]
pub(crate) fn inverse_root(square: f32) -> f32 {
    if square == 0.0 {
        0.0
    } else {
        reciprocal_root(square)
    }
}

/// The rotation at an angle from the middle of a chord, whose sine and cosine are `turn`, with the inverse
/// lengths of the sum and of the difference.
#[inline(always)]
pub(crate) fn along(
    sum: [f32; 4],
    difference: [f32; 4],
    (to_unit, inverse): (f32, f32),
    turn: (f32, f32),
) -> [f32; 4] {
    std::array::from_fn(|c| sum[c] * to_unit * turn.1 + difference[c] * inverse * turn.0)
}

/// The function of the shader, whose parts are functions of their own for blocks of rotations
/// ([`lay_over`](crate::crowd::lay_over)).
#[inline(always)]
pub(crate) fn slerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    let (sum, difference) = chord(a, b);
    let square = dot(difference, difference);
    let whole = dot(sum, sum);
    let half = arc_tangent(root(square), root(whole));
    let turn = sine_cosine((t + t - 1.0) * half);
    let scales = (reciprocal_root(whole), inverse_root(square));
    along(sum, difference, scales, turn)
}

#[inline(always)]
pub(crate) fn over(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    let inner = if t == 1.0 { b } else { slerp(a, b, t) };
    if t == 0.0 { a } else { inner }
}
