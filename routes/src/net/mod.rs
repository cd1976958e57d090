//! Bézier surfaces, and routes on them.

mod bernstein;
mod nearest;

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::error::{MeshError, RouteError};
use crate::mesh::Mesh;
use crate::net::bernstein::Derivatives;
use crate::route::{By, Route};

/// The largest number of control points along a side: polynomials of higher degree lose digits.
pub const MAX_POINTS: usize = 32;
/// The largest number of facets along a side.
pub const MAX_FACETS: usize = 10_000;
/// Number of points of a line in (u, v), without the first.
const LINE_STEPS: usize = 256;

/// A Bézier surface over the unit square: `u` runs along the first axis of its control points, `v`
/// along the second.
#[derive(Debug, Clone, PartialEq)]
pub struct Net {
    rows: usize,
    columns: usize,
    points: Vec<DVec3>,
}

/// Why there is no surface, or no route on it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum NetError {
    /// There are too few or too many control points along a side.
    #[error("the net has {rows} x {columns} control points; each side has 2 to {MAX_POINTS}")]
    Shape {
        /// Number of points along u.
        rows: usize,
        /// Number of points along v.
        columns: usize,
    },
    /// The number of points is not rows times columns.
    #[error("{found} control points are given for {rows} x {columns}")]
    Count {
        /// Number of points along u.
        rows: usize,
        /// Number of points along v.
        columns: usize,
        /// Number of points that were passed.
        found: usize,
    },
    /// A coordinate of a control point is NaN or infinite, or its magnitude exceeds 1e75.
    #[error("control point ({row}, {column}) is {point}; coordinates must be numbers below 1e75")]
    NotFinite {
        /// Index along u, from 0.
        row: usize,
        /// Index along v, from 0.
        column: usize,
        /// The control point.
        point: DVec3,
    },
    /// There are no facets, or too many.
    #[error("{facets} facets along a side are out of range; give 1 to {MAX_FACETS}")]
    Facets {
        /// Requested number of facets along a side.
        facets: usize,
    },
    /// The facets do not make a mesh.
    #[error("the facets of the net do not make a valid mesh: {0}")]
    Mesh(#[from] MeshError),
    /// There is no route on the facets.
    #[error(transparent)]
    Route(#[from] RouteError),
}

/// How a route on a surface is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetBy {
    /// The straight line in (u, v), mapped to the surface; this is not the shortest path.
    Line,
    /// The shortest path on a mesh of n × n squares of two triangles each, where n is this number. The distance of
    /// the mesh from the surface decreases with the square of n.
    Facets(usize),
}

/// The point of a surface that is nearest to another point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnNet {
    /// Its parameters (u, v) in the unit square.
    pub uv: DVec2,
    /// Its position.
    pub point: DVec3,
    /// Distance from the other point.
    pub distance: f64,
}

impl Net {
    /// Makes a net of `rows` × `columns` control points, row by row.
    ///
    /// # Errors
    /// * When a side has fewer than 2 or more than [`MAX_POINTS`] points.
    /// * When the number of points is not `rows` times `columns`.
    /// * When a coordinate is not finite or exceeds 1e75 in magnitude.
    pub fn new(rows: usize, columns: usize, points: Vec<DVec3>) -> Result<Self, NetError> {
        let sides = 2..=MAX_POINTS;
        if !sides.contains(&rows) || !sides.contains(&columns) {
            return Err(NetError::Shape { rows, columns });
        }
        if points.len() != rows * columns {
            let found = points.len();
            return Err(NetError::Count {
                rows,
                columns,
                found,
            });
        }
        let is_bad = |point: &DVec3| !point.is_finite() || point.abs().max_element() > 1e75;
        if let Some(index) = points.iter().position(is_bad) {
            return Err(NetError::NotFinite {
                row: index / columns,
                column: index % columns,
                point: points[index],
            });
        }
        Ok(Self {
            rows,
            columns,
            points,
        })
    }

    /// The point of the surface at (u, v), each from 0 to 1.
    #[must_use]
    pub fn at(&self, uv: DVec2) -> DVec3 {
        self.derivatives(uv).point
    }

    /// The unit normal at (u, v), in the direction of the derivative by u × the derivative by v. On a side that is
    /// collapsed to a point, it is the normal at a point beside it.
    #[must_use]
    pub fn normal(&self, uv: DVec2) -> DVec3 {
        let at = |uv| {
            let Derivatives { u, v, .. } = self.derivatives(uv);
            (u.cross(v), u.length() * v.length())
        };
        let (cross, size) = at(uv);
        match cross.length() > 1e-9 * size {
            true => cross.normalize(),
            false => at(uv.lerp(DVec2::splat(0.5), 1e-4)).0.normalize_or_zero(),
        }
    }

    /// The point of the surface that is nearest to `point`. On a side that is collapsed to a point, (u, v) is any of
    /// its parameters.
    #[must_use]
    pub fn nearest(&self, point: DVec3) -> OnNet {
        nearest::nearest(self, point)
    }

    /// Largest extent of the control points along an axis.
    #[must_use]
    pub fn size(&self) -> f64 {
        let low = self
            .points
            .iter()
            .copied()
            .fold(DVec3::INFINITY, DVec3::min);
        let high = self
            .points
            .iter()
            .copied()
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        (high - low).max_element()
    }

    /// The surface as a mesh of `facets` × `facets` squares of two triangles each.
    ///
    /// # Errors
    /// When `facets` is 0 or exceeds [`MAX_FACETS`], or when the facets do not make a mesh.
    pub fn facets(&self, facets: usize) -> Result<Mesh, NetError> {
        if !(1..=MAX_FACETS).contains(&facets) {
            return Err(NetError::Facets { facets });
        }
        let part = |i: usize| i as f64 / facets as f64;
        let row = |i| (0..=facets).map(move |j| DVec2::new(part(i), part(j)));
        let positions: Vec<DVec3> = (0..=facets)
            .flat_map(row)
            .map(|uv| self.vertex(uv))
            .collect();
        let mut triangles = Vec::with_capacity(2 * facets * facets);
        for i in 0..facets {
            for j in 0..facets {
                let at = |di, dj| ((i + di) * (facets + 1) + j + dj) as u32;
                triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
                triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
            }
        }
        Ok(Mesh::new(&positions, &triangles)?)
    }

    /// A vertex of the facets. On a side that is collapsed to a point, it is always the same, without rounding.
    fn vertex(&self, uv: DVec2) -> DVec3 {
        let side = |at: f64, count: usize, stride: usize, across: usize, step: usize| {
            let first = match at {
                0.0 => 0,
                1.0 => (count - 1) * stride,
                _ => return None,
            };
            let mut points = (0..across).map(|k| self.points[first + k * step]);
            points
                .clone()
                .all(|point| point == self.points[first])
                .then(|| points.next())?
        };
        let by_u = side(uv.x, self.rows, self.columns, self.columns, 1);
        let by_v = || side(uv.y, self.columns, 1, self.rows, self.columns);
        by_u.or_else(by_v).unwrap_or_else(|| self.at(uv))
    }

    /// The route between the points of the surface that are nearest to `from` and `to`.
    ///
    /// # Errors
    /// When a point is not finite, when the facets do not make a mesh, or when there is no route on them.
    pub fn route(&self, from: DVec3, to: DVec3, by: NetBy) -> Result<Route, NetError> {
        for point in [from, to] {
            if !point.is_finite() {
                return Err(RouteError::NotFinite { point }.into());
            }
        }
        let ends = [from, to].map(|point| self.nearest(point));
        let off = ends.map(|end| end.distance);
        match by {
            NetBy::Line => Ok(self.line(ends.map(|end| end.uv), off)),
            NetBy::Facets(facets) => {
                let mesh = self.facets(facets)?;
                let [from, to] = ends.map(|end| self.on_facet(end.uv, facets));
                let route = mesh.route(from, to, By::Exact)?;
                Ok(Route { off, ..route })
            }
        }
    }

    /// The straight line in (u, v). Its length is that of the curve on the surface.
    fn line(&self, [from, to]: [DVec2; 2], off: [f64; 2]) -> Route {
        if from == to {
            return Route {
                points: vec![self.at(from)],
                normals: Some(vec![self.normal(from)]),
                length: 0.0,
                off,
            };
        }
        let along = (0..=LINE_STEPS).map(|step| from.lerp(to, step as f64 / LINE_STEPS as f64));
        let rate = to - from;
        let speed = |part: f64| {
            let Derivatives { u, v, .. } = self.derivatives(from.lerp(to, part));
            (rate.x * u + rate.y * v).length()
        };
        Route {
            points: along.clone().map(|uv| self.at(uv)).collect(),
            normals: Some(along.map(|uv| self.normal(uv)).collect()),
            length: integral(&speed, 0.0, 1.0, 0),
            off,
        }
    }

    /// The point of a facet at (u, v).
    fn on_facet(&self, uv: DVec2, facets: usize) -> DVec3 {
        let scaled = uv * facets as f64;
        let cell = scaled.floor().min(DVec2::splat(facets as f64 - 1.0));
        let DVec2 { x, y } = scaled - cell;
        let at = |du, dv| self.vertex((cell + DVec2::new(du, dv)) / facets as f64);
        let (first, last) = (at(0.0, 0.0), at(1.0, 1.0));
        match x >= y {
            true => first + (x - y) * (at(1.0, 0.0) - first) + y * (last - first),
            false => first + (y - x) * (at(0.0, 1.0) - first) + x * (last - first),
        }
    }
}

/// An integral by the rule of Gauss and Legendre with 5 points. Intervals are halved until the halves agree with the
/// whole.
fn integral(function: &impl Fn(f64) -> f64, from: f64, to: f64, depth: u32) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (0.0, 128.0 / 225.0),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let over = |from: f64, to: f64| -> f64 {
        let (middle, half) = (f64::midpoint(from, to), (to - from) / 2.0);
        half * NODES
            .iter()
            .map(|(node, weight)| weight * function(middle + half * node))
            .sum::<f64>()
    };
    let middle = f64::midpoint(from, to);
    let (whole, halves) = (over(from, to), over(from, middle) + over(middle, to));
    // Where the speed has a corner, the sum does not converge, so halving ends after 2^-30 of the line.
    if (whole - halves).abs() <= 1e-13 * halves.abs() || depth >= 30 {
        return halves;
    }
    integral(function, from, middle, depth + 1) + integral(function, middle, to, depth + 1)
}
