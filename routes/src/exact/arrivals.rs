//! How each vertex is reached, and at which vertices paths may bend.

use std::f64::consts::TAU;

use crate::exact::fan::Fan;
use crate::mesh::links::NONE;
use crate::mesh::surface::Surface;

/// A vertex with so much less than a full angle about it can be a source too: rounding decides
/// whether a flat one has less.
const SLACK: f64 = 1e-9;

/// How the best path so far comes to a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) enum Arrival {
    /// Along the edge from this vertex; from none at the start.
    Edge(u32),
    /// Straight on from a window.
    Window {
        trail: u32,
        /// By which the window entered the face.
        half_edge: u32,
        /// At the vertex, from the face's left edge to where the path comes from.
        angle: f64,
        /// The vertex is within the window, which went on at both sides.
        is_inside: bool,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VertexKind {
    /// Less than a full angle: no shortest path passes.
    Convex,
    /// A full angle: paths pass straight on.
    Flat,
    /// More than that, or on a boundary, or where surfaces meet: paths bend.
    Source,
}

/// The best path to each vertex so far.
pub(super) struct Arrivals {
    lengths: Vec<f64>,
    arrivals: Vec<Arrival>,
    kinds: Vec<VertexKind>,
}

impl Arrivals {
    /// At first the paths along edges.
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

    /// Whether paths leave the vertex that do not pass it within a window.
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
