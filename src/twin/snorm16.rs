//! Twin of `shaders/stores/snorm16.wgsl`: the same names, the same order.

use crate::shader::SNORM_SHIFT;

/// The multiple of 1/32767 nearest to a value, ties to even, in its 16 bits.
#[inline(always)]
pub(crate) fn to_snorm(value: f32) -> u16 {
    ((value * 32767.0 + SNORM_SHIFT).to_bits() & 0xffff) as u16
}

#[inline(always)]
pub(crate) fn store([component]: [f32; 1], _: u32) -> [u16; 1] {
    [to_snorm(component)]
}
