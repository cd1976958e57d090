//! The binary data of a new glTF file: its layout, and its bytes.

use std::io::{self, Write};

use crate::gltf::meshopt::encode_attributes;
use crate::gltf::quantized::{Quantization, filtered, quantized};
use crate::gltf::write_new::json::{
    Accessor, Buffer, BufferExtensions, BufferView, FLOAT, Fallback, MeshoptView, SHORT,
    ViewExtensions,
};
use crate::gltf::write_new::samples::{ClipSamples, Property};

/// The data of an accessor.
pub(super) enum AccessorData<'a> {
    /// Inverse bind matrices.
    Matrices(Vec<[f32; 16]>),
    /// Times of samples, increasing.
    Times(Vec<f32>),
    /// The samples of a channel.
    Channel(ClipSamples<'a>, usize, Property),
    /// The keys of a channel.
    Keys(Property, Vec<f32>),
    /// Rotations of 16 bits per component.
    Quantized(Vec<i16>),
    /// Rotations of few bits, which meshopt's filter decodes to 16 bits for each component.
    Filtered(Vec<[u8; 8]>),
}

impl AccessorData<'_> {
    /// The type of the values, the bytes of each, and their number.
    fn shape(&self) -> (&'static str, u64, usize) {
        match self {
            Self::Matrices(matrices) => ("MAT4", 64, matrices.len()),
            Self::Times(times) => ("SCALAR", 4, times.len()),
            Self::Channel(samples, _, Property::Rotation) => ("VEC4", 16, samples.len()),
            Self::Channel(samples, _, _) => ("VEC3", 12, samples.len()),
            Self::Keys(Property::Rotation, numbers) => ("VEC4", 16, numbers.len() / 4),
            Self::Keys(_, numbers) => ("VEC3", 12, numbers.len() / 3),
            Self::Quantized(numbers) => ("VEC4", 8, numbers.len() / 4),
            Self::Filtered(elements) => ("VEC4", 8, elements.len()),
        }
    }

    /// The same data with quantized rotations, if it contains rotations.
    pub(super) fn quantized(self, quantization: Quantization) -> Self {
        let of = |rotations: &mut dyn Iterator<Item = [f32; 4]>| match quantization {
            Quantization::Components => Self::Quantized(rotations.flat_map(quantized).collect()),
            Quantization::Filtered(steps) => Self::Filtered(
                rotations
                    .map(|rotation| filtered(rotation, steps))
                    .collect(),
            ),
        };
        match self {
            Self::Channel(samples, track, Property::Rotation) => of(&mut samples.rotations(track)),
            Self::Keys(Property::Rotation, numbers) => {
                of(&mut numbers.as_chunks::<4>().0.iter().copied())
            }
            other => other,
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Matrices(matrices) => bytes_of(matrices.iter().copied()),
            Self::Times(times) => bytes_of(times.iter().map(|&time| [time])),
            Self::Channel(samples, track, property) => match property {
                Property::Rotation => bytes_of(samples.rotations(*track)),
                Property::Translation => bytes_of(samples.translations(*track)),
                Property::Scale => bytes_of(samples.scales(*track)),
            },
            Self::Keys(_, numbers) => bytes_of(numbers.iter().map(|&number| [number])),
            Self::Quantized(numbers) => {
                let each = numbers.iter().flat_map(|number| number.to_le_bytes());
                each.collect()
            }
            Self::Filtered(elements) => elements.concat(),
        }
    }
}

/// The bytes of numbers in a file, little-endian.
fn bytes_of<const N: usize>(values: impl Iterator<Item = [f32; N]>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 * N * values.size_hint().0);
    for number in values.flatten() {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    bytes
}

/// All binary data, in the order of its accessors. Every value is of f32 or of four 16-bit numbers, so that
/// everything is aligned to 4 bytes.
#[derive(Default)]
pub(super) struct Binary<'a> {
    data: Vec<AccessorData<'a>>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) views: Vec<BufferView>,
}

impl<'a> Binary<'a> {
    /// Number of bytes.
    pub(super) fn length(&self) -> u64 {
        let last = self.views.last();
        last.map_or(0, |view| view.byte_offset + view.byte_length)
    }

    /// Begins a new view for the following data.
    pub(super) fn begin_view(&mut self) {
        self.views.push(BufferView {
            buffer: 0,
            byte_offset: self.length(),
            byte_length: 0,
            extensions: None,
        });
    }

    /// Adds data to the last view; returns the index of its accessor.
    pub(super) fn push(&mut self, data: AccessorData<'a>) -> usize {
        if self.views.is_empty() {
            self.begin_view();
        }
        let buffer_view = self.views.len() - 1;
        let view = &mut self.views[buffer_view];
        let (shape, bytes, count) = data.shape();
        let [min, max] = match &data {
            AccessorData::Times(times) => {
                [times.first(), times.last()].map(|time| time.map(|&time| [time.into()]))
            }
            _ => [None; 2],
        };
        self.accessors.push(Accessor {
            buffer_view,
            byte_offset: view.byte_length,
            component_type: match data {
                AccessorData::Quantized(_) | AccessorData::Filtered(_) => SHORT,
                _ => FLOAT,
            },
            normalized: matches!(data, AccessorData::Quantized(_) | AccessorData::Filtered(_)),
            count,
            shape,
            min,
            max,
        });
        view.byte_length += bytes * count as u64;
        self.data.push(data);
        self.accessors.len() - 1
    }

    /// Compresses everything by meshopt: all data with the same length of elements and the same filter gets one view,
    /// to which the accessors are moved. Returns the bytes, and two buffers: that of the bytes, and that of the
    /// decoded data.
    pub(super) fn compress(&mut self) -> (Vec<u8>, [Buffer; 2]) {
        let kind =
            |data: &AccessorData<'_>| (data.shape().1, matches!(data, AccessorData::Filtered(_)));
        let mut kinds: Vec<(u64, bool)> = self.data.iter().map(kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let (mut views, mut compressed, mut length) = (Vec::new(), Vec::new(), 0);
        for (view, &(stride, is_filtered)) in kinds.iter().enumerate() {
            let mut bytes = Vec::new();
            for (data, accessor) in self.data.iter().zip(&mut self.accessors) {
                if kind(data) == (stride, is_filtered) {
                    accessor.buffer_view = view;
                    accessor.byte_offset = bytes.len() as u64;
                    bytes.extend(data.bytes());
                }
            }
            let stream = encode_attributes(&bytes, stride as usize);
            views.push(BufferView {
                buffer: 1,
                byte_offset: length,
                byte_length: bytes.len() as u64,
                extensions: Some(ViewExtensions {
                    meshopt: MeshoptView {
                        buffer: 0,
                        byte_offset: compressed.len() as u64,
                        byte_length: stream.len() as u64,
                        byte_stride: stride,
                        mode: "ATTRIBUTES",
                        filter: is_filtered.then_some("QUATERNION"),
                        count: bytes.len() as u64 / stride,
                    },
                }),
            });
            length += bytes.len() as u64;
            compressed.extend(stream);
            compressed.resize(compressed.len().next_multiple_of(4), 0);
        }
        self.views = views;
        let buffers = [
            Buffer {
                uri: None,
                byte_length: compressed.len() as u64,
                extensions: None,
            },
            Buffer {
                uri: None,
                byte_length: length,
                extensions: Some(BufferExtensions {
                    meshopt: Fallback { fallback: true },
                }),
            },
        ];
        (compressed, buffers)
    }

    /// Writes all data, one channel at a time.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let mut data = self.data.iter();
        data.try_for_each(|data| out.write_all(&data.bytes()))
    }
}
