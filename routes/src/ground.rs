//! Finds the parts of a mesh that are clear of obstacles and not too steep.

use std::collections::HashMap;

use glam::DVec3;
use thiserror::Error;

use crate::error::{MeshError, RouteError};
use crate::mesh::Mesh;
use crate::route::{By, Route};
use crate::together;

/// The largest number of triangles after halving.
pub const MAX_TRIANGLES: usize = 4_000_000;

/// A point is on free ground if its distance from it is less than this, relative to the size of the mesh.
const ON_GROUND: f64 = 1e-9;

/// The obstacles and slopes that a route avoids.
#[derive(Debug, Clone, Copy)]
pub struct Clear<'a> {
    /// The obstacles, which do not move. Their surfaces count: ground inside an obstacle is separated from the rest
    /// by the hole around its surface.
    pub obstacles: Option<&'a Mesh>,
    /// The smallest distance of a route from the obstacles, in the unit of the mesh.
    pub clearance: f64,
    /// Triangles at the edge of a hole are halved until their longest edge is not longer than this, in the unit of
    /// the mesh.
    pub finest: f64,
    /// The steepest slope in radians: the angle between a triangle and the plane perpendicular to `up`; `None` for no
    /// limit.
    pub max_slope: Option<f64>,
    /// The upward direction, of any length but 0.
    pub up: DVec3,
}

/// Why there is no free ground.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GroundError {
    /// The clearance is negative or not finite.
    #[error("the clearance is {clearance}; give a number of 0 or more")]
    Clearance {
        /// The clearance.
        clearance: f64,
    },
    /// The finest edge is not a positive finite number.
    #[error("the finest edge is {finest}; give a number over 0")]
    Finest {
        /// The finest edge.
        finest: f64,
    },
    /// The slope is not between 0 and 90°, or the upward direction is 0.
    #[error("slopes are from 0 to 90 degrees against a direction that is not 0")]
    Slope,
    /// Halving down to the finest edge makes too many triangles.
    #[error("more than {MAX_TRIANGLES} triangles at a finest edge of {finest}; give a longer one")]
    TooFine {
        /// The finest edge.
        finest: f64,
    },
    /// No triangle is free.
    #[error("no ground is free: all of it is within the clearance, or too steep")]
    Nothing,
    /// The free triangles do not make a valid mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// The free part of a mesh.
#[derive(Debug, Clone)]
pub struct Ground<'a> {
    whole: &'a Mesh,
    /// The free triangles: they are not too steep, and every point on them is clear of all obstacles.
    pub mesh: Mesh,
    /// Number of triangles after halving that are not too steep, whether they are clear of obstacles or not.
    pub triangle_count: usize,
}

/// Whether a triangle is free.
#[derive(Clone, Copy, PartialEq, Eq)]
enum TriangleClass {
    Free,
    Closed,
    /// Not known: a part may be free, and a part not.
    Open,
}

impl<'a> Ground<'a> {
    /// Cuts holes into a mesh. A triangle stays if the distance of its centre from the obstacles is at least the
    /// clearance plus the triangle's radius, so that all of its points are clear. Routes on these triangles are free
    /// by construction, and shortest up to the finest edge.
    ///
    /// Triangles at the edge of a hole are halved at their longest edges, together with their neighbours at these
    /// edges, so that no vertex lies within an edge (Rivara, 1984).
    ///
    /// # Errors
    /// When an option is out of range, when halving makes more than [`MAX_TRIANGLES`], when no triangle is free, or
    /// when the free triangles do not make a mesh.
    pub fn new(mesh: &'a Mesh, clear: Clear<'_>) -> Result<Self, GroundError> {
        let Clear {
            clearance, finest, ..
        } = clear;
        if !(clearance >= 0.0 && clearance.is_finite()) {
            return Err(GroundError::Clearance { clearance });
        }
        if !(finest > 0.0 && finest.is_finite()) {
            return Err(GroundError::Finest { finest });
        }
        let up = clear.up.try_normalize().ok_or(GroundError::Slope)?;
        let least_up = match clear.max_slope {
            None => 0.0,
            Some(slope) if (0.0..=std::f64::consts::FRAC_PI_2).contains(&slope) => libm::cos(slope),
            Some(_) => return Err(GroundError::Slope),
        };
        let is_level = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            normal.dot(up).abs() >= least_up - 1e-12
        };
        let class_of = |corners: [DVec3; 3]| match clear.obstacles {
            Some(obstacles) => classify(obstacles, clearance, corners),
            None => TriangleClass::Free,
        };
        let mut positions = mesh.positions().to_vec();
        let level = mesh.triangles().iter().copied();
        let mut triangles: Vec<[u32; 3]> = level
            .filter(|corners| is_level(corners.map(|vertex| positions[vertex as usize])))
            .collect();
        // Both halves of a free triangle are free, and both halves of a closed one are closed.
        let mut classes = vec![TriangleClass::Open; triangles.len()];
        loop {
            let corners = |triangle: &[u32; 3]| triangle.map(|vertex| positions[vertex as usize]);
            let open = |i: &usize| classes[*i] == TriangleClass::Open;
            let open: Vec<usize> = (0..triangles.len()).filter(open).collect();
            let found = together::map(&open, |&i| class_of(corners(&triangles[i])));
            for (i, class) in open.into_iter().zip(found) {
                classes[i] = class;
            }
            let is_coarse = |(class, triangle): (&TriangleClass, &[u32; 3])| {
                *class == TriangleClass::Open
                    && sides(corners(triangle)).into_iter().fold(0.0, f64::max) > finest
            };
            let coarse: Vec<bool> = classes.iter().zip(&triangles).map(is_coarse).collect();
            if !coarse.contains(&true) {
                break;
            }
            halve(&mut positions, &mut triangles, &mut classes, &coarse);
            if triangles.len() > MAX_TRIANGLES {
                return Err(GroundError::TooFine { finest });
            }
        }
        let count = triangles.len();
        let free = triangles.into_iter().zip(classes);
        let free: Vec<[u32; 3]> = free
            .filter(|&(_, class)| class == TriangleClass::Free)
            .map(|(triangle, _)| triangle)
            .collect();
        if free.is_empty() {
            return Err(GroundError::Nothing);
        }
        Ok(Self {
            whole: mesh,
            mesh: Mesh::new(&positions, &free)?,
            triangle_count: count,
        })
    }

    /// The route over the free triangles between the points of the whole mesh that are nearest to `from` and `to`.
    ///
    /// # Errors
    /// When one of these points is not on free ground, and as [`Mesh::route`].
    pub fn route(&self, from: DVec3, to: DVec3, by: By) -> Result<Route, RouteError> {
        let mut off = [0.0; 2];
        let mut ends = [from, to];
        for (end, off) in ends.iter_mut().zip(&mut off) {
            let requested = *end;
            if !requested.is_finite() {
                return Err(RouteError::NotFinite { point: requested });
            }
            *end = self.whole.nearest(requested);
            *off = end.distance(requested);
            let distance = self.mesh.nearest(*end).distance(*end);
            if distance > ON_GROUND * self.whole.size() {
                let point = *end;
                return Err(RouteError::NotFree { point, distance });
            }
        }
        let route = self.mesh.route(ends[0], ends[1], by)?;
        Ok(Route { off, ..route })
    }

    /// The routes of many pairs of points, computed in parallel.
    #[must_use]
    pub fn routes(&self, pairs: &[[DVec3; 2]], by: By) -> Vec<Result<Route, RouteError>> {
        let route = |&[from, to]: &[DVec3; 2]| self.route(from, to, by);
        together::map(pairs, route)
    }
}

fn classify(obstacles: &Mesh, clearance: f64, corners: [DVec3; 3]) -> TriangleClass {
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    let radius = corners
        .iter()
        .map(|corner| corner.distance(centre))
        .fold(0.0, f64::max);
    let distance = obstacles.nearest(centre).distance(centre);
    if distance >= clearance + radius {
        TriangleClass::Free
    } else if distance + radius < clearance {
        TriangleClass::Closed
    } else {
        TriangleClass::Open
    }
}

/// The lengths of the sides, each from a corner to the next.
fn sides([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    [a.distance(b), b.distance(c), c.distance(a)]
}

/// The longest side. Of equal ones, it is the one between the lowest vertices, so that both triangles at an edge
/// agree.
fn longest(positions: &[DVec3], triangle: [u32; 3]) -> usize {
    let lengths = sides(triangle.map(|vertex| positions[vertex as usize]));
    let key = |side: usize| edge(triangle[side], triangle[(side + 1) % 3]);
    let better = |one: &usize, other: &usize| {
        lengths[*one]
            .total_cmp(&lengths[*other])
            .then(key(*other).cmp(&key(*one)))
    };
    (0..3).max_by(better).unwrap_or(0)
}

fn edge(one: u32, other: u32) -> (u32, u32) {
    (one.min(other), one.max(other))
}

/// Halves the `coarse` triangles at their longest edges. If this divides an edge of another triangle, that triangle
/// is also halved at its longest edge, and so on.
fn halve(
    positions: &mut Vec<DVec3>,
    triangles: &mut Vec<[u32; 3]>,
    classes: &mut Vec<TriangleClass>,
    coarse: &[bool],
) {
    let longest_sides: Vec<usize> = triangles
        .iter()
        .map(|&triangle| longest(positions, triangle))
        .collect();
    let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
    let split =
        |positions: &mut Vec<DVec3>, middles: &mut HashMap<(u32, u32), u32>, index: usize| {
            let (triangle, side) = (triangles[index], longest_sides[index]);
            let (one, other) = edge(triangle[side], triangle[(side + 1) % 3]);
            let mut is_new = false;
            middles.entry((one, other)).or_insert_with(|| {
                is_new = true;
                positions.push(DVec3::midpoint(
                    positions[one as usize],
                    positions[other as usize],
                ));
                positions.len() as u32 - 1
            });
            is_new
        };
    for index in (0..coarse.len()).filter(|&index| coarse[index]) {
        split(positions, &mut middles, index);
    }
    loop {
        let mut is_done = true;
        for (index, triangle) in triangles.iter().enumerate() {
            let is_cut =
                (0..3).any(|k| middles.contains_key(&edge(triangle[k], triangle[(k + 1) % 3])));
            if is_cut && split(positions, &mut middles, index) {
                is_done = false;
            }
        }
        if is_done {
            break;
        }
    }
    for index in 0..coarse.len() {
        let triangle = triangles[index];
        let middle = |one, other| middles.get(&edge(one, other)).copied();
        let side = longest_sides[index];
        let [a, b, c] = [0, 1, 2].map(|k| triangle[(side + k) % 3]);
        // First divide the longest edge a-b, then the others.
        let Some(ab) = middle(a, b) else { continue };
        let mut parts = Vec::with_capacity(4);
        match middle(b, c) {
            Some(bc) => parts.extend([[ab, b, bc], [ab, bc, c]]),
            None => parts.push([ab, b, c]),
        }
        match middle(c, a) {
            Some(ca) => parts.extend([[ab, c, ca], [ab, ca, a]]),
            None => parts.push([ab, c, a]),
        }
        let class = classes[index];
        triangles[index] = parts[0];
        triangles.extend(&parts[1..]);
        classes.extend(parts[1..].iter().map(|_| class));
    }
}
