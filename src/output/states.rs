//! The arrays of states of a motion library's clips, and of a robot's.

use std::ops::Range;

use crate::names::names;
use crate::output::encoding::Encoding;
use crate::output::pose_error::OFFSET_STEP;
use crate::shader::{ANGULAR_VELOCITY, LOCAL_ROTATION, POSITION, VELOCITY, WORLD_ROTATION};

/// An array of [`MotionStates`](crate::crowd::MotionStates).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StateArray {
    /// Rotations in the parents' frames, `x y z w`.
    Rotations,
    /// Positions in the world.
    Positions,
    /// Rotations in the world, `x y z w`.
    WorldRotations,
    /// Velocities in the world.
    Velocities,
    /// Angular velocities about the world's axes.
    AngularVelocities,
}

names! {
    StateArray, "array",
    Rotations => "rotations",
    Positions => "positions",
    WorldRotations => "world_rotations",
    Velocities => "velocities",
    AngularVelocities => "angular_velocities",
}

impl StateArray {
    /// The encoding of the array, if that of rotations is `rotations`. All have f32 numbers.
    #[must_use]
    pub fn encoding(self, rotations: Encoding) -> Encoding {
        match self {
            Self::Rotations | Self::WorldRotations => rotations,
            Self::Positions | Self::Velocities | Self::AngularVelocities => Encoding::Vector,
        }
    }

    /// Its vector in the state of a joint, as kernels have it.
    pub(crate) fn vector(self) -> u32 {
        match self {
            Self::Rotations => LOCAL_ROTATION,
            Self::Positions => POSITION,
            Self::WorldRotations => WORLD_ROTATION,
            Self::Velocities => VELOCITY,
            Self::AngularVelocities => ANGULAR_VELOCITY,
        }
    }

    /// The numbers that a kernel stores of an instance, for so many joints, if the encoding of rotations is `rotations`.
    pub(crate) fn stored(self, joints: u32, rotations: Encoding) -> StoredArray {
        let encoding = self.encoding(rotations);
        StoredArray {
            numbers: joints * encoding.components().len() as u32,
            from: StoredNumbers::OfJoints {
                vector: self.vector(),
                encoding,
            },
            needs_walk: self != Self::Rotations,
            needs_velocities: matches!(self, Self::Velocities | Self::AngularVelocities),
        }
    }
}

/// An array of [`BodyStates`](crate::crowd::BodyStates).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BodyArray {
    /// Values of hinges and slides.
    JointValues,
    /// Their velocities.
    JointRates,
    /// Positions of bodies in the world.
    Positions,
    /// Rotations in the world; the order of components is that of the frames
    /// ([`TreeFrames`](crate::trees::TreeFrames)).
    Rotations,
    /// Velocities in the world.
    Velocities,
    /// Angular velocities about the world's axes.
    AngularVelocities,
}

names! {
    BodyArray, "array",
    JointValues => "joint_pos",
    JointRates => "joint_vel",
    Positions => "body_pos_w",
    Rotations => "body_quat_w",
    Velocities => "body_lin_vel_w",
    AngularVelocities => "body_ang_vel_w",
}

impl BodyArray {
    /// The number of f32 numbers of a joint or body.
    #[must_use]
    pub fn numbers(self) -> usize {
        match self {
            Self::JointValues | Self::JointRates => 1,
            Self::Rotations => 4,
            Self::Positions | Self::Velocities | Self::AngularVelocities => 3,
        }
    }

    /// Whether it has the numbers of joints, not those of bodies.
    #[must_use]
    pub fn is_of_joints(self) -> bool {
        matches!(self, Self::JointValues | Self::JointRates)
    }
}

/// An array of a result, as kernels store it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StoredArray {
    /// The f32 numbers of an instance.
    pub(crate) numbers: u32,
    pub(crate) from: StoredNumbers,
    /// Whether it has values in the world.
    pub(crate) needs_walk: bool,
    pub(crate) needs_velocities: bool,
}

/// Where an array's numbers are in the states.
#[derive(Debug, Clone, Copy)]
pub(crate) enum StoredNumbers {
    /// A vector of each joint, in an encoding of f32 numbers.
    OfJoints { vector: u32, encoding: Encoding },
    /// Words of a list, from `first` on, in the states of frames or else of tracks.
    Picked { first: u32, of_frames: bool },
}

impl StoredArray {
    /// The ranges in bytes of arrays in a result of so many instances. Each starts where a kernel can bind it.
    pub(crate) fn ranges(arrays: &[Self], instances: usize) -> Vec<Range<u64>> {
        let mut end = 0u64;
        let range = |array: &Self| {
            let start = end.next_multiple_of(OFFSET_STEP);
            end = start + 4 * instances as u64 * u64::from(array.numbers);
            start..end
        };
        arrays.iter().map(range).collect()
    }
}
