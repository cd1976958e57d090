//! Paths in NPY, of shape (tracks, points, 3).

use glam::DVec3;

use crate::diagnostic::{Code, Diagnostic};
use crate::npy;
use crate::path::{PathFormat, PathPoints};

/// The NPY format of paths: `NumPy` arrays.
pub static FORMAT: PathFormat = PathFormat {
    name: "npy",
    summary: "a NumPy array of floats of shape (tracks, points, 3), without times",
    probe: npy::FORMAT.probe,
    is_of_paths: |start| npy::shape_of(start).is_some_and(|shape| matches!(shape[..], [_, _, 3])),
    read_bytes: read_array,
};

fn read_array(file: &str, bytes: &[u8]) -> Result<Vec<PathPoints>, Diagnostic> {
    let refuse = |code, message: String| Diagnostic::new(file, code, message);
    let array = npy::read_numbers(file, bytes, |shape| match shape {
        [_, _, 3] => Ok(()),
        _ => Err(format!(
            "the array has the shape {shape:?}; paths have (tracks, points, 3)"
        )),
    })?;
    let (tracks, points) = (array.shape[0], array.shape[1]);
    if tracks == 0 || points == 0 {
        return Err(refuse(
            Code::NoKeys,
            "there is no point in the array".to_owned(),
        ));
    }
    let of_track = |(track, numbers): (usize, &[f64])| -> Result<PathPoints, Diagnostic> {
        let points = numbers
            .as_chunks::<3>()
            .0
            .iter()
            .map(|&point| DVec3::from_array(point));
        let points: Vec<DVec3> = points.collect();
        match points.iter().position(|point| !point.as_vec3().is_finite()) {
            Some(point) => {
                let message = "a coordinate is not a finite f32".to_owned();
                Err(refuse(Code::NotFinite, message).inside(format!("[{track}, {point}]")))
            }
            None => Ok(PathPoints {
                points,
                ..PathPoints::default()
            }),
        }
    };
    array
        .values
        .chunks(points * 3)
        .enumerate()
        .map(of_track)
        .collect()
}
