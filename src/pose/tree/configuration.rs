//! The values of a tree's joints, and the bodies that follow from them.

use glam::{DQuat, DVec3};

use crate::pose::tree::{JointCounts, JointKind, Tree, TreeBody, TreeError};

/// A value for each joint of a [`Tree`].
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// The pose of the tree's base in the world. It moves all bodies except those with a free joint in the world, and
    /// the bodies below these.
    pub base: BodyPose,
    /// Each free joint: the pose in the world, or relative to the body's place in its parent, if it has a parent.
    pub free: Vec<BodyPose>,
    /// Each ball: its rotation. Quaternions are normalised.
    pub balls: Vec<DQuat>,
    /// Each hinge (rad) and slide (metres) that mimics no other joint, as [`Tree::scalar_joints`] lists them.
    pub scalars: Vec<f64>,
}

/// How fast the values of a [`Configuration`] change, per second.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfigurationRates {
    /// The velocity of the base, in the world's axes.
    pub base: BodyVelocity,
    /// The velocity of each free joint, in the world's axes, or in those of the body's place in its parent.
    pub free: Vec<BodyVelocity>,
    /// The angular velocity of each ball in the body's axes, in rad/s.
    pub balls: Vec<DVec3>,
    /// The velocity of each hinge (rad/s) and slide (m/s).
    pub scalars: Vec<f64>,
}

/// The position and rotation of a body.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Zeroable)]
pub struct BodyPose {
    /// The position of its origin in metres.
    pub position: DVec3,
    /// Its rotation, a unit quaternion.
    pub rotation: DQuat,
}

/// The velocities of a body.
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Zeroable)]
pub struct BodyVelocity {
    /// The velocity of its origin in m/s.
    pub linear: DVec3,
    /// Its angular velocity in rad/s.
    pub angular: DVec3,
}

/// A body in the world, and its velocities in the world's axes.
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Zeroable)]
pub struct BodyMotion {
    /// Its pose.
    pub pose: BodyPose,
    /// Its velocities.
    pub velocity: BodyVelocity,
}

impl BodyPose {
    /// At the origin, not rotated.
    pub const IDENTITY: Self = Self {
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
    };
}

impl Default for BodyPose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl BodyMotion {
    /// The velocity of a point that is fixed to the body, such as its centre of mass; the point is in the body's
    /// frame.
    #[must_use]
    pub fn velocity_at(&self, point: DVec3) -> DVec3 {
        let BodyVelocity { linear, angular } = self.velocity;
        linear + angular.cross(self.pose.rotation * point)
    }
}

impl Tree {
    /// The configuration of the file: hinges and slides at their references, balls not turned, free joints where their
    /// bodies are.
    #[must_use]
    pub fn rest(&self) -> Configuration {
        let free = |body: &TreeBody| match body.parent {
            None => BodyPose {
                position: body.position,
                rotation: body.rotation,
            },
            Some(_) => BodyPose::IDENTITY,
        };
        let is_free =
            |body: &&TreeBody| matches!(&body.joints[..], [joint] if joint.kind == JointKind::Free);
        Configuration {
            base: BodyPose::IDENTITY,
            free: self.bodies.iter().filter(is_free).map(free).collect(),
            balls: vec![DQuat::IDENTITY; self.counts.balls],
            scalars: self.scalar_joints().map(|joint| joint.reference).collect(),
        }
    }

    /// Rates of 0.
    #[must_use]
    pub fn no_rates(&self) -> ConfigurationRates {
        ConfigurationRates {
            base: BodyVelocity::default(),
            free: vec![BodyVelocity::default(); self.counts.free],
            balls: vec![DVec3::ZERO; self.counts.balls],
            scalars: vec![0.0; self.counts.scalars],
        }
    }
}

impl Configuration {
    /// Refuses values that are not finite, or not one for each joint.
    pub(super) fn check(&self, counts: JointCounts) -> Result<(), TreeError> {
        check_counts([
            ("free joints", self.free.len(), counts.free),
            ("balls", self.balls.len(), counts.balls),
            ("scalars", self.scalars.len(), counts.scalars),
        ])?;
        let is_pose = |pose: &BodyPose| pose.position.is_finite() && is_rotation(pose.rotation);
        check_values("base", &[self.base], is_pose)?;
        check_values("free joint", &self.free, is_pose)?;
        check_values("ball", &self.balls, |&rotation| is_rotation(rotation))?;
        check_values("scalar", &self.scalars, |value| {
            value.abs() <= LARGEST_SCALAR
        })
    }
}

/// The largest value of a hinge or a slide: beyond it, an angle in f64 is less precise than 1e-8 rad.
const LARGEST_SCALAR: f64 = 1e8;

impl ConfigurationRates {
    /// Refuses rates that are not finite, or not one for each joint.
    pub(super) fn check(&self, counts: JointCounts) -> Result<(), TreeError> {
        check_counts([
            ("rates of free joints", self.free.len(), counts.free),
            ("rates of balls", self.balls.len(), counts.balls),
            ("rates of scalars", self.scalars.len(), counts.scalars),
        ])?;
        let is_velocity = |rate: &BodyVelocity| rate.linear.is_finite() && rate.angular.is_finite();
        check_values("the rate of the base", &[self.base], is_velocity)?;
        check_values("the rate of free joint", &self.free, is_velocity)?;
        check_values("the rate of ball", &self.balls, |rate| rate.is_finite())?;
        check_values("the rate of scalar", &self.scalars, |rate| rate.is_finite())
    }
}

fn is_rotation(q: DQuat) -> bool {
    let square = q.length_squared();
    square.is_finite() && square > 1e-12
}

/// Refuses more or fewer values of a kind than there should be.
pub(super) fn check_counts<const N: usize>(
    counts: [(&'static str, usize, usize); N],
) -> Result<(), TreeError> {
    let other = counts
        .into_iter()
        .find(|(_, found, expected)| found != expected);
    match other {
        None => Ok(()),
        Some((kind, found, expected)) => Err(TreeError::Count {
            kind,
            found,
            expected,
        }),
    }
}

fn check_values<T: std::fmt::Debug>(
    kind: &'static str,
    values: &[T],
    is_right: impl Fn(&T) -> bool,
) -> Result<(), TreeError> {
    match values.iter().position(|value| !is_right(value)) {
        None => Ok(()),
        Some(index) => Err(TreeError::Value {
            kind,
            index,
            value: format!("{:?}", values[index]),
        }),
    }
}
