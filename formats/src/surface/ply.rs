//! Reads meshes in PLY.

use std::io::Cursor;

use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use crate::diagnostic::{Code, Diagnostic};
use crate::surface::{Polygons, Surface, SurfaceFormat, SurfaceKind};

/// The PLY format: meshes as text or binary.
pub static FORMAT: SurfaceFormat = SurfaceFormat {
    name: "ply",
    summary: "PLY, text or binary: `x`, `y` and `z` of its vertices, `vertex_indices` of its faces",
    extensions: &[],
    kind: SurfaceKind::Mesh,
    read_bytes: |name, bytes, _, _| Ok(Surface::Mesh(read_ply(name, &bytes)?)),
};

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

/// Reads the vertices and faces of a PLY file, text or binary: `x`, `y` and `z` of its vertices, and `vertex_indices`
/// (or `vertex_index`) of its faces. `name` is the file's name in messages.
///
/// # Errors
/// When the bytes are invalid.
pub fn read_ply(name: &str, bytes: &[u8]) -> Result<Polygons, Diagnostic> {
    let refuse = |reason: String| {
        let message = format!("the PLY file cannot be read: {reason}; export it again");
        Diagnostic::new(name, Code::Mesh, message)
    };
    let parser = Parser::<PlyRow>::new();
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = parser
        .read_header(&mut reader)
        .map_err(|error| refuse(error.to_string()))?;
    for (rows, element) in &header.elements {
        // A row with any property takes at least a byte.
        if element.count > bytes.len() || (element.properties.is_empty() && element.count > 0) {
            let reason = format!(
                "it says {} rows of `{rows}`, and has {} bytes",
                element.count,
                bytes.len()
            );
            return Err(refuse(reason));
        }
    }
    let payload = parser.read_payload(&mut reader, &header);
    let payload = payload.map_err(|error| refuse(error.to_string()))?;
    let rows = |name: &str| payload.get(name).map_or(&[][..], Vec::as_slice);
    let mut all = Polygons {
        positions: rows("vertex").iter().map(|row| row.position).collect(),
        ..Polygons::default()
    };
    for (face, row) in rows("face").iter().enumerate() {
        let Some(indices) = &row.indices else {
            let reason = format!("face {face} (from 0) has no `vertex_indices`");
            return Err(refuse(reason));
        };
        let corners: Result<Vec<u32>, _> =
            indices.iter().map(|&index| u32::try_from(index)).collect();
        let corners = corners.map_err(|_| {
            refuse(format!(
                "face {face} (from 0) names a vertex below 0: {indices:?}"
            ))
        })?;
        all.push(corners);
    }
    Ok(all)
}
