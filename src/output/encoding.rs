//! The representations in which rotations are stored, and the conversions on the CPU.

use glam::{Mat3, Quat, Vec3};

use crate::math::canonical::canonical;
use crate::output::euler::EulerSequence;
use crate::shader::Store;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::twin::axis_angle::axis_angle;
use crate::twin::euler::euler;
use crate::twin::f16::to_half;
use crate::twin::matrix::rows;
use crate::twin::snorm16::to_snorm;

/// The representation in which a rotation is stored. It is converted on the device that evaluates
/// it, so that only the converted numbers are moved; every device gives the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Encoding {
    /// `x y z w`, f32: 16 bytes a rotation.
    #[default]
    F32,
    /// `x y z w` in IEEE 754 half precision, rounded to nearest, ties to even: 8 bytes a
    /// rotation, within 2^-12 of each component.
    F16,
    /// `x y z w` as whole numbers of 1/32767 in 16 bits, rounded to nearest, ties to even
    /// (`VK_FORMAT_R16G16B16A16_SNORM`): 8 bytes a rotation, within 1.6e-5 of each
    /// component.
    Snorm16,
    /// The axis, a unit vector, and the angle in degrees, `2 atan2(|v|, w)`, 0 to 360. If `v` is
    /// zero the axis is x. Four f32.
    AxisAngle,
    /// The 3 × 3 matrix that turns column vectors: nine f32.
    Matrix3x3(MatrixOrder),
    /// The same with a translation of 0: twelve f32.
    Matrix3x4(MatrixOrder),
    /// Three angles in degrees, in the order of the sequence: the first and the third within ±180,
    /// the second within ±90, or from 0 to 180 if the third axis equals the first. In gimbal lock,
    /// where the first and the third angle turn about the same axis, the third is 0. Three f32.
    Euler(EulerSequence),
    /// `x y z` alone, for velocities and accelerations: three f32.
    Vector,
}

/// How a matrix lies in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MatrixOrder {
    /// Row by row.
    RowMajor,
    /// Column by column.
    ColumnMajor,
}

impl Encoding {
    /// One of every kind.
    pub const KINDS: [Self; 10] = [
        Self::F32,
        Self::F16,
        Self::Snorm16,
        Self::AxisAngle,
        Self::Matrix3x3(MatrixOrder::RowMajor),
        Self::Matrix3x3(MatrixOrder::ColumnMajor),
        Self::Matrix3x4(MatrixOrder::RowMajor),
        Self::Matrix3x4(MatrixOrder::ColumnMajor),
        Self::Euler(EulerSequence::XYZ),
        Self::Vector,
    ];

    pub(crate) const MOST_BYTES: usize = 48;

    /// Bytes of one rotation.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::F16 | Self::Snorm16 => 8,
            Self::Euler(_) | Self::Vector => 12,
            Self::F32 | Self::AxisAngle => 16,
            Self::Matrix3x3(_) => 36,
            Self::Matrix3x4(_) => Self::MOST_BYTES,
        }
    }

    /// The shape of one rotation in an array: `[4]`, `[3]`, `[3, 3]`, ….
    #[must_use]
    pub fn shape(self) -> &'static [usize] {
        match self {
            Self::F32 | Self::F16 | Self::Snorm16 | Self::AxisAngle => &[4],
            Self::Euler(_) | Self::Vector => &[3],
            Self::Matrix3x3(_) => &[3, 3],
            Self::Matrix3x4(MatrixOrder::RowMajor) => &[3, 4],
            Self::Matrix3x4(MatrixOrder::ColumnMajor) => &[4, 3],
        }
    }

    /// The names of its numbers, in order.
    #[must_use]
    pub fn components(self) -> Vec<String> {
        let names: &[&str] = match self {
            Self::F32 | Self::F16 | Self::Snorm16 => &["x", "y", "z", "w"],
            Self::AxisAngle => &["x", "y", "z", "degrees"],
            Self::Vector => &["x", "y", "z"],
            Self::Matrix3x3(order) | Self::Matrix3x4(order) => {
                let columns = self.bytes() / 12;
                let name = |i: usize| match order {
                    MatrixOrder::RowMajor => (i / columns, i % columns),
                    MatrixOrder::ColumnMajor => (i % 3, i / 3),
                };
                let names = (0..3 * columns).map(name);
                return names
                    .map(|(row, column)| format!("m{row}{column}"))
                    .collect();
            }
            Self::Euler(sequence) => {
                let axes = (1..).zip(sequence.axes());
                return axes
                    .map(|(i, axis)| format!("{}{i}", ["x", "y", "z"][axis]))
                    .collect();
            }
        };
        names.iter().map(|&name| name.to_owned()).collect()
    }

    /// Whether it can store rotations only, not velocities and accelerations.
    pub(crate) fn needs_rotations(self) -> bool {
        !matches!(self, Self::F32 | Self::Vector)
    }

    /// The store of the kernels for it.
    pub(crate) fn store(self) -> Store {
        match self {
            Self::F32 => Store::F32,
            Self::F16 => Store::F16,
            Self::Snorm16 => Store::Snorm16,
            Self::AxisAngle => Store::AxisAngle,
            Self::Matrix3x3(_) => Store::Matrix3x3,
            Self::Matrix3x4(_) => Store::Matrix3x4,
            Self::Euler(_) => Store::Euler,
            Self::Vector => Store::Vector,
        }
    }

    /// The parameter of the kernels' store: a matrix's order, or the sequence of Euler angles.
    pub(crate) fn detail(self) -> u32 {
        match self {
            Self::F32 | Self::F16 | Self::Snorm16 | Self::AxisAngle | Self::Vector => 0,
            Self::Matrix3x3(order) | Self::Matrix3x4(order) => {
                u32::from(order == MatrixOrder::ColumnMajor)
            }
            Self::Euler(sequence) => sequence.detail(),
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
            _ => in_lanes(&mut Converted(self, rotations, output)),
        }
    }

    /// Reads what is stored: the rotation, up to rounding and sign, or the vector.
    ///
    /// # Panics
    /// When `bytes` are not those of one rotation.
    #[must_use]
    pub fn decode(self, bytes: &[u8]) -> [f32; 4] {
        assert_eq!(bytes.len(), self.bytes());
        let number = |i: usize| f32::from_ne_bytes(std::array::from_fn(|b| bytes[4 * i + b]));
        let half = |i: usize| u16::from_ne_bytes([bytes[2 * i], bytes[2 * i + 1]]);
        match self {
            Self::F32 => [0, 1, 2, 3].map(number),
            Self::F16 => [0, 1, 2, 3].map(|i| from_half(half(i))),
            // -32768 means -1 too.
            Self::Snorm16 => [0, 1, 2, 3].map(|i| (f32::from(half(i) as i16) / 32767.0).max(-1.0)),
            Self::AxisAngle => {
                let axis = Vec3::new(number(0), number(1), number(2));
                Quat::from_axis_angle(axis, number(3).to_radians()).to_array()
            }
            Self::Matrix3x3(order) => {
                let columns = Mat3::from_cols_array(&std::array::from_fn(number));
                from_columns(columns, order)
            }
            Self::Matrix3x4(MatrixOrder::ColumnMajor) => {
                let columns = Mat3::from_cols_array(&std::array::from_fn(number));
                from_columns(columns, MatrixOrder::ColumnMajor)
            }
            Self::Matrix3x4(MatrixOrder::RowMajor) => {
                let columns = Mat3::from_cols_array(&std::array::from_fn(|i| number(i + i / 3)));
                from_columns(columns, MatrixOrder::RowMajor)
            }
            Self::Euler(sequence) => {
                let turns = [0, 1, 2].map(|i| {
                    let axis = Vec3::AXES[sequence.axes()[i]];
                    Quat::from_axis_angle(axis, number(i).to_radians())
                });
                let [first, second, third] = turns;
                let together = if sequence.is_intrinsic() {
                    first * second * third
                } else {
                    third * second * first
                };
                together.to_array()
            }
            Self::Vector => [number(0), number(1), number(2), 0.0],
        }
    }
}

fn from_columns(columns: Mat3, order: MatrixOrder) -> [f32; 4] {
    let matrix = match order {
        MatrixOrder::ColumnMajor => columns,
        MatrixOrder::RowMajor => columns.transpose(),
    };
    Quat::from_mat3(&matrix).to_array()
}

/// Converts rotations to a representation in f32: the encoding, the rotations, the output.
struct Converted<'a>(Encoding, &'a [[f32; 4]], &'a mut [u8]);

impl InLanes for Converted<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Self(encoding, rotations, output) = self;
        let detail = encoding.detail();
        match encoding {
            Encoding::Matrix3x3(_) => each(rotations, output, |rotation| {
                let [a, b, c] = rows(rotation, detail);
                [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]]
            }),
            Encoding::Matrix3x4(MatrixOrder::RowMajor) => each(rotations, output, |rotation| {
                let [a, b, c] = rows(rotation, detail);
                let [first, second] = [[a[0], a[1], a[2], 0.0], [b[0], b[1], b[2], 0.0]];
                let third = [c[0], c[1], c[2], 0.0];
                std::array::from_fn::<_, 12, _>(|i| [first, second, third][i / 4][i % 4])
            }),
            Encoding::Matrix3x4(MatrixOrder::ColumnMajor) => each(rotations, output, |rotation| {
                let rows = rows(rotation, detail);
                std::array::from_fn::<_, 12, _>(|i| if i < 9 { rows[i / 3][i % 3] } else { 0.0 })
            }),
            Encoding::Euler(_) => each(rotations, output, |rotation| {
                euler(rotation, detail).map(canonical)
            }),
            Encoding::Vector => each(rotations, output, |[x, y, z, _]| [x, y, z]),
            _ => each(rotations, output, |rotation| {
                axis_angle(rotation).map(canonical)
            }),
        }
    }
}

#[inline(always)]
fn each<const N: usize>(
    rotations: &[[f32; 4]],
    output: &mut [u8],
    convert: impl Fn([f32; 4]) -> [f32; N],
) {
    for (&rotation, bytes) in rotations.iter().zip(output.chunks_exact_mut(4 * N)) {
        bytes.copy_from_slice(bytemuck::cast_slice(&convert(rotation)));
    }
}

fn components(rotations: &[[f32; 4]]) -> &[f32] {
    rotations.as_flattened()
}

/// Converts f32 to half precision: the input and the output.
struct Halves<'a>(&'a [f32], &'a mut [u8]);

impl InLanes for Halves<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for (&value, bytes) in self.0.iter().zip(self.1.chunks_exact_mut(2)) {
            bytes.copy_from_slice(&to_half(value).to_ne_bytes());
        }
    }
}

/// Converts f32 to whole numbers of 1/32767: the input and the output.
struct WholeNumbers<'a>(&'a [f32], &'a mut [u8]);

impl InLanes for WholeNumbers<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
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
