//! Headings: directions on the ground.

use glam::{DQuat, DVec3};
use tumble::names;

/// The axis that points up. Headings are angles about it, in rad, from -π to π.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ground {
    /// y is up, as in SMPL and HumanML3D; the heading of +z is 0.
    Y,
    /// z is up, as in most robots; the heading of +x is 0.
    Z,
}

names! {
    Ground, "axis that points up",
    Y => "y",
    Z => "z",
}

impl Ground {
    /// The unit vector that points up.
    #[must_use]
    pub fn up(self) -> DVec3 {
        match self {
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
        }
    }

    /// The height of a point.
    #[must_use]
    pub fn height(self, point: DVec3) -> f64 {
        point.dot(self.up())
    }

    /// The heading of a direction; 0 if it points straight up or down.
    #[must_use]
    pub fn heading(self, direction: DVec3) -> f64 {
        match self {
            Self::Y => libm::atan2(direction.x, direction.z),
            Self::Z => libm::atan2(direction.y, direction.x),
        }
    }
}

/// The heading of a rotation by its twist about the axis that points up (swing–twist decomposition, IsaacLab's
/// `yaw_quat`). It is 0 where the rotation has no twist, as after half a turn about an axis on the ground.
#[must_use]
pub fn twist_heading(rotation: DQuat, ground: Ground) -> f64 {
    let along = match ground {
        Ground::Y => rotation.y,
        Ground::Z => rotation.z,
    };
    // A quaternion and its negative are the same rotation, so they must have the same heading.
    let (along, w) = match rotation.w < 0.0 {
        true => (-along, -rotation.w),
        false => (along, rotation.w),
    };
    2.0 * libm::atan2(along, w)
}

/// The heading of an axis of a body, such as x (Isaac Gym).
#[must_use]
pub fn forward_heading(rotation: DQuat, axis: DVec3, ground: Ground) -> f64 {
    ground.heading(rotation * axis)
}

/// The direction that a person faces, a unit vector on the ground: across the hips and shoulders. `None` if these are
/// one above the other.
#[must_use]
pub fn facing(hips: [DVec3; 2], shoulders: [DVec3; 2], ground: Ground) -> Option<DVec3> {
    let [left_hip, right_hip] = hips;
    let [left_shoulder, right_shoulder] = shoulders;
    let across = (right_hip - left_hip) + (right_shoulder - left_shoulder);
    let facing = ground.up().cross(across);
    facing.try_normalize()
}
