//! Files of surfaces, on which routes lie and bodies stand: meshes of polygons, and nets of control points. To add a
//! format, write a module with a `FORMAT`, and add it to the table [`SURFACES`].

pub mod net;
pub mod obj;
pub mod ply;

use std::path::Path;

use glam::DVec3;

use crate::SURFACES;
use crate::diagnostic::Diagnostic;
use crate::limits::Limits;
use crate::source::Source;

/// A file format of surfaces.
pub struct SurfaceFormat {
    /// Name of the format in options and messages, which is also the extension of its files.
    pub name: &'static str,
    /// A short description of the contents that are read.
    pub summary: &'static str,
    /// Other extensions of its files.
    pub extensions: &'static [&'static str],
    /// The kind of surface in its files.
    pub kind: SurfaceKind,
    /// Reads the bytes of a file.
    pub read_bytes: ReadSurface,
}

/// A function that reads the bytes of a file. Its arguments are the input's name in messages, the bytes, the folder
/// of the files that the input names (without a folder they are not read), and the largest sizes that are read.
pub type ReadSurface = fn(&str, Vec<u8>, Option<&Path>, Limits) -> Result<Surface, Diagnostic>;

/// A kind of surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SurfaceKind {
    /// A mesh of polygons.
    Mesh,
    /// The control points of a Bézier surface.
    Net,
}

/// The surface in a file. It is not checked; a polygon may name vertices that do not exist, for example.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// A mesh.
    Mesh(Polygons),
    /// A net of control points.
    Net(ControlNet),
}

/// The polygons of a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polygons {
    /// Positions of the vertices.
    pub positions: Vec<DVec3>,
    /// Vertex indices of all polygons, one polygon after another.
    pub corners: Vec<u32>,
    /// For each polygon, the index after its last corner in `corners`; empty if all polygons are triangles.
    pub ends: Vec<usize>,
    /// Warnings about the file.
    pub warnings: Vec<Diagnostic>,
}

impl Polygons {
    /// Adds a polygon of any number of vertices. All polygons of the mesh must have been added by this function.
    pub fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// The vertex indices of each polygon.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let triangles = self.corners.chunks_exact(3);
        let triangles = triangles.take(if self.ends.is_empty() { usize::MAX } else { 0 });
        let starts = std::iter::once(&0).chain(&self.ends);
        let polygons = starts.zip(&self.ends);
        triangles.chain(polygons.map(|(&start, &end)| &self.corners[start..end]))
    }
}

/// A net of control points.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlNet {
    /// Number of rows.
    pub rows: usize,
    /// Number of points in a row.
    pub columns: usize,
    /// The points, row by row.
    pub points: Vec<DVec3>,
}

impl SurfaceFormat {
    /// The format with the extension of this path; case is ignored.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?;
        let mut all = SURFACES.iter().copied();
        all.find(|format| {
            let mut endings = format.endings();
            endings.any(|ending| ending.eq_ignore_ascii_case(extension))
        })
    }

    /// All extensions of its files.
    pub fn endings(&self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.name).chain(self.extensions.iter().copied())
    }

    /// The extensions of all formats of a kind, for messages: `.obj, .ply`.
    #[must_use]
    pub fn endings_of(kind: SurfaceKind) -> String {
        let all = SURFACES.iter().filter(|format| format.kind == kind);
        let endings = all.flat_map(|format| format.endings());
        let endings: Vec<String> = endings.map(|ending| format!(".{ending}")).collect();
        endings.join(", ")
    }

    /// Reads a file in this format, but not a pipe.
    ///
    /// # Errors
    /// When the file cannot be opened or is invalid.
    pub fn open(&self, path: &Path, limits: Limits) -> Result<Surface, Diagnostic> {
        let source = Source::open(path, false)?;
        let name = source.name.clone();
        let bytes = source.into_bytes(limits.file)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        (self.read_bytes)(&name, bytes, Some(folder), limits)
    }
}

impl std::fmt::Debug for SurfaceFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("SurfaceFormat").field(&self.name).finish()
    }
}
