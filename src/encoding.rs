//! How a result is stored: f32, or half of the bytes.

use crate::cpu::{InLanes, in_lanes, to_half, to_snorm};

/// What a component of a rotation becomes. The shorter ones are converted where the
/// rotations are evaluated, so that only half of the bytes are moved; with the same
/// bits on every device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Encoding {
    /// f32: 16 bytes a rotation.
    #[default]
    F32,
    /// IEEE 754 half precision, rounded to nearest, ties to even: 8 bytes a rotation,
    /// within 2^-12 of each component.
    F16,
    /// Whole numbers of 1/32767 in 16 bits, rounded to nearest, ties to even
    /// (`VK_FORMAT_R16G16B16A16_SNORM`): 8 bytes a rotation, within 1.6e-5 of each
    /// component.
    Snorm16,
}

impl Encoding {
    /// Every encoding.
    pub const ALL: [Self; 3] = [Self::F32, Self::F16, Self::Snorm16];

    /// Bytes of one rotation.
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 => 16,
            Self::F16 | Self::Snorm16 => 8,
        }
    }

    /// Stores rotations, `x y z w` each, in the machine's byte order.
    ///
    /// # Panics
    /// When `output` has not [`Encoding::bytes`] for each rotation.
    pub fn encode(self, rotations: &[[f32; 4]], output: &mut [u8]) {
        assert_eq!(output.len(), rotations.len() * self.bytes());
        match self {
            Self::F32 => output.copy_from_slice(bytemuck::cast_slice(rotations)),
            Self::F16 => in_lanes(&mut Halves(components(rotations), output)),
            Self::Snorm16 => in_lanes(&mut WholeNumbers(components(rotations), output)),
        }
    }

    /// What a stored rotation means.
    ///
    /// # Panics
    /// When `bytes` are not those of one rotation.
    pub fn decode(self, bytes: &[u8]) -> [f32; 4] {
        assert_eq!(bytes.len(), self.bytes());
        if self == Self::F32 {
            return bytemuck::pod_read_unaligned(bytes);
        }
        let components: [u16; 4] = bytemuck::pod_read_unaligned(bytes);
        components.map(|component| match self {
            // -32768 means -1 too.
            Self::Snorm16 => (f32::from(component as i16) / 32767.0).max(-1.0),
            _ => from_half(component),
        })
    }
}

fn components(rotations: &[[f32; 4]]) -> &[f32] {
    rotations.as_flattened()
}

/// From and to.
struct Halves<'a>(&'a [f32], &'a mut [u8]);

impl InLanes for Halves<'_> {
    #[inline(always)]
    fn run(&mut self) {
        for (&value, bytes) in self.0.iter().zip(self.1.chunks_exact_mut(2)) {
            bytes.copy_from_slice(&to_half(value).to_ne_bytes());
        }
    }
}

/// From and to.
struct WholeNumbers<'a>(&'a [f32], &'a mut [u8]);

impl InLanes for WholeNumbers<'_> {
    #[inline(always)]
    fn run(&mut self) {
        for (&value, bytes) in self.0.iter().zip(self.1.chunks_exact_mut(2)) {
            bytes.copy_from_slice(&to_snorm(value).to_ne_bytes());
        }
    }
}

fn from_half(half: u16) -> f32 {
    let magnitude = u32::from(half & 0x7fff);
    let value = if magnitude < 0x0400 {
        magnitude as f32 * 2.0f32.powi(-24)
    } else {
        f32::from_bits((magnitude << 13) + 0x3800_0000)
    };
    if half & 0x8000 == 0 { value } else { -value }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every half from 0 to 1 and what lies between: the nearest one is stored, the
    /// even one where two are.
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
                assert_eq!(stored, expected, "{value}");
                assert_eq!(to_half(-value), expected | 0x8000);
            }
        }
    }

    #[test]
    fn whole_numbers_are_the_nearest() {
        for n in -32767..=32767i32 {
            let value = n as f32 / 32767.0;
            assert_eq!(to_snorm(value), n as i16 as u16);
            let off = (f64::from(n) + 0.49) / 32767.0;
            assert_eq!(to_snorm(off as f32), n as i16 as u16);
        }
        // A component may pass 1 by rounding.
        assert_eq!(to_snorm(1.000_000_4), 32767);
        assert_eq!(to_snorm(-1.000_000_4), -32767i16 as u16);
    }

    #[test]
    fn what_is_decoded_is_near_what_was_encoded() {
        let rotation = [0.5, -0.5, 0.099_999, -0.7];
        for (encoding, bound) in [
            (Encoding::F32, 0.0),
            (Encoding::F16, 2.5e-4),
            (Encoding::Snorm16, 1.6e-5),
        ] {
            let mut bytes = vec![0; encoding.bytes()];
            encoding.encode(&[rotation], &mut bytes);
            let decoded = encoding.decode(&bytes);
            for (a, b) in rotation.iter().zip(decoded) {
                assert!((a - b).abs() <= bound, "{encoding:?}: {a} {b}");
            }
        }
    }
}
