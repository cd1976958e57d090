//! Triangles with their neighbourhood: the data that all route searches work on.

use glam::DVec3;

use crate::mesh::links::{Links, at};

/// A checked mesh, perhaps with start and goal added as vertices.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) positions: Vec<DVec3>,
    /// The vertices of each face, wound alike if the surface has two sides.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Normals of the vertices; `None` if the surface has only one side.
    pub(crate) normals: Option<Vec<DVec3>>,
    pub(crate) links: Links,
}

/// A point on an edge: the fraction of the distance from one vertex to the other. If both vertices are the same, the
/// point is this vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spot {
    pub(crate) from: u32,
    pub(crate) to: u32,
    pub(crate) fraction: f64,
}

impl Spot {
    pub(crate) fn vertex(vertex: u32) -> Self {
        Self {
            from: vertex,
            to: vertex,
            fraction: 0.0,
        }
    }
}

impl Surface {
    pub(crate) fn corner(&self, corner: u32) -> DVec3 {
        self.positions[at(&self.faces, corner) as usize]
    }

    pub(crate) fn triangle(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|vertex| self.positions[vertex as usize])
    }

    pub(crate) fn distance(&self, one: u32, other: u32) -> f64 {
        self.positions[one as usize].distance(self.positions[other as usize])
    }

    pub(crate) fn position(&self, spot: Spot) -> DVec3 {
        between(&self.positions, spot)
    }

    /// The unit normal at a spot; 0 if the normals of the faces cancel out.
    pub(crate) fn normal(&self, spot: Spot) -> Option<DVec3> {
        let normals = self.normals.as_ref()?;
        Some(between(normals, spot).normalize_or_zero())
    }
}

fn between(values: &[DVec3], spot: Spot) -> DVec3 {
    let from = values[spot.from as usize];
    if spot.from == spot.to {
        return from;
    }
    from + spot.fraction * (values[spot.to as usize] - from)
}
