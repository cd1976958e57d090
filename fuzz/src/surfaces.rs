//! The readers of meshes, nets and paths.

use tumble_formats::gltf::meshes::triangles_of;
use tumble_formats::npy::read_numbers;
use tumble_formats::path::{Pace, read_paths};
use tumble_formats::{Diagnostic, Limits};
use tumble_routes::mesh::read::{Polygons, ReadError, obj, ply};

use super::signature;

fn hint(error: &Diagnostic) -> String {
    assert!(!error.message.is_empty());
    error.message.chars().rev().take(12).collect()
}

/// OBJ, PLY and the meshes of glTF: what is read has the vertices that its faces name, or is refused when it
/// becomes a mesh.
pub(crate) fn meshes(bytes: &[u8]) -> u64 {
    let outcome = |read: Result<Polygons, ReadError>| {
        let text = match read.map(|polygons| polygons.mesh()) {
            Ok(Ok(mesh)) => format!("{:?}", mesh.pieces().len().min(3)),
            Ok(Err(error)) => error.to_string(),
            Err(error) => error.to_string(),
        };
        let words = text.chars().filter(|c| !c.is_ascii_digit()).take(40);
        words.collect::<String>()
    };
    let triangles = match triangles_of("fuzz", bytes.to_vec(), None, Limits::default()) {
        Ok(found) => {
            let count = found.positions.len();
            let corners = found.triangles.as_flattened();
            assert!(corners.iter().all(|&corner| (corner as usize) < count));
            found.triangles.len().min(3).to_string()
        }
        Err(error) => hint(&error),
    };
    signature((outcome(obj(bytes)), outcome(ply(bytes)), triangles))
}

/// Paths in CSV and NPY: what is read has points in order.
pub(crate) fn paths(bytes: &[u8]) -> u64 {
    let paces = [None, Some(Pace::Seconds(2.0)), Some(Pace::Rate(1.0))];
    let outcomes = paces.map(|pace| match read_paths("fuzz", "path", bytes, pace) {
        Ok(paths) => {
            let set = paths.set;
            for track in 0..set.track_count() {
                let path = set.vector_keys(tumble::Channel::Translation, track);
                let path = path.expect("points");
                assert!(path.times.windows(2).all(|pair| pair[0] < pair[1]));
                assert!(path.keys.iter().all(|point| point.is_finite()));
            }
            set.track_count().min(4).to_string()
        }
        Err(error) => format!("{} {}", error.code, hint(&error)),
    });
    signature(outcomes)
}

/// Arrays whose meaning the caller knows.
pub(crate) fn numbers(bytes: &[u8]) -> u64 {
    match read_numbers("fuzz", bytes, |_| Ok(())) {
        Ok(found) => {
            assert_eq!(found.values.len(), found.shape.iter().product::<usize>());
            signature((found.shape.len().min(5), found.values.len().min(9)))
        }
        Err(error) => signature((error.code, hint(&error))),
    }
}
