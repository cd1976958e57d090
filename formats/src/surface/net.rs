//! Reads nets of control points in NPY.

use glam::DVec3;

use crate::diagnostic::Diagnostic;
use crate::npy::read_numbers;
use crate::surface::{ControlNet, Surface, SurfaceFormat, SurfaceKind};

/// The NPY format of surfaces: a net of control points.
pub static FORMAT: SurfaceFormat = SurfaceFormat {
    name: "npy",
    summary: "a NumPy array of shape (m, n, 3): the control points of a Bézier surface",
    extensions: &[],
    kind: SurfaceKind::Net,
    read_bytes: |name, bytes, _, _| Ok(Surface::Net(read_net(name, &bytes)?)),
};

/// Reads the control points of a net; `name` is the file's name in messages.
///
/// # Errors
/// When the bytes are not an array of floats of shape (rows, columns, 3).
pub fn read_net(name: &str, bytes: &[u8]) -> Result<ControlNet, Diagnostic> {
    let array = read_numbers(name, bytes, |shape| match shape {
        [_, _, 3] => Ok(()),
        _ => Err(format!(
            "the array has the shape {shape:?}; a net has (m, n, 3)"
        )),
    })?;
    let points = array.values.chunks_exact(3).map(DVec3::from_slice);
    Ok(ControlNet {
        rows: array.shape[0],
        columns: array.shape[1],
        points: points.collect(),
    })
}
