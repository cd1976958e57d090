//! NPY: float32 (or float16, or int16), C order, shape `(tracks, frames, …)` or
//! `(frames, tracks, …)`, four numbers a rotation or as its encoding has it.

use std::io::{self, Write};

use glam::Quat;
use npyz::WriterBuilder;

use tumble::{ComponentType, Encoding, Layout};

use crate::format::{Format, FormatOption, ResultShape, ResultWriter, WriteResults};
use crate::npz::open_npy;

/// The order of a quaternion's components in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum ComponentOrder {
    /// `x y z w`, as in memory, glTF and `SciPy`.
    #[default]
    Xyzw,
    /// `w x y z`, as in `.dat` files.
    Wxyz,
}

impl ComponentOrder {
    /// As it is written: `xyzw`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Xyzw => "xyzw",
            Self::Wxyz => "wxyz",
        }
    }
}

/// `NumPy`'s array files.
pub static FORMAT: Format = Format {
    name: "npy",
    summary: "NumPy's, float32",
    extensions: &[],
    probe: |start| start.starts_with(b"\x93NUMPY"),
    read: open_npy,
    write: Some(WriteResults {
        is_text: false,
        order: ComponentOrder::Xyzw,
        layout: None,
        rotation_bytes: |encoding| encoding.bytes() as f64,
        rotations: |out, result| Ok(Box::new(NpyWriter::of(out, result)?)),
        poses: |poses, mut out| poses.write_npy(&mut out),
    }),
    write_motion: None,
    features: &[],
    options: &FormatOption::OF_ARRAYS,
};

/// Rotations written at once, so that a signal is noticed soon: 4 MB.
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

/// Writes rotations as they come, some at a time.
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

    /// Writes the header for `rows × columns` rotations; [`Encoding::Snorm16`] is
    /// int16, to be divided by 32767. The order is that of quaternions; nothing else has
    /// one.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) no file could hold so many.
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
        let own = encoding.shape().iter().map(|&length| length as u64);
        let shape: Vec<u64> = [rows as u64, columns as u64]
            .into_iter()
            .chain(own)
            .collect();
        let mut header = Vec::new();
        // The values are written below, whole slices at a time.
        match encoding.component_type() {
            ComponentType::F32 => write_header::<f32>(&mut header, "<f4", &shape)?,
            ComponentType::F16 => write_header::<half::f16>(&mut header, "<f2", &shape)?,
            ComponentType::Snorm16 => write_header::<i16>(&mut header, "<i2", &shape)?,
        }
        writer.write_all(&header)?;
        Ok(Self {
            writer,
            order,
            encoding,
            missing,
        })
    }

    /// Writes the next rotations.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) there are more than the shape has.
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

    /// Flushes and gives the writer back.
    ///
    /// # Errors
    /// When flushing fails, or (`InvalidInput`) there are fewer rotations than the
    /// shape has.
    pub fn finish(mut self) -> io::Result<W> {
        if self.missing > 0 {
            let message = format!("{} rotations of the shape are missing", self.missing);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        self.writer.flush()?;
        Ok(self.writer)
    }
}

fn write_header<T: npyz::Serialize>(
    header: &mut Vec<u8>,
    dtype: &str,
    shape: &[u64],
) -> io::Result<()> {
    npyz::WriteOptions::<T>::new()
        .dtype(npyz::DType::Plain(dtype.parse().map_err(io::Error::other)?))
        .shape(shape)
        .writer(header)
        .begin_nd()
        .map(drop)
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
