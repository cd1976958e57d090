//! Adjacency of triangles: the other side of each edge, and the corners at each vertex.

/// No half-edge: the edge is on the boundary.
pub(crate) const NONE: u32 = u32::MAX;
/// More than one half-edge: the edge has three or more faces.
pub(crate) const MANY: u32 = u32::MAX - 1;

/// The adjacency of the triangles of a mesh.
///
/// A *half-edge* `3f + k` is from corner `k` of face `f` to the next corner; the opposite corner is `k + 2` modulo 3.
/// The same number is that of corner `k` of face `f`.
#[derive(Debug, Clone)]
pub(crate) struct Links {
    /// For each half-edge, the one of the other face at the same edge, [`NONE`] or [`MANY`].
    twins: Vec<u32>,
    /// For each vertex, the index of its first corner in `corners`; one more entry than vertices.
    starts: Vec<u32>,
    /// The corners, vertex by vertex.
    corners: Vec<u32>,
}

/// The corner after `corner` in its face.
pub(crate) fn next(corner: u32) -> u32 {
    if corner % 3 == 2 {
        corner - 2
    } else {
        corner + 1
    }
}

/// The corner before `corner` in its face.
pub(crate) fn previous(corner: u32) -> u32 {
    if corner.is_multiple_of(3) {
        corner + 2
    } else {
        corner - 1
    }
}

/// The vertex at a corner.
pub(crate) fn at(faces: &[[u32; 3]], corner: u32) -> u32 {
    faces[(corner / 3) as usize][(corner % 3) as usize]
}

/// For each half-edge, the one on the other side. Half-edges are sorted by their ends, so that an edge of thousands
/// of faces takes as long as thousands of edges.
fn twins(faces: &[[u32; 3]]) -> Vec<u32> {
    let ends = |half_edge: u32| {
        let (a, b) = (at(faces, half_edge), at(faces, next(half_edge)));
        (a.min(b), a.max(b))
    };
    let mut sorted: Vec<u32> = (0..3 * faces.len() as u32).collect();
    sorted.sort_unstable_by_key(|&half_edge| ends(half_edge));
    let mut twins = vec![NONE; sorted.len()];
    for edge in sorted.chunk_by(|&a, &b| ends(a) == ends(b)) {
        match *edge {
            [_] => {}
            [a, b] => (twins[a as usize], twins[b as usize]) = (b, a),
            _ => edge.iter().for_each(|&one| twins[one as usize] = MANY),
        }
    }
    twins
}

impl Links {
    pub(crate) fn new(vertices: usize, faces: &[[u32; 3]]) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        for &vertex in faces.as_flattened() {
            starts[vertex as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        let mut ends = starts.clone();
        let mut corners = vec![0; 3 * faces.len()];
        for (corner, &vertex) in (0u32..).zip(faces.as_flattened()) {
            let end = &mut ends[vertex as usize];
            corners[*end as usize] = corner;
            *end += 1;
        }
        let mut links = Self {
            twins: Vec::new(),
            starts,
            corners,
        };
        links.twins = twins(faces);
        links
    }

    /// The half-edges of all faces at the edge of this one, including itself. They are searched at the end of the
    /// edge with fewer corners, so that the centre of a fan costs nothing.
    pub(crate) fn on_edge<'a>(
        &'a self,
        faces: &'a [[u32; 3]],
        half_edge: u32,
    ) -> impl Iterator<Item = u32> + 'a {
        let (mut pivot, mut other) = (at(faces, half_edge), at(faces, next(half_edge)));
        if self.corners(pivot).len() > self.corners(other).len() {
            (pivot, other) = (other, pivot);
        }
        self.corners(pivot).iter().filter_map(move |&corner| {
            if at(faces, next(corner)) == other {
                Some(corner)
            } else {
                let before = previous(corner);
                (at(faces, before) == other).then_some(before)
            }
        })
    }

    pub(crate) fn twin(&self, half_edge: u32) -> u32 {
        self.twins[half_edge as usize]
    }

    pub(crate) fn twins(&self) -> &[u32] {
        &self.twins
    }

    /// The corners at a vertex.
    pub(crate) fn corners(&self, vertex: u32) -> &[u32] {
        let vertex = vertex as usize;
        &self.corners[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }

    /// The vertices that share an edge with this one; those at inner edges occur twice.
    pub(crate) fn neighbours<'a>(
        &'a self,
        faces: &'a [[u32; 3]],
        vertex: u32,
    ) -> impl Iterator<Item = u32> + 'a {
        let both = |&corner: &u32| [at(faces, next(corner)), at(faces, previous(corner))];
        self.corners(vertex).iter().flat_map(both)
    }
}
