//! Angles about axes, of `shaders/stores/euler.wgsl`.

use crate::math::canonical::canonical;
pub(crate) use crate::twin::functions::euler;

#[inline(always)]
pub(crate) fn store(rotation: [f32; 4], detail: u32) -> [f32; 3] {
    euler(rotation, detail).map(canonical)
}
