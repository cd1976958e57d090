//! Converts the faces of a file to triangles between different points: equal points are welded, polygons are cut,
//! faces on each other are merged, and sides are divided at corners that lie on them.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use crate::error::{MeshError, MeshWarning};
use crate::mesh::MAX_TRIANGLES;
use crate::mesh::cut::{MAX_CORNERS, Uncut, cut};
use crate::mesh::joints::{near_open_sides, on_open_sides};

/// Triangles between different points, all of which are used.
pub(super) struct Welded {
    pub(super) positions: Vec<DVec3>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) warnings: Vec<MeshWarning>,
}

/// The largest coordinate: for larger ones, squares of areas are not finite.
const LARGEST: f64 = 1e75;
/// A corner lies on a side if their distance is less than this fraction of the mesh's size, to which f32 positions
/// are rounded.
const ON_SIDE: f64 = 1e-7;
/// Open sides at less than this distance from a corner, relative to the mesh's size, are a seam that may need
/// welding.
const SEAM: f64 = 1e-5;

/// A counter that keeps the first face.
#[derive(Default)]
struct Count {
    count: usize,
    face: usize,
}

impl Count {
    fn add(&mut self, more: usize, face: usize) {
        if self.count == 0 {
            self.face = face;
        }
        self.count += more;
    }
}

/// Merges positions within `tolerance` of each other into the first of them, and makes triangles.
pub(super) fn weld<'a>(
    input: &[DVec3],
    polygons: impl IntoIterator<Item = &'a [u32]>,
    tolerance: f64,
) -> Result<Welded, MeshError> {
    for (vertex, &position) in input.iter().enumerate() {
        if !position.is_finite() || position.abs().max_element() > LARGEST {
            return Err(MeshError::NotFinite { vertex, position });
        }
    }
    if !(0.0..=LARGEST).contains(&tolerance) {
        return Err(MeshError::Weld { tolerance });
    }
    let mut welding = Welding::new(input, tolerance);
    let [mut dropped, mut flat, mut uneven, mut doubled] = <[Count; 4]>::default();
    for (face, polygon) in polygons.into_iter().enumerate() {
        if polygon.len() < 3 {
            let corners = polygon.len();
            return Err(MeshError::Corners { face, corners });
        }
        let outside = polygon
            .iter()
            .find(|&&vertex| vertex as usize >= input.len());
        if let Some(&vertex) = outside {
            return Err(MeshError::Index {
                face,
                vertex: u64::from(vertex),
                count: input.len(),
            });
        }
        // Equal neighbouring corners are one corner.
        let mut corners: Vec<u32> = polygon
            .iter()
            .map(|&vertex| welding.first_at(vertex))
            .collect();
        corners.dedup();
        while corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() < 3 {
            dropped.add(polygon.len() - 2, face);
            continue;
        }
        dropped.add(polygon.len() - corners.len(), face);
        if corners.len() > 3 && !welding.polygons.insert(canonical(&corners)) {
            doubled.add(corners.len() - 2, face);
            continue;
        }
        let points: Vec<DVec3> = corners
            .iter()
            .map(|&vertex| input[vertex as usize])
            .collect();
        let made = match cut(&points) {
            Ok(made) => made,
            Err(Uncut::Flat) => {
                flat.add(1, face);
                continue;
            }
            Err(Uncut::Crosses) => return Err(MeshError::Crosses { face }),
            Err(Uncut::TooMany) => {
                return Err(MeshError::TooManyCorners {
                    face,
                    corners: corners.len(),
                    max: MAX_CORNERS,
                });
            }
        };
        if !made.is_flat {
            uneven.add(1, face);
        }
        for triangle in made.triangles {
            let vertices = triangle.map(|corner| corners[corner]);
            if vertices[0] == vertices[1]
                || vertices[1] == vertices[2]
                || vertices[2] == vertices[0]
            {
                dropped.add(1, face);
            } else if !welding.triangles.insert(sorted(vertices)) {
                doubled.add(1, face);
            } else {
                let face = vertices.map(|vertex| welding.vertex(vertex));
                welding.faces.push(face);
            }
        }
        if welding.faces.len() > MAX_TRIANGLES {
            return Err(MeshError::TooMany {
                triangles: welding.faces.len(),
                max: MAX_TRIANGLES,
            });
        }
    }
    let Welding {
        positions,
        mut faces,
        ..
    } = welding;
    if faces.is_empty() {
        return Err(MeshError::Empty);
    }
    let mut warnings = Vec::new();
    if let Count {
        count: count @ 1..,
        face,
    } = dropped
    {
        warnings.push(MeshWarning::Dropped { count, face });
    }
    if let Count {
        count: count @ 1..,
        face,
    } = flat
    {
        warnings.push(MeshWarning::NoArea { count, face });
    }
    if let Count {
        count: count @ 1..,
        face,
    } = uneven
    {
        warnings.push(MeshWarning::NotFlat { count, face });
    }
    if let Count {
        count: count @ 1..,
        face,
    } = doubled
    {
        warnings.push(MeshWarning::Doubled { count, face });
    }
    let (low, high) = (positions.iter())
        .fold((DVec3::MAX, DVec3::MIN), |(low, high), &position| {
            (low.min(position), high.max(position))
        });
    let size = (high - low).max_element();
    let count = cut_sides(&positions, &mut faces, tolerance.max(ON_SIDE * size));
    if count > 0 {
        warnings.push(MeshWarning::SidesCut { count });
    }
    let distance = SEAM * size;
    let count = near_open_sides(&positions, &faces, distance);
    if count > 0 {
        warnings.push(MeshWarning::Seam { count, distance });
    }
    Ok(Welded {
        positions,
        faces,
        warnings,
    })
}

/// Cuts faces where corners of others lie on their open sides; returns how many corners these are.
fn cut_sides(positions: &[DVec3], faces: &mut Vec<[u32; 3]>, tolerance: f64) -> usize {
    let mut sides: HashMap<usize, [Vec<u32>; 3]> = HashMap::new();
    let mut order = Vec::new();
    for (face, side, corners) in on_open_sides(positions, faces, tolerance) {
        sides.entry(face).or_insert_with(|| {
            order.push(face);
            Default::default()
        })[side] = corners;
    }
    let mut count = 0;
    for face in order {
        let on_sides = &sides[&face];
        let [a, b, c] = faces[face];
        let corners: Vec<u32> = [a]
            .into_iter()
            .chain(on_sides[0].iter().copied())
            .chain([b])
            .chain(on_sides[1].iter().copied())
            .chain([c])
            .chain(on_sides[2].iter().copied())
            .collect();
        let points: Vec<DVec3> = corners
            .iter()
            .map(|&vertex| positions[vertex as usize])
            .collect();
        // If a face is too thin to be divided, it is kept as it is.
        let Ok(made) = cut(&points) else { continue };
        count += corners.len() - 3;
        let mut triangles = made
            .triangles
            .into_iter()
            .map(|triangle| triangle.map(|corner| corners[corner]));
        if let Some(first) = triangles.next() {
            faces[face] = first;
        }
        faces.extend(triangles);
    }
    count
}

fn sorted(mut triangle: [u32; 3]) -> [u32; 3] {
    triangle.sort_unstable();
    triangle
}

/// The same list for the same polygon, whatever its first corner and its direction.
fn canonical(corners: &[u32]) -> Vec<u32> {
    let count = corners.len();
    let from =
        |first: usize, step: usize| (0..count).map(move |k| corners[(first + k * step) % count]);
    let least = corners.iter().min().copied().unwrap_or_default();
    let firsts = (0..count).filter(|&first| corners[first] == least);
    let both = firsts.flat_map(|first| [1, count - 1].map(|step| (first, step)));
    let best = both.min_by(|&(first, step), &(other, other_step)| {
        from(first, step).cmp(from(other, other_step))
    });
    best.map(|(first, step)| from(first, step).collect())
        .unwrap_or_default()
}

/// The vertices, positions and faces that are welded.
struct Welding<'a> {
    input: &'a [DVec3],
    tolerance: f64,
    /// The first vertices in each cell of the size of the tolerance, or at each exact position.
    cells: HashMap<[u64; 3], Vec<u32>>,
    /// For each input vertex, the first one at its position.
    firsts: Vec<u32>,
    /// For each of these, its index among the vertices that triangles use.
    numbers: HashMap<u32, u32>,
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    /// The triangles and polygons that were added, to find duplicates.
    triangles: HashSet<[u32; 3]>,
    polygons: HashSet<Vec<u32>>,
}

const UNKNOWN: u32 = u32::MAX;

impl<'a> Welding<'a> {
    fn new(input: &'a [DVec3], tolerance: f64) -> Self {
        Self {
            input,
            tolerance,
            cells: HashMap::new(),
            firsts: vec![UNKNOWN; input.len()],
            numbers: HashMap::new(),
            positions: Vec::new(),
            faces: Vec::new(),
            triangles: HashSet::new(),
            polygons: HashSet::new(),
        }
    }

    /// The first vertex at the position of this one, or within the tolerance of it.
    fn first_at(&mut self, vertex: u32) -> u32 {
        let known = self.firsts[vertex as usize];
        if known != UNKNOWN {
            return known;
        }
        let position = self.input[vertex as usize];
        // Adding 0 changes -0 to 0.
        let key = |cell: DVec3| (cell + DVec3::ZERO).to_array().map(f64::to_bits);
        let cell = (position / self.tolerance).floor();
        let cell_key = if self.tolerance > 0.0 {
            key(cell)
        } else {
            key(position)
        };
        let mut found = None;
        if self.tolerance > 0.0 {
            for step in 0..27 {
                let step = DVec3::new(
                    f64::from(step % 3 - 1),
                    f64::from(step / 3 % 3 - 1),
                    f64::from(step / 9 - 1),
                );
                let there = self
                    .cells
                    .get(&key(cell + step))
                    .map_or(&[][..], Vec::as_slice);
                let near = there.iter().copied().filter(|&other| {
                    self.input[other as usize].distance(position) <= self.tolerance
                });
                found = found.into_iter().chain(near).min();
            }
        } else {
            found = self
                .cells
                .get(&cell_key)
                .and_then(|there| there.first().copied());
        }
        let first = found.unwrap_or(vertex);
        if found.is_none() {
            self.cells.entry(cell_key).or_default().push(vertex);
        }
        self.firsts[vertex as usize] = first;
        first
    }

    /// The index of a first vertex among those that triangles use.
    fn vertex(&mut self, vertex: u32) -> u32 {
        let position = self.input[vertex as usize];
        *self.numbers.entry(vertex).or_insert_with(|| {
            self.positions.push(position + DVec3::ZERO);
            self.positions.len() as u32 - 1
        })
    }
}
