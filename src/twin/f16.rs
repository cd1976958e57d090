//! Twin of `shaders/stores/f16.wgsl` and `shaders/math/half.wgsl`: the same names, the same order.

use crate::shader::LEAST_NORMAL;

/// The half nearest to a value below 2, ties to even.
#[inline(always)]
pub(crate) fn to_half(value: f32) -> u16 {
    let bits = value.to_bits();
    let sign = (bits >> 16) & 0x8000;
    let magnitude = bits & 0x7fff_ffff;
    let odd = (magnitude >> 13) & 1;
    let rounded = magnitude.wrapping_add(0x0fff).wrapping_add(odd);
    let normal = rounded.wrapping_sub(0x3800_0000) >> 13;
    let small = (f32::from_bits(magnitude) + 0.5)
        .to_bits()
        .wrapping_sub(0x3f00_0000);
    let half = if magnitude < LEAST_NORMAL {
        small
    } else {
        normal
    };
    (sign | half) as u16
}

#[inline(always)]
pub(crate) fn store([component]: [f32; 1], _: u32) -> [u16; 1] {
    [to_half(component)]
}
