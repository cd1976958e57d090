//! Twin of `shaders/poses/steps.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::math::quaternion::{dot, product};
use crate::twin::arc_tangent::{arc_tangent, flushed, reciprocal_root, root};

/// The rotation from one rotation to the nearer sign of the next: its vector part and its cosine.
#[inline(always)]
pub(crate) fn relative_rotation(from: [f32; 4], to: [f32; 4]) -> [f32; 4] {
    let near = if dot(from, to) < 0.0 {
        to.map(|c| -c)
    } else {
        to
    };
    let inverse = [-from[0], -from[1], -from[2], from[3]];
    let difference = std::array::from_fn(|c| near[c] - from[c]);
    let rotation = product(inverse, difference).map(flushed);
    [rotation[0], rotation[1], rotation[2], dot(from, near)]
}

#[inline(always)]
pub(crate) fn square_of(rotation: [f32; 4]) -> f32 {
    rotation[0] * rotation[0] + rotation[1] * rotation[1] + rotation[2] * rotation[2]
}

/// The rotation's vector part, which has this square, by half the angle over the sine.
#[inline(always)]
pub(crate) fn scaled(rotation: [f32; 4], square: f32, ratio: f32) -> [f32; 4] {
    let scale = if square == 0.0 { 0.0 } else { ratio };
    [
        rotation[0] * scale,
        rotation[1] * scale,
        rotation[2] * scale,
        0.0,
    ]
}

/// The function of the shader; its parts are separate functions for [`rows`](crate::smooth::rows).
#[inline(always)]
pub(crate) fn rotation_step(from: [f32; 4], to: [f32; 4]) -> [f32; 4] {
    let rotation = relative_rotation(from, to);
    let square = square_of(rotation);
    let sine = root(square);
    let half = arc_tangent(sine, rotation[3]);
    scaled(rotation, square, half * reciprocal_root(square))
}

#[inline(always)]
pub(crate) fn pose(value: [f32; 4], next: [f32; 4], are_rotations: bool) -> [f32; 4] {
    let step = match are_rotations {
        true => rotation_step(value, next),
        false => std::array::from_fn(|c| next[c] - value[c]),
    };
    step.map(canonical)
}
