//! Methods: rules that define a curve through keys.
//!
//! Each method has a source file. A method computes from a track's keys one curve for each key interval. The kernels
//! evaluate these curves in one of a few forms ([`Form`]). [`METHODS`] lists all methods.

pub(crate) mod b_spline;
pub(crate) mod bessel_overhauser;
pub(crate) mod bessel_overhauser_mean;
pub(crate) mod c2;
pub(crate) mod catmull_rom;
pub(crate) mod ends;
pub(crate) mod gltf_cubic;
pub(crate) mod hermite;
pub(crate) mod interpolation;
pub(crate) mod interpolation_options;
pub(crate) mod kochanek_bartels;
pub(crate) mod nlerp;
pub(crate) mod shoemake;
pub(crate) mod shoemake_1985;
pub(crate) mod shoemake_2;
pub(crate) mod slerp;
pub(crate) mod squad;
pub(crate) mod step;
pub(crate) mod vector_curve;
pub(crate) mod vector_method;

pub use crate::method::b_spline::B_SPLINE;
pub use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
pub use crate::method::bessel_overhauser_mean::BESSEL_OVERHAUSER_MEAN;
pub use crate::method::c2::C2;
pub use crate::method::catmull_rom::CATMULL_ROM;
pub use crate::method::gltf_cubic::GLTF_CUBIC;
pub use crate::method::hermite::HERMITE;
pub use crate::method::kochanek_bartels::KOCHANEK_BARTELS;
pub use crate::method::nlerp::NLERP;
pub use crate::method::shoemake::SHOEMAKE;
pub use crate::method::shoemake_2::SHOEMAKE_2;
pub use crate::method::shoemake_1985::SHOEMAKE_1985;
pub use crate::method::slerp::SLERP;
pub use crate::method::squad::SQUAD;
pub use crate::method::step::STEP;
pub use crate::shader::Form;

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use crate::curve::options::{Ends, KeySigns};
use crate::fit::block::{Intervals, TrackStretch};
use crate::fit::exact::fit::Shape;
use crate::fit::exact::handles::{ExactSteps, HandleRule};
use crate::fit::fast::handles::HandlesF32;
use crate::fit::fast::long_tangents::set_long;
use crate::fit::tangent_weights::WeightRule;
use crate::math::quaternion::Vector;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::names::{UnknownNameError, named};
use crate::reference;
use crate::reference::curve::Definition;
use crate::simd::dispatch::in_lanes;
use crate::tracks::set::Track;
use crate::tracks::signs::Signs;

/// Every method, in the order of lists in help and reports.
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
/// # Ok::<(), tumble::UnknownNameError>(())
/// ```
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Method {
    /// The name that programs use.
    pub name: &'static str,
    /// The purpose, in one sentence.
    pub summary: &'static str,
    /// The formula, in the notation of the documentation.
    pub formula: &'static str,
    /// The source of the formula.
    pub source: &'static str,
    /// The smoothness where intervals meet, for any key times.
    pub continuity: Continuity,
    /// The smoothness where intervals meet, for keys that are evenly spaced in time.
    pub continuity_on_even_keys: Continuity,
    /// The key times for which a rotation at constant angular velocity keeps this velocity.
    pub keeps_constant_velocity: Keys,
    /// Whether the curve passes through its keys.
    pub interpolates: bool,
    /// Whether reversed keys give the reversed curve (with tangents and bias reversed too).
    pub symmetric: bool,
    /// Whether a curve depends on more keys than the two at its ends. Then [`Ends`] have an effect.
    pub uses_neighbours: bool,
    /// The form of the curves that the kernels evaluate.
    pub form: Form,
    /// The default ends.
    pub ends: Ends,
    /// The signs of keys in tracks with tangents, if the method's definition prescribes them.
    pub signs: Option<KeySigns>,
    /// The computing time on one thread.
    pub cost: Cost,
    /// The method for translations and scales, if one method is requested for everything.
    pub vector_method: VectorMethod,
    /// How the curves are computed. This is a reference to a static, because otherwise every crate that names a
    /// constant would compile its functions again, and all functions that they call, for each vector width.
    pub(crate) curves: &'static CurveKind,
}

/// The default values of methods. Names, formula, curves and the method for vectors differ from method to method.
const fn defaults(vector_method: VectorMethod) -> Method {
    Method {
        name: "",
        summary: "",
        formula: "",
        source: "",
        continuity: Continuity::C0,
        continuity_on_even_keys: Continuity::C1,
        keeps_constant_velocity: Keys::Never,
        interpolates: true,
        symmetric: true,
        uses_neighbours: true,
        form: Form::Polynomial,
        ends: Ends::Parabolic,
        signs: None,
        cost: Cost::new(0.0, 0.0),
        curves: &CurveKind::Steps,
        vector_method,
    }
}

/// The kind of curve between two keys.
#[derive(Clone, Copy)]
pub(crate) enum CurveKind {
    /// The first key is held.
    Steps,
    /// The great-circle arc at constant speed, with its formula for derivatives.
    Arcs(SmoothCurves),
    /// A curve that is defined by a formula.
    Smooth(SmoothCurves),
}

/// How a method's curves are computed.
#[derive(Clone, Copy)]
pub(crate) struct SmoothCurves {
    pub(crate) shape: &'static Shape,
    /// Sets the numbers of every curve in a block, with these ends.
    pub(crate) curves: fn(&mut Intervals, &[TrackStretch], Ends),
    pub(crate) input: MethodInput,
    /// Whether a track of two keys rotates at constant velocity, for any ends.
    pub(crate) steady_alone: bool,
    /// How curves are computed in f32 directly from keys, for methods that allow it.
    pub(crate) fast: Option<FastCurves>,
}

/// How curves are computed directly from keys, without additional numbers.
#[derive(Clone, Copy)]
pub(crate) struct FastCurves {
    /// The rule for the tangent weights.
    pub(crate) weights: WeightRule,
    /// Sets, in f64, the handles of keys whose tangents are too long for f32's formulas.
    pub(crate) set_long: fn(&mut HandlesF32, &[usize], &Intervals),
}

/// The numbers of a method for an interval in addition to its keys.
#[derive(Clone, Copy)]
pub(crate) enum MethodInput {
    Nothing,
    /// Numbers for the key at the interval's start, and for the key at its end.
    Numbers(fn(Track, usize, &Interpolation) -> [[f64; 4]; 2]),
    Velocities {
        /// The angular velocity at every key of some intervals (rad/s, body frame); each depends on all keys of the
        /// track.
        solve: fn(Track, Signs<'_>, Range<usize>, &Interpolation) -> Vec<Vector>,
        /// The keys of a track at which these velocities do not give the smoothness of the method.
        jumps: fn(Track, Signs<'_>, &Interpolation) -> Vec<usize>,
    },
}

impl Method {
    /// Whether equations of many keys are solved for each curve.
    pub(crate) fn is_solved(&self) -> bool {
        match self.curves {
            CurveKind::Smooth(smooth) | CurveKind::Arcs(smooth) => {
                matches!(smooth.input, MethodInput::Velocities { .. })
            }
            CurveKind::Steps => false,
        }
    }
}

impl SmoothCurves {
    const fn new(shape: &'static Shape, curves: fn(&mut Intervals, &[TrackStretch], Ends)) -> Self {
        Self {
            shape,
            curves,
            input: MethodInput::Nothing,
            steady_alone: false,
            fast: None,
        }
    }

    /// Allows curves directly from keys; tracks of two keys then rotate at constant velocity.
    const fn fast<R: HandleRule>(self, weights: WeightRule) -> Self {
        Self {
            steady_alone: true,
            fast: Some(FastCurves {
                weights,
                set_long: set_long::<R>,
            }),
            ..self
        }
    }

    const fn with(self, input: MethodInput) -> Self {
        Self { input, ..self }
    }

    /// Computes the curves of a block's intervals.
    pub(crate) fn find_curves(
        &self,
        intervals: &mut Intervals,
        stretches: &[TrackStretch],
        ends: Ends,
    ) {
        in_lanes(&mut ExactSteps(intervals));
        (self.curves)(intervals, stretches, ends);
    }
}

/// The smoothness of a curve at its keys, where intervals meet. With specified tangents, tension or continuity of keys,
/// a curve may be less smooth than its method says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Continuity {
    /// The rotation jumps.
    Jumps,
    /// The rotation is continuous.
    C0,
    /// The angular velocity is continuous too.
    C1,
    /// The angular acceleration is continuous too.
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

/// The computing time of a method on one thread, nanoseconds, for comparisons between methods. Measured with `cargo
/// bench` on a machine with AVX2, for steps up to 85°.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Cost {
    /// The time to prepare a key.
    pub key: f64,
    /// The time to evaluate a rotation.
    pub rotation: f64,
}

impl Cost {
    const fn new(key: f64, rotation: f64) -> Self {
        Self { key, rotation }
    }
}

/// The key times for which a property of a method holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Keys {
    /// The property holds for no key times.
    Never,
    /// The property holds for evenly spaced keys.
    Even,
    /// The property holds for any key times.
    Any,
}

/// The compiler refuses a method without a definition in the reference.
const _: () = {
    let mut i = 0;
    while i < METHODS.len() {
        let definition = reference::definition(METHODS[i].name);
        assert!(
            definition.is_some(),
            "a method has no Definition in src/reference/"
        );
        i += 1;
    }
};

impl Method {
    /// The textbook definition in f64. This is a function and not a field, so that only programs that compare with the
    /// reference contain the code of the reference.
    #[must_use]
    #[allow(clippy::missing_panics_doc)] // every method has one, or the engine does not compile
    pub fn reference(&self) -> Definition {
        reference::definition(self.name).expect("every method has one, as is checked above")
    }

    /// The smoothness, in words.
    #[must_use]
    pub fn smoothness(&self) -> String {
        match (self.continuity, self.continuity_on_even_keys) {
            (any, even) if any == even => any.to_string(),
            (any, even) => format!("{any}, {even} on even keys"),
        }
    }

    /// The method for scalars, and for the root of a robot, if one method is requested for everything: that of the same
    /// name, such as `c2`, or else that of vectors.
    #[must_use]
    pub fn scalar_method(&self) -> VectorMethod {
        self.name.parse().unwrap_or(self.vector_method)
    }

    /// The method with this name, if there is one.
    #[must_use]
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

impl FromStr for Method {
    type Err = UnknownNameError;

    fn from_str(name: &str) -> Result<Self, UnknownNameError> {
        named("method", &METHODS, |method| method.name, name)
    }
}
