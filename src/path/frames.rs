//! The rotations of a body along its path.

use std::ops::Range;

use glam::{DQuat, DVec3, Vec3};

use crate::path::carry::{Piece, Uncarried, about_z, around_corner, least_turn};
use crate::path::lanes;
use crate::path::options::{Follow, Frame, Twist};
use crate::path::polynomial::Polynomial;
use crate::path::rolls::{Rolls, unwrapped, wrapped};
use crate::path::route::{Heading, Route, Stretch, signed};

/// What gives the rotations of a stretch.
enum Turn {
    /// A carried frame with the places of its pieces, and that of the rolls added to it.
    Carried(Range<usize>, usize),
    /// The x axis is this polynomial's direction. Within the given distance of the upward direction
    /// it has none, and the axis before is kept.
    Fixed(Option<Polynomial>, DVec3),
    /// The x axis is this polynomial's direction: `P' × P''`, its zeros divided out.
    Frenet(Polynomial),
}

/// The rotations along a path.
pub(crate) struct Frames {
    pub(crate) route: Route,
    pub(crate) stretches: Vec<Stretch>,
    turns: Vec<Turn>,
    /// The pieces of all carried frames.
    pieces: Vec<Piece>,
    rolls: Vec<Rolls>,
    /// The largest angle by which a minimal frame was off, where its roll is given.
    pub(crate) left_over: f64,
    up: DVec3,
    body: DQuat,
}

/// The path bows less than this many steps of f32 where it counts as straight: the keys' rounding
/// alone would give it a normal.
const STRAIGHT: f64 = 4.0 * f32::EPSILON as f64;

/// The sine of the angle to the upward direction below which a fixed frame keeps its x axis.
const UPRIGHT: f64 = 1e-6;

/// `P' × P''` below this part of its largest coefficient vanishes: about the rounding of f32 keys.
const INFLECTED: f64 = 1e-7;

impl Frames {
    /// A body on a path that is cut into these stretches.
    pub(crate) fn new(route: Route, stretches: Vec<Stretch>, follow: &Follow) -> Self {
        Self {
            route,
            turns: Vec::with_capacity(stretches.len()),
            stretches,
            pieces: Vec::new(),
            rolls: Vec::new(),
            left_over: 0.0,
            up: follow.up.normalize(),
            body: follow.body(),
        }
    }

    /// Finds the rotations on a path that has upward directions at some keys. If the frame is minimal,
    /// its stretches are those from `first` on of `uncarried`.
    pub(crate) fn turn(
        &mut self,
        follow: &Follow,
        ups: &[Option<Vec3>],
        uncarried: &Uncarried,
        first: usize,
    ) {
        match follow.frame {
            _ if self.stretches.is_empty() => {}
            Frame::Fixed => self.fix(),
            Frame::Minimal => self.carry_all(follow, ups, uncarried, first),
            Frame::Frenet => self.frenet(),
        }
    }

    /// The pieces of a stretch with a carried frame, and the rolls added to them.
    pub(crate) fn carried(&self, stretch: usize) -> Option<(&[Piece], &Rolls)> {
        match &self.turns[stretch] {
            Turn::Carried(pieces, rolls) => {
                Some((&self.pieces[pieces.clone()], &self.rolls[*rolls]))
            }
            _ => None,
        }
    }

    /// What the x axis is to be near to at a place of a stretch whose frame is not carried, with the
    /// direction there.
    pub(crate) fn side(&self, stretch: usize, t: f64, way: DVec3) -> DVec3 {
        let own = &self.stretches[stretch];
        match &self.turns[stretch] {
            Turn::Fixed(x, kept) => {
                let is_upright = self.up.cross(way).length() < UPRIGHT;
                let near_start = t - own.from < own.to - t || x.is_none();
                match x {
                    _ if is_upright && near_start => *kept,
                    Some(x) => x.at(t),
                    None => self.up.cross(way),
                }
            }
            Turn::Frenet(x) => x.at(t),
            Turn::Carried(..) => DVec3::ZERO,
        }
    }

    /// The rotation of the body with such a side.
    pub(crate) fn rotation(&self, side: DVec3, way: DVec3) -> DQuat {
        of_axes(side, way) * self.body
    }

    /// Makes the y axis as near to the upward direction as it can be.
    fn fix(&mut self) {
        let up = self.up;
        let mut kept = DVec3::ZERO;
        let mut cut = Vec::with_capacity(self.stretches.len());
        for own in std::mem::take(&mut self.stretches) {
            let mut places = vec![own.from, own.to];
            let side = match &own.heading {
                Heading::Polynomial(way) => {
                    let side = way.map(|c| up.cross(c));
                    let tolerance = UPRIGHT * way.size();
                    (side.size() > tolerance).then(|| side.without_zeros(tolerance))
                }
                _ => None,
            };
            if let Some((zeros, _)) = &side {
                let within = |&&zero: &&f64| zero > own.from && zero < own.to;
                places.extend(zeros.iter().filter(within));
            }
            places.sort_by(f64::total_cmp);
            places.dedup();
            for pair in places.windows(2) {
                let (from, to) = (pair[0], pair[1]);
                let part = Stretch {
                    from,
                    to,
                    ..own.clone()
                };
                if kept == DVec3::ZERO {
                    kept = first_side(up, part.way(&self.route, from)[0]);
                }
                let x = side.as_ref().map(|own| signed(own, 0.5 * (from + to)));
                let end = part.way(&self.route, to)[0];
                self.turns.push(Turn::Fixed(x, kept));
                kept = match (x, up.cross(end)) {
                    (Some(x), _) => across(x.at(to), end),
                    (None, side) if side.length() < UPRIGHT => across(kept, end),
                    (None, side) => side.normalize(),
                };
                cut.push(part);
            }
        }
        self.stretches = cut;
    }

    /// Carries a frame along the whole path, and spreads what given upward directions and the end of
    /// a closed path leave over.
    fn carry_all(
        &mut self,
        follow: &Follow,
        ups: &[Option<Vec3>],
        uncarried: &Uncarried,
        first_stretch: usize,
    ) {
        let given = |key: usize| ups.get(key).copied().flatten().map(Vec3::as_dvec3);
        let [start, _] = uncarried.ends(first_stretch);
        let first = first_rotation(given(0).unwrap_or(self.up), start);
        self.pieces.reserve(self.stretches.len());
        let mut points = vec![(0.0, 0.0)];
        let mut most = 0.0f64;
        let mut give = |length: f64, own: DQuat, wanted: DQuat| {
            let near = points[points.len() - 1].1;
            let angle = unwrapped(about_forward(own, wanted), near);
            most = most.max(wrapped(angle - near).abs());
            points.push((length, angle));
        };
        let mut at_end = first;
        let mut arriving = start;
        let mut before = 0;
        for stretch in 0..self.stretches.len() {
            let [way, end] = uncarried.ends(first_stretch + stretch);
            if stretch > 0 {
                at_end = around_corner(at_end, arriving, way);
            }
            let interval = self.stretches[stretch].interval;
            if interval > before
                && let Some(up) = given(interval)
            {
                let length = self.route.lengths.of(interval)[0];
                give(length, at_end, first_rotation(up, way));
            }
            at_end = self.carry_one(at_end, uncarried, first_stretch + stretch);
            (arriving, before) = (end, interval);
        }
        let total = self.route.lengths.total();
        if let Some(up) = given(self.route.curves.len()) {
            give(total, at_end, first_rotation(up, arriving));
        }
        if follow.is_closed() && follow.twist == Twist::Spread {
            let arrived = around_corner(at_end, arriving, start);
            give(total, arrived, first);
        }
        self.rolls.push(Rolls::through(&points));
        self.left_over = most;
    }

    /// Carries a rotation along a stretch, to which the next rolls are added; returns it at the end.
    fn carry_one(&mut self, start: DQuat, uncarried: &Uncarried, place: usize) -> DQuat {
        let first = self.pieces.len();
        let end = uncarried.carry(place, start, &mut self.pieces);
        let pieces = first..self.pieces.len();
        self.turns.push(Turn::Carried(pieces, self.rolls.len()));
        end
    }

    /// Frenet's frame, its half turns undone. Straight parts are carried, and turned evenly from the
    /// frame before to the nearer of the two after.
    fn frenet(&mut self) {
        let normals: Vec<Option<Polynomial>> = (self.stretches.iter())
            .map(|own| self.normal(own))
            .collect();
        // On straight parts turns are spread over the length.
        if normals.iter().any(Option::is_none) && self.route.lengths.is_empty() {
            self.route.measure();
        }
        let mut before: Option<DQuat> = None;
        let mut stretch = 0;
        while stretch < self.stretches.len() {
            if let Some(mut normal) = normals[stretch] {
                let [from, to] = self.ends(stretch);
                let start = of_axes(normal.at(self.stretches[stretch].from), from);
                if let Some(before) = before
                    && (start * DVec3::Y).dot(before * DVec3::Y) < 0.0
                {
                    normal = normal.map(|c| -c);
                }
                self.turns.push(Turn::Frenet(normal));
                before = Some(of_axes(normal.at(self.stretches[stretch].to), to));
                stretch += 1;
                continue;
            }
            let run = (stretch..self.stretches.len()).take_while(|&own| normals[own].is_none());
            let end = stretch + run.count();
            let mut rotation = match before {
                Some(before) => self.carried_to(stretch, before),
                None => first_rotation(self.up, self.ends(stretch)[0]),
            };
            let straight = self.stretches[stretch..end].iter();
            let straight: Vec<_> = straight.map(|own| (&self.route, own)).collect();
            let uncarried = Uncarried::new(&straight);
            for own in stretch..end {
                if own > stretch {
                    rotation = self.carried_to(own, rotation);
                }
                rotation = self.carry_one(rotation, &uncarried, own - stretch);
            }
            let mut points = Vec::new();
            if let Some(Some(next)) = normals.get(end) {
                let wanted = of_axes(next.at(self.stretches[end].from), self.ends(end)[0]);
                let angle = about_forward(self.carried_to(end, rotation), wanted);
                let (start, arrival) = (&self.stretches[stretch], &self.stretches[end - 1]);
                let first = self.route.lengths.at(start.interval, start.from);
                let last = self.route.lengths.at(arrival.interval, arrival.to);
                points = match before {
                    // Half a turn is repaired, so that at most a quarter is left.
                    Some(_) => {
                        let half = std::f64::consts::PI;
                        let nearer = angle - half * (angle / half).round();
                        vec![(first, 0.0), (last, nearer)]
                    }
                    None => vec![(first, angle)],
                };
                rotation *= about_z(points[points.len() - 1].1);
            }
            self.rolls.push(Rolls::through(&points));
            before = Some(rotation);
            stretch = end;
        }
    }

    /// A rotation at the end of the stretch before, carried over the corner to a stretch.
    fn carried_to(&self, stretch: usize, rotation: DQuat) -> DQuat {
        let [arriving, leaving] = [self.ends(stretch - 1)[1], self.ends(stretch)[0]];
        around_corner(rotation, arriving, leaving)
    }

    /// The directions at both ends of a stretch.
    fn ends(&self, stretch: usize) -> [DVec3; 2] {
        let own = &self.stretches[stretch];
        [own.from, own.to].map(|t| own.way(&self.route, t)[0])
    }

    /// `P' × P''` on a stretch, with the sign that it has at the start; `None` where it is straight.
    fn normal(&self, own: &Stretch) -> Option<Polynomial> {
        let curve = &self.route.curves[own.interval];
        let start = curve.at(own.from);
        let offsets: [DVec3; 8] = std::array::from_fn(|i| {
            curve.at(own.from + (own.to - own.from) * (i + 1) as f64 / 8.0) - start
        });
        // The line to the farthest point: the ends of a curve that comes back may be one point.
        let farthest = |a: &&DVec3, b: &&DVec3| a.length().total_cmp(&b.length());
        let line = offsets.iter().max_by(farthest).copied();
        let line = line.unwrap_or_default().normalize_or_zero();
        let off = |offset: &DVec3| (offset - line * line.dot(*offset)).length();
        let bow = offsets.iter().map(off).fold(0.0, f64::max);
        let far = self.route.far;
        if matches!(own.heading, Heading::Still(_)) || bow < STRAIGHT * far {
            return None;
        }
        let normal = Polynomial::binormal(curve);
        if normal.size() == 0.0 {
            return None;
        }
        let divided = normal.without_zeros(INFLECTED * normal.size());
        let start = own.from + 1e-9 * (own.to - own.from);
        Some(signed(&divided, start))
    }
}

/// The rotation that takes z to a direction and x as near as possible to a side.
fn of_axes(side: DVec3, way: DVec3) -> DQuat {
    let side = across(side, way);
    DQuat::from_array(lanes::of_axes(side.to_array(), way.to_array()))
}

/// The part of a vector across a direction, of unit length.
fn across(vector: DVec3, way: DVec3) -> DVec3 {
    (vector - way * way.dot(vector)).normalize_or(way.any_orthonormal_vector())
}

/// The first x axis: `up × way`, with another direction in the place of `up` where both are one.
fn first_side(up: DVec3, way: DVec3) -> DVec3 {
    let up = up.normalize();
    let side = up.cross(way);
    if side.length() >= UPRIGHT {
        return side.normalize();
    }
    // The axis that is farthest from it, x first.
    let [x, y, z] = way.abs().to_array();
    let axis = match x <= y && x <= z {
        true => DVec3::X,
        false if y <= z => DVec3::Y,
        false => DVec3::Z,
    };
    axis.cross(way).normalize()
}

/// The first rotation, with the y axis as near as possible to `up`.
fn first_rotation(up: DVec3, way: DVec3) -> DQuat {
    of_axes(first_side(up, way), way)
}

/// The angle about z of the step between two rotations that face the same way.
fn about_forward(from: DQuat, to: DQuat) -> f64 {
    let ways = [from, to].map(|rotation| rotation * DVec3::Z);
    let step = (least_turn(ways[0], ways[1]) * from).conjugate() * to;
    wrapped(2.0 * libm::atan2(step.z, step.w))
}
