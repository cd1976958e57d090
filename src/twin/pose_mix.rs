//! Twin of `shaders/poses/mix.wgsl`: the same names, the same order.

use crate::math::canonical::canonical;
use crate::twin::quaternion::over;

#[inline(always)]
pub(crate) fn pose(from: [f32; 4], to: [f32; 4], weight: f32) -> [f32; 4] {
    over(from, to, weight).map(canonical)
}
