//! What ways lead over, read from a file.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use tumble_formats::Limits;
use tumble_formats::beneath::open_beneath;
use tumble_formats::gltf::meshes::read_triangles;
use tumble_routes::mesh::Mesh;
use tumble_routes::net::Net;

use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// The largest file that is read.
const MOST_BYTES: u64 = 4 << 30;

pub(crate) enum Surface {
    Mesh(Box<Mesh>),
    Net(Net),
}

impl Surface {
    /// Reads a file, known by its name.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let name = path.display();
        let refuse =
            |error: &dyn std::fmt::Display| Failure::new(ALL_INPUTS, format!("{name}: {error}"));
        let extension = path
            .extension()
            .and_then(|own| own.to_str())
            .unwrap_or_default();
        let mesh = match extension.to_lowercase().as_str() {
            "obj" => Mesh::of_obj(&bytes(path)?).map_err(|error| refuse(&error))?,
            "ply" => Mesh::of_ply(&bytes(path)?).map_err(|error| refuse(&error))?,
            "glb" | "gltf" => {
                let all = read_triangles(path, Limits::default())
                    .map_err(|error| Failure::input(&error, ""))?;
                for warning in &all.warnings {
                    words::note(&warning.to_string());
                }
                Mesh::new(&all.positions, &all.triangles).map_err(|error| refuse(&error))?
            }
            "npy" => {
                let net = Net::of_npy(&bytes(path)?).map_err(|error| refuse(&error))?;
                return Ok(Self::Net(net));
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
        false => Err(io::Error::other("is no file; give one")),
    };
    read(path, open())
}

/// All bytes of a file that a file in `folder` names.
pub(super) fn bytes_beneath(folder: &Path, name: &Path) -> Result<Vec<u8>, Failure> {
    read(name, open_beneath(folder, name))
}

fn read(path: &Path, file: io::Result<File>) -> Result<Vec<u8>, Failure> {
    let name = path.display();
    let refuse =
        |error: io::Error| Failure::new(ALL_INPUTS, format!("{name}: cannot be read: {error}"));
    let mut bytes = Vec::new();
    let file = file.map_err(refuse)?;
    file.take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(refuse)?;
    match bytes.len() as u64 <= MOST_BYTES {
        true => Ok(bytes),
        false => Err(Failure::new(
            ALL_INPUTS,
            format!("{name}: is longer than 4 GiB; simplify it"),
        )),
    }
}
