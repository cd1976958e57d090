//! A method with its options.

use crate::curve::options::{Ends, Path, Quantity, Speed};
use crate::fit::tangent_weights::WeightRule;
use crate::method::{Curves, Method};
use crate::reference::curve::Curve;
use crate::shader::Form;
use crate::time::wrap::{Wrap, WrapMode};
use crate::tracks::key_data::Tcb;
use crate::tracks::set::Track;

/// A method with its options: what [`Engine::upload`](crate::engine::Engine::upload)
/// takes. A bare [`Method`] has the default options.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation {
    /// The method.
    pub method: Method,
    /// Which way round, of the two.
    pub path: Path,
    /// What happens at the first and the last key.
    pub ends: Ends,
    /// For [`KOCHANEK_BARTELS`](crate::method::kochanek_bartels::KOCHANEK_BARTELS), where a track has none of its own.
    pub tcb: Tcb,
    /// What of the rotation is asked for.
    pub quantity: Quantity,
    /// How fast the curve is run through.
    pub speed: Speed,
    /// What lies before a track's first key, and after its last.
    pub before: WrapMode,
    /// See `before`.
    pub after: WrapMode,
}

impl Interpolation {
    /// What the kernels evaluate for it.
    #[must_use]
    pub fn form(&self) -> Form {
        match self.method.form {
            Form::Arc if self.is_by_formula() => Form::Polynomial,
            form => form,
        }
    }

    /// Whether tracks of two keys turn about one axis at constant speed.
    pub(crate) fn is_steady_alone(&self) -> bool {
        let Curves::Smooth(smooth) = self.method.curves else {
            return false;
        };
        smooth.steady_alone
            && self.path == Path::Shortest
            && self.quantity == Quantity::Rotation
            && self.speed == Speed::AsKeyed
    }

    /// How curves that turn little follow from keys alone, where every key counts with the
    /// sign nearer to its predecessor's.
    pub(crate) fn small_angle_weights(&self) -> Option<WeightRule> {
        let Curves::Smooth(smooth) = self.method.curves else {
            return None;
        };
        let suits = self.path == Path::Shortest
            && self.quantity == Quantity::Rotation
            && self.speed == Speed::AsKeyed;
        smooth.direct.filter(|_| suits).map(|direct| direct.weights)
    }

    /// Whether arcs too are curves with a formula: for what follows from derivatives.
    pub(crate) fn is_by_formula(&self) -> bool {
        let extrapolates = [self.before, self.after].contains(&WrapMode::Extrapolate);
        let constant = self.speed == Speed::Constant;
        self.quantity != Quantity::Rotation || extrapolates || constant
    }

    pub(crate) fn wrap(&self) -> Wrap {
        Wrap {
            before: self.before,
            after: self.after,
        }
    }
}

impl Curve {
    /// The curve of a track of a set, as the textbook has it.
    #[must_use]
    pub fn of(interpolation: &Interpolation, track: Track<'_>) -> Self {
        let &Interpolation {
            method, path, ends, ..
        } = interpolation;
        let curve = Self::of_track(method.reference, path, ends, interpolation.tcb, track);
        match interpolation.speed {
            Speed::AsKeyed => curve,
            Speed::Constant => curve.at_constant_speed(),
        }
    }
}

impl From<Method> for Interpolation {
    fn from(method: Method) -> Self {
        Self {
            method,
            path: method.path.unwrap_or_default(),
            ends: method.ends,
            tcb: Tcb::default(),
            quantity: Quantity::Rotation,
            speed: Speed::AsKeyed,
            before: WrapMode::Hold,
            after: WrapMode::Hold,
        }
    }
}
