//! The surfaces that routes lie on, read from files.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use glam::DVec3;
use tumble_formats::beneath::open_beneath;
use tumble_formats::gltf::meshes::read_triangles;
use tumble_formats::npy::read_numbers;
use tumble_formats::{Code, Diagnostic, Limits};
use tumble_routes::mesh::{Mesh, read};
use tumble_routes::net::Net;

use crate::messages::exit::Failure;
use crate::messages::names;
use crate::messages::words;

/// The largest file that is read.
const MAX_BYTES: u64 = 4 << 30;

pub(crate) enum Surface {
    Mesh(Box<Mesh>),
    Net(Net),
}

impl Surface {
    /// Reads a file, known by its name; vertices of a mesh within a distance of each other are welded.
    pub(crate) fn read(path: &Path, weld: f64) -> Result<Self, Failure> {
        let name = names::input(path);
        let refused = |code, error: &dyn std::fmt::Display| {
            let fault = Diagnostic::new(path.display().to_string(), code, error.to_string());
            Failure::input(&fault, "")
        };
        let refuse = |error: &dyn std::fmt::Display| refused(Code::Mesh, error);
        let extension = path
            .extension()
            .and_then(|raw| raw.to_str())
            .unwrap_or_default();
        let mesh = match extension.to_lowercase().as_str() {
            "obj" => {
                let polygons = read::obj(&bytes(path)?).map_err(|error| refuse(&error))?;
                polygons.welded(weld).map_err(|error| refuse(&error))?
            }
            "ply" => {
                let polygons = read::ply(&bytes(path)?).map_err(|error| refuse(&error))?;
                polygons.welded(weld).map_err(|error| refuse(&error))?
            }
            "glb" | "gltf" => {
                let all = read_triangles(path, Limits::default())
                    .map_err(|error| Failure::input(&error, ""))?;
                for warning in &all.warnings {
                    words::note(&warning.to_string());
                }
                let triangles = all.triangles.iter().map(<[u32; 3]>::as_slice);
                Mesh::welded(&all.positions, triangles, weld).map_err(|error| refuse(&error))?
            }
            "npy" => {
                let array =
                    read_numbers(
                        &path.display().to_string(),
                        &bytes(path)?,
                        |shape| match shape {
                            [_, _, 3] => Ok(()),
                            _ => Err(format!(
                                "the array has the shape {shape:?}; a net has (m, n, 3)"
                            )),
                        },
                    );
                let array = array.map_err(|fault| Failure::input(&fault, ""))?;
                let points = array.values.chunks_exact(3).map(DVec3::from_slice);
                let net = Net::new(array.shape[0], array.shape[1], points.collect());
                return net
                    .map(Self::Net)
                    .map_err(|error| refused(Code::Net, &error));
            }
            _ => {
                return Err(Failure::usage(format!(
                    "{name}: a surface is a mesh in .obj, .ply, .glb or .gltf, or a net in .npy"
                )));
            }
        };
        for warning in mesh.warnings() {
            words::warning(&format!("{name}: {warning}"));
        }
        Ok(Self::Mesh(Box::new(mesh)))
    }

    pub(super) fn size(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.size(),
            Self::Net(net) => net.size(),
        }
    }
}

/// All bytes of a file; no pipe, which could have no end.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    let open = || match std::fs::metadata(path)?.is_file() {
        true => File::open(path),
        false => Err(io::Error::other("is not a regular file")),
    };
    read(path, open())
}

/// All bytes of a file that a file in `folder` names.
pub(super) fn bytes_beneath(folder: &Path, name: &Path) -> Result<Vec<u8>, Failure> {
    read(name, open_beneath(folder, name))
}

fn read(path: &Path, file: io::Result<File>) -> Result<Vec<u8>, Failure> {
    let refused = |code, message: String| {
        let fault = Diagnostic::new(path.display().to_string(), code, message);
        Failure::input(&fault, "")
    };
    let refuse = |error: io::Error| refused(Code::Open, format!("cannot be read: {error}"));
    let mut bytes = Vec::new();
    let file = file.map_err(refuse)?;
    file.take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(refuse)?;
    match bytes.len() as u64 <= MAX_BYTES {
        true => Ok(bytes),
        false => {
            let message = "is longer than 4 GiB; simplify it";
            Err(refused(Code::FileTooLong, message.to_owned()))
        }
    }
}
