//! Meshes: the input is checked, welded, cut into triangles and wound alike.

mod cut;
mod joints;
pub(crate) mod links;

pub(crate) mod surface;
pub(crate) mod tree;
mod weld;
mod windings;

use glam::DVec3;

use crate::error::{MeshError, MeshWarning};
use crate::mesh::links::Links;
use crate::mesh::surface::Surface;
use crate::mesh::tree::FaceTree;
use crate::mesh::weld::Welded;

/// The largest number of triangles of a mesh: their corners are numbered in 32 bits.
pub const MAX_TRIANGLES: usize = (u32::MAX / 3 - 8) as usize;

/// A surface of triangles, on which routes are found.
///
/// Vertices at equal positions are merged, and so are faces with the same corners: a sheet that is modelled from both
/// sides is one sheet. Faces of no area are left out. An open side is divided where a corner of another face lies on
/// it, so that faces at a T-joint are connected with or without a sliver between them. Within each piece, faces are
/// wound alike, in the direction that the majority of them had.
#[derive(Debug, Clone)]
pub struct Mesh {
    pub(crate) surface: Surface,
    pub(crate) tree: FaceTree,
    /// Largest extent along an axis.
    pub(crate) size: f64,
    pub(crate) has_branches: bool,
    /// The connected part of the mesh (piece) to which each vertex belongs.
    pub(crate) pieces: Vec<u32>,
    /// The number of triangles of each piece.
    pub(crate) piece_sizes: Vec<usize>,
    warnings: Vec<MeshWarning>,
}

impl Mesh {
    /// Makes a mesh of positions and triangles, each of three indices of positions.
    ///
    /// # Errors
    /// When there are no triangles with an area or too many, when an index is out of range, or when a coordinate is not
    /// finite or exceeds 1e75.
    pub fn new(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        Self::of_polygons(positions, triangles.iter().map(<[u32; 3]>::as_slice))
    }

    /// Makes a mesh of positions and polygons, each of the indices of positions around it. Polygons are cut into
    /// triangles within them, whether they are convex or not.
    ///
    /// # Errors
    /// As [`Mesh::new`], when a polygon has fewer than three corners, when its sides cross each other, or when it has
    /// too many corners and is not convex.
    pub fn of_polygons<'a>(
        positions: &[DVec3],
        polygons: impl IntoIterator<Item = &'a [u32]>,
    ) -> Result<Self, MeshError> {
        Self::welded(positions, polygons, 0.0)
    }

    /// Makes a mesh as [`Mesh::of_polygons`] does, and merges positions within `distance` of each other into the
    /// first of them, for seams whose two sides differ by rounding.
    ///
    /// # Errors
    /// As [`Mesh::of_polygons`], and when the distance is negative or not finite.
    pub fn welded<'a>(
        positions: &[DVec3],
        polygons: impl IntoIterator<Item = &'a [u32]>,
        distance: f64,
    ) -> Result<Self, MeshError> {
        let Welded {
            positions,
            mut faces,
            mut warnings,
        } = weld::weld(positions, polygons, distance)?;
        let rewinding = windings::wind_alike(positions.len(), &mut faces);
        if rewinding.count > 0 {
            let count = rewinding.count;
            warnings.push(MeshWarning::Rewound { count });
        }
        if rewinding.is_one_sided {
            warnings.push(MeshWarning::OneSided);
        }
        let links = Links::new(positions.len(), &faces);
        let has_branches = links.twins().contains(&links::MANY);
        let (pieces, piece_sizes) = pieces(positions.len(), &faces);
        let normals = (!rewinding.is_one_sided).then(|| normals(&positions, &faces));
        let mut surface = Surface {
            positions,
            faces,
            normals,
            links,
        };
        let tree = FaceTree::new(&surface);
        let size = tree.extent();
        surface.positions.shrink_to_fit();
        Ok(Self {
            surface,
            tree,
            size,
            has_branches,
            pieces,
            piece_sizes,
            warnings,
        })
    }

    /// Warnings about the input.
    #[must_use]
    pub fn warnings(&self) -> &[MeshWarning] {
        &self.warnings
    }

    /// Positions of the vertices that triangles use; each position occurs once.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.surface.positions
    }

    /// The triangles, each of three indices of [`Mesh::positions`].
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.surface.faces
    }

    /// The unit normal at each vertex: the mean of the normals of its faces, weighted by their angles at the vertex;
    /// 0 if they cancel out. `None` if the surface has only one side.
    #[must_use]
    pub fn normals(&self) -> Option<&[DVec3]> {
        self.surface.normals.as_deref()
    }

    /// Largest extent along an axis.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Number of triangles of each piece of the surface; pieces share no vertex.
    #[must_use]
    pub fn pieces(&self) -> &[usize] {
        &self.piece_sizes
    }

    /// The point of the surface that is nearest to `point`.
    #[must_use]
    pub fn nearest(&self, point: DVec3) -> DVec3 {
        self.tree.nearest(&self.surface, point).point
    }
}

/// The piece of each vertex, and the number of triangles of each piece.
fn pieces(vertices: usize, faces: &[[u32; 3]]) -> (Vec<u32>, Vec<usize>) {
    let mut parents: Vec<u32> = (0..vertices as u32).collect();
    fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
        while parents[vertex as usize] != vertex {
            let above = parents[parents[vertex as usize] as usize];
            parents[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }
    for &[a, b, c] in faces {
        let root_a = root(&mut parents, a);
        for other in [b, c] {
            let other = root(&mut parents, other);
            parents[other as usize] = root_a;
        }
    }
    let mut numbers = vec![u32::MAX; vertices];
    let mut sizes = Vec::new();
    let mut pieces = Vec::with_capacity(vertices);
    for vertex in 0..vertices as u32 {
        let root = root(&mut parents, vertex) as usize;
        if numbers[root] == u32::MAX {
            numbers[root] = sizes.len() as u32;
            sizes.push(0);
        }
        pieces.push(numbers[root]);
    }
    for face in faces {
        sizes[pieces[face[0] as usize] as usize] += 1;
    }
    (pieces, sizes)
}

/// The normals of the vertices, weighted by the angles of the faces there, so that they do not depend on how flat
/// parts are cut into triangles (Thürmer and Wüthrich, 1998).
fn normals(positions: &[DVec3], faces: &[[u32; 3]]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for face in faces {
        let corners = face.map(|vertex| positions[vertex as usize]);
        for k in 0..3 {
            let (one, other) = (
                corners[(k + 1) % 3] - corners[k],
                corners[(k + 2) % 3] - corners[k],
            );
            let cross = one.cross(other);
            let angle = libm::atan2(cross.length(), one.dot(other));
            sums[face[k] as usize] += angle * cross.normalize_or_zero();
        }
    }
    let unit = |sum: DVec3| {
        if sum.length() > 1e-12 {
            sum.normalize()
        } else {
            DVec3::ZERO
        }
    };
    sums.into_iter().map(unit).collect()
}
