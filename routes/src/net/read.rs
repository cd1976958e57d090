//! Nets in files: NPY.

use glam::DVec3;
use npyz::{NpyFile, Order};

use crate::net::{MOST_POINTS, Net, NetError};

impl Net {
    /// Of the bytes of an NPY file of shape (m, n, 3), f32 or f64, little-endian, in C order.
    ///
    /// # Errors
    /// When the bytes are another file, or no net.
    pub fn of_npy(bytes: &[u8]) -> Result<Self, NetError> {
        let refuse = |reason: String| NetError::Npy { reason };
        let file = NpyFile::new(bytes).map_err(|error| refuse(error.to_string()))?;
        let shape = file.shape().to_vec();
        let &[rows, columns, 3] = &shape[..] else {
            return Err(refuse(format!(
                "its shape is {shape:?}, and that of a net (m, n, 3)"
            )));
        };
        let [rows, columns] =
            [rows, columns].map(|side| usize::try_from(side).unwrap_or(usize::MAX));
        // Before anything is allocated for it.
        if rows.max(columns) > MOST_POINTS {
            return Err(NetError::Shape { rows, columns });
        }
        if file.order() != Order::C {
            return Err(refuse(
                "it is in Fortran's order; save a C-contiguous array".to_owned(),
            ));
        }
        let kind = file.dtype().descr();
        let broken = |error: std::io::Error| refuse(error.to_string());
        let numbers: Vec<f64> = match kind.trim_matches('\'') {
            "<f8" => file.into_vec().map_err(broken)?,
            "<f4" => file
                .into_vec::<f32>()
                .map_err(broken)?
                .into_iter()
                .map(f64::from)
                .collect(),
            _ => {
                return Err(refuse(format!(
                    "it has {kind}; save it as float32 or float64"
                )));
            }
        };
        let points = numbers.chunks_exact(3).map(DVec3::from_slice).collect();
        Self::new(rows, columns, points)
    }
}
