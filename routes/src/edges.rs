//! Finds the shortest path along edges (Dijkstra, 1959).

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use crate::endpoints::Task;
use crate::mesh::links::NONE;
use crate::mesh::surface::{Spot, Surface};

/// A distance with a total order: it is never NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Distance(pub(crate) f64);

impl Eq for Distance {}

impl PartialOrd for Distance {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Distance {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// For every vertex, the length of the shortest path along edges and the vertex before it on that path; infinity and
/// [`NONE`] if there is no path.
pub(crate) fn distances(surface: &Surface, start: u32) -> (Vec<f64>, Vec<u32>) {
    let mut lengths = vec![f64::INFINITY; surface.positions.len()];
    let mut before = vec![NONE; surface.positions.len()];
    lengths[start as usize] = 0.0;
    let mut heap = BinaryHeap::from([Reverse((Distance(0.0), start))]);
    while let Some(Reverse((Distance(length), vertex))) = heap.pop() {
        if length > lengths[vertex as usize] {
            continue;
        }
        for other in surface.links.neighbours(&surface.faces, vertex) {
            let sum = length + surface.distance(vertex, other);
            if sum < lengths[other as usize] {
                lengths[other as usize] = sum;
                before[other as usize] = vertex;
                heap.push(Reverse((Distance(sum), other)));
            }
        }
    }
    (lengths, before)
}

/// The path from start to goal, which lie on the same piece.
pub(crate) fn find_path(task: &Task<'_>) -> Vec<Spot> {
    let (_, before) = distances(&task.surface, task.start);
    let mut path = vec![Spot::vertex(task.goal)];
    let mut vertex = task.goal;
    while vertex != task.start && before[vertex as usize] != NONE {
        vertex = before[vertex as usize];
        path.push(Spot::vertex(vertex));
    }
    path.reverse();
    path
}
