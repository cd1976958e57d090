//! Encodings of rotations: a table with the name, the layout in memory, and the CPU's functions to write and read
//! each.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use glam::{Mat3, Quat, Vec3};

use crate::math::quaternion::about;
use crate::names::fields::with_fields;
use crate::names::{UnknownNameError, named, names};
use crate::output::component_type::ComponentType;
use crate::output::euler::EulerSequence;
use crate::shader::Store;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::twin::{axis_angle, euler, f16, matrix, snorm16};

/// A row of the table of encodings. [`Encoding`] documents the fields that have a function of the same name.
pub(crate) struct Representation {
    name: &'static str,
    summary: &'static str,
    component_type: ComponentType,
    shape: &'static [usize],
    components: &'static [&'static str],
    /// The indices of the components that are angles in degrees.
    angles: Range<usize>,
    /// The maximum angle in radians between a rotation and its decoded value; `None` if rotations cannot be stored.
    pub(crate) error_bound: Option<f64>,
    /// Whether velocities and accelerations can be stored.
    pub(crate) takes_vectors: bool,
    /// The store function of the kernels for this encoding, and its parameter.
    #[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
    pub(crate) store: Store,
    pub(crate) detail: u32,
    /// Encodes rotations, with the parameter.
    encode: fn(&[[f32; 4]], u32, &mut [u8]),
    /// Decodes a rotation from its numbers, with the parameter.
    decode: fn(&StoredNumbers, u32) -> [f32; 4],
}

/// The numbers of one rotation, by their indices.
type StoredNumbers<'a> = dyn Fn(usize) -> f32 + 'a;

/// Quaternions in f32.
const QUATERNION: Representation = Representation {
    name: "f32",
    summary: "float32",
    component_type: ComponentType::F32,
    shape: &[4],
    components: &["x", "y", "z", "w"],
    angles: 0..0,
    error_bound: Some(0.0),
    takes_vectors: true,
    store: Store::F32,
    detail: 0,
    encode: |rotations, _, output| output.copy_from_slice(bytemuck::cast_slice(rotations)),
    decode: |number, _| [0, 1, 2, 3].map(number),
};

/// The fields that the encodings of rotations in f32 share.
const OF_ROTATIONS: Representation = Representation {
    error_bound: Some(4e-6), // mostly the error of decoding, not of encoding
    takes_vectors: false,
    ..QUATERNION
};

/// A function that encodes rotations by the twin of a kernel's store, which takes whole rotations or single
/// components. Each has its loop, because compilers do not inline a large function that is passed to a loop.
macro_rules! by {
    ($store:path) => {
        |rotations, detail, output| {
            struct Each<'a>(&'a [[f32; 4]], u32, &'a mut [u8]);

            impl InLanes for Each<'_> {
                #[inline(always)]
                fn run<L: Lanes>(&mut self) {
                    let (rotations, detail, output) = (self.0, self.1, &mut *self.2);
                    let (numbers, _) = rotations.as_flattened().as_chunks();
                    let outputs = output.chunks_exact_mut(stored_bytes($store));
                    for (&input, output) in numbers.iter().zip(outputs) {
                        output.copy_from_slice(bytemuck::bytes_of(&$store(input, detail)));
                    }
                }
            }
            in_lanes(&mut Each(rotations, detail, output));
        }
    };
}

/// The number of bytes that the twin of a store returns.
#[inline(always)]
fn stored_bytes<const N: usize, S>(_: impl Fn([f32; N], u32) -> S) -> usize {
    size_of::<S>()
}

/// The twin of the store for vectors.
#[inline(always)]
fn xyz([x, y, z, _]: [f32; 4], _: u32) -> [f32; 3] {
    [x, y, z]
}

/// Declares [`Encoding`]: a variant for each encoding, with an option if it has one, and its row of the table. In the
/// row, the option's variable is named as its field of [`EncodingOptions`].
macro_rules! representations {
    ($(
        $(#[$attribute:meta])*
        $variant:ident $(($option:ident: $type:ty))? {
            kinds: [$($kind:expr),+],
            $($row:tt)*
        }
    )*) => {
        /// The representation in which a rotation is stored. The device that evaluates a rotation also converts it,
        /// so only the converted numbers are transferred; every device gives the same bits.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
        #[non_exhaustive]
        pub enum Encoding {
            $($(#[$attribute])* $variant $(($type))?,)*
        }

        /// The name and the option: `matrix column by column`.
        impl fmt::Display for Encoding {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.name())?;
                match self {
                    $(Self::$variant $(($option))? => { $(write!(f, " {}", $option.in_words())?;)? })*
                }
                Ok(())
            }
        }

        impl Encoding {
            /// One value of every kind; matrices in both orders.
            pub const ALL: [Self; [$($(stringify!($kind)),+),*].len()] = [$($($kind),+),*];

            /// This encoding with other options.
            #[must_use]
            pub fn with(self, options: EncodingOptions) -> Self {
                match self {
                    $(Self::$variant { .. } => Self::$variant $((options.$option))?,)*
                }
            }

            /// The encoding's row of the table.
            #[inline]
            pub(crate) fn row(self) -> Representation {
                match self {
                    $(Self::$variant $(($option))? => Representation { $($row)* },)*
                }
            }
        }
    };
}

representations! {
    /// `x y z w`, f32: 16 bytes per rotation.
    #[default]
    F32 {
        kinds: [Self::F32],
        ..QUATERNION
    }
    /// `x y z w` in IEEE 754 half precision, rounded to nearest, ties to even: 8 bytes per
    /// rotation, within 2^-12 of each component.
    F16 {
        kinds: [Self::F16],
        name: "f16",
        summary: "float16: half the size, within 2.5e-4 of each component",
        component_type: ComponentType::F16,
        error_bound: Some(2e-3),
        store: Store::F16,
        encode: by!(f16::store),
        ..OF_ROTATIONS
    }
    /// `x y z w` as multiples of 1/32767 in 16 bits, rounded to nearest, ties to even
    /// (`VK_FORMAT_R16G16B16A16_SNORM`): 8 bytes per rotation, within 1.6e-5 of each component.
    Snorm16 {
        kinds: [Self::Snorm16],
        name: "snorm16",
        summary: "int16, to be divided by 32767: half the size, within 1.6e-5",
        component_type: ComponentType::Snorm16,
        error_bound: Some(1.5e-4),
        store: Store::Snorm16,
        encode: by!(snorm16::store),
        ..OF_ROTATIONS
    }
    /// The axis, a unit vector, and the angle in degrees, `2 atan2(|v|, w)`, 0 to 360. If `v` is zero, the axis is x.
    /// Four f32.
    AxisAngle {
        kinds: [Self::AxisAngle],
        name: "axis-angle",
        summary: "x y z of the axis, and degrees, 0 to 360",
        components: &["x", "y", "z", "degrees"],
        angles: 3..4,
        store: Store::AxisAngle,
        encode: by!(axis_angle::store),
        decode: |number, _| {
            let axis = [0, 1, 2].map(|i| f64::from(number(i)));
            about(axis, f64::from(number(3))).map(|c| c as f32)
        },
        ..OF_ROTATIONS
    }
    /// The 3 × 3 matrix that rotates column vectors: nine f32.
    Matrix3x3(order: MatrixOrder) {
        kinds: [Self::Matrix3x3(MatrixOrder::RowMajor), Self::Matrix3x3(MatrixOrder::ColumnMajor)],
        name: "matrix",
        summary: "3 × 3, for column vectors",
        shape: &[3, 3],
        components: match order {
            MatrixOrder::RowMajor => &["m00", "m01", "m02", "m10", "m11", "m12", "m20", "m21", "m22"],
            MatrixOrder::ColumnMajor => &["m00", "m10", "m20", "m01", "m11", "m21", "m02", "m12", "m22"],
        },
        store: Store::Matrix3x3,
        detail: order as u32,
        encode: by!(matrix::rows),
        decode: |number, order| of_matrix(number, 3, order),
        ..OF_ROTATIONS
    }
    /// The 3 × 4 matrix that rotates column vectors, with a translation of 0: twelve f32.
    Matrix3x4(order: MatrixOrder) {
        kinds: [Self::Matrix3x4(MatrixOrder::RowMajor), Self::Matrix3x4(MatrixOrder::ColumnMajor)],
        name: "matrix-3x4",
        summary: "3 × 4, its translation 0",
        shape: match order {
            MatrixOrder::RowMajor => &[3, 4],
            MatrixOrder::ColumnMajor => &[4, 3],
        },
        components: match order {
            MatrixOrder::RowMajor => &[
                "m00", "m01", "m02", "m03", "m10", "m11", "m12", "m13", "m20", "m21", "m22", "m23",
            ],
            MatrixOrder::ColumnMajor => &[
                "m00", "m10", "m20", "m01", "m11", "m21", "m02", "m12", "m22", "m03", "m13", "m23",
            ],
        },
        store: Store::Matrix3x4,
        detail: order as u32,
        encode: match order {
            MatrixOrder::RowMajor => by!(matrix::store3x4_rows),
            MatrixOrder::ColumnMajor => by!(matrix::store3x4_columns),
        },
        decode: |number, order| of_matrix(number, if order == 0 { 4 } else { 3 }, order),
        ..OF_ROTATIONS
    }
    /// The first two columns of the 3 × 3 matrix, one after the other: the six numbers that models learn (Zhou et al.
    /// 2019, On the Continuity of Rotation Representations in Neural Networks). Six f32.
    SixD {
        kinds: [Self::SixD],
        name: "6d",
        summary: "the first two columns of the 3 × 3 matrix",
        shape: &[6],
        components: &["m00", "m10", "m20", "m01", "m11", "m21"],
        store: Store::SixD,
        detail: MatrixOrder::ColumnMajor as u32,
        encode: by!(matrix::first_two),
        decode: |number, _| {
            let [x, y] = [0, 3].map(|first| Vec3::from_array([0, 1, 2].map(|i| number(first + i))));
            Quat::from_mat3(&Mat3::from_cols(x, y, x.cross(y))).to_array()
        },
        ..OF_ROTATIONS
    }
    /// Three angles in degrees, in the order of the sequence: the first and the third within ±180; the second within
    /// ±90, or from 0 to 180 if the third axis equals the first. In gimbal lock, where the first and the third angle
    /// rotate about the same axis, the third is 0. Three f32.
    Euler(sequence: EulerSequence) {
        kinds: [Self::Euler(EulerSequence::XYZ)],
        name: "euler",
        summary: "three angles, degrees",
        shape: &[3],
        components: sequence.angle_names(),
        angles: 0..3,
        store: Store::Euler,
        detail: sequence.detail(),
        encode: by!(euler::store),
        decode: EulerSequence::decode,
        ..OF_ROTATIONS
    }
    /// `x y z` only, for velocities and accelerations: three f32.
    Vector {
        kinds: [Self::Vector],
        name: "vector",
        summary: "x y z",
        shape: &[3],
        components: &["x", "y", "z"],
        error_bound: None,
        store: Store::Vector,
        encode: by!(xyz),
        decode: |number, _| [number(0), number(1), number(2), 0.0],
        ..QUATERNION
    }
}

/// The options of some encodings; see [`Encoding::with`].
///
/// ```
/// use tumble::{Encoding, EncodingOptions, MatrixOrder};
/// let options = EncodingOptions::default().with_order(MatrixOrder::ColumnMajor).with_sequence("ZXY".parse()?);
/// let matrices = Encoding::ALL.into_iter().find(|kind| kind.name() == "matrix").unwrap();
/// let columns = matrices.with(options);
/// let mut bytes = vec![0; columns.bytes()];
/// columns.encode(&[[0.0, 0.0, 0.0, 1.0]], &mut bytes)?;
/// assert_eq!(columns.decode(&bytes)?, [0.0, 0.0, 0.0, 1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct EncodingOptions {
    /// The order of matrix elements in memory.
    pub order: MatrixOrder,
    /// The axes of Euler angles.
    pub sequence: EulerSequence,
}

with_fields! {
    EncodingOptions:
    with_order(order: MatrixOrder),
    with_sequence(sequence: EulerSequence),
}

impl Default for EncodingOptions {
    /// Matrices row by row, and Euler angles XYZ.
    fn default() -> Self {
        Self {
            order: MatrixOrder::RowMajor,
            sequence: EulerSequence::XYZ,
        }
    }
}

/// The length of memory does not fit the number of rotations.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{rotations} rotations take {needed} bytes, and {bytes} were given")]
#[non_exhaustive]
pub struct EncodingLengthError {
    /// The number of rotations.
    pub rotations: usize,
    /// The length of the memory in bytes.
    pub bytes: usize,
    /// The required length in bytes.
    pub needed: usize,
}

/// The order of matrix elements in memory. The discriminants are the parameter of the kernels' stores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MatrixOrder {
    /// Row by row.
    RowMajor = 0,
    /// Column by column.
    ColumnMajor = 1,
}

names! {
    MatrixOrder, "matrix order",
    RowMajor => "row",
    ColumnMajor => "column",
}

impl MatrixOrder {
    /// The order in words: `matrix column by column`.
    fn in_words(self) -> &'static str {
        match self {
            Self::RowMajor => "row by row",
            Self::ColumnMajor => "column by column",
        }
    }
}

/// The encoding with this name, with the default options: row by row, XYZ.
impl FromStr for Encoding {
    type Err = UnknownNameError;

    fn from_str(name: &str) -> Result<Self, UnknownNameError> {
        let kinds: Vec<Self> = Self::kinds().collect();
        named("encoding", &kinds, Self::name, name)
    }
}

impl Encoding {
    /// The name that programs use; it does not depend on the options.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// A short description.
    #[must_use]
    pub fn summary(self) -> &'static str {
        self.row().summary
    }

    /// The number of bytes of one rotation.
    #[must_use]
    pub fn bytes(self) -> usize {
        let row = self.row();
        row.component_type.bytes() * row.components.len()
    }

    /// The shape of one rotation in an array: `[4]`, `[3]`, `[3, 3]`, ….
    #[must_use]
    pub fn shape(self) -> &'static [usize] {
        self.row().shape
    }

    /// The names of the components, in order.
    #[must_use]
    pub fn components(self) -> &'static [&'static str] {
        self.row().components
    }

    /// The indices of the components that are angles, in degrees: the last one of axis and angle, all of Euler
    /// angles.
    #[must_use]
    pub fn angles(self) -> Range<usize> {
        self.row().angles
    }

    /// The number type of the components.
    #[must_use]
    pub fn component_type(self) -> ComponentType {
        self.row().component_type
    }

    /// One encoding for each name, with the default options: row by row, XYZ.
    pub fn kinds() -> impl Iterator<Item = Self> {
        let all = Self::ALL.into_iter().enumerate();
        let kinds = all.filter(|(index, encoding)| {
            let mut before = Self::ALL[..*index].iter();
            before.all(|other| other.name() != encoding.name())
        });
        kinds.map(|(_, encoding)| encoding)
    }

    /// Whether rotations can be stored and read again; otherwise the encoding is for velocities and accelerations
    /// only.
    #[must_use]
    pub fn stores_rotations(self) -> bool {
        self.row().error_bound.is_some()
    }

    /// Whether the components are `x y z w`, in any precision.
    #[must_use]
    pub fn is_quaternion(self) -> bool {
        self.components() == QUATERNION.components
    }

    /// Encodes rotations, `x y z w` each, in the machine's byte order.
    ///
    /// ```
    /// use tumble::Encoding;
    /// let mut bytes = [0; 8];
    /// Encoding::Snorm16.encode(&[[0.0, 0.0, 0.0, 1.0]], &mut bytes)?;
    /// assert_eq!(bytes, [0, 0, 0, 0, 0, 0, 0xff, 0x7f]);
    /// # Ok::<(), tumble::EncodingLengthError>(())
    /// ```
    ///
    /// # Errors
    /// When the length of `output` is not [`Encoding::bytes`] for each rotation.
    pub fn encode(
        self,
        rotations: &[[f32; 4]],
        output: &mut [u8],
    ) -> Result<(), EncodingLengthError> {
        self.check_length(rotations.len(), output.len())?;
        self.encode_all(rotations, output);
        Ok(())
    }

    /// As [`Encoding::encode`], for memory of the right length.
    pub(crate) fn encode_all(self, rotations: &[[f32; 4]], output: &mut [u8]) {
        let row = self.row();
        (row.encode)(rotations, row.detail, output);
    }

    /// Decodes one rotation or one vector. The rotation equals the encoded one up to rounding and sign.
    ///
    /// # Errors
    /// When the length of `bytes` is not that of one rotation.
    pub fn decode(self, bytes: &[u8]) -> Result<[f32; 4], EncodingLengthError> {
        self.check_length(1, bytes.len())?;
        Ok(self.decode_one(bytes))
    }

    pub(crate) fn check_length(
        self,
        rotations: usize,
        bytes: usize,
    ) -> Result<(), EncodingLengthError> {
        let needed = rotations.saturating_mul(self.bytes());
        if bytes == needed {
            Ok(())
        } else {
            Err(EncodingLengthError {
                rotations,
                bytes,
                needed,
            })
        }
    }

    /// As [`Encoding::decode`], for bytes of the right length.
    pub(crate) fn decode_one(self, bytes: &[u8]) -> [f32; 4] {
        let row = self.row();
        let size = row.component_type.bytes();
        let number = |index: usize| (row.component_type).decode(&bytes[index * size..][..size]);
        (row.decode)(&number, row.detail)
    }
}

/// The rotation of a matrix whose rows, or columns if `order` is 1, start `length` numbers apart.
fn of_matrix(number: &StoredNumbers, length: usize, order: u32) -> [f32; 4] {
    let columns = Mat3::from_cols_array(&std::array::from_fn(|i| number(i / 3 * length + i % 3)));
    let matrix = match order {
        0 => columns.transpose(),
        _ => columns,
    };
    Quat::from_mat3(&matrix).to_array()
}

/// The encodings of the kernels' store functions.
#[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
impl Encoding {
    /// Every encoding with every value of its options, in the order of [`Encoding::ALL`].
    pub(crate) fn with_all_options() -> Vec<Self> {
        let mut all = Vec::new();
        for encoding in Self::ALL {
            for order in MatrixOrder::ALL {
                for sequence in EulerSequence::all() {
                    let encoding = encoding.with(EncodingOptions { order, sequence });
                    if !all.contains(&encoding) {
                        all.push(encoding);
                    }
                }
            }
        }
        all
    }

    /// The encodings of a store function of the kernels.
    pub(crate) fn of_store(store: Store) -> Vec<Self> {
        let mut all = Self::with_all_options();
        all.retain(|encoding| encoding.row().store == store);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_decoded_is_near_what_was_encoded() {
        let rotation = [0.5, -0.5, 0.099_999, -0.7];
        for (encoding, bound) in [
            (Encoding::F32, 0.0),
            (Encoding::F16, 2.5e-4),
            (Encoding::Snorm16, 1.6e-5),
        ] {
            let mut bytes = vec![0; encoding.bytes()];
            encoding.encode(&[rotation], &mut bytes).unwrap();
            let decoded = encoding.decode(&bytes).unwrap();
            for (a, b) in rotation.iter().zip(decoded) {
                assert!((a - b).abs() <= bound, "{encoding:?}: {a} {b}");
            }
        }
    }

    #[test]
    fn every_store_makes_an_encoding_whose_row_is_whole() {
        for kernel in &crate::shader::KERNELS {
            if let Some((_, _, store)) = kernel.segments {
                assert!(!Encoding::of_store(store).is_empty(), "{store:?}");
            }
        }
        let all = Encoding::with_all_options();
        assert_eq!(
            Encoding::of_store(Store::Euler).len(),
            EulerSequence::all().len()
        );
        assert_eq!(
            Encoding::of_store(Store::Matrix3x4).len(),
            MatrixOrder::ALL.len()
        );
        for encoding in all {
            let numbers = encoding.components().len();
            assert_eq!(
                encoding.shape().iter().product::<usize>(),
                numbers,
                "{encoding}"
            );
            assert!(encoding.angles().end <= numbers, "{encoding}");
            assert_eq!(
                encoding.bytes() % 4,
                0,
                "{encoding}: kernels store whole words"
            );
        }
    }
}
