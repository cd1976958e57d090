//! Axis and angle, of `shaders/stores/axis_angle.wgsl`.

use crate::math::canonical::canonical;
pub(crate) use crate::twin::functions::axis_angle;

#[inline(always)]
pub(crate) fn store(rotation: [f32; 4], _: u32) -> [f32; 4] {
    axis_angle(rotation).map(canonical)
}
