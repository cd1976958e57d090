//! Makes start and goal vertices of the surface.

use std::borrow::Cow;

use glam::DVec3;

use crate::error::RouteError;
use crate::mesh::Mesh;
use crate::mesh::links::Links;
use crate::mesh::surface::Surface;
use crate::mesh::tree::{Nearest, nearest_on};

/// A point within this fraction of a face's height of an edge counts as on the edge. Points of edges move less than
/// this by rounding, and routes whose lengths differ by this are equal.
const ON_EDGE: f64 = 1e-12;

/// A surface with start and goal among its vertices.
pub(crate) struct Task<'a> {
    pub(crate) surface: Cow<'a, Surface>,
    pub(crate) start: u32,
    pub(crate) goal: u32,
    /// The distances of the requested start and goal from the surface.
    pub(crate) off: [f64; 2],
}

/// Finds start and goal on the surface, and makes vertices of them.
///
/// # Errors
/// When a point is not finite, or no path can lead from one to the other.
pub(crate) fn locate_endpoints(
    mesh: &Mesh,
    from: DVec3,
    to: DVec3,
) -> Result<Task<'_>, RouteError> {
    for point in [from, to] {
        if !point.is_finite() {
            return Err(RouteError::NotFinite { point });
        }
    }
    let start = mesh.tree.nearest(&mesh.surface, from);
    let goal = mesh.tree.nearest(&mesh.surface, to);
    let [from_piece, to_piece] =
        [start, goal].map(|at| mesh.pieces[mesh.surface.faces[at.face][0] as usize] as usize);
    if from_piece != to_piece {
        return Err(RouteError::OtherPiece {
            start: mesh.piece_sizes[from_piece],
            goal: mesh.piece_sizes[to_piece],
        });
    }
    let mut inserter = VertexInserter {
        surface: Cow::Borrowed(&mesh.surface),
        changed: Vec::new(),
    };
    let off = [start.distance, goal.distance];
    let start = inserter.vertex(start);
    // Inserting the start may have divided the goal's face.
    let near = |face: &usize| nearest_on(&inserter.surface, *face, goal.point);
    let pieces = inserter.changed.contains(&goal.face);
    let cut = inserter.changed.iter().map(near);
    let goal = match cut.min_by(|a, b| a.distance.total_cmp(&b.distance)) {
        Some(piece) if pieces => piece,
        _ => goal,
    };
    let goal = inserter.vertex(goal);
    let mut surface = inserter.surface;
    if let Cow::Owned(owned) = &mut surface {
        owned.links = Links::new(owned.positions.len(), &owned.faces);
    }
    Ok(Task {
        surface,
        start,
        goal,
        off,
    })
}

/// A copy of a surface to which vertices are added. Its links are those from before the first new vertex.
struct VertexInserter<'a> {
    surface: Cow<'a, Surface>,
    /// The faces that were divided, and their parts.
    changed: Vec<usize>,
}

impl VertexInserter<'_> {
    /// The vertex at a point of the surface, which is added if there is none.
    fn vertex(&mut self, at: Nearest) -> u32 {
        let corners = self.surface.triangle(at.face);
        let longest = (0..3)
            .map(|k| corners[k].distance(corners[(k + 1) % 3]))
            .fold(0.0, f64::max);
        let largest = corners
            .iter()
            .fold(0.0, |max: f64, c| max.max(c.abs().max_element()));
        // Far from the origin, the rounding of positions exceeds `ON_EDGE`.
        let least = ON_EDGE.max(4.0 * f64::EPSILON * largest / longest);
        let inside: Vec<usize> = (0..3).filter(|&k| at.weights[k] > least).collect();
        let face = self.surface.faces[at.face];
        match inside[..] {
            [corner] => face[corner],
            [one, other] => {
                let weight = at.weights[other] / (at.weights[one] + at.weights[other]);
                self.split_edge(face[one], face[other], weight)
            }
            _ => self.split_face(at),
        }
    }

    /// Adds a vertex between others, with a normal between theirs.
    fn add(&mut self, position: DVec3, normal: impl FnOnce(&[DVec3]) -> DVec3) -> u32 {
        let surface = self.surface.to_mut();
        surface.positions.push(position);
        if let Some(normals) = &mut surface.normals {
            let normal = normal(normals).normalize_or_zero();
            normals.push(normal);
        }
        surface.positions.len() as u32 - 1
    }

    fn split_face(&mut self, at: Nearest) -> u32 {
        let face = self.surface.faces[at.face];
        let new = self.add(at.point, |normals| {
            let each = face.map(|vertex| normals[vertex as usize]);
            at.weights[0] * each[0] + at.weights[1] * each[1] + at.weights[2] * each[2]
        });
        self.replace(at.face, [0, 1, 2].map(|k| with(face, k, new)));
        new
    }

    fn split_edge(&mut self, from: u32, to: u32, fraction: f64) -> u32 {
        let ends = [from, to].map(|vertex| self.surface.positions[vertex as usize]);
        let new = self.add(ends[0] + fraction * (ends[1] - ends[0]), |normals| {
            (1.0 - fraction) * normals[from as usize] + fraction * normals[to as usize]
        });
        for face in 0..self.surface.faces.len() {
            let corners = self.surface.faces[face];
            let corner_of = |vertex| corners.iter().position(|&corner| corner == vertex);
            if let (Some(one), Some(other)) = (corner_of(from), corner_of(to)) {
                self.replace(face, [with(corners, one, new), with(corners, other, new)]);
            }
        }
        new
    }

    fn replace<const N: usize>(&mut self, face: usize, parts: [[u32; 3]; N]) {
        let faces = &mut self.surface.to_mut().faces;
        self.changed.push(face);
        faces[face] = parts[0];
        for &part in &parts[1..] {
            self.changed.push(faces.len());
            faces.push(part);
        }
    }
}

/// The face with another vertex at one corner.
fn with(mut face: [u32; 3], corner: usize, vertex: u32) -> [u32; 3] {
    face[corner] = vertex;
    face
}
