//! Finds a walk along edges that always takes the edge whose direction is nearest to that of the goal.

use crate::endpoints::Task;
use crate::mesh::surface::Spot;

/// Cosines that differ by less than this are equal; the vertex with the lower index is then used.
const SAME: f64 = 1e-12;

/// The path from start to goal, which lie on the same piece. No vertex is visited twice. At a dead end the walk goes
/// back, and the vertices from which it went back are not part of the path.
pub(crate) fn find_path(task: &Task<'_>) -> Vec<Spot> {
    let surface = &*task.surface;
    let goal = surface.positions[task.goal as usize];
    let mut visited = vec![false; surface.positions.len()];
    visited[task.start as usize] = true;
    let mut path = vec![task.start];
    while let Some(&vertex) = path.last() {
        if vertex == task.goal {
            break;
        }
        let here = surface.positions[vertex as usize];
        let to_goal = (goal - here).normalize_or_zero();
        let mut best: Option<(f64, u32)> = None;
        for other in surface.links.neighbours(&surface.faces, vertex) {
            if visited[other as usize] {
                continue;
            }
            // The goal itself is preferred to an edge that leads in the same direction to another vertex.
            let edge = (surface.positions[other as usize] - here).normalize_or_zero();
            let cosine = if other == task.goal {
                2.0
            } else {
                edge.dot(to_goal)
            };
            let is_better = best.is_none_or(|(highest, lowest)| {
                cosine > highest + SAME || (cosine >= highest - SAME && other < lowest)
            });
            if is_better {
                best = Some((cosine, other));
            }
        }
        match best {
            Some((_, other)) => {
                visited[other as usize] = true;
                path.push(other);
            }
            None => {
                path.pop();
            }
        }
    }
    path.into_iter().map(Spot::vertex).collect()
}
