//! Meshes whose shortest routes are known.

use glam::{DVec3, dvec3};
use tumble_formats::surface::Polygons;
use tumble_routes::error::MeshError;
use tumble_routes::mesh::Mesh;

pub(crate) fn of(positions: &[DVec3], polygons: &[&[u32]]) -> Mesh {
    Mesh::of_polygons(positions, polygons.iter().copied()).unwrap()
}

/// A box from the origin to `size`.
pub(crate) fn cuboid(size: DVec3) -> Mesh {
    let corner = |i: u32| dvec3(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * size;
    let corners: Vec<DVec3> = (0..8).map(corner).collect();
    of(
        &corners,
        &[
            &[0, 2, 3, 1],
            &[0, 1, 5, 4],
            &[0, 4, 6, 2],
            &[7, 6, 4, 5],
            &[7, 5, 1, 3],
            &[7, 3, 2, 6],
        ],
    )
}

/// Two triangles for each square, by their lower left corners; the diagonals run from there to
/// (x+1, y+1).
pub(crate) fn squares(corners: impl IntoIterator<Item = (i32, i32)>) -> Mesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for (x, y) in corners {
        let first = positions.len() as u32;
        for (dx, dy) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
            positions.push(dvec3(f64::from(x + dx), f64::from(y + dy), 0.0));
        }
        triangles.extend([[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(|k: u32| first + k)));
    }
    Mesh::new(&positions, &triangles).unwrap()
}

/// `width` × `width` vertices above the integers, with diagonals from (x, y) to (x+1, y+1).
pub(crate) fn heights(width: u32, height: impl Fn(u32, u32) -> f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let all = (0..width).flat_map(|y| (0..width).map(move |x| (x, y)));
    let position = |(x, y)| dvec3(f64::from(x), f64::from(y), height(x, y));
    let positions = all.clone().map(position).collect();
    let inner = all.filter(|&(x, y)| x + 1 < width && y + 1 < width);
    let cut = |(x, y): (u32, u32)| {
        let at = |dx, dy| (y + dy) * width + x + dx;
        [
            [at(0, 0), at(1, 0), at(1, 1)],
            [at(0, 0), at(1, 1), at(0, 1)],
        ]
    };
    (positions, inner.flat_map(cut).collect())
}

/// The height of the terrain at a vertex.
pub(crate) fn terrain_height(x: u32, y: u32) -> f64 {
    f64::from((7 * x * x + 13 * y * y + 5 * x * y + 3 * x) % 17) / 8.0
}

/// 10 × 10 vertices, rough.
pub(crate) fn terrain() -> Mesh {
    let (positions, triangles) = heights(10, terrain_height);
    Mesh::new(&positions, &triangles).unwrap()
}

/// A vertex of the terrain.
pub(crate) fn on_terrain(x: u32, y: u32) -> DVec3 {
    dvec3(f64::from(x), f64::from(y), terrain_height(x, y))
}

/// The corners and faces of a polyhedron whose edges are 1: all triples of corners at distance 1.
pub(crate) fn deltahedron(corners: &[DVec3]) -> Mesh {
    let is_edge = |a: usize, b: usize| (corners[a].distance(corners[b]) - 1.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for a in 0..corners.len() {
        for b in a + 1..corners.len() {
            for c in b + 1..corners.len() {
                if is_edge(a, b) && is_edge(b, c) && is_edge(c, a) {
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    Mesh::new(corners, &triangles).unwrap()
}

/// The mesh of a file, with positions within a distance of each other welded.
pub(crate) fn welded(polygons: &Polygons, distance: f64) -> Result<Mesh, MeshError> {
    Mesh::welded(&polygons.positions, polygons.iter(), distance)
}
