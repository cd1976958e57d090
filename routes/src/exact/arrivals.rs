//! How paths arrive at each vertex, and the vertices at which paths may bend.

use std::f64::consts::TAU;

use crate::exact::fan::Fan;
use crate::mesh::links::NONE;
use crate::mesh::surface::Surface;

/// A vertex whose angle is less than a full angle by this can still be a source, because rounding decides this for a
/// flat vertex.
const SLACK: f64 = 1e-9;

/// How the best known path arrives at a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) enum Arrival {
    /// Along the edge from this vertex; `NONE` at the start.
    Edge(u32),
    /// Straight from a window.
    Window {
        trail: u32,
        /// The half-edge through which the window entered the face.
        half_edge: u32,
        /// Angle at the vertex, from the left edge of the face to the direction from which the path comes.
        angle: f64,
        /// Whether the vertex is within the window, which continued on both sides of it.
        is_inside: bool,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VertexKind {
    /// Less than a full angle: no shortest path passes the vertex.
    Convex,
    /// A full angle: paths pass the vertex without bending.
    Flat,
    /// More than a full angle, or a vertex on a boundary or where surfaces meet: paths may bend at it.
    Source,
}

/// The best known path to each vertex.
pub(super) struct Arrivals {
    lengths: Vec<f64>,
    arrivals: Vec<Arrival>,
    kinds: Vec<VertexKind>,
}

impl Arrivals {
    /// Begins with the paths along edges.
    pub(super) fn new(surface: &Surface, lengths: Vec<f64>, before: &[u32]) -> Self {
        let kind = |vertex| {
            let fan = Fan::about(surface, vertex);
            match fan.is_closed() {
                true if fan.total() < TAU - SLACK => VertexKind::Convex,
                true if fan.total() <= TAU + SLACK => VertexKind::Flat,
                _ => VertexKind::Source,
            }
        };
        Self {
            kinds: (0..lengths.len() as u32).map(kind).collect(),
            arrivals: before.iter().map(|&vertex| Arrival::Edge(vertex)).collect(),
            lengths,
        }
    }

    pub(super) fn length(&self, vertex: u32) -> f64 {
        self.lengths[vertex as usize]
    }

    pub(super) fn arrival(&self, vertex: u32) -> Arrival {
        self.arrivals[vertex as usize]
    }

    pub(super) fn set(&mut self, vertex: u32, length: f64, arrival: Arrival) {
        self.lengths[vertex as usize] = length;
        self.arrivals[vertex as usize] = arrival;
    }

    /// Whether paths begin at the vertex: paths that no window carries past the vertex.
    pub(super) fn is_source(&self, vertex: u32) -> bool {
        match self.kinds[vertex as usize] {
            VertexKind::Convex => false,
            VertexKind::Source => true,
            VertexKind::Flat => match self.arrivals[vertex as usize] {
                Arrival::Edge(before) => before != NONE,
                Arrival::Window { is_inside, .. } => !is_inside,
            },
        }
    }
}
