//! Finds the cut of the surface by a plane through start and goal.

use glam::DVec3;

use crate::endpoints::Task;
use crate::error::RouteError;
use crate::mesh::links::{NONE, at, next, previous};
use crate::mesh::surface::{Spot, Surface};

/// A direction is parallel to another if the sine of the angle between them is below this.
const ALONG: f64 = 1e-9;

/// The shorter half of the cut, of those that lead from start to goal.
///
/// # Errors
/// When the plane is not defined, or neither half leads to the goal.
pub(crate) fn find_path(task: &Task<'_>) -> Result<Vec<Spot>, RouteError> {
    let surface = &*task.surface;
    let normal = plane_normal(task)?;
    let start = surface.positions[task.start as usize];
    // Start and goal are in the plane, so their distance is 0, also where rounding differs.
    let mut heights: Vec<f64> = (surface.positions.iter().zip(0..))
        .map(
            |(&position, vertex)| match vertex == task.start || vertex == task.goal {
                true => 0.0,
                false => (position - start).dot(normal),
            },
        )
        .collect();
    // A vertex in the plane counts as above it, so that every cut of a face has two ends. If this leads nowhere, as
    // along a boundary, such vertices count as below in a second attempt.
    for _ in 0..2 {
        let cut = PlaneCut {
            task,
            surface,
            heights: &heights,
        };
        let paths = cut.exits().into_iter().filter_map(|exit| cut.follow(exit));
        let length = |path: &Vec<Spot>| -> f64 {
            let points = path.iter().map(|&spot| surface.position(spot));
            points
                .clone()
                .zip(points.skip(1))
                .map(|(a, b)| a.distance(b))
                .sum()
        };
        if let Some(path) = paths.min_by(|a, b| length(a).total_cmp(&length(b))) {
            return Ok(path);
        }
        for height in &mut heights {
            *height = -*height;
        }
    }
    Err(RouteError::NoPlaneRoute)
}

/// The unit normal of the plane, which contains both points and the direction of the sum of their normals. If this is
/// undefined, the plane contains the normal of the start, otherwise that of the goal.
fn plane_normal(task: &Task<'_>) -> Result<DVec3, RouteError> {
    let surface = &*task.surface;
    let [start, goal] = [task.start, task.goal].map(|vertex| surface.positions[vertex as usize]);
    let of = |vertex| {
        surface
            .normal(Spot::vertex(vertex))
            .ok_or(RouteError::OneSided)
    };
    let (at_start, at_goal) = (of(task.start)?, of(task.goal)?);
    let chord = (goal - start).normalize_or_zero();
    [at_start + at_goal, at_start, at_goal]
        .into_iter()
        .map(|up| chord.cross(up))
        .find(|normal| normal.length() > ALONG)
        .map(DVec3::normalize)
        .ok_or(RouteError::NoPlane)
}

struct PlaneCut<'a> {
    task: &'a Task<'a>,
    surface: &'a Surface,
    heights: &'a [f64],
}

impl PlaneCut<'_> {
    fn is_above(&self, vertex: u32) -> bool {
        self.heights[vertex as usize] >= 0.0
    }

    /// Whether the plane passes between the ends of this edge.
    fn cuts(&self, half_edge: u32) -> bool {
        let faces = &self.surface.faces;
        self.is_above(at(faces, half_edge)) != self.is_above(at(faces, next(half_edge)))
    }

    /// The half-edges through which the cut leaves the faces around the start.
    fn exits(&self) -> Vec<u32> {
        let corners = self.surface.links.corners(self.task.start).iter();
        let opposite = corners.map(|&corner| next(corner));
        opposite.filter(|&half_edge| self.cuts(half_edge)).collect()
    }

    /// Follows the cut from face to face, until it reaches the goal, a boundary or its beginning.
    fn follow(&self, exit: u32) -> Option<Vec<Spot>> {
        let faces = &self.surface.faces;
        let mut path = vec![Spot::vertex(self.task.start)];
        let mut half_edge = exit;
        // The cut crosses each face at most once.
        for _ in 0..=faces.len() {
            let (from, to) = (at(faces, half_edge), at(faces, next(half_edge)));
            if from == self.task.goal || to == self.task.goal {
                path.push(Spot::vertex(self.task.goal));
                return Some(path);
            }
            let (low, high) = (self.heights[from as usize], self.heights[to as usize]);
            path.push(Spot {
                from,
                to,
                fraction: low / (low - high),
            });
            let twin = self.surface.links.twin(half_edge);
            if twin == NONE {
                return None;
            }
            half_edge = [next(twin), previous(twin)]
                .into_iter()
                .find(|&side| self.cuts(side))?;
        }
        None
    }
}
