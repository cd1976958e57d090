//! Faces as a file has them become triangles between different points.

use std::collections::HashMap;

use glam::DVec3;

use crate::error::{MeshError, MeshWarning};
use crate::mesh::MOST_TRIANGLES;

/// Triangles between different points, all of which are used.
pub(super) struct Welded {
    pub(super) positions: Vec<DVec3>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) warnings: Vec<MeshWarning>,
}

/// A triangle is flat when its height is less than this fraction of its longest edge.
const FLAT: f64 = 1e-12;
/// A polygon is not flat when a corner is farther from its plane than this fraction of its size.
const UNEVEN: f64 = 1e-6;
/// Beyond this squares of areas are no finite numbers.
const LARGEST: f64 = 1e75;

pub(super) fn weld<'a>(
    given: &[DVec3],
    polygons: impl IntoIterator<Item = &'a [u32]>,
) -> Result<Welded, MeshError> {
    for (vertex, &position) in given.iter().enumerate() {
        if !position.is_finite() || position.abs().max_element() > LARGEST {
            return Err(MeshError::NotFinite { vertex, position });
        }
    }
    let mut welding = Welding {
        given,
        known: HashMap::new(),
        positions: Vec::new(),
    };
    let mut faces = Vec::new();
    let (mut dropped, mut uneven) = ((0, 0), (0, 0));
    for (number, polygon) in polygons.into_iter().enumerate() {
        if polygon.len() < 3 {
            let (face, corners) = (number, polygon.len());
            return Err(MeshError::Corners { face, corners });
        }
        let outside = polygon
            .iter()
            .find(|&&vertex| vertex as usize >= given.len());
        if let Some(&vertex) = outside {
            return Err(MeshError::Index {
                face: number,
                vertex: u64::from(vertex),
                count: given.len(),
            });
        }
        if polygon.len() > 3 && !is_flat(given, polygon) {
            count(&mut uneven, number);
        }
        for pair in polygon[1..].windows(2) {
            let corners = [polygon[0], pair[0], pair[1]].map(|vertex| given[vertex as usize]);
            let [a, b, c] = corners;
            if a == b || b == c || c == a {
                count(&mut dropped, number);
                continue;
            }
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            if (b - a).cross(c - a).length() <= FLAT * longest * longest {
                return Err(MeshError::Flat {
                    face: number,
                    corners,
                });
            }
            faces.push([polygon[0], pair[0], pair[1]].map(|vertex| welding.vertex(vertex)));
        }
    }
    if faces.is_empty() {
        return Err(MeshError::Empty);
    }
    if faces.len() > MOST_TRIANGLES {
        return Err(MeshError::TooMany {
            triangles: faces.len(),
            most: MOST_TRIANGLES,
        });
    }
    let mut warnings = Vec::new();
    if let (count @ 1.., face) = dropped {
        warnings.push(MeshWarning::Dropped { count, face });
    }
    if let (count @ 1.., face) = uneven {
        warnings.push(MeshWarning::NotFlat { count, face });
    }
    Ok(Welded {
        positions: welding.positions,
        faces,
        warnings,
    })
}

/// Counts, and keeps the first.
fn count(counted: &mut (usize, usize), number: usize) {
    if counted.0 == 0 {
        counted.1 = number;
    }
    counted.0 += 1;
}

struct Welding<'a> {
    given: &'a [DVec3],
    known: HashMap<[u64; 3], u32>,
    positions: Vec<DVec3>,
}

impl Welding<'_> {
    /// The number of a vertex among those at different positions.
    fn vertex(&mut self, vertex: u32) -> u32 {
        let position = self.given[vertex as usize];
        // Adding 0 makes 0 of -0.
        let key = (position + DVec3::ZERO).to_array().map(f64::to_bits);
        *self.known.entry(key).or_insert_with(|| {
            self.positions.push(position + DVec3::ZERO);
            self.positions.len() as u32 - 1
        })
    }
}

/// Whether the corners lie in the plane of Newell's normal.
fn is_flat(given: &[DVec3], polygon: &[u32]) -> bool {
    let at = |corner: usize| {
        given[polygon[corner % polygon.len()] as usize] - given[polygon[0] as usize]
    };
    let normal: DVec3 = (0..polygon.len()).map(|i| at(i).cross(at(i + 1))).sum();
    let normal = normal.normalize_or_zero();
    let size = (0..polygon.len())
        .map(|i| at(i).length())
        .fold(0.0, f64::max);
    (0..polygon.len()).all(|i| at(i).dot(normal).abs() <= UNEVEN * size)
}
