//! The number types of an encoding's components.

use crate::names::names;

/// The number type of an encoding's component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ComponentType {
    /// IEEE 754 single precision.
    F32,
    /// IEEE 754 half precision.
    F16,
    /// A multiple of 1/32767, as an integer of 16 bits.
    Snorm16,
}

names! {
    ComponentType, "component type",
    F32 => "f32",
    F16 => "f16",
    Snorm16 => "snorm16",
}

impl ComponentType {
    /// Bytes of one component.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 | Self::Snorm16 => 2,
        }
    }

    /// The stored number as f32.
    pub(crate) fn decode(self, bytes: &[u8]) -> f32 {
        let half = || u16::from_ne_bytes([bytes[0], bytes[1]]);
        match self {
            Self::F32 => bytemuck::pod_read_unaligned(bytes),
            Self::F16 => from_half(half()),
            // -32768 also means -1, so the value is limited.
            Self::Snorm16 => (f32::from(half() as i16) / 32767.0).max(-1.0),
        }
    }
}

/// 2^-24.
const SMALLEST_HALF: f32 = 1.0 / (1 << 24) as f32;

fn from_half(half: u16) -> f32 {
    let magnitude = u32::from(half & 0x7fff);
    let value = if magnitude < 0x0400 {
        magnitude as f32 * SMALLEST_HALF
    } else {
        f32::from_bits((magnitude << 13) + 0x3800_0000)
    };
    if half & 0x8000 == 0 { value } else { -value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::f16::to_half;
    use crate::twin::snorm16::to_snorm;

    /// Every half from 0 to 1, and values between two of them: the nearest half is stored, and the
    /// even one if two are equally near.
    #[test]
    fn halves_are_the_nearest() {
        for half in 0..0x3c00u16 {
            let (low, high) = (from_half(half), from_half(half + 1));
            let middle = low + (high - low) * 0.5; // exact
            let even = if half & 1 == 0 { half } else { half + 1 };
            for (value, expected) in [
                (low, half),
                (middle.next_down(), half),
                (middle, even),
                (middle.next_up(), half + 1),
                (high, half + 1),
            ] {
                let stored = to_half(value);
                assert_eq!(stored, u32::from(expected), "{value}");
                assert_eq!(to_half(-value), u32::from(expected | 0x8000));
            }
        }
    }

    #[test]
    fn whole_numbers_are_the_nearest() {
        for n in -32767..=32767i32 {
            let value = n as f32 / 32767.0;
            assert_eq!(to_snorm(value), u32::from(n as i16 as u16));
            let off = (f64::from(n) + 0.49) / 32767.0;
            assert_eq!(to_snorm(off as f32), u32::from(n as i16 as u16));
        }
        // Rounding may make a component slightly larger than 1.
        assert_eq!(to_snorm(1.000_000_4), 32767);
        assert_eq!(to_snorm(-1.000_000_4), u32::from(-32767i16 as u16));
    }
}
