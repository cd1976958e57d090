//! Files of surfaces, on which routes lie and bodies stand: meshes of polygons, and nets of control points. A
//! format is a file that names it in a `FORMAT`, and a line in the table [`SURFACES`].

pub mod net;
pub mod obj;
pub mod ply;

use std::path::Path;

use glam::DVec3;

use crate::SURFACES;
use crate::diagnostic::Diagnostic;
use crate::source::Source;
use crate::text::lines::Limits;

/// A file format of surfaces.
pub struct SurfaceFormat {
    /// The name by which programs call it, and the extension of its files.
    pub name: &'static str,
    /// What is read of it, in a few words.
    pub summary: &'static str,
    /// Other extensions of its files.
    pub extensions: &'static [&'static str],
    /// What its files hold.
    pub kind: SurfaceKind,
    /// Reads the bytes of a file.
    pub read_bytes: ReadSurface,
}

/// Reads the bytes of a file: what messages call it, its bytes, the folder where the files are that it
/// names (they are not read without one), and how much is read at most.
pub type ReadSurface = fn(&str, Vec<u8>, Option<&Path>, Limits) -> Result<Surface, Diagnostic>;

/// What a surface is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SurfaceKind {
    /// Polygons.
    Mesh,
    /// The control points of a Bézier surface.
    Net,
}

/// What a file of a surface holds. Nothing of it is checked but that it could be read: whether corners are
/// there, say.
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
    /// Of the vertices.
    pub positions: Vec<DVec3>,
    /// The vertices of all polygons, one polygon after another.
    pub corners: Vec<u32>,
    /// Where each polygon ends among the corners; empty where all are triangles.
    pub ends: Vec<usize>,
    /// What is odd about the file.
    pub warnings: Vec<Diagnostic>,
}

impl Polygons {
    /// Adds a polygon of any number of vertices, behind others that were added so.
    pub fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// The vertices of each polygon.
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
    /// How many rows it has.
    pub rows: usize,
    /// How many points a row has.
    pub columns: usize,
    /// The points, row by row.
    pub points: Vec<DVec3>,
}

impl SurfaceFormat {
    /// The format that the extension of a file tells, in any case.
    #[must_use]
    pub fn of(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?;
        let mut all = SURFACES.iter().copied();
        all.find(|format| {
            let mut endings = format.endings();
            endings.any(|ending| ending.eq_ignore_ascii_case(extension))
        })
    }

    /// The extensions of its files.
    pub fn endings(&self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.name).chain(self.extensions.iter().copied())
    }

    /// The extensions of all files of a kind, for messages: `.obj, .ply`.
    #[must_use]
    pub fn endings_of(kind: SurfaceKind) -> String {
        let all = SURFACES.iter().filter(|format| format.kind == kind);
        let endings = all.flat_map(|format| format.endings());
        let endings: Vec<String> = endings.map(|ending| format!(".{ending}")).collect();
        endings.join(", ")
    }

    /// Reads a file in this format; no pipe.
    ///
    /// # Errors
    /// When the file cannot be read or has a fault.
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
