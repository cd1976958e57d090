//! Root motion: the part of a motion that carries a body over the ground, without the motion in place.

use glam::{DQuat, DVec3};
use tumble::names;

use crate::learning::heading::{Ground, forward_heading, twist_heading};

/// How the heading of a root is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum HeadingSource {
    /// Its twist about the axis that points up ([`twist_heading`]).
    #[default]
    Twist,
    /// The direction of its x axis on the ground ([`forward_heading`]).
    X,
    /// The direction of its y axis on the ground.
    Y,
    /// The direction of its z axis on the ground.
    Z,
}

names! {
    HeadingSource, "heading",
    Twist => "twist",
    X => "x",
    Y => "y",
    Z => "z",
}

impl HeadingSource {
    /// The heading of a rotation in rad.
    #[must_use]
    pub fn heading(self, rotation: DQuat, ground: Ground) -> f64 {
        match self {
            Self::Twist => twist_heading(rotation, ground),
            Self::X => forward_heading(rotation, DVec3::X, ground),
            Self::Y => forward_heading(rotation, DVec3::Y, ground),
            Self::Z => forward_heading(rotation, DVec3::Z, ground),
        }
    }
}

/// A motion over the ground. Each frame has a pose: a place on the ground and a heading.
#[derive(Debug, Clone, PartialEq)]
pub struct RootMotion {
    /// The axis that points up.
    pub ground: Ground,
    /// Places at height 0.
    pub positions: Vec<DVec3>,
    /// Headings in rad. They change by half a turn at most from frame to frame, so they also count whole turns.
    pub headings: Vec<f64>,
}

/// A rotation about the axis that points up.
pub(super) fn about_up(angle: f64, ground: Ground) -> DQuat {
    let axis = ground.up() * libm::sin(0.5 * angle);
    DQuat::from_xyzw(axis.x, axis.y, axis.z, libm::cos(0.5 * angle))
}

/// A rotation about the axis that points up, and then a translation along the ground.
#[derive(Clone, Copy)]
struct GroundStep {
    angle: f64,
    offset: DVec3,
}

impl GroundStep {
    /// This step after another one.
    fn after(self, first: Self, ground: Ground) -> Self {
        Self {
            angle: self.angle + first.angle,
            offset: self.offset + about_up(self.angle, ground) * first.offset,
        }
    }

    /// This step, repeated; negative numbers go backwards. The power is computed by squaring, so that rounding errors do
    /// not grow with the number.
    fn repeated(self, times: i64, ground: Ground) -> Self {
        let mut square = match times < 0 {
            true => Self {
                angle: -self.angle,
                offset: -(about_up(-self.angle, ground) * self.offset),
            },
            false => self,
        };
        let mut all = Self {
            angle: 0.0,
            offset: DVec3::ZERO,
        };
        let mut left = times.unsigned_abs();
        while left > 0 {
            if left & 1 == 1 {
                all = square.after(all, ground);
            }
            square = square.after(square, ground);
            left >>= 1;
        }
        Self {
            angle: self.angle * times as f64,
            ..all
        }
    }
}

impl RootMotion {
    /// The root motion of a body. `positions` and `rotations` are the poses of its root in the world.
    #[must_use]
    pub fn of(
        positions: &[DVec3],
        rotations: &[DQuat],
        ground: Ground,
        heading: HeadingSource,
    ) -> Self {
        let mut motion = Self {
            ground,
            positions: Vec::with_capacity(positions.len()),
            headings: Vec::with_capacity(positions.len()),
        };
        for (&position, &rotation) in positions.iter().zip(rotations) {
            let up = ground.up();
            motion.positions.push(position - up * position.dot(up));
            let angle = heading.heading(rotation, ground);
            let revolutions = motion.headings.last().map_or(0.0, |before| {
                libm::rint((before - angle) / std::f64::consts::TAU)
            });
            motion
                .headings
                .push(angle + revolutions * std::f64::consts::TAU);
        }
        motion
    }

    /// The rotation of a frame.
    ///
    /// # Panics
    /// When there is no such frame.
    #[must_use]
    pub fn rotation(&self, frame: usize) -> DQuat {
        about_up(self.headings[frame], self.ground)
    }

    /// Removes this motion from a pose in the world: the body is then above the origin and faces heading 0.
    ///
    /// # Panics
    /// When there is no such frame.
    #[must_use]
    pub fn in_place(&self, frame: usize, position: DVec3, rotation: DQuat) -> (DVec3, DQuat) {
        let back = self.rotation(frame).conjugate();
        (back * (position - self.positions[frame]), back * rotation)
    }

    /// Adds this motion to a pose: the inverse of [`RootMotion::in_place`]. For positions within a few units
    /// of 0, both together change a pose by less than 1e-14.
    ///
    /// # Panics
    /// When there is no such frame.
    #[must_use]
    pub fn restored(&self, frame: usize, position: DVec3, rotation: DQuat) -> (DVec3, DQuat) {
        let forth = self.rotation(frame);
        (self.positions[frame] + forth * position, forth * rotation)
    }

    /// The motion after a number of loops. Each loop begins where the one before ended: the last frame of a loop is the
    /// first frame of the next one. Negative numbers are loops before this motion.
    #[must_use]
    pub fn after_loops(&self, loops: i64) -> Self {
        let ends = self.positions.first().zip(self.positions.last());
        let headings = self.headings.first().zip(self.headings.last());
        let (Some((&from, &to)), Some((&first, &last))) = (ends, headings) else {
            return self.clone();
        };
        let angle = last - first;
        let one = GroundStep {
            angle,
            offset: to - about_up(angle, self.ground) * from,
        };
        let all = one.repeated(loops, self.ground);
        let rotation = about_up(all.angle, self.ground);
        let moved = self
            .positions
            .iter()
            .map(|&position| all.offset + rotation * position);
        Self {
            ground: self.ground,
            positions: moved.collect(),
            headings: self
                .headings
                .iter()
                .map(|heading| heading + all.angle)
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::learning::HeadingFrame;

    /// A root that walks a curve and turns by a third of a turn, tilted by a constant rotation.
    fn walk(ground: Ground, frames: usize) -> (Vec<DVec3>, Vec<DQuat>) {
        let tilt = DQuat::from_axis_angle(DVec3::new(1.0, 0.2, -0.3).normalize(), 0.2);
        let frame = |frame: usize| {
            let t = frame as f64 / (frames - 1) as f64;
            let across = DVec3::ONE - ground.up();
            let position = across * DVec3::new(t, 2.0 * t * t, 3.0 * t - t * t);
            (
                position + ground.up() * (0.9 + 0.1 * t),
                about_up(3.0 + t * TAU / 3.0, ground) * tilt,
            )
        };
        (0..frames).map(frame).unzip()
    }

    #[test]
    fn in_place_and_extracted_motion_are_the_motion() {
        for ground in Ground::ALL {
            for heading in HeadingSource::ALL {
                let (positions, rotations) = walk(ground, 31);
                let motion = RootMotion::of(&positions, &rotations, ground, heading);
                for frame in 0..31 {
                    let (position, rotation) = (positions[frame], rotations[frame]);
                    let (still, upright) = motion.in_place(frame, position, rotation);
                    let level = still - ground.up() * ground.height(position);
                    assert!(level.length() < 1e-15, "{ground} {heading}: {still}");
                    let left = heading.heading(upright, ground);
                    assert!(left.abs() < 1e-14, "{ground} {heading}: {left}");
                    let follows = HeadingFrame::of(position, rotation, ground, heading);
                    assert!((follows.position(position) - still).length() < 1e-14);
                    // The motion counts whole turns, after which a quaternion has the other sign.
                    let same = follows.rotation(rotation).dot(upright).abs();
                    assert!((same - 1.0).abs() < 1e-14, "{ground} {heading}: {same}");
                    let (back, rotated) = motion.restored(frame, still, upright);
                    assert!((back - position).length() < 1e-14);
                    assert!((rotated - rotation).length() < 1e-14);
                }
                // The tilt is constant. The heading changes by a third of a turn and passes half a turn without a jump.
                let change = motion.headings[30] - motion.headings[0];
                let steps = motion.headings.windows(2);
                assert!(
                    steps
                        .into_iter()
                        .all(|pair| (pair[1] - pair[0]).abs() < 0.2)
                );
                let bound = if heading == HeadingSource::Twist {
                    1e-12
                } else {
                    0.2
                };
                assert!(
                    (change - TAU / 3.0).abs() < bound,
                    "{ground} {heading}: {change}"
                );
            }
        }
    }

    /// Three loops of a third of a turn lead back to the start; a million are where counting leads.
    #[test]
    fn loops_go_on_from_where_the_last_one_ended() {
        for ground in Ground::ALL {
            let (positions, rotations) = walk(ground, 13);
            let motion = RootMotion::of(&positions, &rotations, ground, HeadingSource::Twist);
            let mut before = motion.clone();
            for loops in 1..7 {
                let now = motion.after_loops(loops);
                assert!((now.positions[0] - before.positions[12]).length() < 1e-14);
                assert!((now.headings[0] - before.headings[12]).abs() < 1e-14);
                // The shape of the path does not change.
                let step =
                    |motion: &RootMotion| (motion.positions[5] - motion.positions[2]).length();
                assert!((step(&now) - step(&motion)).abs() < 1e-14);
                before = now;
            }
            let three = motion.after_loops(3);
            for (a, b) in three.positions.iter().zip(&motion.positions) {
                assert!((*a - *b).length() < 1e-13, "{ground}: {a} {b}");
            }
            assert!((three.headings[4] - motion.headings[4] - TAU).abs() < 1e-14);
            let many = motion.after_loops(3_000_000);
            assert!((many.positions[7] - motion.positions[7]).length() < 1e-8);
            let back = motion.after_loops(5).after_loops(0);
            assert_eq!(back, motion.after_loops(5));
            let before = motion.after_loops(-1);
            assert!((before.positions[12] - motion.positions[0]).length() < 1e-14);
            assert!((before.headings[12] - motion.headings[0]).abs() < 1e-14);
        }
        // On a straight path, all loops have the same length.
        let (positions, rotations) = ([DVec3::ZERO, DVec3::X], [DQuat::IDENTITY; 2]);
        let ahead = RootMotion::of(&positions, &rotations, Ground::Z, HeadingSource::X);
        assert_eq!(
            ahead.after_loops(1 << 40).positions[1].x,
            (1u64 << 40) as f64 + 1.0
        );
        assert!(PI > ahead.headings[1]);
    }
}
