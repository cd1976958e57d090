//! The options of a curve of any method: the path between the keys, the shape at its ends, the
//! quantity that is evaluated and the speed at which the curve is run through.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use glam::Quat;

use crate::math::quaternion::{self, dot, length, log, unit};
use crate::names::{UnknownNameError, named, names};
use crate::tracks::set::TrackSet;
use crate::tracks::set::key_data::LARGEST_TCB;
use crate::tracks::signs::Signs;

/// What is evaluated: the rotation, or how fast it changes. Velocities and accelerations are
/// vectors, `x y z` and 0 in the place of `w`, by the derivatives of the formula. On a key they are
/// those of the segment after it, on the last key those of the last segment; outside the keys they
/// are 0 while the end value is held.
///
/// ```
/// use tumble::glam::{Quat, Vec3};
/// use tumble::{Axes, Device, Engine, SampleTimes, Interpolation, Layout, Quantity, TrackSet, method};
/// let mut set = TrackSet::new();
/// set.push("wheel", &[0.0, 2.0], &[Quat::IDENTITY, Quat::from_rotation_z(1.0)])?;
/// let quantity = Quantity::Velocity(Axes::Body);
/// let how = Interpolation { quantity, ..method::SLERP.into() };
/// let found = Engine::new(Device::Cpu)?.rates(&set, how, &SampleTimes::fps(1), Layout::TrackMajor)?;
/// assert!(found.get(0, 0).unwrap().distance(Vec3::Z * 0.5) < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Quantity {
    /// The rotation, a unit quaternion.
    #[default]
    Rotation,
    /// The angular velocity, radians per second.
    Velocity(Axes),
    /// The angular acceleration, radians per second squared.
    Acceleration(Axes),
}

impl Quantity {
    /// Every quantity.
    pub const ALL: [Self; 5] = [
        Self::Rotation,
        Self::Velocity(Axes::Body),
        Self::Velocity(Axes::Parent),
        Self::Acceleration(Axes::Body),
        Self::Acceleration(Axes::Parent),
    ];

    /// The name by which programs call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rotation => "rotation",
            Self::Velocity(Axes::Body) => "velocity-in-body",
            Self::Velocity(Axes::Parent) => "velocity-in-parent",
            Self::Acceleration(Axes::Body) => "acceleration-in-body",
            Self::Acceleration(Axes::Parent) => "acceleration-in-parent",
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Quantity {
    type Err = UnknownNameError;

    fn from_str(name: &str) -> Result<Self, UnknownNameError> {
        named("quantity", &Self::ALL, Self::name, name)
    }
}

/// How fast a track runs through its curve; no effect on [`STEP`](crate::method::step::STEP).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Speed {
    /// As the key times say.
    #[default]
    AsKeyed,
    /// At one angular speed from the first key to the last (by arc length). The path is the same,
    /// but inner keys are met at other times than their own. Preparing takes milliseconds per key.
    /// Where the keyed curve is slow, the direction of its velocity changes fast: there velocities
    /// are within 1e-5 and accelerations within 1e-3 of the largest.
    Constant,
}

names! {
    Speed, "speed",
    AsKeyed => "as-keyed",
    Constant => "constant",
}

/// The axes in which a vector is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axes {
    /// Those of the body that turns.
    Body,
    /// Those of the frame in which it turns: its parent's in a skeleton, the world's for a track that
    /// has no parent.
    Parent,
}

names! {
    Axes, "kind of axes",
    Body => "body",
    Parent => "parent",
}

/// Which of the two quaternions of each key counts: `q` and `-q` are one rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KeySigns {
    /// Each key is taken with the sign nearer to its predecessor, so no rotation
    /// goes the long way round. Keys 180° apart keep the sign they were given.
    #[default]
    Shortest,
    /// Signs as given: a dot product below zero turns the long way.
    AsAuthored,
}

names! {
    KeySigns, "path",
    Shortest => "shortest",
    AsAuthored => "as-authored",
}

impl KeySigns {
    /// The signs of a track's keys on this path.
    pub(crate) fn signs(self, set: &TrackSet, index: usize) -> Signs<'_> {
        match self {
            Self::Shortest => set.signs(index),
            Self::AsAuthored => Signs::AS_AUTHORED,
        }
    }

    /// Refuses keys without a path between them, in some `intervals` of the `index`th track of a
    /// set.
    pub(crate) fn check(
        self,
        keys: &[Quat],
        intervals: Range<usize>,
        index: usize,
    ) -> Result<(), InterpolationError> {
        if self == Self::Shortest {
            return Ok(());
        }
        for key in intervals {
            let [from, to] = [key, key + 1].map(|key| unit(keys[key].to_array()));
            if dot(from, to) < -1.0 + f64::from(f32::EPSILON) {
                return Err(InterpolationError::Antipodal { track: index, key });
            }
        }
        Ok(())
    }
}

/// The curve in the first and in the last segment, where a neighbouring key is missing. Two keys
/// alone are joined by slerp, whatever the ends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[doc(alias = "boundary condition")]
#[doc(alias = "end condition")]
pub enum Ends {
    /// The parabola through the last three keys: constant velocity stays constant
    /// to the very ends.
    #[default]
    Parabolic,
    /// No angular acceleration at the ends.
    Natural,
    /// Given angular velocities (radians per second, body frame) at the ends.
    Clamped {
        /// At the first key.
        start: glam::DVec3,
        /// At the last key.
        end: glam::DVec3,
    },
    /// The angular velocity of slerp between the last two keys: constant velocity stays constant
    /// too. The default of [`C2`](crate::method::c2::C2).
    Secant,
    /// A closed curve: the last key equals the first.
    Loop,
    /// The first and the last segment hold their first key.
    Frozen,
}

names! {
    Ends, "kind of ends",
    Parabolic => "parabolic",
    Natural => "natural",
    Clamped = Self::AT_REST => "clamped",
    Secant => "secant",
    Loop => "loop",
    Frozen => "frozen",
}

/// How far the last key of a loop may be from the first (half-angle, radians).
const LOOP_TOLERANCE: f64 = 1e-3;

/// The largest angular velocity at an end, radians per second.
const FASTEST: f64 = 1e12;

impl Ends {
    /// Both ends at rest: what `clamped` stands for.
    pub const AT_REST: Self = Self::Clamped {
        start: glam::DVec3::ZERO,
        end: glam::DVec3::ZERO,
    };

    /// Refuses end velocities that are not finite or too large.
    pub(crate) fn check_velocities(self) -> Result<(), InterpolationError> {
        if let Self::Clamped { start, end } = self {
            for velocity in [start, end] {
                let speed = length(velocity.to_array());
                if !speed.is_finite() || speed > FASTEST {
                    return Err(InterpolationError::EndVelocity { velocity });
                }
            }
        }
        Ok(())
    }

    /// Refuses loops whose last key is not their first. `index` is the track's index in its set.
    pub(crate) fn check_loop(self, keys: &[Quat], index: usize) -> Result<(), InterpolationError> {
        let (Self::Loop, [first, .., last]) = (self, keys) else {
            return Ok(());
        };
        let seam = quaternion::step(unit(first.to_array()), unit(last.to_array()));
        let half_angle = length(log([seam[0], seam[1], seam[2], seam[3].abs()]));
        if half_angle > LOOP_TOLERANCE {
            let degrees = (2.0 * half_angle).to_degrees();
            return Err(InterpolationError::OpenLoop {
                track: index,
                degrees,
            });
        }
        Ok(())
    }
}

/// Why a track cannot be interpolated as asked. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InterpolationError {
    /// Under [`KeySigns::AsAuthored`] neighbouring keys are each other's negative: no
    /// great circle is defined.
    #[error(
        "track {track}: keys {key} and {} are opposite quaternions, between which as-authored has no path; flip one sign or use the shortest path",
        key + 1
    )]
    Antipodal {
        /// The track's index in the set.
        track: usize,
        /// The first of the two keys.
        key: usize,
    },
    /// Under [`WrapMode::Mirror`](crate::time::wrap::WrapMode::Mirror) velocities would change
    /// their signs from copy to copy.
    #[error("velocities cannot be mirrored; hold, loop or extrapolate them")]
    MirroredVelocity,
    /// Under [`Ends::Clamped`] a velocity is not finite, or too large.
    #[error(
        "the end velocity ({}, {}, {}) rad/s is out of range; give a finite one of at most 1e12",
        velocity.x, velocity.y, velocity.z
    )]
    EndVelocity {
        /// What was given.
        velocity: glam::DVec3,
    },
    /// A tension, a continuity or a bias is not finite, or too large.
    #[error(
        "the {option} {value} is out of range; give a number between -{LARGEST_TCB:e} and {LARGEST_TCB:e}, mostly within -1 and 1"
    )]
    Tcb {
        /// `tension`, `continuity` or `bias`.
        option: &'static str,
        /// What was given.
        value: f64,
    },
    /// Under [`Ends::Loop`] the last key must repeat the first.
    #[error(
        "track {track}: the last key is {degrees:.3}° from the first; a loop needs a last key that equals the first"
    )]
    OpenLoop {
        /// The track's index in the set.
        track: usize,
        /// Angle between first and last key, degrees.
        degrees: f64,
    },
}

/// A warning about a track that is interpolated all the same. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InterpolationWarning {
    /// [`C2`](crate::method::c2::C2) found no velocities that make the angular acceleration continuous.
    #[error(
        "track {track}: c2 found no curve with continuous angular acceleration; it jumps at {count} keys, the first is key {key}; add keys in long intervals beside short ones, or use bessel-overhauser"
    )]
    AccelerationJumps {
        /// The track's index in the set.
        track: usize,
        /// The first such key.
        key: usize,
        /// How many such keys the track has.
        count: usize,
    },
}
