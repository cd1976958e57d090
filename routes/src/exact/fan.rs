//! The faces about a vertex, unrolled.

use std::f64::consts::PI;

use crate::exact::arrivals::Arrival;
use crate::exact::window::Shape;
use crate::mesh::links::{MANY, NONE, at, next, previous};
use crate::mesh::surface::Surface;

/// Angle in radians by which paths may bend less than 180°, so that rounding leaves no gap.
const SLACK: f64 = 1e-8;

/// The faces about a vertex, in order.
pub(super) struct Fan {
    wedges: Vec<Wedge>,
    is_closed: bool,
    /// Whether the faces are one fan, closed or open, and every edge has one or two faces.
    is_simple: bool,
}

/// The angle of a face at the vertex.
struct Wedge {
    /// The corner of the face at the vertex.
    corner: u32,
    /// The other end of the edge at which it begins.
    first: u32,
    /// The angles at which it begins and ends, in radians.
    from: f64,
    to: f64,
}

/// The directions in which paths leave a vertex.
pub(super) enum Sector {
    All,
    Empty,
    /// Intervals of angles.
    Within([(f64, f64); 3]),
}

impl Fan {
    pub(super) fn about(surface: &Surface, vertex: u32) -> Self {
        let faces = &surface.faces;
        let corners = surface.links.corners(vertex);
        let mut fan = Self {
            wedges: Vec::with_capacity(corners.len()),
            is_closed: false,
            is_simple: true,
        };
        let Some(&any) = corners.first() else {
            return fan;
        };
        // The half-edge between the vertex and `end`, in the face of the corner.
        let side = |corner: u32, end: u32| match at(faces, next(corner)) == end {
            true => corner,
            false => previous(corner),
        };
        // Crosses the edge to `end`: returns the corner of the next face, and the end of its other edge.
        let step = |corner: u32, end: u32| -> Option<(u32, u32)> {
            let twin = surface.links.twin(side(corner, end));
            if twin == NONE || twin == MANY {
                return None;
            }
            let found = [twin, next(twin)]
                .into_iter()
                .find(|&half_edge| at(faces, half_edge) == vertex)?;
            let ends = [at(faces, next(found)), at(faces, previous(found))];
            Some((found, if ends[0] == end { ends[1] } else { ends[0] }))
        };
        // Go back to the beginning of the fan. If the fan goes all around, any corner will do.
        let (mut corner, mut first) = (any, at(faces, next(any)));
        for _ in 0..corners.len() {
            match step(corner, first) {
                Some((other, end)) => (corner, first) = (other, end),
                None => break,
            }
            if corner == any {
                fan.is_closed = true;
                break;
            }
        }
        let begin = corner;
        let mut angle = 0.0;
        for _ in 0..corners.len() {
            let ends = [at(faces, next(corner)), at(faces, previous(corner))];
            let last = if ends[0] == first { ends[1] } else { ends[0] };
            let to = angle + corner_angle(surface, corner);
            fan.wedges.push(Wedge {
                corner,
                first,
                from: angle,
                to,
            });
            angle = to;
            match step(corner, last) {
                Some((other, _)) if other != begin => (corner, first) = (other, last),
                _ => break,
            }
        }
        let branches = |&corner: &u32| {
            surface.links.twin(corner) == MANY || surface.links.twin(previous(corner)) == MANY
        };
        fan.is_simple = fan.wedges.len() == corners.len() && !corners.iter().any(branches);
        fan
    }

    /// Whether the fan is closed and contains all faces of the vertex.
    pub(super) fn is_closed(&self) -> bool {
        self.is_closed && self.is_simple
    }

    /// The sum of the angles.
    pub(super) fn total(&self) -> f64 {
        self.wedges.last().map_or(0.0, |wedge| wedge.to)
    }

    /// The directions that differ by at least 180° on either side from the direction from which a path comes.
    pub(super) fn sector(&self, surface: &Surface, arrival: Arrival) -> Sector {
        if !self.is_simple {
            return Sector::All;
        }
        let Some(from) = self.direction(surface, arrival) else {
            return Sector::All;
        };
        let total = self.total();
        let (low, high) = (from + PI - SLACK, from - PI + SLACK);
        if !self.is_closed {
            return Sector::Within([(low, total + 1.0), (-1.0, high), (1.0, 0.0)]);
        }
        if low > high + total {
            return Sector::Empty;
        }
        Sector::Within([
            (low, high + total),
            (low - total, high),
            (low + total, high + 2.0 * total),
        ])
    }

    /// The angle at which a path arrives.
    fn direction(&self, surface: &Surface, arrival: Arrival) -> Option<f64> {
        let faces = &surface.faces;
        match arrival {
            Arrival::Edge(before) => {
                let of = |wedge: &Wedge| {
                    let ends = [
                        at(faces, next(wedge.corner)),
                        at(faces, previous(wedge.corner)),
                    ];
                    match ends.contains(&before) {
                        true if wedge.first == before => Some(wedge.from),
                        true => Some(wedge.to),
                        false => None,
                    }
                };
                self.wedges.iter().find_map(of)
            }
            Arrival::Window {
                half_edge, angle, ..
            } => {
                let wedge = self
                    .wedges
                    .iter()
                    .find(|wedge| wedge.corner / 3 == half_edge / 3)?;
                match wedge.first == at(faces, half_edge) {
                    true => Some(wedge.from + angle),
                    false => Some(wedge.to - angle),
                }
            }
        }
    }

    /// The parts of the edge opposite a corner that lie in the sector, measured along its half-edge, whose shape is
    /// `shape`.
    pub(super) fn intervals(
        &self,
        surface: &Surface,
        sector: &Sector,
        corner: u32,
        shape: &Shape,
    ) -> Vec<(f64, f64)> {
        let whole = (0.0, shape.length);
        let directions = match sector {
            Sector::All => return vec![whole],
            Sector::Empty => return Vec::new(),
            Sector::Within(directions) => directions,
        };
        let Some(wedge) = self.wedges.iter().find(|wedge| wedge.corner == corner) else {
            return vec![whole];
        };
        let angle = wedge.to - wedge.from;
        // The half-edge begins at the next corner.
        let is_forward = wedge.first == at(&surface.faces, next(corner));
        let along = |rotation: f64| {
            let from_start = if is_forward {
                rotation
            } else {
                angle - rotation
            };
            shape.met_by(from_start, angle)
        };
        let mut parts = Vec::new();
        for &(low, high) in directions {
            let (low, high) = (
                low.max(wedge.from) - wedge.from,
                high.min(wedge.to) - wedge.from,
            );
            if low < high {
                let (one, other) = (along(low), along(high));
                parts.push((one.min(other), one.max(other)));
            }
        }
        parts
    }
}

/// The angle of a face at a corner.
fn corner_angle(surface: &Surface, corner: u32) -> f64 {
    let here = surface.corner(corner);
    let one = surface.corner(next(corner)) - here;
    let other = surface.corner(previous(corner)) - here;
    libm::atan2(one.cross(other).length(), one.dot(other))
}
