//! The rotations of a body along its path.

use std::ops::Range;

use glam::{DQuat, DVec3, Vec3};

use crate::path::carried_piece::CarriedPiece;
use crate::path::carry::{RelativePieces, about_z, around_corner, rotation_between};
use crate::path::lanes;
use crate::path::options::{Follow, PathFrame, Twist};
use crate::path::polynomial::Polynomial;
use crate::path::rolls::{Rolls, unwrapped, wrapped};
use crate::path::stretch::{Heading, PathStretch, signed};
use crate::path::timed_path::TimedPath;

/// The method by which the rotations of a stretch are computed.
enum FrameSource {
    /// A carried (rotation-minimising) frame: the range of its pieces, and the index of the rolls that are added to
    /// it.
    Carried(Range<usize>, usize),
    /// The x axis is the direction of this polynomial. Near the upward direction, within the specified distance, the
    /// polynomial has no direction, and the previous axis is kept.
    Fixed(Option<Polynomial>, DVec3),
    /// The x axis is the direction of this polynomial: `P' × P''`, divided by its zeros.
    Frenet(Polynomial),
}

/// The rotations along a path.
pub(crate) struct BodyOnPath {
    pub(crate) timed_path: TimedPath,
    pub(crate) stretches: Vec<PathStretch>,
    sources: Vec<FrameSource>,
    /// The pieces of all carried frames.
    pieces: Vec<CarriedPiece>,
    rolls: Vec<Rolls>,
    /// The largest roll in radians of a minimal frame after one round, if the roll is kept.
    pub(crate) left_over: f64,
    up: DVec3,
    body_axes: DQuat,
}

/// A path counts as straight if it deviates by less than this many steps of f32, because the rounding of keys would
/// define a normal.
const STRAIGHT: f64 = 4.0 * f32::EPSILON as f64;

/// The sine of the angle to the upward direction below which a fixed frame keeps its x axis.
const UPRIGHT: f64 = 1e-6;

/// `P' × P''` counts as zero below this fraction of its largest coefficient, about the rounding of f32 keys.
const INFLECTED: f64 = 1e-7;

impl BodyOnPath {
    /// A body on a path that is divided into these stretches.
    pub(crate) fn new(timed_path: TimedPath, stretches: Vec<PathStretch>, follow: &Follow) -> Self {
        Self {
            timed_path,
            sources: Vec::with_capacity(stretches.len()),
            stretches,
            pieces: Vec::new(),
            rolls: Vec::new(),
            left_over: 0.0,
            up: follow.up.normalize(),
            body_axes: follow.body_axes(),
        }
    }

    /// Computes the rotations on a path, which has upward directions at some keys. For a minimal frame, its stretches
    /// are those of `relative_pieces` from `first` on.
    pub(crate) fn find_rotations(
        &mut self,
        follow: &Follow,
        ups: &[Option<Vec3>],
        relative_pieces: &RelativePieces,
        first: usize,
    ) {
        match follow.frame {
            _ if self.stretches.is_empty() => {}
            PathFrame::Fixed => self.fix(),
            PathFrame::Minimal => self.carry_all(follow, ups, relative_pieces, first),
            PathFrame::Frenet => self.frenet(),
        }
    }

    /// The pieces of a stretch with a carried frame, and the rolls added to them.
    pub(crate) fn carried(&self, stretch: usize) -> Option<(&[CarriedPiece], &Rolls)> {
        match &self.sources[stretch] {
            FrameSource::Carried(pieces, rolls) => {
                Some((&self.pieces[pieces.clone()], &self.rolls[*rolls]))
            }
            _ => None,
        }
    }

    /// The vector to which the x axis is as near as possible, at a parameter of a stretch whose frame is not carried,
    /// for the direction there.
    pub(crate) fn side(&self, index: usize, t: f64, direction: DVec3) -> DVec3 {
        let stretch = &self.stretches[index];
        match &self.sources[index] {
            FrameSource::Fixed(x, kept) => {
                let is_upright = self.up.cross(direction).length() < UPRIGHT;
                let near_start = t - stretch.from < stretch.to - t || x.is_none();
                match x {
                    _ if is_upright && near_start => *kept,
                    Some(x) => x.at(t),
                    None => self.up.cross(direction),
                }
            }
            FrameSource::Frenet(x) => x.at(t),
            FrameSource::Carried(..) => DVec3::ZERO,
        }
    }

    /// The rotation of the body with this side vector.
    pub(crate) fn rotation(&self, side: DVec3, direction: DVec3) -> DQuat {
        of_axes(side, direction) * self.body_axes
    }

    /// Computes a fixed frame: the y axis is as near to the upward direction as possible.
    fn fix(&mut self) {
        let up = self.up;
        let mut kept = DVec3::ZERO;
        let mut parts = Vec::with_capacity(self.stretches.len());
        for stretch in std::mem::take(&mut self.stretches) {
            let mut cuts = vec![stretch.from, stretch.to];
            let side = match &stretch.heading {
                Heading::Polynomial(direction) => {
                    let side = direction.map(|c| up.cross(c));
                    let tolerance = UPRIGHT * direction.size();
                    (side.size() > tolerance).then(|| side.without_zeros(tolerance))
                }
                _ => None,
            };
            if let Some((zeros, _)) = &side {
                let within = |&&zero: &&f64| zero > stretch.from && zero < stretch.to;
                cuts.extend(zeros.iter().filter(within));
            }
            cuts.sort_by(f64::total_cmp);
            cuts.dedup();
            for pair in cuts.windows(2) {
                let (from, to) = (pair[0], pair[1]);
                let part = PathStretch {
                    from,
                    to,
                    ..stretch.clone()
                };
                if kept == DVec3::ZERO {
                    kept = first_side(up, part.direction(&self.timed_path, from)[0]);
                }
                let x = side
                    .as_ref()
                    .map(|divided| signed(divided, 0.5 * (from + to)));
                let end = part.direction(&self.timed_path, to)[0];
                self.sources.push(FrameSource::Fixed(x, kept));
                kept = match (x, up.cross(end)) {
                    (Some(x), _) => across(x.at(to), end),
                    (None, side) if side.length() < UPRIGHT => across(kept, end),
                    (None, side) => side.normalize(),
                };
                parts.push(part);
            }
        }
        self.stretches = parts;
    }

    /// Carries a frame along the whole path, and distributes the angles by which it differs from the requested upward
    /// directions and, on a closed path, from the start.
    fn carry_all(
        &mut self,
        follow: &Follow,
        ups: &[Option<Vec3>],
        relative_pieces: &RelativePieces,
        first_stretch: usize,
    ) {
        let up_at = |key: usize| ups.get(key).copied().flatten().map(Vec3::as_dvec3);
        let [start, _] = relative_pieces.ends(first_stretch);
        let first = first_rotation(up_at(0).unwrap_or(self.up), start);
        self.pieces.reserve(self.stretches.len());
        let mut points = vec![(0.0, 0.0)];
        let mut largest = 0.0f64;
        let mut add_roll = |length: f64, carried: DQuat, requested: DQuat| {
            let near = points[points.len() - 1].1;
            let angle = unwrapped(about_forward(carried, requested), near);
            largest = largest.max(wrapped(angle - near).abs());
            points.push((length, angle));
        };
        let mut at_end = first;
        let mut arriving = start;
        let mut before = 0;
        for stretch in 0..self.stretches.len() {
            let [leaving, end] = relative_pieces.ends(first_stretch + stretch);
            if stretch > 0 {
                at_end = around_corner(at_end, arriving, leaving);
            }
            let interval = self.stretches[stretch].interval;
            if interval > before
                && let Some(up) = up_at(interval)
            {
                let length = self.timed_path.lengths.of(interval)[0];
                add_roll(length, at_end, first_rotation(up, leaving));
            }
            at_end = self.carry_one(at_end, relative_pieces, first_stretch + stretch);
            (arriving, before) = (end, interval);
        }
        let total = self.timed_path.lengths.total();
        if let Some(up) = up_at(self.timed_path.curves.len()) {
            add_roll(total, at_end, first_rotation(up, arriving));
        }
        if follow.is_closed() && follow.twist == Twist::Spread {
            let arrived = around_corner(at_end, arriving, start);
            add_roll(total, arrived, first);
        }
        self.rolls.push(Rolls::through(&points));
        self.left_over = largest;
    }

    /// Carries a rotation along a stretch, to which the next rolls are added; returns the rotation at its end.
    fn carry_one(
        &mut self,
        start: DQuat,
        relative_pieces: &RelativePieces,
        stretch: usize,
    ) -> DQuat {
        let first = self.pieces.len();
        let end = relative_pieces.carry(stretch, start, &mut self.pieces);
        let pieces = first..self.pieces.len();
        self.sources
            .push(FrameSource::Carried(pieces, self.rolls.len()));
        end
    }

    /// Computes Frenet's frame without its flips by 180°. On straight parts the frame is carried, and rolled evenly
    /// from the frame before to the nearer of the two frames after.
    fn frenet(&mut self) {
        let normals: Vec<Option<Polynomial>> = (self.stretches.iter())
            .map(|part| self.normal(part))
            .collect();
        // On straight parts the normal is undefined. There the roll changes at a constant rate with the length.
        if normals.iter().any(Option::is_none) && self.timed_path.lengths.is_empty() {
            self.timed_path.measure();
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
                self.sources.push(FrameSource::Frenet(normal));
                before = Some(of_axes(normal.at(self.stretches[stretch].to), to));
                stretch += 1;
                continue;
            }
            let run = (stretch..self.stretches.len()).take_while(|&i| normals[i].is_none());
            let end = stretch + run.count();
            let mut rotation = match before {
                Some(before) => self.carried_to(stretch, before),
                None => first_rotation(self.up, self.ends(stretch)[0]),
            };
            let straight = self.stretches[stretch..end].iter();
            let straight: Vec<_> = straight.map(|part| (&self.timed_path, part)).collect();
            let relative_pieces = RelativePieces::new(&straight);
            for i in stretch..end {
                if i > stretch {
                    rotation = self.carried_to(i, rotation);
                }
                rotation = self.carry_one(rotation, &relative_pieces, i - stretch);
            }
            let mut points = Vec::new();
            if let Some(Some(next)) = normals.get(end) {
                let next_rotation = of_axes(next.at(self.stretches[end].from), self.ends(end)[0]);
                let angle = about_forward(self.carried_to(end, rotation), next_rotation);
                let (start, arrival) = (&self.stretches[stretch], &self.stretches[end - 1]);
                let first = self.timed_path.lengths.at(start.interval, start.from);
                let last = self.timed_path.lengths.at(arrival.interval, arrival.to);
                points = match before {
                    // If the roll would be more than 90°, the normal is reversed.
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

    /// The rotation at the end of the previous stretch, carried around the corner to a stretch.
    fn carried_to(&self, stretch: usize, rotation: DQuat) -> DQuat {
        let [arriving, leaving] = [self.ends(stretch - 1)[1], self.ends(stretch)[0]];
        around_corner(rotation, arriving, leaving)
    }

    /// The directions at both ends of a stretch.
    fn ends(&self, index: usize) -> [DVec3; 2] {
        let stretch = &self.stretches[index];
        [stretch.from, stretch.to].map(|t| stretch.direction(&self.timed_path, t)[0])
    }

    /// `P' × P''` on a stretch, with the sign at the start; `None` if the stretch is straight.
    fn normal(&self, stretch: &PathStretch) -> Option<Polynomial> {
        let curve = &self.timed_path.curves[stretch.interval];
        let start = curve.at(stretch.from);
        let offsets: [DVec3; 8] = std::array::from_fn(|i| {
            curve.at(stretch.from + (stretch.to - stretch.from) * (i + 1) as f64 / 8.0) - start
        });
        // A line from the start to the farthest point, because the ends of a closed curve may be one point.
        let farthest = |a: &&DVec3, b: &&DVec3| a.length().total_cmp(&b.length());
        let line = offsets.iter().max_by(farthest).copied();
        let line = line.unwrap_or_default().normalize_or_zero();
        let off = |offset: &DVec3| (offset - line * line.dot(*offset)).length();
        let bow = offsets.iter().map(off).fold(0.0, f64::max);
        let max_coordinate = self.timed_path.max_coordinate;
        if matches!(stretch.heading, Heading::Still(_)) || bow < STRAIGHT * max_coordinate {
            return None;
        }
        let normal = Polynomial::binormal(curve);
        if normal.size() == 0.0 {
            return None;
        }
        let divided = normal.without_zeros(INFLECTED * normal.size());
        let start = stretch.from + 1e-9 * (stretch.to - stretch.from);
        Some(signed(&divided, start))
    }
}

/// The rotation that takes z to a direction and x as near as possible to a side.
fn of_axes(side: DVec3, direction: DVec3) -> DQuat {
    let side = across(side, direction);
    DQuat::from_array(lanes::of_axes(side.to_array(), direction.to_array()))
}

/// The component of a vector orthogonal to a direction, normalised.
fn across(vector: DVec3, direction: DVec3) -> DVec3 {
    (vector - direction * direction.dot(vector)).normalize_or(direction.any_orthonormal_vector())
}

/// The first x axis: `up × direction`, with another vector instead of `up` if both are parallel.
fn first_side(up: DVec3, direction: DVec3) -> DVec3 {
    let up = up.normalize();
    let side = up.cross(direction);
    if side.length() >= UPRIGHT {
        return side.normalize();
    }
    // The axis with the largest angle to the direction; if several are equal, x comes first.
    let [x, y, z] = direction.abs().to_array();
    let axis = match x <= y && x <= z {
        true => DVec3::X,
        false if y <= z => DVec3::Y,
        false => DVec3::Z,
    };
    axis.cross(direction).normalize()
}

/// The first rotation, with the y axis as near as possible to `up`.
fn first_rotation(up: DVec3, direction: DVec3) -> DQuat {
    of_axes(first_side(up, direction), direction)
}

/// The angle about z between two rotations with the same direction.
fn about_forward(from: DQuat, to: DQuat) -> f64 {
    let directions = [from, to].map(|rotation| rotation * DVec3::Z);
    let step = (rotation_between(directions[0], directions[1]) * from).conjugate() * to;
    wrapped(2.0 * libm::atan2(step.z, step.w))
}
