//! The readers of meshes, nets and paths.

use tumble_formats::npy::read_numbers;
use tumble_formats::path::{Pace, read_paths};
use tumble_formats::surface::{Surface, SurfaceFormat};
use tumble_formats::times::read_times;
use tumble_formats::{Diagnostic, Limits, SURFACES};
use tumble_routes::mesh::Mesh;
use tumble_routes::net::Net;

use super::signature;

fn hint(error: &Diagnostic) -> String {
    assert!(!error.message.is_empty());
    error.message.chars().rev().take(12).collect()
}

/// Every format of surfaces: a surface that is read has the vertices that its faces name, or is refused when it
/// becomes a mesh or a net.
pub(crate) fn surfaces(bytes: &[u8]) -> u64 {
    let outcome = |format: &&SurfaceFormat| {
        let found = (format.read_bytes)("fuzz", bytes.to_vec(), None, Limits::default());
        let text = match found {
            Ok(Surface::Mesh(found)) => match Mesh::welded(&found.positions, found.iter(), 0.0) {
                Ok(mesh) => format!("{:?}", mesh.pieces().len().min(3)),
                Err(error) => error.to_string(),
            },
            Ok(Surface::Net(net)) => {
                assert_eq!(Some(net.points.len()), net.rows.checked_mul(net.columns));
                match Net::new(net.rows, net.columns, net.points) {
                    Ok(_) => "a net".to_owned(),
                    Err(error) => error.to_string(),
                }
            }
            Err(error) => hint(&error),
        };
        let words = text.chars().filter(|c| !c.is_ascii_digit()).take(40);
        words.collect::<String>()
    };
    signature(SURFACES.iter().map(outcome).collect::<Vec<_>>())
}

/// Paths in CSV and NPY: a path that is read has points in order.
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

/// Arrays whose meaning the caller knows, and lists of times.
pub(crate) fn numbers(bytes: &[u8]) -> u64 {
    let _ = read_times("fuzz", bytes);
    match read_numbers("fuzz", bytes, |_| Ok(())) {
        Ok(found) => {
            assert_eq!(found.values.len(), found.shape.iter().product::<usize>());
            signature((found.shape.len().min(5), found.values.len().min(9)))
        }
        Err(error) => signature((error.code, hint(&error))),
    }
}
