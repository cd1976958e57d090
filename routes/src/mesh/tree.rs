//! Finds the nearest triangle by a tree of boxes.

use glam::DVec3;

use crate::mesh::surface::Surface;
use crate::triangle::{blend, nearest_weights};

/// Number of triangles in a leaf.
const LEAF: usize = 4;

/// A tree of bounding boxes; each node has half of the triangles of its parent.
#[derive(Debug, Clone)]
pub(crate) struct FaceTree {
    /// A complete binary tree: the halves of box `i` are `2i + 1` and `2i + 2`.
    boxes: Vec<(DVec3, DVec3)>,
    /// The faces in the order of the leaves.
    order: Vec<u32>,
}

/// The point of a surface that is nearest to another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) face: usize,
    pub(crate) weights: [f64; 3],
    pub(crate) point: DVec3,
    pub(crate) distance: f64,
}

impl FaceTree {
    pub(crate) fn new(surface: &Surface) -> Self {
        let count = surface.faces.len();
        let mut tree = Self {
            boxes: Vec::new(),
            order: (0..count as u32).collect(),
        };
        let mut depth = 0;
        while (LEAF << depth) < count {
            depth += 1;
        }
        tree.boxes = vec![(DVec3::ZERO, DVec3::ZERO); (2 << depth) - 1];
        let mut order = std::mem::take(&mut tree.order);
        tree.build(surface, 0, &mut order);
        tree.order = order;
        tree
    }

    fn build(&mut self, surface: &Surface, index: usize, faces: &mut [u32]) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in faces
            .iter()
            .flat_map(|&face| surface.triangle(face as usize))
        {
            (low, high) = (low.min(corner), high.max(corner));
        }
        self.boxes[index] = (low, high);
        if 2 * index + 1 >= self.boxes.len() {
            return;
        }
        let axis = (high - low).max_position();
        let middle = |face: &u32| -> f64 {
            let [a, b, c] = surface.triangle(*face as usize);
            a[axis] + b[axis] + c[axis]
        };
        let half = faces.len() / 2;
        if half > 0 {
            faces.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        }
        let (one, other) = faces.split_at_mut(half);
        self.build(surface, 2 * index + 1, one);
        self.build(surface, 2 * index + 2, other);
    }

    /// The largest extent of all along an axis.
    pub(crate) fn extent(&self) -> f64 {
        let (low, high) = self.boxes[0];
        (high - low).max_element()
    }

    /// The nearest point of the surface of which the tree was made; of several at the same distance, that of the face
    /// with the lowest index.
    pub(crate) fn nearest(&self, surface: &Surface, point: DVec3) -> Nearest {
        let mut best = Nearest {
            face: usize::MAX,
            weights: [0.0; 3],
            point,
            distance: f64::INFINITY,
        };
        self.search(surface, point, (0, 0, self.order.len()), &mut best);
        best
    }

    fn search(
        &self,
        surface: &Surface,
        point: DVec3,
        (index, start, end): (usize, usize, usize),
        best: &mut Nearest,
    ) {
        if self.distance(index, point) > best.distance {
            return;
        }
        let middle = start + (end - start) / 2;
        let halves = [(2 * index + 1, start, middle), (2 * index + 2, middle, end)];
        if halves[0].0 < self.boxes.len() {
            let swap = self.distance(halves[1].0, point) < self.distance(halves[0].0, point);
            self.search(surface, point, halves[usize::from(swap)], best);
            self.search(surface, point, halves[usize::from(!swap)], best);
            return;
        }
        for &face in &self.order[start..end] {
            let candidate = nearest_on(surface, face as usize, point);
            if (candidate.distance, candidate.face) < (best.distance, best.face) {
                *best = candidate;
            }
        }
    }

    fn distance(&self, index: usize, point: DVec3) -> f64 {
        let (low, high) = self.boxes[index];
        (low - point).max(point - high).max(DVec3::ZERO).length()
    }
}

/// The nearest point of one face.
pub(crate) fn nearest_on(surface: &Surface, face: usize, point: DVec3) -> Nearest {
    let corners = surface.triangle(face);
    let weights = nearest_weights(point, corners);
    let found = blend(weights, corners);
    Nearest {
        face,
        weights,
        point: found,
        distance: found.distance(point),
    }
}
