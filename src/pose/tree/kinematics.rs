//! Forward kinematics: bodies from the values of joints.

use glam::{DQuat, DVec3};

use crate::math::quaternion::sine_cosine;
use crate::pose::tree::{
    BodyMotion, BodyPose, BodyVelocity, Configuration, ConfigurationRates, JointKind, JointValue,
    Tree, TreeBody, TreeError, TreeJoint,
};

impl Tree {
    /// The pose of each body in the world, in the order of [`Tree::bodies`].
    ///
    /// # Errors
    /// When the configuration has not one finite value for each joint.
    pub fn poses(&self, configuration: &Configuration) -> Result<Vec<BodyPose>, TreeError> {
        let motions = self.motions(configuration, &self.no_rates())?;
        Ok(motions.into_iter().map(|motion| motion.pose).collect())
    }

    /// The pose of each body in the world, and its velocities in the world's axes, in the order of [`Tree::bodies`].
    ///
    /// # Errors
    /// When the configuration or the rates have not one finite value for each joint.
    pub fn motions(
        &self,
        configuration: &Configuration,
        rates: &ConfigurationRates,
    ) -> Result<Vec<BodyMotion>, TreeError> {
        configuration.check(self)?;
        rates.check(self)?;
        let base = BodyMotion {
            pose: BodyPose {
                rotation: configuration.base.rotation.normalize(),
                ..configuration.base
            },
            velocity: rates.base,
        };
        let mut motions: Vec<BodyMotion> = Vec::with_capacity(self.bodies.len());
        let mut values = self.values.iter().copied();
        for body in &self.bodies {
            let parent = body.parent.map(|parent| motions[parent]);
            let mut moved = parent.unwrap_or(base).with(body);
            for joint in &body.joints {
                let Some(value) = values.next() else { continue };
                moved = match value {
                    JointValue::Free(i) => {
                        let (pose, rate) = (configuration.free[i], rates.free[i]);
                        moved.freely(pose, rate, parent.is_some())
                    }
                    JointValue::Ball(i) => {
                        let rotation = configuration.balls[i].normalize();
                        let turned = moved.pose.rotation * rotation;
                        moved.about(joint.anchor, rotation, turned * rates.balls[i])
                    }
                    JointValue::Scalar { .. } => {
                        let shift = configuration.scalar(value) - joint.reference;
                        moved.by_scalar(joint, shift, rates.scalar(value))
                    }
                };
            }
            moved.pose.rotation = moved.pose.rotation.normalize();
            motions.push(moved);
        }
        Ok(motions)
    }
}

impl BodyMotion {
    /// A child of this body before its joints act.
    fn with(self, child: &TreeBody) -> Self {
        let Self { pose, velocity } = self;
        Self {
            velocity: BodyVelocity {
                linear: self.velocity_at(child.position),
                ..velocity
            },
            pose: BodyPose {
                position: pose.position + pose.rotation * child.position,
                rotation: pose.rotation * child.rotation,
            },
        }
    }

    /// After a free joint: in the world, or relative to where the body is.
    fn freely(self, pose: BodyPose, rate: BodyVelocity, is_relative: bool) -> Self {
        let rotation = pose.rotation.normalize();
        if !is_relative {
            let pose = BodyPose { rotation, ..pose };
            return Self {
                pose,
                velocity: rate,
            };
        }
        let axes = self.pose.rotation;
        Self {
            velocity: BodyVelocity {
                linear: self.velocity_at(pose.position) + axes * rate.linear,
                angular: self.velocity.angular + axes * rate.angular,
            },
            pose: BodyPose {
                position: self.pose.position + axes * pose.position,
                rotation: axes * rotation,
            },
        }
    }

    /// After a hinge turned by `value` rad, or a slide shifted by `value` metres.
    fn by_scalar(self, joint: &TreeJoint, value: f64, rate: f64) -> Self {
        let axis = self.pose.rotation * joint.axis;
        if joint.kind == JointKind::Hinge {
            let (sine, cosine) = sine_cosine(value * 0.5);
            let [x, y, z] = (joint.axis * sine).to_array();
            let rotation = DQuat::from_xyzw(x, y, z, cosine);
            return self.about(joint.anchor, rotation, axis * rate);
        }
        let (shift, mut moved) = (axis * value, self);
        moved.velocity.linear += self.velocity.angular.cross(shift) + axis * rate;
        moved.pose.position += shift;
        moved
    }

    /// After a rotation about an anchor; `rate` is the angular velocity in the world's axes.
    fn about(self, anchor: DVec3, rotation: DQuat, rate: DVec3) -> Self {
        let Self { pose, velocity } = self;
        let rotation = pose.rotation * rotation;
        let fixed = pose.position + pose.rotation * anchor;
        let position = fixed - rotation * anchor;
        let angular = velocity.angular + rate;
        let linear = self.velocity_at(anchor) + angular.cross(position - fixed);
        Self {
            pose: BodyPose { position, rotation },
            velocity: BodyVelocity { linear, angular },
        }
    }
}
