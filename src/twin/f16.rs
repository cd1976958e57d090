//! Half precision, of `shaders/stores/f16.wgsl` and `shaders/math/half.wgsl`, and of `shaders/stores/f16_converted.wgsl`,
//! which has the device convert.

pub(crate) use crate::twin::functions::to_half;

#[inline(always)]
pub(crate) fn store([component]: [f32; 1], _: u32) -> [u16; 1] {
    [to_half(component) as u16]
}
