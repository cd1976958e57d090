//! The arrays of states of a motion library's clips.

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

    /// The ranges in bytes of arrays in a result, for so many joints of instances. Each starts where a kernel can bind
    /// it.
    pub(crate) fn ranges(arrays: &[Self], rotations: Encoding, joints: usize) -> Vec<Range<u64>> {
        let mut end = 0u64;
        let range = |array: &Self| {
            let start = end.next_multiple_of(OFFSET_STEP);
            end = start + joints as u64 * array.encoding(rotations).bytes() as u64;
            start..end
        };
        arrays.iter().map(range).collect()
    }
}
