//! Twin of `shaders/stores/axis_angle.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::shader::DEGREES;
use crate::twin::arc_tangent::{arc_tangent, flushed, reciprocal_root, root};

#[inline(always)]
pub(crate) fn axis_angle(rotation: [f32; 4]) -> [f32; 4] {
    let x = flushed(rotation[0]);
    let y = flushed(rotation[1]);
    let z = flushed(rotation[2]);
    let square = x * x + y * y + z * z;
    let scale = reciprocal_root(square);
    let angle = arc_tangent(root(square), flushed(rotation[3])) * (2.0 * DEGREES);
    let result = [x * scale, y * scale, z * scale, angle];
    if square == 0.0 {
        [1.0, 0.0, 0.0, angle]
    } else {
        result
    }
}

#[inline(always)]
pub(crate) fn store(rotation: [f32; 4], _: u32) -> [f32; 4] {
    axis_angle(rotation).map(canonical)
}
