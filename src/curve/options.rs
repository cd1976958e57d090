//! Options of a curve of any method: the signs of its keys, its ends, the quantity that is evaluated, and the speed.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use glam::Quat;

use crate::math::quaternion::{self, dot, length, log, unit};
use crate::names::{UnknownNameError, counted, named, names};
use crate::tracks::set::TrackSet;
use crate::tracks::set::key_data::LARGEST_TCB;
use crate::tracks::signs::Signs;

/// The quantity that is evaluated: the rotation, its velocity or its acceleration.
///
/// Velocities and accelerations are vectors, `x y z 0`, from the derivatives of the formula. At a key they are those of
/// the interval after the key, and at the last key those of the last interval. Where the value at an end is held, they
/// are 0.
///
/// ```
/// use tumble::glam::{Quat, Vec3};
/// use tumble::{Axes, Device, Engine, SampleTimes, Interpolation, Layout, Quantity, TrackSet, method};
/// let mut set = TrackSet::new();
/// set.push("wheel", &[0.0, 2.0], &[Quat::IDENTITY, Quat::from_rotation_z(1.0)])?;
/// let quantity = Quantity::Velocity(Axes::Body);
/// let how = Interpolation::new(method::SLERP).with_quantity(quantity);
/// let found = Engine::new(Device::Cpu)?.rates(&set, how, &SampleTimes::fps(1), Layout::TrackMajor)?;
/// assert!(found.get(0, 0).unwrap().distance(Vec3::Z * 0.5) < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Quantity {
    /// The rotation, a unit quaternion.
    #[default]
    Rotation,
    /// The angular velocity in radians per second.
    Velocity(Axes),
    /// The angular acceleration in radians per second squared.
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

    /// The name that programs use.
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

/// The speed on a track's curve; no effect on [`STEP`](crate::method::step::STEP).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Speed {
    /// According to the key times.
    #[default]
    AsKeyed,
    /// The same angular speed from the first key to the last (by arc length).
    ///
    /// The path is the same, but inner keys are reached at other times. Preparing takes milliseconds for each key.
    /// Where the keyed curve is slow, the direction of its velocity changes fast; there, velocities are within 1e-5
    /// and accelerations within 1e-3 of the largest.
    Constant,
}

names! {
    Speed, "speed",
    AsKeyed => "as-keyed",
    Constant => "constant",
}

/// The axes of a vector's components.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axes {
    /// The axes of the rotating body.
    Body,
    /// The axes of the frame in which the body rotates: in a skeleton the parent's frame, otherwise the world.
    Parent,
}

names! {
    Axes, "kind of axes",
    Body => "body",
    Parent => "parent",
}

/// Which sign of each key is used: `q` and `-q` are the same rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum KeySigns {
    /// Each key has the sign that is nearer to the key before it, so rotations between keys are at most 180°. Keys
    /// that are 180° apart keep their signs.
    #[default]
    Shortest,
    /// Keys keep their signs. Where the dot product of neighbouring keys is negative, the rotation between them is
    /// more than 180°.
    AsAuthored,
}

names! {
    KeySigns, "kind of signs",
    Shortest => "shortest",
    AsAuthored => "as-authored",
}

impl KeySigns {
    /// The signs of a track's keys under this option.
    pub(crate) fn signs(self, set: &TrackSet, index: usize) -> Signs<'_> {
        match self {
            Self::Shortest => set.signs(index),
            Self::AsAuthored => Signs::AS_AUTHORED,
        }
    }

    /// Refuses neighbouring keys that are opposite quaternions, in some `intervals` of the track `index` of a set.
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

/// The curve in the first and in the last interval, where a neighbouring key is missing. A track of only two keys is
/// interpolated by slerp for any ends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[doc(alias = "boundary condition")]
#[doc(alias = "end condition")]
#[non_exhaustive]
pub enum Ends {
    /// The parabola through the last three keys at each end. Constant velocity stays constant up to the ends.
    #[default]
    Parabolic,
    /// The angular acceleration is 0 at the ends.
    Natural,
    /// The angular velocities at the ends are specified (radians per second, body frame).
    Clamped {
        /// The velocity at the first key.
        start: glam::DVec3,
        /// The velocity at the last key.
        end: glam::DVec3,
    },
    /// The angular velocity at an end is that of slerp between the last two keys there. Constant velocity stays
    /// constant. The default of [`C2`](crate::method::c2::C2).
    Secant,
    /// The curve is closed: the last key equals the first, and the curve is smooth there.
    Loop,
    /// The first and the last interval are constant; each has the value of the key at its start.
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

/// The maximum half-angle in radians between the last key of a loop and the first.
const LOOP_TOLERANCE: f64 = 1e-3;

/// The largest angular velocity at an end in radians per second.
const FASTEST: f64 = 1e12;

impl Ends {
    /// Both ends at rest: the value of the name `clamped`.
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

    /// Refuses a loop whose last key differs from its first. `index` is the track's index in its set.
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

/// Why a track cannot be interpolated as requested. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InterpolationError {
    /// Under [`KeySigns::AsAuthored`], neighbouring keys are opposite quaternions, between which no arc is defined.
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
    /// A velocity or an acceleration is requested under [`WrapMode::Mirror`](crate::time::wrap::WrapMode::Mirror),
    /// where it would change its sign from copy to copy.
    #[error("velocities cannot be mirrored; hold, loop or extrapolate them")]
    MirroredVelocity,
    /// Under [`Ends::Clamped`] a velocity is not finite, or too large.
    #[error(
        "the end velocity ({}, {}, {}) rad/s is out of range; give a finite one of at most 1e12",
        velocity.x, velocity.y, velocity.z
    )]
    EndVelocity {
        /// The velocity.
        velocity: glam::DVec3,
    },
    /// A tension, a continuity or a bias is not finite, or too large.
    #[error(
        "the {option} {value} is out of range; give a number between -{LARGEST_TCB:e} and {LARGEST_TCB:e}, mostly within -1 and 1"
    )]
    Tcb {
        /// `tension`, `continuity` or `bias`.
        option: &'static str,
        /// The number.
        value: f64,
    },
    /// Under [`Ends::Loop`], the last key differs from the first.
    #[error(
        "track {track}: the last key is {degrees:.3}° from the first; a loop needs a last key that equals the first"
    )]
    OpenLoop {
        /// The track's index in the set.
        track: usize,
        /// The angle between the first key and the last in degrees; `Ends::Loop` needs equal keys.
        degrees: f64,
    },
}

/// A warning about a track that is interpolated nevertheless. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InterpolationWarning {
    /// The angular acceleration of [`C2`](crate::method::c2::C2) jumps, because no velocities that make it continuous
    /// were found.
    #[error(
        "track {track}: c2 found no curve with continuous angular acceleration; it jumps at {}, the first is key {key}; add keys in long intervals beside short ones, or use bessel-overhauser", counted(*.count, "key")
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
