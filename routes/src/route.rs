//! Routes from one point of a mesh to another.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;

use crate::endpoints::{Task, locate_endpoints};
use crate::error::RouteError;
use crate::mesh::Mesh;
use crate::mesh::surface::Spot;
use crate::{edges, exact, greedy, plane, together};

/// How a route is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum By {
    /// The shortest path over the surface.
    #[default]
    Exact,
    /// The cut of the surface by the plane that contains start and goal and the direction of the sum of their
    /// normals.
    Plane,
    /// A walk along edges that always takes the edge whose direction is nearest to that of the goal.
    Greedy,
    /// The shortest path along edges.
    Edges,
}

impl By {
    /// All methods.
    pub const ALL: [Self; 4] = [Self::Exact, Self::Plane, Self::Greedy, Self::Edges];

    /// The name: `exact`, `plane`, `greedy` or `edges`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Plane => "plane",
            Self::Greedy => "greedy",
            Self::Edges => "edges",
        }
    }
}

impl fmt::Display for By {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for By {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|by| by.name() == text);
        found.ok_or_else(|| format!("`{text}` is none of exact, plane, greedy, edges"))
    }
}

/// A path over a surface, straight from each point to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// The points from the start to the goal, in the unit of the mesh; one point if both are equal.
    pub points: Vec<DVec3>,
    /// The unit normal of the surface at each point; 0 if the normals of its faces cancel out. `None` if the
    /// surface has only one side.
    pub normals: Option<Vec<DVec3>>,
    /// The length over the surface, in the unit of the mesh.
    pub length: f64,
    /// The distances of the requested start and goal from the surface.
    pub off: [f64; 2],
}

impl Mesh {
    /// The route between the points of the surface that are nearest to `from` and `to`.
    ///
    /// # Errors
    /// When a point is not finite, when start and goal are not connected, or when `by` finds no route.
    pub fn route(&self, from: DVec3, to: DVec3, by: By) -> Result<Route, RouteError> {
        if by == By::Plane && self.has_branches {
            return Err(RouteError::PlaneBranches);
        }
        let task = locate_endpoints(self, from, to)?;
        if task.start == task.goal {
            return Ok(Route::new(&task, &[Spot::vertex(task.start)]));
        }
        let spots = match by {
            By::Exact => exact::find_path(&task)?,
            By::Plane => plane::find_path(&task)?,
            By::Greedy => greedy::find_path(&task),
            By::Edges => edges::find_path(&task),
        };
        Ok(Route::new(&task, &spots))
    }

    /// The routes of many pairs of points, computed in parallel. Each takes as much memory as a single call.
    #[must_use]
    pub fn routes(&self, pairs: &[[DVec3; 2]], by: By) -> Vec<Result<Route, RouteError>> {
        let route = |&[from, to]: &[DVec3; 2]| self.route(from, to, by);
        together::map(pairs, route)
    }
}

impl Route {
    /// The point at a distance along the straight lines from the start, and the unit normal at it. Distances below 0
    /// and above the length of these lines have the first and the last point.
    ///
    /// # Panics
    /// When the route has no points.
    #[must_use]
    pub fn at(&self, distance: f64) -> (DVec3, Option<DVec3>) {
        let mut rest = distance.max(0.0);
        let normals = |index: usize| self.normals.as_ref().map(|normals| normals[index]);
        for (index, pair) in self.points.windows(2).enumerate() {
            let length = pair[0].distance(pair[1]);
            if rest <= length {
                let part = if length > 0.0 { rest / length } else { 0.0 };
                let ends = normals(index).zip(normals(index + 1));
                let normal = ends.map(|(one, other)| one.lerp(other, part).normalize_or_zero());
                return (pair[0].lerp(pair[1], part), normal);
            }
            rest -= length;
        }
        let last = self.points.len() - 1;
        (self.points[last], normals(last))
    }

    /// The route through points on edges; consecutive points at the same position become one.
    pub(crate) fn new(task: &Task<'_>, spots: &[Spot]) -> Self {
        let surface = &*task.surface;
        let mut points: Vec<DVec3> = Vec::with_capacity(spots.len());
        let mut kept: Vec<Spot> = Vec::with_capacity(spots.len());
        for &spot in spots {
            let point = surface.position(spot);
            if points.last() != Some(&point) {
                points.push(point);
                kept.push(spot);
            }
        }
        let normals: Option<Vec<DVec3>> = kept.iter().map(|&spot| surface.normal(spot)).collect();
        Self {
            // `sum()` of no numbers would be -0.
            length: points
                .windows(2)
                .map(|pair| pair[0].distance(pair[1]))
                .fold(0.0, |sum, distance| sum + distance),
            points,
            normals,
            off: task.off,
        }
    }
}
