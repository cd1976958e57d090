//! Reads meshes in OBJ.

use std::io::{BufReader, Cursor};

use glam::DVec3;

use crate::diagnostic::{Code, Diagnostic};
use crate::surface::{Polygons, Surface, SurfaceFormat, SurfaceKind};
use crate::text::lines::refuse_lone_returns;

/// The OBJ format: meshes as text.
pub static FORMAT: SurfaceFormat = SurfaceFormat {
    name: "obj",
    summary: "OBJ: the faces of all objects and groups",
    extensions: &[],
    kind: SurfaceKind::Mesh,
    read_bytes: |name, bytes, _, _| Ok(Surface::Mesh(read_obj(name, &bytes)?)),
};

/// The lines of an OBJ file with positions and faces, and of the corners only the positions: this is all that a mesh
/// needs. Lines that `\` continues are joined. Objects, groups, materials, texture coordinates and normals are left
/// out, valid or not.
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

/// Reads the faces of all objects and groups of an OBJ file; `name` is the file's name in messages.
///
/// # Errors
/// When the text is invalid.
pub fn read_obj(name: &str, text: &[u8]) -> Result<Polygons, Diagnostic> {
    refuse_lone_returns(name, text, None)?;
    let options = tobj::LoadOptions {
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Materials are in other files, and nothing here depends on them.
    let none = |_: &std::path::Path| Ok((Vec::new(), std::collections::HashMap::default()));
    let text = vertices_and_faces(text);
    let loaded = tobj::load_obj_buf(&mut BufReader::new(Cursor::new(text)), &options, none);
    let (models, _) = loaded.map_err(|reason| {
        let message = format!("the OBJ file cannot be read: {reason}; export it again");
        Diagnostic::new(name, Code::Mesh, message)
    })?;
    let mut all = Polygons::default();
    for model in models {
        let mesh = model.mesh;
        let first = all.positions.len() as u32;
        let positions = mesh.positions.chunks_exact(3);
        all.positions.extend(positions.map(DVec3::from_slice));
        let corners = mesh.indices.iter();
        let mut corners = corners.map(|&index| first.saturating_add(index));
        let arities = match mesh.face_arities.is_empty() {
            true => vec![3; mesh.indices.len() / 3],
            false => mesh.face_arities,
        };
        for arity in arities {
            all.push(corners.by_ref().take(arity as usize));
        }
    }
    Ok(all)
}
