//! Twin of `shaders/store_axis_angle.wgsl`: the same names, the same order.

use super::arc_tangent::{arc_tangent, clean, reciprocal_root, root};
use crate::segment::shader::DEGREES;

#[inline(always)]
pub(crate) fn axis_angle(rotation: [f32; 4]) -> [f32; 4] {
    let x = clean(rotation[0]);
    let y = clean(rotation[1]);
    let z = clean(rotation[2]);
    let square = x * x + y * y + z * z;
    let scale = reciprocal_root(square);
    let angle = arc_tangent(root(square), clean(rotation[3])) * (2.0 * DEGREES);
    let turned = [x * scale, y * scale, z * scale, angle];
    if square == 0.0 {
        [1.0, 0.0, 0.0, angle]
    } else {
        turned
    }
}
