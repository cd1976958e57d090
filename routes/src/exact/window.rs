//! Windows: the straight paths from one source through one sequence of edges.

use glam::DVec2;

use crate::mesh::links::{next, previous};
use crate::mesh::surface::Surface;

/// `√(x² + y²)`, because the `hypot` of different systems rounds differently.
pub(super) fn hypotenuse(x: f64, y: f64) -> f64 {
    DVec2::new(x, y).length()
}

/// A face in a plane: the half-edge is on the x axis from the origin, and the opposite corner has a positive y.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Length of the half-edge.
    pub(super) length: f64,
    /// Coordinates of the opposite corner.
    pub(super) x: f64,
    pub(super) y: f64,
}

impl Shape {
    pub(super) fn of(surface: &Surface, half_edge: u32) -> Self {
        let from = surface.corner(half_edge);
        let edge = surface.corner(next(half_edge)) - from;
        let opposite = surface.corner(previous(half_edge)) - from;
        let length = edge.length();
        Self {
            length,
            x: opposite.dot(edge) / length,
            y: opposite.cross(edge).length() / length,
        }
    }

    /// The point at which a ray from the opposite corner meets the edge. `from_start` is the angle in radians from
    /// the start of the edge to the ray; `angle` is the face's angle at that corner.
    pub(super) fn met_by(&self, from_start: f64, angle: f64) -> f64 {
        let start = hypotenuse(self.x, self.y) * libm::sin(from_start.max(0.0));
        let end =
            hypotenuse(self.length - self.x, self.y) * libm::sin((angle - from_start).max(0.0));
        self.length * start / (start + end)
    }

    /// Distance from the right corner to the point `along` the left edge, whose length is `length`.
    pub(super) fn right_corner_to(&self, along: f64, length: f64) -> f64 {
        let part = along / length;
        hypotenuse(self.length - part * self.x, part * self.y)
    }

    /// Distance from the left corner to the point `along` the edge from the opposite corner to the right one, whose
    /// length is `length`.
    pub(super) fn left_corner_to(&self, along: f64, length: f64) -> f64 {
        let part = along / length;
        hypotenuse(
            self.x + part * (self.length - self.x),
            (1.0 - part) * self.y,
        )
    }
}

/// An interval of an edge, and the source that is visible through it.
///
/// The half-edge is on the x axis from the origin, the source is at `(x, -y)`, and the window continues towards
/// positive y, so that the start of the half-edge is on its left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub(super) half_edge: u32,
    /// Index of its predecessor in the trail.
    pub(super) parent: u32,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) x: f64,
    pub(super) y: f64,
    /// Length from the start to the source.
    pub(super) length: f64,
}

impl Window {
    /// Distance from the source to a point of the edge.
    pub(super) fn distance(&self, along: f64) -> f64 {
        hypotenuse(along - self.x, self.y)
    }

    /// The same window, measured from the other end of its edge.
    pub(super) fn mirrored(&self, length: f64) -> Self {
        Self {
            low: length - self.high,
            high: length - self.low,
            x: length - self.x,
            ..*self
        }
    }

    /// Whether each of its points is nearer through an end of its edge. The lengths from the start to these ends are
    /// `left` and `right` (Xin and Wang, 2009, the first two tests).
    pub(super) fn is_behind(&self, left: f64, right: f64, edge: f64, same: f64) -> bool {
        left + self.high < self.length + self.distance(self.high) - same
            || right + edge - self.low < self.length + self.distance(self.low) - same
    }

    /// Angle at the opposite corner between the left edge of the face and the path to the source.
    pub(super) fn angle_at_corner(&self, shape: &Shape) -> f64 {
        let corner = DVec2::new(shape.x, shape.y);
        let source = DVec2::new(self.x, -self.y);
        let (to_source, edge) = (source - corner, -corner);
        libm::atan2(to_source.perp_dot(edge), to_source.dot(edge)).abs()
    }

    /// The part that reaches the left edge, measured from the left corner. Its half-edge is that of this face.
    pub(super) fn through_left(&self, shape: &Shape, entry: f64, parent: u32) -> Option<Self> {
        let length = hypotenuse(shape.x, shape.y);
        let along = DVec2::new(shape.x, shape.y) / length;
        // The distance from the start of the left edge at which the ray through a point meets it.
        let meets = |point: f64| {
            let met = point * self.y / (along.x * self.y - along.y * (point - self.x));
            met.clamp(0.0, length)
        };
        let low = meets(self.low);
        let high = if self.high >= entry {
            length
        } else {
            meets(self.high)
        };
        (low < high).then(|| Self {
            half_edge: previous(self.half_edge),
            parent,
            low,
            high,
            x: self.x * along.x - self.y * along.y,
            y: self.x * along.y + self.y * along.x,
            length: self.length,
        })
    }

    /// The part that reaches the right edge, measured from the opposite corner. Its half-edge is that of this face.
    pub(super) fn through_right(&self, shape: &Shape, entry: f64, parent: u32) -> Option<Self> {
        let corner = DVec2::new(shape.x, shape.y);
        let edge = DVec2::new(shape.length, 0.0) - corner;
        let length = edge.length();
        let along = edge / length;
        let from_corner = DVec2::new(self.x, -self.y) - corner;
        let meets = |point: f64| {
            let ray = DVec2::new(point - self.x, self.y);
            let met = from_corner.perp_dot(ray) / along.perp_dot(ray);
            met.clamp(0.0, length)
        };
        let low = if self.low <= entry {
            0.0
        } else {
            meets(self.low)
        };
        let high = meets(self.high);
        (low < high).then(|| Self {
            half_edge: next(self.half_edge),
            parent,
            low,
            high,
            x: from_corner.dot(along),
            y: -along.perp_dot(from_corner),
            length: self.length,
        })
    }

    /// The least length from the start through the window to a goal at `(x, y)` on the other side of the edge.
    pub(super) fn bound(&self, x: f64, y: f64) -> f64 {
        let height = self.y + y;
        let crossing = match height > 0.0 {
            true => self.x + (x - self.x) * self.y / height,
            false => x,
        };
        let crossing = crossing.clamp(self.low, self.high);
        self.length + self.distance(crossing) + hypotenuse(crossing - x, y)
    }
}
