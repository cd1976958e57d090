//! NPY: float32, C order, shape `(tracks, frames, 4)` or `(frames, tracks, 4)`.

use std::io::{self, Write};

use glam::Quat;
use npyz::WriterBuilder;

/// The order of a quaternion's components in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum ComponentOrder {
    /// `x y z w`, as in memory, glTF and SciPy.
    #[default]
    Xyzw,
    /// `w x y z`, as in `.dat` files.
    Wxyz,
}

/// Writes rotations as they come, some at a time.
pub struct NpyWriter<W> {
    writer: W,
    order: ComponentOrder,
    missing: usize,
}

impl<W: Write> NpyWriter<W> {
    /// Writes the header for `rows × columns` rotations.
    ///
    /// # Errors
    /// When writing fails.
    pub fn new(
        mut writer: W,
        rows: usize,
        columns: usize,
        order: ComponentOrder,
    ) -> io::Result<Self> {
        let shape = [rows as u64, columns as u64, 4];
        let mut header = Vec::new();
        // The values are written below, whole slices at a time.
        npyz::WriteOptions::<f32>::new()
            .dtype(npyz::DType::Plain("<f4".parse().map_err(io::Error::other)?))
            .shape(&shape)
            .writer(&mut header)
            .begin_nd()?;
        writer.write_all(&header)?;
        Ok(Self {
            writer,
            order,
            missing: rows * columns,
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
        if self.order == ComponentOrder::Xyzw && cfg!(target_endian = "little") {
            return self.writer.write_all(bytemuck::cast_slice(rotations));
        }
        const BLOCK: usize = 4096;
        let mut bytes = Vec::with_capacity(BLOCK * size_of::<Quat>());
        for block in rotations.chunks(BLOCK) {
            bytes.clear();
            for q in block {
                let components = match self.order {
                    ComponentOrder::Xyzw => [q.x, q.y, q.z, q.w],
                    ComponentOrder::Wxyz => [q.w, q.x, q.y, q.z],
                };
                bytes.extend(components.iter().flat_map(|c| c.to_le_bytes()));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn write(order: ComponentOrder) -> Vec<u8> {
        let rotations: Vec<Quat> = (0..6)
            .map(|i| Quat::from_xyzw(i as f32, 0.25, -0.5, 1.0))
            .collect();
        let mut writer = NpyWriter::new(Vec::new(), 2, 3, order).unwrap();
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
    fn a_wrong_count_is_an_error() {
        let mut writer = NpyWriter::new(Vec::new(), 1, 2, ComponentOrder::Xyzw).unwrap();
        assert!(writer.write(&[Quat::IDENTITY; 3]).is_err());
        writer.write(&[Quat::IDENTITY]).unwrap();
        assert!(writer.finish().is_err());
    }
}
