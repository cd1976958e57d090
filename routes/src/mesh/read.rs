//! Meshes in files: OBJ and PLY.

use std::io::{BufReader, Cursor};

use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use thiserror::Error;

use crate::error::MeshError;
use crate::mesh::Mesh;

/// Why a file is no mesh.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The text of an OBJ file has a fault.
    #[error("the OBJ file cannot be read: {reason}; export it again")]
    Obj {
        /// What is wrong.
        reason: String,
    },
    /// A PLY file has a fault.
    #[error("the PLY file cannot be read: {reason}; export it again")]
    Ply {
        /// What is wrong, and in which line where that is known.
        reason: String,
    },
    /// The file can be read, but does not make a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Positions and polygons as a file has them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polygons {
    /// Of the vertices.
    pub positions: Vec<DVec3>,
    /// The vertices of each polygon.
    pub polygons: Vec<Vec<u32>>,
}

impl Polygons {
    /// # Errors
    /// As [`Mesh::new`].
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        self.welded(0.0)
    }

    /// With positions within a distance of each other welded.
    ///
    /// # Errors
    /// As [`Mesh::welded`].
    pub fn welded(&self, distance: f64) -> Result<Mesh, MeshError> {
        let polygons = self.polygons.iter().map(Vec::as_slice);
        Mesh::welded(&self.positions, polygons, distance)
    }
}

impl Mesh {
    /// Of the text of an OBJ file: the faces of all its objects and groups.
    ///
    /// # Errors
    /// When the text has a fault, or does not make a valid mesh.
    pub fn of_obj(text: &[u8]) -> Result<Self, ReadError> {
        Ok(obj(text)?.mesh()?)
    }

    /// Of the bytes of a PLY file, as text or binary: `x`, `y` and `z` of its vertices and
    /// `vertex_indices` (or `vertex_index`) of its faces.
    ///
    /// # Errors
    /// When the bytes have a fault, or do not make a valid mesh.
    pub fn of_ply(bytes: &[u8]) -> Result<Self, ReadError> {
        Ok(ply(bytes)?.mesh()?)
    }
}

/// The lines of an OBJ file that say positions and faces, with the corners' positions alone: what a mesh
/// needs. Lines that `\` continues are one line. Objects, groups, materials, texture coordinates and
/// normals are passed over, whether they are right or not.
fn vertices_and_faces(text: &[u8]) -> Vec<u8> {
    let mut lines = Vec::with_capacity(text.len());
    let mut whole: Vec<u8> = Vec::new();
    for line in text.split(|byte| *byte == b'\n') {
        let line = line.trim_ascii_end();
        if let Some(begun) = line.strip_suffix(b"\\") {
            whole.extend_from_slice(begun);
            whole.push(b' ');
            continue;
        }
        whole.extend_from_slice(line);
        let mut words = whole
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty());
        match words.next() {
            Some(b"v") => lines.extend_from_slice(&whole),
            Some(b"f") => {
                lines.push(b'f');
                for word in words.take_while(|word| word[0] != b'#') {
                    lines.push(b' ');
                    lines.extend(word.iter().copied().take_while(|byte| *byte != b'/'));
                }
            }
            _ => {}
        }
        lines.push(b'\n');
        whole.clear();
    }
    lines
}

/// The faces of all objects and groups of an OBJ file.
///
/// # Errors
/// When the text has a fault.
pub fn obj(text: &[u8]) -> Result<Polygons, ReadError> {
    let options = tobj::LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Materials are in other files, and nothing here depends on them.
    let none = |_: &std::path::Path| Ok((Vec::new(), std::collections::HashMap::default()));
    let text = vertices_and_faces(text);
    let loaded = tobj::load_obj_buf(&mut BufReader::new(Cursor::new(text)), &options, none);
    let (models, _) = loaded.map_err(|error| ReadError::Obj {
        reason: error.to_string(),
    })?;
    let mut all = Polygons::default();
    for model in models {
        let mesh = model.mesh;
        let first = all.positions.len() as u32;
        let positions = mesh.positions.chunks_exact(3);
        all.positions.extend(positions.map(DVec3::from_slice));
        let mut indices = mesh
            .indices
            .iter()
            .map(|&index| first.saturating_add(index));
        let arities = match mesh.face_arities.is_empty() {
            true => vec![3; mesh.indices.len() / 3],
            false => mesh.face_arities,
        };
        let polygon = |arity: u32| indices.by_ref().take(arity as usize).collect();
        all.polygons.extend(arities.into_iter().map(polygon));
    }
    Ok(all)
}

/// A row of a PLY file: a vertex, a face, or something else.
struct PlyRow {
    position: DVec3,
    indices: Option<Vec<i64>>,
}

impl PropertyAccess for PlyRow {
    fn new() -> Self {
        Self {
            position: DVec3::NAN,
            indices: None,
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match (name, number(&property)) {
            ("x", Some(value)) => self.position.x = value,
            ("y", Some(value)) => self.position.y = value,
            ("z", Some(value)) => self.position.z = value,
            ("vertex_indices" | "vertex_index", None) => self.indices = indices(&property),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(value) => f64::from(value),
        Property::UChar(value) => f64::from(value),
        Property::Short(value) => f64::from(value),
        Property::UShort(value) => f64::from(value),
        Property::Int(value) => f64::from(value),
        Property::UInt(value) => f64::from(value),
        Property::Float(value) => f64::from(value),
        Property::Double(value) => value,
        _ => return None,
    })
}

fn indices(property: &Property) -> Option<Vec<i64>> {
    fn wide<T: Copy + Into<i64>>(values: &[T]) -> Vec<i64> {
        values.iter().map(|&value| value.into()).collect()
    }
    Some(match property {
        Property::ListChar(values) => wide(values),
        Property::ListUChar(values) => wide(values),
        Property::ListShort(values) => wide(values),
        Property::ListUShort(values) => wide(values),
        Property::ListInt(values) => wide(values),
        Property::ListUInt(values) => wide(values),
        _ => return None,
    })
}

/// The vertices and faces of a PLY file.
///
/// # Errors
/// When the bytes have a fault.
pub fn ply(bytes: &[u8]) -> Result<Polygons, ReadError> {
    let refuse = |reason: String| ReadError::Ply { reason };
    let parser = Parser::<PlyRow>::new();
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = parser
        .read_header(&mut reader)
        .map_err(|error| refuse(error.to_string()))?;
    for (name, element) in &header.elements {
        // A row takes a byte at least, where it has anything.
        if element.count > bytes.len() || (element.properties.is_empty() && element.count > 0) {
            let reason = format!(
                "it says {} rows of `{name}`, and has {} bytes",
                element.count,
                bytes.len()
            );
            return Err(refuse(reason));
        }
    }
    let payload = parser.read_payload(&mut reader, &header);
    let payload = payload.map_err(|error| refuse(error.to_string()))?;
    let rows = |name: &str| payload.get(name).map_or(&[][..], Vec::as_slice);
    let positions: Vec<DVec3> = rows("vertex").iter().map(|row| row.position).collect();
    let mut polygons = Vec::with_capacity(rows("face").len());
    for (face, row) in rows("face").iter().enumerate() {
        let Some(indices) = &row.indices else {
            return Err(refuse(format!(
                "face {face} (from 0) has no `vertex_indices`"
            )));
        };
        let polygon: Result<Vec<u32>, _> =
            indices.iter().map(|&index| u32::try_from(index)).collect();
        polygons.push(polygon.map_err(|_| {
            refuse(format!(
                "face {face} (from 0) names a vertex below 0: {indices:?}"
            ))
        })?);
    }
    Ok(Polygons {
        positions,
        polygons,
    })
}
