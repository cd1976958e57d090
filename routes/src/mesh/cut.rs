//! Polygons are cut into triangles that use all their corners, also those in the middle of a side, and
//! that stay within the polygon.

use glam::{DVec2, DVec3};

/// A polygon is not flat when a corner is farther from its plane than this fraction of its size.
const UNEVEN: f64 = 1e-6;
/// A corner turns when the triangle at it is higher than this fraction of its longest edge.
const STRAIGHT: f64 = 1e-12;
/// The most corners of a polygon that is not convex: the search for ears is quadratic.
pub(super) const MOST_CORNERS: usize = 10_000;

/// What a polygon was cut into: triangles of its corners, by their places.
pub(super) struct Cut {
    pub(super) triangles: Vec<[usize; 3]>,
    pub(super) is_flat: bool,
}

/// Why a polygon cannot be cut.
pub(super) enum Uncut {
    /// All corners lie on a line.
    Flat,
    /// Its sides cross each other.
    Crosses,
    /// It has more than [`MOST_CORNERS`].
    TooMany,
}

/// Cuts the polygon in its plane. A convex one is cut from its first corner on; of another, ears are cut
/// off: triangles between neighbouring corners that no other corner touches.
pub(super) fn cut(corners: &[DVec3]) -> Result<Cut, Uncut> {
    let count = corners.len();
    let at = |corner: usize| corners[corner % count] - corners[0];
    // Newell's normal.
    let normal: DVec3 = (0..count).map(|i| at(i).cross(at(i + 1))).sum();
    let size = (0..count).map(|i| at(i).length()).fold(0.0, f64::max);
    // Of corners too far apart for f64 the normal is no number.
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
        false if count > MOST_CORNERS => return Err(Uncut::TooMany),
        false => ears(&flat).ok_or(Uncut::Crosses)?,
    };
    Ok(Cut { triangles, is_flat })
}

/// Whether three corners have no area.
fn is_flat_triangle([a, b, c]: [DVec3; 3]) -> bool {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    (b - a).cross(c - a).length() <= STRAIGHT * longest * longest
}

fn is_on_a_line(corners: &[DVec3]) -> bool {
    let far = |from: DVec3| {
        let longer = |a: &&DVec3, b: &&DVec3| a.distance(from).total_cmp(&b.distance(from));
        corners.iter().copied().max_by(|a, b| longer(&a, &b))
    };
    let Some(one) = far(corners[0]) else {
        return true;
    };
    let other = far(one).unwrap_or(one);
    corners
        .iter()
        .all(|&corner| is_flat_triangle([one, other, corner]))
}

/// How far the way turns at `b`: 1 to the left, -1 to the right, 0 not at all.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> i32 {
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
    let turns = (0..count).all(|i| turn(at(i), at(i + 1), at(i + 2)) > 0);
    // A star turns to the left everywhere too, more than once round.
    turns && (1..count - 1).all(|i| turn(at(0), at(i), at(i + 1)) > 0)
}

/// The ears of a polygon that goes round to the left, until nothing is left of it.
fn ears(flat: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    let mut from = 0;
    while left.len() > 3 {
        let count = left.len();
        let around = |place: usize| [count - 1, 0, 1].map(|step| left[(place + step) % count]);
        // Corners that can lie within an ear: those that do not turn to the left.
        let blunt: Vec<usize> = (0..count)
            .filter(|&place| {
                let [a, b, c] = around(place).map(|corner| flat[corner]);
                turn(a, b, c) <= 0
            })
            .map(|place| left[place])
            .collect();
        let is_ear = |&place: &usize| {
            let corners = around(place);
            let [a, b, c] = corners.map(|corner| flat[corner]);
            let touches = |&other: &usize| {
                let p = flat[other];
                !corners.contains(&other)
                    && p != a
                    && p != b
                    && p != c
                    && turn(a, b, p) >= 0
                    && turn(b, c, p) >= 0
                    && turn(c, a, p) >= 0
            };
            turn(a, b, c) > 0 && !blunt.iter().any(touches)
        };
        let place = (from..count).chain(0..from).find(is_ear)?;
        triangles.push(around(place));
        left.remove(place);
        // The next ear is looked for at the other side of the cut, so that no fan of slivers arises.
        from = (place + 1) % left.len();
    }
    let last = [left[0], left[1], left[2]];
    let [a, b, c] = last.map(|corner| flat[corner]);
    (turn(a, b, c) > 0).then(|| {
        triangles.push(last);
        triangles
    })
}
