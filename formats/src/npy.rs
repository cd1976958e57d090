//! NPY arrays in C order, of shape `(tracks, frames, …)` or `(frames, tracks, …)`. They are float32, float16 or
//! int16, with four numbers for a quaternion or the numbers of another encoding.

use std::borrow::Cow;
use std::io::{self, Write};

use glam::Quat;
use tumble::{ComponentType, Encoding, Layout};

use crate::array::NumberArray;
use crate::array::{ArrayHeader, Element};
use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, ResultShape, ResultWriter, WriteResults};
use crate::npz::array::Array;
use crate::npz::{open_npy, read_npy};
use crate::quaternion::ComponentOrder;

/// The NPY format: array files of `NumPy`.
pub static FORMAT: Format = Format {
    name: "npy",
    summary: "a NumPy array, float32",
    extensions: &[],
    probe: |start| start.starts_with(b"\x93NUMPY"),
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_npy,
    read_bytes: read_npy,
    write: Some(WriteResults {
        order: ComponentOrder::Xyzw,
        layout: None,
        rotation_bytes: |encoding| encoding.bytes() as f64,
        rotations: |out, result| Ok(Box::new(NpyWriter::of(out, result)?)),
        poses: |poses, mut out| poses.write_npy(&mut out),
    }),
    write_motion: None,
    features: &[Feature::SeveralTracks],
    options: &FormatOption::OF_ARRAYS,
};

/// Reads an array whose meaning the caller knows, such as points of paths or nets of control points. Its elements are
/// floats (f2, f4 or f8, in either byte order, in C or Fortran order). `file` is the input's name in messages.
/// `is_right` checks the shape before any number is read; it returns the error as text.
///
/// # Errors
/// When the bytes are not such an array, or `is_right` refuses the shape.
pub fn read_numbers(
    file: &str,
    bytes: &[u8],
    is_right: impl FnOnce(&[usize]) -> Result<(), String>,
) -> Result<NumberArray, Diagnostic> {
    let refuse = |code, message: String| Diagnostic::new(file, code, message);
    let header = ArrayHeader::parse(bytes).map_err(|why| {
        let message = format!("the array's header cannot be read: {why}");
        refuse(Code::ArrayHeader, message)
    })?;
    if !header.element.is_float() {
        let message = format!(
            "the array is of {}; save it as float32 or float64",
            header.element
        );
        return Err(refuse(Code::ElementType, message));
    }
    is_right(&header.shape).map_err(|message| refuse(Code::Shape, message))?;
    let found = bytes.len() - header.start;
    if header.byte_count() != Some(found) {
        let message = format!("an array {header} has not the {found} bytes after the header");
        return Err(refuse(Code::ArraySize, message));
    }
    let array = Array {
        header: &header,
        bytes: Cow::Borrowed(bytes),
    };
    let values = array.numbers().unwrap_or_default();
    Ok(NumberArray {
        shape: header.shape.clone(),
        values,
    })
}

/// The shape of the array at the beginning of some bytes; `None` if there is no complete header.
pub(crate) fn shape_of(start: &[u8]) -> Option<Vec<usize>> {
    ArrayHeader::parse(start).ok().map(|header| header.shape)
}

/// How many rotations are written at once, so that a signal is noticed soon: 4 MB.
const PIECE: usize = 1 << 18;

impl<W: Write> ResultWriter for NpyWriter<W> {
    fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        let mut pieces = rotations.chunks(PIECE);
        pieces.try_for_each(|piece| self.write(piece))
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        (*self).finish().map(drop)
    }
}

/// Writes rotations as an NPY array, in parts.
pub struct NpyWriter<W> {
    writer: W,
    order: ComponentOrder,
    encoding: Encoding,
    missing: usize,
}

impl<W: Write> NpyWriter<W> {
    /// Writes the header of a result.
    fn of(writer: W, result: &ResultShape<'_>) -> io::Result<Self> {
        let (tracks, samples) = (result.set.track_count(), result.timeline.len());
        let (rows, columns) = match result.layout {
            Layout::TrackMajor => (tracks, samples),
            Layout::FrameMajor => (samples, tracks),
        };
        Self::new(
            writer,
            rows,
            columns,
            result.order.unwrap_or_default(),
            result.encoding,
        )
    }

    /// Writes the header of an array of `rows × columns` rotations. With [`Encoding::Snorm16`], numbers are int16, to
    /// be divided by 32767. `order` is that of quaternions; other encodings have only one.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) when a file cannot store so many rotations.
    pub fn new(
        mut writer: W,
        rows: usize,
        columns: usize,
        order: ComponentOrder,
        encoding: Encoding,
    ) -> io::Result<Self> {
        let rotations = rows.checked_mul(columns);
        let bytes = rotations.and_then(|count| count.checked_mul(encoding.bytes()));
        let Some(missing) = rotations.filter(|_| bytes.is_some()) else {
            let message = format!("{rows} × {columns} rotations are more than a file can hold");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        };
        let shape = [&[rows, columns], encoding.shape()].concat();
        let element = match encoding.component_type() {
            ComponentType::F32 => Element::F32,
            ComponentType::F16 => Element::F16,
            ComponentType::Snorm16 => Element::Signed(2),
        };
        writer.write_all(&ArrayHeader::write(&element, &shape))?;
        Ok(Self {
            writer,
            order,
            encoding,
            missing,
        })
    }

    /// Writes the next rotations, in the order of the array.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) when there are more rotations than the shape has.
    pub fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        let Some(missing) = self.missing.checked_sub(rotations.len()) else {
            return Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                "more rotations than the shape has",
            ));
        };
        self.missing = missing;
        let little = cfg!(target_endian = "little");
        if self.order == ComponentOrder::Xyzw && self.encoding == Encoding::F32 && little {
            return self.writer.write_all(bytemuck::cast_slice(rotations));
        }
        let w_first = self.order == ComponentOrder::Wxyz && self.encoding.is_quaternion();
        const BLOCK: usize = 4096;
        let mut ordered = Vec::with_capacity(BLOCK);
        let mut bytes = Vec::new();
        for block in rotations.chunks(BLOCK) {
            ordered.clear();
            ordered.extend(block.iter().map(|q| match w_first {
                true => [q.w, q.x, q.y, q.z],
                false => q.to_array(),
            }));
            bytes.resize(block.len() * self.encoding.bytes(), 0);
            let encoded = self.encoding.encode(&ordered, &mut bytes);
            encoded.map_err(io::Error::other)?;
            if !little {
                let component = self.encoding.component_type().bytes();
                bytes.chunks_exact_mut(component).for_each(<[u8]>::reverse);
            }
            self.writer.write_all(&bytes)?;
        }
        Ok(())
    }

    /// Flushes the output and returns the writer.
    ///
    /// # Errors
    /// When flushing fails, or (`InvalidInput`) when there are fewer rotations than the shape has.
    pub fn finish(mut self) -> io::Result<W> {
        if self.missing > 0 {
            let message = format!("{} rotations of the result were not written", self.missing);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        self.writer.flush()?;
        Ok(self.writer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(order: ComponentOrder) -> Vec<u8> {
        let rotations: Vec<Quat> = (0..6)
            .map(|i| Quat::from_xyzw(i as f32, 0.25, -0.5, 1.0))
            .collect();
        let mut writer = NpyWriter::new(Vec::new(), 2, 3, order, Encoding::F32).unwrap();
        writer.write(&rotations[..4]).unwrap();
        writer.write(&rotations[4..]).unwrap();
        writer.finish().unwrap()
    }

    #[test]
    fn what_is_written_reads_back() {
        for (order, first) in [
            (ComponentOrder::Xyzw, [4.0, 0.25, -0.5, 1.0]),
            (ComponentOrder::Wxyz, [1.0, 4.0, 0.25, -0.5]),
        ] {
            let file = write(order);
            let npy = npyz::NpyFile::new(&file[..]).unwrap();
            assert_eq!(npy.shape(), [2, 3, 4]);
            assert_eq!(npy.order(), npyz::Order::C);
            let values: Vec<f32> = npy.into_vec().unwrap();
            assert_eq!(values[16..20], first);
        }
    }

    #[test]
    fn whole_numbers_are_16_bits() {
        let mut file = Vec::new();
        let (order, encoding) = (ComponentOrder::Wxyz, Encoding::Snorm16);
        let mut writer = NpyWriter::new(&mut file, 1, 1, order, encoding).unwrap();
        writer
            .write(&[Quat::from_xyzw(0.0, 0.5, -1.0, 1.0)])
            .unwrap();
        writer.finish().unwrap();
        let npy = npyz::NpyFile::new(&file[..]).unwrap();
        assert_eq!(npy.into_vec::<i16>().unwrap(), [32767, 0, 16384, -32767]);
    }

    #[test]
    fn a_wrong_count_is_an_error() {
        let order = ComponentOrder::Xyzw;
        let mut writer = NpyWriter::new(Vec::new(), 1, 2, order, Encoding::F32).unwrap();
        assert!(writer.write(&[Quat::IDENTITY; 3]).is_err());
        writer.write(&[Quat::IDENTITY]).unwrap();
        assert!(writer.finish().is_err());
    }
}
