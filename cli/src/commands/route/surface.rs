//! The surfaces that routes lie on, read from files.

use std::path::Path;

use tumble_formats::surface::{self, SurfaceFormat, SurfaceKind};
use tumble_formats::{Code, Diagnostic, Limits};
use tumble_routes::mesh::Mesh;
use tumble_routes::net::Net;

use crate::messages::exit::Failure;
use crate::messages::names;
use crate::messages::words;

/// The largest file that is read.
pub(super) const MAX_BYTES: u64 = 4 << 30;

pub(crate) enum Surface {
    Mesh(Box<Mesh>),
    Net(Net),
}

impl Surface {
    /// Reads a file, known by its name; vertices of a mesh within a distance of each other are welded.
    pub(crate) fn read(path: &Path, weld: f64) -> Result<Self, Failure> {
        let name = names::input(path);
        let format = SurfaceFormat::of(path)
            .ok_or_else(|| Failure::usage(format!("{name}: a surface is {}", kinds())))?;
        let limits = Limits {
            file: MAX_BYTES,
            ..Limits::default()
        };
        let found = format.open(path, limits);
        let refused = |code, error: &dyn std::fmt::Display| {
            let fault = Diagnostic::new(path.display().to_string(), code, error.to_string());
            Failure::input(&fault, "")
        };
        match found.map_err(|fault| Failure::input(&fault, ""))? {
            surface::Surface::Mesh(polygons) => {
                polygons.warnings.iter().cloned().for_each(words::warn_of);
                let mesh = Mesh::welded(&polygons.positions, polygons.iter(), weld)
                    .map_err(|error| refused(Code::Mesh, &error))?;
                for warning in mesh.warnings() {
                    words::warning(&format!("{name}: {warning}"));
                }
                Ok(Self::Mesh(Box::new(mesh)))
            }
            surface::Surface::Net(net) => {
                let net = Net::new(net.rows, net.columns, net.points);
                net.map(Self::Net)
                    .map_err(|error| refused(Code::Net, &error))
            }
        }
    }

    pub(super) fn size(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.size(),
            Self::Net(net) => net.size(),
        }
    }
}

/// The kinds of surfaces with the endings of their files, for help and messages.
pub(crate) fn kinds() -> String {
    let [meshes, nets] = [SurfaceKind::Mesh, SurfaceKind::Net].map(SurfaceFormat::endings_of);
    format!("a mesh ({meshes}) or a net of Bézier control points ({nets})")
}
