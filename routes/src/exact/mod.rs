//! Finds the shortest path over the surface.
//!
//! A shortest path is straight within the triangles that it crosses, once they are unfolded into a plane. It bends
//! only at vertices with more than a full angle around them, or on the boundary (Mitchell, Mount and Papadimitriou,
//! 1987). Therefore *windows* are propagated over the surface: a window contains all straight paths from one such
//! vertex through one sequence of edges that end on one interval of the last edge. Of the windows that contain the
//! opposite corner, one may continue through both other edges (Chen and Han, 1996). Windows behind which another
//! vertex is a nearer source are dropped (Xin and Wang, 2009). The others are taken from a heap in the order of the
//! least length that a path through them to the goal can have.

mod arrivals;
mod fan;
mod trace;
mod window;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::edges::{Distance, distances};
use crate::endpoints::Task;
use crate::error::RouteError;
use crate::exact::arrivals::{Arrival, Arrivals};
use crate::exact::fan::{Fan, Sector};
use crate::exact::trace::Trail;
use crate::exact::window::{Shape, Window, hypotenuse};
use crate::mesh::links::{MANY, NONE, at, next, previous};
use crate::mesh::surface::{Spot, Surface};

/// The largest number of windows that are kept to trace the path back: 8 bytes each, and 80 for each window in the
/// heap. Together with the mesh this is less than 1 GiB.
pub(crate) const MAX_WINDOWS: usize = 1 << 26;
/// The largest number of windows in the heap.
const MAX_WAITING: usize = 4_000_000;

/// A corner counts as within a window that ends this near to it, relative to the edge. Lengths that differ by less,
/// relative to the whole, are equal.
const TOLERANCE: f64 = 1e-12;

/// An event in the heap: a window by its index, or a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    Vertex(u32),
    Window(u32),
}

/// The shortest path from start to goal, which lie on the same piece.
///
/// # Errors
/// When it needs more windows than may be kept.
pub(crate) fn find_path(task: &Task<'_>) -> Result<Vec<Spot>, RouteError> {
    find_path_within(task, MAX_WINDOWS)
}

fn find_path_within(task: &Task<'_>, max_windows: usize) -> Result<Vec<Spot>, RouteError> {
    let mut search = Search::new(task);
    search.run(max_windows)?;
    Ok(trace::trace_path(
        search.surface,
        task.start,
        task.goal,
        &search.arrivals,
        &search.trail,
    ))
}

/// The window with the shortest path to the opposite corner, of all windows that enter through a half-edge and
/// contain it.
#[derive(Debug, Clone, Copy)]
struct Occupant {
    /// Length from the start to the corner.
    length: f64,
    /// The point at which the ray to the corner enters, along the half-edge.
    entry: f64,
}

struct Search<'a> {
    surface: &'a Surface,
    start: u32,
    goal: u32,
    shapes: Vec<Shape>,
    arrivals: Arrivals,
    occupants: Vec<Occupant>,
    windows: Vec<Window>,
    free: Vec<u32>,
    heap: BinaryHeap<Reverse<(Distance, Event)>>,
    trail: Trail,
    /// Lengths that differ by less than this are equal.
    same: f64,
}

impl<'a> Search<'a> {
    fn new(task: &'a Task<'a>) -> Self {
        let surface = &*task.surface;
        let half_edges = 3 * surface.faces.len();
        let shapes = (0..half_edges as u32)
            .map(|half_edge| Shape::of(surface, half_edge))
            .collect();
        let (lengths, before) = distances(surface, task.start);
        let same = TOLERANCE * lengths[task.goal as usize];
        let unoccupied = Occupant {
            length: f64::INFINITY,
            entry: 0.0,
        };
        Self {
            surface,
            start: task.start,
            goal: task.goal,
            shapes,
            arrivals: Arrivals::new(surface, lengths, &before),
            occupants: vec![unoccupied; half_edges],
            windows: Vec::new(),
            free: Vec::new(),
            heap: BinaryHeap::new(),
            trail: Trail::default(),
            same,
        }
    }

    fn run(&mut self, max_windows: usize) -> Result<(), RouteError> {
        for vertex in 0..self.surface.positions.len() as u32 {
            if vertex == self.start || self.arrivals.is_source(vertex) {
                self.push_vertex(vertex);
            }
        }
        while let Some(Reverse((Distance(least), event))) = self.heap.pop() {
            if least > self.arrivals.length(self.goal) {
                break;
            }
            match event {
                Event::Vertex(vertex) => {
                    // A shorter path has reached the vertex meanwhile.
                    if least <= self.bound_at(vertex) {
                        self.leave_vertex(vertex);
                    }
                }
                Event::Window(index) => {
                    let window = self.windows[index as usize];
                    self.free.push(index);
                    self.propagate(&window);
                }
            }
            let waiting = self.windows.len() - self.free.len();
            if self.trail.len() > max_windows || waiting > MAX_WAITING {
                return Err(RouteError::TooLarge {
                    triangles: self.surface.faces.len(),
                    max: max_windows,
                });
            }
        }
        Ok(())
    }

    /// The least length of a path to the goal through this vertex.
    fn bound_at(&self, vertex: u32) -> f64 {
        self.arrivals.length(vertex) + self.surface.distance(vertex, self.goal)
    }

    fn push_vertex(&mut self, vertex: u32) {
        let bound = self.bound_at(vertex);
        if bound <= self.arrivals.length(self.goal) {
            self.heap
                .push(Reverse((Distance(bound), Event::Vertex(vertex))));
        }
    }

    /// Stores an arrival that is shorter than those before it.
    fn arrive(&mut self, vertex: u32, length: f64, arrival: Arrival) {
        if length < self.arrivals.length(vertex) {
            self.arrivals.set(vertex, length, arrival);
            if self.arrivals.is_source(vertex) && vertex != self.goal {
                self.push_vertex(vertex);
            }
        }
    }

    /// Creates the windows of all paths that continue from a vertex.
    fn leave_vertex(&mut self, vertex: u32) {
        let length = self.arrivals.length(vertex);
        let arrival = self.arrivals.arrival(vertex);
        let fan = Fan::about(self.surface, vertex);
        let sector = match vertex == self.start {
            true => Sector::All,
            false => fan.sector(self.surface, arrival),
        };
        if matches!(sector, Sector::Empty) {
            return;
        }
        for other in self.surface.links.neighbours(&self.surface.faces, vertex) {
            let sum = length + self.surface.distance(vertex, other);
            self.arrive(other, sum, Arrival::Edge(vertex));
        }
        let root = self.trail.root(vertex);
        for index in 0..self.surface.links.corners(vertex).len() {
            let corner = self.surface.links.corners(vertex)[index];
            let half_edge = next(corner);
            let shape = self.shapes[half_edge as usize];
            for (low, high) in fan.intervals(self.surface, &sector, corner, &shape) {
                let window = Window {
                    half_edge,
                    parent: root,
                    low,
                    high,
                    x: shape.x,
                    y: shape.y,
                    length,
                };
                self.cross(window.mirrored(shape.length));
            }
        }
    }

    /// Propagates a window over its face, to both other edges.
    fn propagate(&mut self, window: &Window) {
        let faces = &self.surface.faces;
        let half_edge = window.half_edge;
        let shape = self.shapes[half_edge as usize];
        let (left, right, opposite) = (
            at(faces, half_edge),
            at(faces, next(half_edge)),
            at(faces, previous(half_edge)),
        );
        let mut lengths = [left, right, opposite].map(|vertex| self.arrivals.length(vertex));
        if window.is_behind(lengths[0], lengths[1], shape.length, self.same) {
            return;
        }
        let parent = self.trail.push(window.parent, half_edge);
        // The point where the ray to the opposite corner crosses the edge.
        let entry = window.x + (shape.x - window.x) * window.y / (window.y + shape.y);
        let near = TOLERANCE * shape.length;
        let (mut goes_left, mut goes_right) = (window.low < entry, entry < window.high);
        if entry >= window.low - near && entry <= window.high + near {
            let length = window.length + hypotenuse(shape.x - window.x, shape.y + window.y);
            if goes_left && goes_right {
                (goes_left, goes_right) = self.occupy(half_edge, length, entry, near);
            }
            let is_inside = entry > window.low + near && entry < window.high - near;
            let arrival = Arrival::Window {
                trail: parent,
                half_edge,
                angle: window.angle_at_corner(&shape),
                is_inside: is_inside && goes_left && goes_right,
            };
            self.arrive(opposite, length, arrival);
            lengths[2] = self.arrivals.length(opposite);
        }
        // The third test of Xin and Wang drops a window if a path over the corner behind it reaches the window's far
        // end sooner. For rays that leave to the left, this is the right corner, and vice versa.
        if goes_left && let Some(child) = window.through_left(&shape, entry, parent) {
            let length = self.shapes[previous(half_edge) as usize].length;
            let limit = child.length + child.distance(child.low) - self.same;
            let is_behind = child.is_behind(lengths[0], lengths[2], length, self.same)
                || lengths[1] + shape.right_corner_to(child.low, length) < limit;
            if !is_behind {
                self.cross(child);
            }
        }
        if goes_right && let Some(child) = window.through_right(&shape, entry, parent) {
            let length = self.shapes[next(half_edge) as usize].length;
            let limit = child.length + child.distance(child.high) - self.same;
            let is_behind = child.is_behind(lengths[2], lengths[1], length, self.same)
                || lengths[0] + shape.left_corner_to(child.high, length) < limit;
            if !is_behind {
                self.cross(child);
            }
        }
    }

    /// Compares two windows that enter through one edge and contain the opposite corner. The window whose path to this
    /// corner is longer continues on one side of the corner only. On the other side its paths would have to cross the
    /// ray of the shorter path to the corner, and would be longer after it (Chen and Han, 1996). Returns whether a
    /// window continues on each side.
    fn occupy(&mut self, half_edge: u32, length: f64, entry: f64, near: f64) -> (bool, bool) {
        let occupant = &mut self.occupants[half_edge as usize];
        if length < occupant.length {
            *occupant = Occupant { length, entry };
            return (true, true);
        }
        (
            entry <= occupant.entry + near,
            entry >= occupant.entry - near,
        )
    }

    /// Passes a window to the neighbouring faces at its edge. The window's half-edge is that of the face from which
    /// it comes. It is measured from the end that is the start of a twin in the opposite direction.
    fn cross(&mut self, window: Window) {
        let bound = self.bound(&window);
        if bound.is_nan() || bound > self.arrivals.length(self.goal) {
            return;
        }
        match self.surface.links.twin(window.half_edge) {
            NONE => {}
            MANY => {
                let surface = self.surface;
                for other in surface.links.on_edge(&surface.faces, window.half_edge) {
                    if other != window.half_edge {
                        self.wait(&window, other, bound);
                    }
                }
            }
            twin => self.wait(&window, twin, bound),
        }
    }

    fn wait(&mut self, window: &Window, twin: u32, bound: f64) {
        let faces = &self.surface.faces;
        let length = self.shapes[twin as usize].length;
        let same_direction = at(faces, twin) == at(faces, window.half_edge);
        let oriented = match same_direction {
            true => window.mirrored(length),
            false => *window,
        };
        let entering = Window {
            half_edge: twin,
            ..oriented
        };
        let index = match self.free.pop() {
            Some(index) => {
                self.windows[index as usize] = entering;
                index
            }
            None => {
                self.windows.push(entering);
                self.windows.len() as u32 - 1
            }
        };
        self.heap
            .push(Reverse((Distance(bound), Event::Window(index))));
    }

    /// The least length that a path through the window to the goal can have: the goal is rotated about the edge into
    /// the plane of the window.
    fn bound(&self, window: &Window) -> f64 {
        let from = self.surface.corner(next(window.half_edge));
        let to = self.surface.corner(window.half_edge);
        let goal = self.surface.positions[self.goal as usize] - from;
        let along = (to - from) / self.shapes[window.half_edge as usize].length;
        window.bound(goal.dot(along), goal.cross(along).length())
    }
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;
    use crate::endpoints::locate_endpoints;
    use crate::mesh::Mesh;

    #[test]
    fn too_many_windows_are_an_error_that_names_the_edges() {
        let rim = |i: u32| {
            let (sin, cos) = (f64::from(i) * 0.5).sin_cos();
            dvec3(cos, sin, f64::from(i % 2))
        };
        let positions: Vec<_> = (0..12).map(rim).collect();
        let faces: Vec<[u32; 3]> = (0..10).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = Mesh::new(&positions, &faces).unwrap();
        let task = locate_endpoints(&mesh, rim(0), rim(11)).unwrap();
        let error = find_path_within(&task, 3).unwrap_err();
        let triangles = 10;
        assert_eq!(error, RouteError::TooLarge { triangles, max: 3 });
        assert!(error.to_string().contains("--by edges"), "{error}");
        assert!(find_path_within(&task, 1000).is_ok());
    }
}
