//! Whole numbers of 16 bits, of `shaders/stores/snorm16.wgsl`.

pub(crate) use crate::twin::functions::to_snorm;

#[inline(always)]
pub(crate) fn store([component]: [f32; 1], _: u32) -> [u16; 1] {
    [to_snorm(component) as u16]
}
