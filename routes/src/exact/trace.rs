//! Traces the path from the goal back to the start: windows are unfolded once more, and straight lines through them
//! are intersected with edges.

use glam::DVec2;

use crate::exact::arrivals::{Arrival, Arrivals};
use crate::exact::window::Shape;
use crate::mesh::links::{NONE, at, next, previous};
use crate::mesh::surface::{Spot, Surface};

/// The predecessor of each window.
#[derive(Debug, Default)]
pub(super) struct Trail {
    /// The window before, or [`NONE`] for a source; and the half-edge through which the window enters its face, or
    /// the vertex of the source.
    links: Vec<(u32, u32)>,
}

impl Trail {
    pub(super) fn len(&self) -> usize {
        self.links.len()
    }

    /// Adds a source.
    pub(super) fn root(&mut self, vertex: u32) -> u32 {
        self.push(NONE, vertex)
    }

    pub(super) fn push(&mut self, parent: u32, half_edge: u32) -> u32 {
        self.links.push((parent, half_edge));
        self.links.len() as u32 - 1
    }

    /// The source of a window, and the half-edges from it to the window.
    fn back(&self, window: u32) -> (u32, Vec<u32>) {
        let mut half_edges = Vec::new();
        let (mut parent, mut item) = self.links[window as usize];
        while parent != NONE {
            half_edges.push(item);
            (parent, item) = self.links[parent as usize];
        }
        half_edges.reverse();
        (item, half_edges)
    }
}

/// The path from start to goal.
pub(super) fn trace_path(
    surface: &Surface,
    start: u32,
    goal: u32,
    arrivals: &Arrivals,
    trail: &Trail,
) -> Vec<Spot> {
    let mut path = vec![Spot::vertex(goal)];
    let mut vertex = goal;
    while vertex != start {
        vertex = match arrivals.arrival(vertex) {
            // Only the start has no predecessor.
            Arrival::Edge(NONE) => break,
            Arrival::Edge(before) => before,
            Arrival::Window { trail: window, .. } => {
                let (source, half_edges) = trail.back(window);
                let spots = straight(surface, source, &half_edges);
                path.extend(spots.into_iter().rev());
                source
            }
        };
        path.push(Spot::vertex(vertex));
    }
    path.reverse();
    path
}

/// The points where the straight line from a source to the corner opposite the last half-edge crosses the edges, each
/// of which leads to the next face.
fn straight(surface: &Surface, source: u32, half_edges: &[u32]) -> Vec<Spot> {
    let faces = &surface.faces;
    let Some(&first) = half_edges.first() else {
        return Vec::new();
    };
    // In the plane of the unfolded faces, the first edge lies on the x axis, and the source is below it.
    let ends = [at(faces, first), at(faces, next(first))];
    let [from, to] = ends.map(|vertex| surface.positions[vertex as usize]);
    let to_source = surface.positions[source as usize] - from;
    let (edge, length) = ((to - from).normalize(), from.distance(to));
    let source = DVec2::new(to_source.dot(edge), -to_source.cross(edge).length());
    let mut edges = Vec::with_capacity(half_edges.len());
    let mut known = [(ends[0], DVec2::ZERO), (ends[1], DVec2::new(length, 0.0))];
    let mut target = DVec2::ZERO;
    for (index, &half_edge) in half_edges.iter().enumerate() {
        // `known` begins with the left end of the edge, but the half-edge may begin at either end.
        edges.push(known);
        let is_reversed = known[0].0 != at(faces, half_edge);
        let shape = Shape::of(surface, half_edge);
        let x = if is_reversed {
            shape.length - shape.x
        } else {
            shape.x
        };
        let along = (known[1].1 - known[0].1) / shape.length;
        target = known[0].1 + x * along + shape.y * along.perp();
        let opposite = (at(faces, previous(half_edge)), target);
        if let Some(&following) = half_edges.get(index + 1) {
            let ends = [at(faces, following), at(faces, next(following))];
            let is_left = ends.contains(&known[0].0) && ends.contains(&opposite.0);
            known[usize::from(is_left)] = opposite;
        }
    }
    let ray = target - source;
    let crossing = |[(from, one), (to, other)]: [(u32, DVec2); 2]| {
        let (before, behind) = (ray.perp_dot(one - source), ray.perp_dot(other - source));
        let fraction = (before / (before - behind)).clamp(0.0, 1.0);
        Spot {
            from,
            to,
            fraction: if fraction.is_nan() { 0.0 } else { fraction },
        }
    };
    edges.into_iter().map(crossing).collect()
}
