//! Cuts polygons into triangles that stay within the polygon and use all corners, also those in the middle of a side.

use glam::{DVec2, DVec3};

/// A polygon is not flat when a corner is farther from its plane than this fraction of its size.
const UNEVEN: f64 = 1e-6;
/// A corner counts as bent when the triangle at it is higher than this fraction of its longest edge.
const STRAIGHT: f64 = 1e-12;
/// The most corners of a polygon that is not convex: the search for ears is quadratic.
pub(super) const MAX_CORNERS: usize = 10_000;

/// The triangles into which a polygon was cut, by the indices of its corners.
pub(super) struct Triangulation {
    pub(super) triangles: Vec<[usize; 3]>,
    pub(super) is_flat: bool,
}

/// Why a polygon cannot be cut.
pub(super) enum Uncut {
    /// All corners lie on a line.
    Flat,
    /// Its sides cross each other.
    Crosses,
    /// It has more than [`MAX_CORNERS`].
    TooMany,
}

/// Cuts the polygon in its plane. A convex polygon is cut from its first corner. From other polygons ears are cut
/// off: triangles at three consecutive corners that no other corner touches.
pub(super) fn cut(corners: &[DVec3]) -> Result<Triangulation, Uncut> {
    let count = corners.len();
    let at = |corner: usize| corners[corner % count] - corners[0];
    // Newell's normal.
    let normal: DVec3 = (0..count).map(|i| at(i).cross(at(i + 1))).sum();
    let size = (0..count).map(|i| at(i).length()).fold(0.0, f64::max);
    // If corners are too far apart for f64, the normal is NaN.
    if normal.length() <= STRAIGHT * size * size || normal.is_nan() {
        return Err(if is_on_a_line(corners) {
            Uncut::Flat
        } else {
            Uncut::Crosses
        });
    }
    let normal = normal.normalize();
    let is_flat = (0..count).all(|i| at(i).dot(normal).abs() <= UNEVEN * size);
    let (x, y) = normal.any_orthonormal_pair();
    // Right-handed in the plane, so that the polygon goes round to the left.
    let y = if x.cross(y).dot(normal) < 0.0 { -y } else { y };
    let flat: Vec<DVec2> = (0..count)
        .map(|i| DVec2::new(at(i).dot(x), at(i).dot(y)))
        .collect();
    let triangles = match is_convex(&flat) {
        true => (1..count - 1).map(|i| [0, i, i + 1]).collect(),
        false if count > MAX_CORNERS => return Err(Uncut::TooMany),
        false => ears(&flat).ok_or(Uncut::Crosses)?,
    };
    Ok(Triangulation { triangles, is_flat })
}

/// Whether three corners have no area.
fn is_flat_triangle([a, b, c]: [DVec3; 3]) -> bool {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    (b - a).cross(c - a).length() <= STRAIGHT * longest * longest
}

fn is_on_a_line(corners: &[DVec3]) -> bool {
    let farthest = |from: DVec3| {
        let longer = |a: &&DVec3, b: &&DVec3| a.distance(from).total_cmp(&b.distance(from));
        corners.iter().copied().max_by(|a, b| longer(&a, &b))
    };
    let Some(one) = farthest(corners[0]) else {
        return true;
    };
    let other = farthest(one).unwrap_or(one);
    corners
        .iter()
        .all(|&corner| is_flat_triangle([one, other, corner]))
}

/// The orientation of three points: 1 if they turn to the left at `b`, -1 to the right, 0 on a line.
fn orientation(a: DVec2, b: DVec2, c: DVec2) -> i32 {
    let area = (b - a).perp_dot(c - a);
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    match area.abs() <= STRAIGHT * longest * longest {
        true => 0,
        false if area > 0.0 => 1,
        false => -1,
    }
}

/// Whether every corner turns to the left, once round in all.
fn is_convex(flat: &[DVec2]) -> bool {
    let count = flat.len();
    let at = |corner: usize| flat[corner % count];
    let is_left_everywhere = (0..count).all(|i| orientation(at(i), at(i + 1), at(i + 2)) > 0);
    // A star-shaped polygon also turns left everywhere, but goes around more than once.
    is_left_everywhere && (1..count - 1).all(|i| orientation(at(0), at(i), at(i + 1)) > 0)
}

/// The ears of a polygon that winds to the left, until no corner is left.
fn ears(flat: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    let mut from = 0;
    while left.len() > 3 {
        let count = left.len();
        let around = |i: usize| [count - 1, 0, 1].map(|step| left[(i + step) % count]);
        // Corners that can lie within an ear: those that do not turn to the left.
        let blunt: Vec<usize> = (0..count)
            .filter(|&i| {
                let [a, b, c] = around(i).map(|corner| flat[corner]);
                orientation(a, b, c) <= 0
            })
            .map(|i| left[i])
            .collect();
        let is_ear = |&i: &usize| {
            let corners = around(i);
            let [a, b, c] = corners.map(|corner| flat[corner]);
            let touches = |&other: &usize| {
                let p = flat[other];
                !corners.contains(&other)
                    && p != a
                    && p != b
                    && p != c
                    && orientation(a, b, p) >= 0
                    && orientation(b, c, p) >= 0
                    && orientation(c, a, p) >= 0
            };
            orientation(a, b, c) > 0 && !blunt.iter().any(touches)
        };
        let ear = (from..count).chain(0..from).find(is_ear)?;
        triangles.push(around(ear));
        left.remove(ear);
        // Look for the next ear on the other side of the cut, so that no fan of thin triangles arises.
        from = (ear + 1) % left.len();
    }
    let last = [left[0], left[1], left[2]];
    let [a, b, c] = last.map(|corner| flat[corner]);
    (orientation(a, b, c) > 0).then(|| {
        triangles.push(last);
        triangles
    })
}
