//! Heading frames: coordinate systems that follow a root over the ground.

use glam::{DQuat, DVec3};

use crate::learning::heading::Ground;
use crate::learning::root_motion::{HeadingSource, about_up};

/// The heading frame of a root. Its origin is the place of the root on the ground, and it is rotated by the root's heading
/// about the axis that points up. Policies often learn from poses in this frame, which do not depend on the place and the
/// heading of a root. The root itself is then in place, as
/// [`RootMotion::in_place`](crate::learning::RootMotion::in_place) leaves it.
///
/// ```
/// use tumble::glam::{DQuat, DVec3};
/// use tumble_formats::learning::{Ground, HeadingFrame, HeadingSource};
/// let half = 0.5_f64.sqrt();
/// let turned = DQuat::from_xyzw(0.0, 0.0, half, half); // to the left, from +x to +y
/// let frame = HeadingFrame::of(DVec3::new(1.0, 2.0, 0.9), turned, Ground::Z, HeadingSource::Twist);
/// assert!((frame.position(DVec3::new(1.0, 3.0, 1.5)) - DVec3::new(1.0, 0.0, 1.5)).length() < 1e-15);
/// assert!((frame.vector(DVec3::Y) - DVec3::X).length() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingFrame {
    origin: DVec3,
    /// From the axes of the world to those of the frame.
    back: DQuat,
}

impl HeadingFrame {
    /// The frame of a root at this pose in the world.
    #[must_use]
    pub fn of(position: DVec3, rotation: DQuat, ground: Ground, heading: HeadingSource) -> Self {
        let up = ground.up();
        Self {
            origin: position - up * position.dot(up),
            back: about_up(heading.heading(rotation, ground), ground).conjugate(),
        }
    }

    /// A point of the world in this frame.
    #[must_use]
    pub fn position(&self, position: DVec3) -> DVec3 {
        self.back * (position - self.origin)
    }

    /// A vector of the world in this frame, such as a velocity or an angular velocity.
    #[must_use]
    pub fn vector(&self, vector: DVec3) -> DVec3 {
        self.back * vector
    }

    /// A rotation in the world, in this frame.
    #[must_use]
    pub fn rotation(&self, rotation: DQuat) -> DQuat {
        self.back * rotation
    }
}
