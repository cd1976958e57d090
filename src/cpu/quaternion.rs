//! Twin of `shaders/quaternion.wgsl`: the same names, the same order.

use super::arc_tangent::{arc_tangent, clean, reciprocal_root, root};
use super::sine_cosine::sine_cosine;

/// The Hamilton product `a b`.
#[inline(always)]
pub(super) fn product(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

#[inline(always)]
pub(super) fn inner(a: [f32; 4], b: [f32; 4]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

#[inline(always)]
pub(super) fn rotated(q: [f32; 4], v: [f32; 3]) -> [f32; 3] {
    let across = [
        q[1] * v[2] - q[2] * v[1],
        q[2] * v[0] - q[0] * v[2],
        q[0] * v[1] - q[1] * v[0],
    ];
    let twice = across.map(|c| c + c);
    let again = [
        q[1] * twice[2] - q[2] * twice[1],
        q[2] * twice[0] - q[0] * twice[2],
        q[0] * twice[1] - q[1] * twice[0],
    ];
    std::array::from_fn(|c| v[c] + twice[c] * q[3] + again[c])
}

#[inline(always)]
pub(super) fn normalised(q: [f32; 4]) -> [f32; 4] {
    let scale = reciprocal_root(inner(q, q));
    q.map(|c| c * scale)
}

#[inline(always)]
pub(super) fn slerp(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    let near = if inner(a, b) < 0.0 { b.map(|c| -c) } else { b };
    let sum: [f32; 4] = std::array::from_fn(|c| a[c] + near[c]);
    let difference: [f32; 4] = std::array::from_fn(|c| clean(near[c] - a[c]));
    let square = inner(difference, difference);
    let whole = inner(sum, sum);
    let half = arc_tangent(root(square), root(whole));
    let turn = sine_cosine((t + t - 1.0) * half);
    let inverse = if square == 0.0 {
        0.0
    } else {
        reciprocal_root(square)
    };
    let to_unit = reciprocal_root(whole);
    std::array::from_fn(|c| sum[c] * to_unit * turn.1 + difference[c] * inverse * turn.0)
}
