//! Twin of `shaders/poses/steps.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::math::quaternion::{dot, product};
use crate::twin::arc_tangent::{arc_tangent, flushed, reciprocal_root, root};

/// The turn from one rotation to the nearer sign of the next: its vector part and its cosine.
#[inline(always)]
pub(crate) fn turn(from: [f32; 4], to: [f32; 4]) -> [f32; 4] {
    let near = if dot(from, to) < 0.0 {
        to.map(|c| -c)
    } else {
        to
    };
    let inverse = [-from[0], -from[1], -from[2], from[3]];
    let difference = std::array::from_fn(|c| near[c] - from[c]);
    let turn = product(inverse, difference).map(flushed);
    [turn[0], turn[1], turn[2], dot(from, near)]
}

#[inline(always)]
pub(crate) fn square_of(turn: [f32; 4]) -> f32 {
    turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
}

/// The turn's vector part, which has this square, by half the angle over the sine.
#[inline(always)]
pub(crate) fn scaled(turn: [f32; 4], square: f32, ratio: f32) -> [f32; 4] {
    let scale = if square == 0.0 { 0.0 } else { ratio };
    [turn[0] * scale, turn[1] * scale, turn[2] * scale, 0.0]
}

/// The function of the shader, whose parts are functions of their own: see
/// [`rows`](crate::smooth::rows).
#[inline(always)]
pub(crate) fn rotation_step(from: [f32; 4], to: [f32; 4]) -> [f32; 4] {
    let turn = turn(from, to);
    let square = square_of(turn);
    let sine = root(square);
    let half = arc_tangent(sine, turn[3]);
    scaled(turn, square, half * reciprocal_root(square))
}

#[inline(always)]
pub(crate) fn pose(own: [f32; 4], next: [f32; 4], are_rotations: bool) -> [f32; 4] {
    let step = match are_rotations {
        true => rotation_step(own, next),
        false => std::array::from_fn(|c| next[c] - own[c]),
    };
    step.map(canonical)
}
