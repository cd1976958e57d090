//! A hill with rocks on it, to find routes over.

use std::io::{self, Write};

use fastrand::Rng;
use glam::{DVec2, DVec3};

/// The hill covers the square from 0 to this along x and z.
pub(super) const SIZE: f64 = 10.0;
/// Squares of two triangles along a side.
const SQUARES: usize = 60;
/// Heights of the large bump and of the small ones.
const HEIGHT: f64 = 2.2;
const BUMPS: usize = 14;
/// Rocks, and their distance from each other and from the two corners that routes join.
const ROCKS: usize = 16;
const APART: f64 = 0.9;
const FREE: f64 = 1.8;
/// The number of random places that are tried for rocks.
const TRIES: usize = 2000;

/// Round bumps: the middle, the radius, and the height.
pub(super) struct Landscape {
    bumps: Vec<(DVec2, f64, f64)>,
    rocks: Vec<(DVec2, f64)>,
    seed: u64,
}

/// Positions, and triangles of their indices from 0.
type TriangleMesh = (Vec<DVec3>, Vec<[usize; 3]>);

fn within(random: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.f64()
}

impl Landscape {
    /// The landscape of a seed: the height is 0 at the rim of the square.
    pub(super) fn new(seed: u64) -> Self {
        let mut random = Rng::with_seed(seed);
        let mut bumps = vec![(DVec2::splat(SIZE / 2.0), SIZE / 2.0, HEIGHT)];
        for _ in 0..BUMPS {
            let radius = within(&mut random, 1.0, 2.4);
            let mut coordinate = || within(&mut random, radius, SIZE - radius);
            let middle = DVec2::new(coordinate(), coordinate());
            bumps.push((middle, radius, within(&mut random, -0.35, 0.45)));
        }
        let mut rocks: Vec<(DVec2, f64)> = Vec::new();
        for _ in 0..TRIES {
            if rocks.len() == ROCKS {
                break;
            }
            let radius = within(&mut random, 0.35, 0.75);
            let mut coordinate = || within(&mut random, 0.9, SIZE - 0.9);
            let middle = DVec2::new(coordinate(), coordinate());
            let clear = |&(other, other_radius): &(DVec2, f64)| {
                middle.distance(other) > radius + other_radius + APART
            };
            let ends = [DVec2::ZERO, DVec2::splat(SIZE)];
            if rocks.iter().all(clear) && ends.iter().all(|end| middle.distance(*end) > FREE) {
                rocks.push((middle, radius));
            }
        }
        Self { bumps, rocks, seed }
    }

    /// The height of the ground, by polynomials only, so that it is the same on every machine.
    fn height(&self, at: DVec2) -> f64 {
        let bump = |&(middle, radius, height): &(DVec2, f64, f64)| {
            let near = (1.0 - at.distance_squared(middle) / (radius * radius)).max(0.0);
            height * (near * near * near)
        };
        self.bumps.iter().map(bump).sum()
    }

    fn hill(&self) -> TriangleMesh {
        let at = |i: usize| i as f64 * SIZE / SQUARES as f64;
        let rows = 0..=SQUARES;
        let positions = rows.clone().flat_map(|row| {
            rows.clone().map(move |column| {
                let flat = DVec2::new(at(column), at(row));
                DVec3::new(flat.x, self.height(flat), flat.y)
            })
        });
        let squares = (0..SQUARES).flat_map(|row| (0..SQUARES).map(move |column| (row, column)));
        let triangles = squares.flat_map(|(row, column)| {
            let a = row * (SQUARES + 1) + column;
            let (b, c, d) = (a + 1, a + SQUARES + 1, a + SQUARES + 2);
            [[a, c, d], [a, d, b]]
        });
        (positions.collect(), triangles.collect())
    }

    /// Dented balls, a part of each in the ground.
    fn rocks(&self) -> TriangleMesh {
        let mut random = Rng::with_seed(self.seed ^ 1);
        let (ball, faces) = ball();
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for &(middle, radius) in &self.rocks {
            let first = positions.len();
            let foot = DVec3::new(middle.x, self.height(middle) + radius * 0.25, middle.y);
            let shape = DVec3::new(1.0, within(&mut random, 0.7, 1.0), 1.0);
            for &direction in &ball {
                let dent = within(&mut random, 0.82, 1.0);
                positions.push(foot + direction * shape * dent * radius);
            }
            triangles.extend(faces.iter().map(|face| face.map(|corner| first + corner)));
        }
        (positions, triangles)
    }

    pub(super) fn write_hill(&self, out: &mut impl Write) -> io::Result<()> {
        write(&self.hill(), out)
    }

    pub(super) fn write_rocks(&self, out: &mut impl Write) -> io::Result<()> {
        write(&self.rocks(), out)
    }
}

/// An octahedron whose edges are halved twice, on the unit sphere.
fn ball() -> TriangleMesh {
    let [x, y, z] = DVec3::AXES;
    let mut positions = vec![x, y, z, -x, -y, -z];
    let mut faces = Vec::new();
    for (a, b, c) in [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2)] {
        // Each triangle with the corner z, and its mirror image with the corner -z.
        faces.extend([[a, b, c], [b, a, c + 3]]);
    }
    for _ in 0..2 {
        let mut halved = Vec::new();
        for [a, b, c] in faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(one, other)| {
                let middle = (positions[one] + positions[other]).normalize();
                let known = positions
                    .iter()
                    .position(|position| position.abs_diff_eq(middle, 1e-9));
                known.unwrap_or_else(|| {
                    positions.push(middle);
                    positions.len() - 1
                })
            });
            halved.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = halved;
    }
    (positions, faces)
}

/// Writes a mesh as OBJ, in which indices of vertices begin at 1.
fn write((positions, triangles): &TriangleMesh, out: &mut impl Write) -> io::Result<()> {
    for position in positions {
        writeln!(
            out,
            "v {:.6} {:.6} {:.6}",
            position.x, position.y, position.z
        )?;
    }
    for [a, b, c] in triangles {
        writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The six volumes that a closed mesh has with the origin add up to its own: outwards is positive.
    fn volume((positions, triangles): &TriangleMesh) -> f64 {
        let tetrahedron =
            |&[a, b, c]: &[usize; 3]| positions[a].dot(positions[b].cross(positions[c])) / 6.0;
        triangles.iter().map(tetrahedron).sum()
    }

    #[test]
    fn a_ball_is_closed_and_faces_outwards() {
        let (positions, faces) = ball();
        assert_eq!((positions.len(), faces.len()), (66, 128));
        let found = volume(&(positions, faces));
        assert!((3.8..4.19).contains(&found), "{found}");
    }

    #[test]
    fn the_rim_is_level_and_rocks_stand_apart() {
        for seed in 0..20 {
            let landscape = Landscape::new(seed);
            let (positions, triangles) = landscape.hill();
            let rim = |coordinate: f64| coordinate == 0.0 || (coordinate - SIZE).abs() < 1e-9;
            let level = positions.iter().filter(|at| rim(at.x) || rim(at.z));
            assert!(level.clone().count() == 4 * SQUARES && level.clone().all(|at| at.y == 0.0));
            assert!(positions.iter().any(|at| at.y > 1.5));
            let up = |&[a, b, c]: &[usize; 3]| {
                let (a, b, c) = (positions[a], positions[b], positions[c]);
                (b - a).cross(c - a).y > 0.0
            };
            assert!(triangles.iter().all(up));
            assert!(
                landscape.rocks.len() > 8,
                "{seed}: {}",
                landscape.rocks.len()
            );
            assert!(volume(&landscape.rocks()) > 0.0);
            for (index, (middle, radius)) in landscape.rocks.iter().enumerate() {
                for (other, other_radius) in &landscape.rocks[..index] {
                    assert!(middle.distance(*other) > radius + other_radius + APART);
                }
            }
        }
    }
}
