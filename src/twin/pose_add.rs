//! Twin of `shaders/poses/add.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::math::quaternion::{product, step};
use crate::twin::quaternion::{normalised, slerp};

#[inline(always)]
pub(crate) fn pose(base: [f32; 4], layer: [f32; 4], reference: [f32; 4], weight: f32) -> [f32; 4] {
    let rotation = slerp([0.0, 0.0, 0.0, 1.0], step(reference, layer), weight);
    normalised(product(base, rotation)).map(canonical)
}
