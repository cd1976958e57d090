//! The interpolation methods for translations, scales and scalars, and the quantities evaluated of them.

use crate::names::names;
use crate::tracks::per_track::PerTrack;

/// A method of interpolation for vectors. Its ends are as those for rotations, but clamped ends are at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum VectorMethod {
    /// The value of the key at or before the time.
    Step,
    /// Straight lines.
    #[default]
    Linear,
    /// Cubics with tangents from the neighbouring keys, regardless of key times.
    CatmullRom,
    /// Cubics with the tangents of the parabola through three keys (Bessel, Overhauser
    /// 1968).
    BesselOverhauser,
    /// glTF's CUBICSPLINE with specified tangents, which are 0 for a track without them.
    GltfCubic,
    /// The cubic spline whose second derivative is continuous.
    C2,
    /// The cubic B-spline: its second derivative is continuous too, and it passes near its keys, not through them.
    BSpline,
}

names! {
    VectorMethod, "vector method",
    Step => "step",
    Linear => "linear",
    CatmullRom => "catmull-rom",
    BesselOverhauser => "bessel-overhauser",
    GltfCubic => "gltf-cubic",
    C2 => "c2",
    BSpline => "b-spline",
}

impl From<VectorMethod> for PerTrack<VectorMethod> {
    fn from(method: VectorMethod) -> Self {
        Self::All(method)
    }
}

/// The quantity evaluated of a scalar or a vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum ScalarQuantity {
    /// The number itself.
    #[default]
    Value,
    /// How fast it changes, units per second: the derivative of the curve. At a key it is that of the interval after
    /// the key, at the last key that of the last interval. It is 0 where a value is held, and of
    /// [`VectorMethod::Step`].
    Velocity,
    /// How fast the velocity changes, units per second squared, with the same rules.
    Acceleration,
}

names! {
    ScalarQuantity, "quantity",
    Value => "value",
    Velocity => "velocity",
    Acceleration => "acceleration",
}
