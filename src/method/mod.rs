//! Methods: how the rotation between keys follows from the keys.
//!
//! One file per method, and the only place that names it. A method turns a track's
//! keys into curves, one for each key interval; the few forms those curves have
//! are what the kernels evaluate ([`Form`]). [`METHODS`] lists them all.

mod b_spline;
mod bessel_overhauser;
mod bessel_overhauser_mean;
mod c2;
mod catmull_rom;
mod ends;
mod gltf_cubic;
mod hermite;
mod kochanek_bartels;
mod nlerp;
mod shoemake;
mod shoemake_1985;
mod shoemake_2;
mod slerp;
mod squad;
mod step;

pub use b_spline::B_SPLINE;
pub use bessel_overhauser::BESSEL_OVERHAUSER;
pub use bessel_overhauser_mean::BESSEL_OVERHAUSER_MEAN;
pub use c2::C2;
pub use catmull_rom::CATMULL_ROM;
pub use gltf_cubic::GLTF_CUBIC;
pub use hermite::HERMITE;
pub use kochanek_bartels::KOCHANEK_BARTELS;
pub use nlerp::NLERP;
pub use shoemake::SHOEMAKE;
pub use shoemake_2::SHOEMAKE_2;
pub use shoemake_1985::SHOEMAKE_1985;
pub use slerp::SLERP;
pub use squad::SQUAD;
pub use step::STEP;

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use crate::branchless::{self, Vector, length, log, unit};
use crate::cycle::{Outside, Sides};
use crate::prepare::{Intervals, Shape, Stretch};
use crate::reference;
use crate::tracks::{Tcb, Track};

/// Every method, in the order in which help and reports list them.
pub static METHODS: [Method; 15] = [
    STEP,
    NLERP,
    SLERP,
    SHOEMAKE,
    SHOEMAKE_2,
    SHOEMAKE_1985,
    SQUAD,
    CATMULL_ROM,
    BESSEL_OVERHAUSER,
    BESSEL_OVERHAUSER_MEAN,
    B_SPLINE,
    HERMITE,
    KOCHANEK_BARTELS,
    GLTF_CUBIC,
    C2,
];

/// A method of interpolation: one of [`METHODS`].
///
/// ```
/// let method: tumble::Method = "catmull-rom".parse()?;
/// assert_eq!(method.name, "catmull-rom");
/// # Ok::<(), tumble::method::UnknownMethod>(())
/// ```
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Method {
    /// The name by which programs call it.
    pub name: &'static str,
    /// What it is for, in one sentence.
    pub summary: &'static str,
    /// Its formula, in the notation of the documentation.
    pub formula: &'static str,
    /// Where the formula comes from.
    pub source: &'static str,
    /// How smooth it is where segments meet, whatever the key times.
    pub continuity: Continuity,
    /// How smooth it is where keys are evenly spaced in time.
    pub continuity_on_even_keys: Continuity,
    /// For which keys a rotation at constant velocity stays one.
    pub keeps_constant_velocity: Keys,
    /// Whether it passes through its keys.
    pub interpolates: bool,
    /// Whether it takes the same way when the keys are given backwards in time (with
    /// tangents and bias the other way round).
    pub symmetric: bool,
    /// Whether its curves depend on keys beyond the two that they join: then [`Ends`]
    /// matter.
    pub uses_neighbours: bool,
    /// What the kernels evaluate for it.
    pub form: Form,
    /// What it does at the ends where nothing else is asked for.
    pub ends: Ends,
    /// The path that it always takes, where that is a part of its definition.
    pub path: Option<Path>,
    /// Its textbook definition in f64.
    pub reference: reference::Kind,
    /// How its curves follow from the keys.
    pub(crate) curves: Curves,
}

/// What lies between two keys.
#[derive(Clone, Copy)]
pub(crate) enum Curves {
    /// The first of them.
    Steps,
    /// The great circle, at constant speed; and as a formula.
    Arcs(Smooth),
    /// A curve with a formula.
    Smooth(Smooth),
}

/// How a method's curves follow from the keys.
#[derive(Clone, Copy)]
pub(crate) struct Smooth {
    pub(crate) shape: &'static Shape,
    /// Gives every interval of a block the numbers of its curve, with those ends where a
    /// track ends.
    pub(crate) curves: fn(&mut Intervals, &[Stretch], Ends),
    pub(crate) given: Given,
}

/// What a method knows of an interval beside its two keys.
#[derive(Clone, Copy)]
pub(crate) enum Given {
    Nothing,
    /// Numbers for the key that it starts with, and for that which it ends with.
    Numbers(fn(Track, usize, &Interpolation) -> [[f64; 4]; 2]),
    /// The angular velocity at every key of some intervals (rad/s, body frame), where
    /// each depends on all keys.
    Velocities(fn(Track, Range<usize>, &Interpolation) -> Vec<Vector>),
}

impl Smooth {
    const fn new(shape: &'static Shape, curves: fn(&mut Intervals, &[Stretch], Ends)) -> Self {
        Self {
            shape,
            curves,
            given: Given::Nothing,
        }
    }

    const fn with(self, given: Given) -> Self {
        Self { given, ..self }
    }
}

/// What a kernel evaluates. Many methods share one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// A great circle at constant angular velocity.
    Arc,
    /// A polynomial in time for each component, fitted to the curve.
    Polynomial,
}

/// How smooth a curve is where its segments meet. With given tangents, tension or
/// continuity of their own, keys may be less smooth than the method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Continuity {
    /// The rotation jumps.
    Jumps,
    /// The rotation is continuous.
    C0,
    /// So is the angular velocity.
    C1,
    /// So is the angular acceleration.
    C2,
}

impl fmt::Display for Continuity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Jumps => "jumps",
            Self::C0 => "C0",
            Self::C1 => "C1",
            Self::C2 => "C2",
        })
    }
}

/// Key times of which something holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Keys {
    /// None.
    Never,
    /// Those evenly spaced.
    Even,
    /// All.
    Any,
}

impl Method {
    /// How smooth it is, in words.
    pub fn smoothness(&self) -> String {
        match (self.continuity, self.continuity_on_even_keys) {
            (any, even) if any == even => any.to_string(),
            (any, even) => format!("{any}, {even} on even keys"),
        }
    }

    /// The method with that name.
    pub fn named(name: &str) -> Option<Self> {
        METHODS.iter().copied().find(|method| method.name == name)
    }
}

impl fmt::Debug for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Method").field(&self.name).finish()
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name)
    }
}

impl PartialEq for Method {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Method {}

/// A name that is no method's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no method `{name}`; there are {}", method_names())]
pub struct UnknownMethod {
    /// The name given.
    pub name: String,
}

fn method_names() -> String {
    METHODS.map(|method| method.name).join(", ")
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        Self::named(name).ok_or_else(|| UnknownMethod {
            name: name.to_owned(),
        })
    }
}

/// A method with its options: what [`Engine::upload`](crate::Engine::upload)
/// takes. A bare [`Method`] has the default options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation {
    /// The method.
    pub method: Method,
    /// Which way round, of the two.
    pub path: Path,
    /// What happens at the first and the last key.
    pub ends: Ends,
    /// For [`KOCHANEK_BARTELS`], where a track has none of its own.
    pub tcb: Tcb,
    /// What of the rotation is asked for.
    pub quantity: Quantity,
    /// What lies before a track's first key, and after its last.
    pub before: Outside,
    /// See `before`.
    pub after: Outside,
}

impl Interpolation {
    /// What the kernels evaluate for it.
    pub fn form(&self) -> Form {
        if self.is_by_formula() {
            Form::Polynomial
        } else {
            self.method.form
        }
    }

    /// Whether arcs too are curves with a formula: for what follows from derivatives.
    pub(crate) fn is_by_formula(&self) -> bool {
        let extrapolates = [self.before, self.after].contains(&Outside::Extrapolate);
        self.quantity != Quantity::Rotation || extrapolates
    }

    pub(crate) fn sides(&self) -> Sides {
        Sides {
            before: self.before,
            after: self.after,
        }
    }
}

/// What is evaluated: the rotation, or how fast it changes. Velocities and accelerations
/// are vectors, `x y z` and 0 in the place of `w`; by the derivative of the formula. On
/// a key they are those of the segment behind it, on the last key those of the last
/// segment; before the first key and behind the last nothing moves.
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

/// Whose axes a vector is given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axes {
    /// Those of what turns.
    Body,
    /// Those of what it turns in: of the parent, in a chain.
    World,
}

impl From<Method> for Interpolation {
    fn from(method: Method) -> Self {
        Self {
            method,
            path: method.path.unwrap_or_default(),
            ends: method.ends,
            tcb: Tcb::default(),
            quantity: Quantity::Rotation,
            before: Outside::Hold,
            after: Outside::Hold,
        }
    }
}

/// Which of the two quaternions of each key counts: `q` and `-q` are one rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Path {
    /// Each key is taken with the sign nearer to its predecessor, so no rotation
    /// goes the long way round. Keys 180° apart keep the sign they were given.
    #[default]
    Shortest,
    /// Signs as given: a dot product below zero turns the long way.
    AsAuthored,
}

/// Dot products nearer to zero than this are rounding noise of f32 keys: the signs
/// given decide, never the noise.
const DOT_NOISE: f64 = 1.0 / (1u64 << 21) as f64;

impl Path {
    /// A key counts with the other sign where its dot product with its predecessor
    /// is below this.
    pub(crate) fn flips_below(self) -> f64 {
        match self {
            Self::Shortest => -DOT_NOISE,
            Self::AsAuthored => f64::NEG_INFINITY,
        }
    }

    /// Whether there is no path between keys with that dot product.
    pub(crate) fn refuses(self, dot: f64) -> bool {
        self == Self::AsAuthored && dot < -1.0 + f64::from(f32::EPSILON)
    }
}

/// What happens in the first and in the last segment, where a neighbour is missing.
/// Two keys are joined by slerp whatever the ends.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
    /// The angular velocity of slerp between the last two keys: constant velocity stays
    /// constant too. [`C2`]'s own ends.
    Secant,
    /// The last key repeats the first; neighbours are taken across the seam.
    Loop,
    /// The first and the last segment stand still, as in the original program.
    Frozen,
}

/// How far the last key of a loop may be from the first (half-angle, radians).
const LOOP_TOLERANCE: f64 = 1e-3;

/// Radians per second at an end; more is refused.
const FASTEST: f64 = 1e12;

impl Ends {
    /// Refuses a track, the `index`th of its set, that does not end as it must.
    pub(crate) fn check(self, track: Track, index: usize) -> Result<(), InterpolationError> {
        if let Self::Clamped { start, end } = self {
            for velocity in [start, end] {
                let speed = length(velocity.to_array());
                if !speed.is_finite() || speed > FASTEST {
                    return Err(InterpolationError::EndVelocity { velocity });
                }
            }
        }
        let (Self::Loop, [first, .., last]) = (self, track.keys) else {
            return Ok(());
        };
        let seam = branchless::step(unit(first.to_array()), unit(last.to_array()));
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

/// Why a track cannot be interpolated as asked. Places count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InterpolationError {
    /// Under [`Path::AsAuthored`] neighbouring keys are each other's negative: no
    /// great circle is defined.
    #[error(
        "track {track}: keys {key} and {} are opposite quaternions, between which as-authored has no path; flip one sign or use the shortest path",
        key + 1
    )]
    Antipodal {
        /// The track's place in the set.
        track: usize,
        /// The first of the two keys.
        key: usize,
    },
    /// Under [`Outside::Mirror`] velocities would change their signs from copy to copy.
    #[error("velocities are not mirrored; hold, loop or extrapolate them")]
    MirroredVelocity,
    /// Under [`Ends::Clamped`] a velocity is no number, or too large.
    #[error(
        "the end velocity ({}, {}, {}) rad/s cannot be met; give a finite one of at most 1e12",
        velocity.x, velocity.y, velocity.z
    )]
    EndVelocity {
        /// What was given.
        velocity: glam::DVec3,
    },
    /// Under [`Ends::Loop`] the last key must repeat the first.
    #[error(
        "track {track}: the last key is {degrees:.3}° from the first; a loop needs the last key to repeat the first"
    )]
    OpenLoop {
        /// The track's place in the set.
        track: usize,
        /// Angle between first and last key, degrees.
        degrees: f64,
    },
}
