//! Finds corners that lie on the side of another face, for example where a large face lies beside two small ones. The
//! side is divided there, so that routes can cross it.

use std::ops::Range;

use glam::DVec3;

use crate::mesh::links::{Links, NONE};

/// Corners in a leaf of the tree.
const LEAF: usize = 8;

/// For each open side of a face that has corners on it: `(face, side)`, and these corners from its start to its end.
pub(super) fn on_open_sides(
    positions: &[DVec3],
    faces: &[[u32; 3]],
    tolerance: f64,
) -> Vec<(usize, usize, Vec<u32>)> {
    let open = open_sides(positions.len(), faces);
    let tree = CornerTree::new(positions, corners_of(faces, &open));
    let mut found = Vec::new();
    for (face, side) in open {
        let [from, to] = ends(faces, face, side);
        let [a, b] = [from, to].map(|vertex| positions[vertex as usize]);
        let mut near = Vec::new();
        tree.near(positions, [a, b], tolerance, &mut near);
        let along = b - a;
        let square = along.length_squared();
        let mut on: Vec<(f64, u32)> = near
            .into_iter()
            .filter(|vertex| !faces[face].contains(vertex))
            .map(|vertex| ((positions[vertex as usize] - a).dot(along) / square, vertex))
            .filter(|&(part, vertex)| {
                let point = positions[vertex as usize];
                let foot = a + part * along;
                let is_between = part > 0.0 && part < 1.0;
                let ends = point.distance(a).min(point.distance(b));
                is_between && foot.distance(point) <= tolerance && ends > tolerance
            })
            .collect();
        if !on.is_empty() {
            on.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            found.push((
                face,
                side,
                on.into_iter().map(|(_, vertex)| vertex).collect(),
            ));
        }
    }
    found
}

/// How many corners on open sides lie within `distance` of an open side that they do not belong to.
pub(super) fn near_open_sides(positions: &[DVec3], faces: &[[u32; 3]], distance: f64) -> usize {
    let open = open_sides(positions.len(), faces);
    let tree = CornerTree::new(positions, corners_of(faces, &open));
    let mut all: Vec<u32> = Vec::new();
    for (face, side) in open {
        let both = ends(faces, face, side);
        let [a, b] = both.map(|vertex| positions[vertex as usize]);
        let along = b - a;
        let mut near = Vec::new();
        tree.near(positions, [a, b], distance, &mut near);
        all.extend(near.into_iter().filter(|&vertex| {
            let point = positions[vertex as usize];
            let part = (point - a).dot(along) / along.length_squared();
            let foot = a + part.clamp(0.0, 1.0) * along;
            !faces[face].contains(&vertex) && foot.distance(point) <= distance
        }));
    }
    // Neighbouring vertices of one border are not a seam.
    all.sort_unstable();
    all.dedup();
    all.len()
}

/// The sides of faces that no other face has.
fn open_sides(vertices: usize, faces: &[[u32; 3]]) -> Vec<(usize, usize)> {
    let links = Links::new(vertices, faces);
    let open = links
        .twins()
        .iter()
        .enumerate()
        .filter(|(_, twin)| **twin == NONE);
    open.map(|(half_edge, _)| (half_edge / 3, half_edge % 3))
        .collect()
}

/// The corners at the ends of open sides.
fn corners_of(faces: &[[u32; 3]], open: &[(usize, usize)]) -> Vec<u32> {
    let both = |&(face, side): &(usize, usize)| ends(faces, face, side);
    let mut corners: Vec<u32> = open.iter().flat_map(both).collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

fn ends(faces: &[[u32; 3]], face: usize, side: usize) -> [u32; 2] {
    [faces[face][side], faces[face][(side + 1) % 3]]
}

/// A tree of boxes around halves of the corners.
struct CornerTree {
    corners: Vec<u32>,
    boxes: Vec<(DVec3, DVec3)>,
}

impl CornerTree {
    fn new(positions: &[DVec3], corners: Vec<u32>) -> Self {
        let mut depth = 0;
        while (LEAF << depth) < corners.len() {
            depth += 1;
        }
        let mut tree = Self {
            boxes: vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); (2 << depth) - 1],
            corners,
        };
        let all = 0..tree.corners.len();
        tree.build(positions, 0, all);
        tree
    }

    fn build(&mut self, positions: &[DVec3], node: usize, range: Range<usize>) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &corner in &self.corners[range.clone()] {
            let position = positions[corner as usize];
            (low, high) = (low.min(position), high.max(position));
        }
        self.boxes[node] = (low, high);
        if 2 * node + 1 >= self.boxes.len() {
            return;
        }
        let half = range.len() / 2;
        if half > 0 {
            let axis = (high - low).max_position();
            let at = |corner: u32| positions[corner as usize][axis];
            let order = |a: &u32, b: &u32| at(*a).total_cmp(&at(*b)).then(a.cmp(b));
            self.corners[range.clone()].select_nth_unstable_by(half, order);
        }
        let middle = range.start + half;
        self.build(positions, 2 * node + 1, range.start..middle);
        self.build(positions, 2 * node + 2, middle..range.end);
    }

    /// Adds the corners that may lie within `distance` of the line from `a` to `b`.
    fn near(&self, positions: &[DVec3], line: [DVec3; 2], distance: f64, found: &mut Vec<u32>) {
        let mut waiting = vec![(0, 0..self.corners.len())];
        while let Some((node, range)) = waiting.pop() {
            if range.is_empty() || !self.meets(node, line, distance) {
                continue;
            }
            if 2 * node + 1 >= self.boxes.len() {
                let all = self.corners[range].iter();
                let [a, b] = line;
                let along = (b - a).normalize_or_zero();
                found.extend(all.filter(|&&corner| {
                    let from = positions[corner as usize] - a;
                    from.reject_from_normalized(along).length() <= 2.0 * distance
                }));
                continue;
            }
            let middle = range.start + range.len() / 2;
            waiting.push((2 * node + 1, range.start..middle));
            waiting.push((2 * node + 2, middle..range.end));
        }
    }

    /// Whether the line meets a box that is enlarged by `distance`, by the method of slabs.
    fn meets(&self, node: usize, [a, b]: [DVec3; 2], distance: f64) -> bool {
        let (low, high) = self.boxes[node];
        let (low, high) = (low - distance, high + distance);
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            let (from, step) = (a[axis], b[axis] - a[axis]);
            if step == 0.0 {
                if from < low[axis] || from > high[axis] {
                    return false;
                }
                continue;
            }
            let (one, other) = ((low[axis] - from) / step, (high[axis] - from) / step);
            enter = enter.max(one.min(other));
            leave = leave.min(one.max(other));
        }
        enter <= leave
    }
}
