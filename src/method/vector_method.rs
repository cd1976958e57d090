//! The interpolation methods for translations and scales.

use std::fmt;
use std::str::FromStr;

/// A method of interpolation for vectors. Its ends are as those for rotations, but clamped ends are
/// at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum VectorMethod {
    /// The key at or before the time.
    Step,
    /// Straight lines.
    #[default]
    Linear,
    /// Cubics with tangents from the neighbouring keys; they ignore the time steps.
    CatmullRom,
    /// Cubics with the tangents of the parabola through three keys (Bessel, Overhauser
    /// 1968).
    BesselOverhauser,
    /// glTF's CUBICSPLINE with given tangents, which are 0 for a track without them.
    GltfCubic,
    /// The cubic spline whose second derivative is continuous.
    C2,
    /// The cubic B-spline: its second derivative is continuous too, and it passes near its keys and
    /// not through them.
    BSpline,
}

impl VectorMethod {
    /// All methods for vectors.
    pub const ALL: [Self; 7] = [
        Self::Step,
        Self::Linear,
        Self::CatmullRom,
        Self::BesselOverhauser,
        Self::GltfCubic,
        Self::C2,
        Self::BSpline,
    ];

    /// The name by which programs call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Linear => "linear",
            Self::CatmullRom => "catmull-rom",
            Self::BesselOverhauser => "bessel-overhauser",
            Self::GltfCubic => "gltf-cubic",
            Self::C2 => "c2",
            Self::BSpline => "b-spline",
        }
    }
}

impl fmt::Display for VectorMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The error for a name that no method for vectors has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no method `{name}` for vectors; there are {}",
    VectorMethod::ALL.map(VectorMethod::name).join(", ")
)]
pub struct UnknownVectorMethod {
    /// The name given.
    pub name: String,
}

impl FromStr for VectorMethod {
    type Err = UnknownVectorMethod;

    fn from_str(name: &str) -> Result<Self, UnknownVectorMethod> {
        let found = Self::ALL.into_iter().find(|method| method.name() == name);
        found.ok_or_else(|| UnknownVectorMethod {
            name: name.to_owned(),
        })
    }
}
