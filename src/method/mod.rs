//! Methods: how the rotation between keys follows from the keys.
//!
//! One file per method, and the only place that names it. A method turns a track's
//! keys into curves, one for each key interval; the few forms those curves have
//! are what the kernels evaluate ([`Form`]). [`METHODS`] lists them all.

mod b_spline;
mod bessel_overhauser;
mod catmull_rom;
pub(crate) mod curve;
mod ends;
mod keys;
mod slerp;

pub use b_spline::B_SPLINE;
pub use bessel_overhauser::BESSEL_OVERHAUSER;
pub use catmull_rom::CATMULL_ROM;
pub(crate) use curve::Curve;
pub(crate) use keys::{DOT_NOISE, Keys};
pub use slerp::SLERP;

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use crate::reference;

/// Every method, in the order in which help and reports list them.
pub static METHODS: [Method; 4] = [SLERP, CATMULL_ROM, BESSEL_OVERHAUSER, B_SPLINE];

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
    /// How smooth it is where segments meet.
    pub continuity: &'static str,
    /// Whether it passes through its keys.
    pub interpolates: bool,
    /// What the kernels evaluate for it.
    pub form: Form,
    /// Its textbook definition in f64.
    pub reference: reference::Kind,
    /// The curves of a range of key intervals.
    pub(crate) curves: fn(&Keys, Range<usize>, &mut dyn FnMut(Curve)),
}

/// What a kernel evaluates. Many methods share one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// A great circle at constant angular velocity.
    Arc,
    /// Three rotations about fixed axes, one after another, by angles that are
    /// cubic in time.
    Cumulative,
}

impl Method {
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
}

impl From<Method> for Interpolation {
    fn from(method: Method) -> Self {
        Self {
            method,
            path: Path::default(),
            ends: Ends::default(),
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
    /// The last key repeats the first; neighbours are taken across the seam.
    Loop,
    /// The first and the last segment stand still, as in the original program.
    Frozen,
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
