//! Forward kinematics: bodies from the values of joints.

use crate::pose::tree::{
    BodyMotion, BodyPose, Configuration, ConfigurationRates, JointValue, Tree, TreeError,
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
        let mut motions = Vec::new();
        self.motions_into(configuration, rates, &mut motions)?;
        Ok(motions)
    }

    /// As [`Tree::motions`], into a list that is used again for each of many configurations. It is cleared first.
    ///
    /// # Errors
    /// As there.
    pub fn motions_into(
        &self,
        configuration: &Configuration,
        rates: &ConfigurationRates,
        motions: &mut Vec<BodyMotion>,
    ) -> Result<(), TreeError> {
        configuration.check(self)?;
        rates.check(self)?;
        let base = BodyMotion {
            pose: BodyPose {
                rotation: configuration.base.rotation.normalize(),
                ..configuration.base
            },
            velocity: rates.base,
        };
        motions.clear();
        motions.reserve(self.bodies.len());
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
                        let axes = moved.pose.rotation * rotation;
                        moved.about(joint.anchor, rotation, axes * rates.balls[i])
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
        Ok(())
    }
}
