//! A method with its options.

use glam::Quat;
use rayon::prelude::*;

use crate::curve::options::{
    Ends, InterpolationError, InterpolationWarning, KeySigns, Quantity, Speed,
};
use crate::method::{CurveKind, Method, MethodInput, SmoothCurves};
use crate::names::fields::with_fields;
use crate::reference::curve::ReferenceCurve;
use crate::shader::Form;
use crate::threads::on_threads;
use crate::time::wrap::{Wrap, WrapMode};
use crate::tracks::per_track::PerTrack;
use crate::tracks::set::key_data::Tcb;
use crate::tracks::set::{Track, TrackSet};

/// A method with its options, for [`Engine::upload`](crate::engine::Engine::upload) and other functions. A [`Method`]
/// alone is converted to an interpolation with default options.
///
/// ```
/// use tumble::glam::Quat;
/// use tumble::{Device, Ends, Engine, SampleTimes, Interpolation, KeySigns, Speed, Tcb, TrackSet, WrapMode, method};
/// let mut set = TrackSet::new();
/// let keys = [0.0, 0.8, 2.0, 0.0].map(Quat::from_rotation_z);
/// set.push("wheel", &[0.0, 1.0, 2.0, 4.0], &keys)?;
/// let looped = Interpolation::new(method::CATMULL_ROM)
///     .with_ends(Ends::Loop)        // the last key repeats the first
///     .with_after(WrapMode::Loop)   // and behind it the track starts again
///     .with_signs(KeySigns::Shortest)
///     .with_speed(Speed::AsKeyed);
/// let engine = Engine::new(Device::Cpu)?;
/// let found = engine.evaluate(&set, looped, &SampleTimes::at(vec![1.0, 5.0]))?;
/// assert_eq!(found.get(0, 0), found.get(0, 1));
///
/// // Kochanek-Bartels with a tension of 1 stands still at its keys.
/// let tcb = Tcb { tension: 1.0, continuity: 0.0, bias: 0.0 };
/// let still = Interpolation::new(method::KOCHANEK_BARTELS).with_tcb(tcb);
/// let near = engine.evaluate(&set, still, &SampleTimes::at(vec![1.0, 1.001]))?;
/// assert!(near.as_quats()[0].angle_between(near.as_quats()[1]) < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Interpolation {
    /// The method.
    pub method: Method,
    /// Which sign of each key is used, and so the direction of the rotation between keys.
    pub signs: KeySigns,
    /// The curve at the first and at the last key.
    pub ends: Ends,
    /// Tension, continuity and bias for [`KOCHANEK_BARTELS`](crate::method::kochanek_bartels::KOCHANEK_BARTELS), for
    /// tracks without values at their keys.
    pub tcb: Tcb,
    /// The quantity to evaluate: the rotation, its velocity or its acceleration.
    pub quantity: Quantity,
    /// The speed on the curve.
    pub speed: Speed,
    /// The wrap mode before a track's first key.
    pub before: WrapMode,
    /// The wrap mode after a track's last key.
    pub after: WrapMode,
}

with_fields! {
    Interpolation:
    with_method(method: Method),
    with_signs(signs: KeySigns),
    with_ends(ends: Ends),
    with_tcb(tcb: Tcb),
    with_quantity(quantity: Quantity),
    with_speed(speed: Speed),
    with_before(before: WrapMode),
    with_after(after: WrapMode),
}

impl Interpolation {
    /// A method with its default options.
    #[must_use]
    pub fn new(method: Method) -> Self {
        method.into()
    }

    /// The form that the kernels evaluate.
    #[must_use]
    pub fn form(&self) -> Form {
        match self.method.form {
            Form::Arc if self.is_by_formula() => Form::Polynomial,
            form => form,
        }
    }

    /// Refuses numbers for which no curve exists. Every evaluation does this; call it to check earlier.
    ///
    /// # Errors
    /// When an end velocity, a tension, a continuity or a bias is not finite, or is too large.
    pub fn check(&self) -> Result<(), InterpolationError> {
        self.ends.check_velocities()?;
        match self.tcb.refused() {
            Some((option, value)) => Err(InterpolationError::Tcb { option, value }),
            None => Ok(()),
        }
    }

    /// As [`Interpolation::check`], and whether the quantity is defined outside the keys: a mirrored velocity is not.
    pub(crate) fn check_wraps(&self) -> Result<(), InterpolationError> {
        self.check()?;
        match self.quantity {
            Quantity::Velocity(_) if self.mirrors() => Err(InterpolationError::MirroredVelocity),
            _ => Ok(()),
        }
    }

    /// Whether tracks are played backwards somewhere.
    pub(crate) fn mirrors(&self) -> bool {
        [self.before, self.after].contains(&WrapMode::Mirror)
    }

    /// Which sign of each key of a track is used: where the method prescribes it, tangents belong to the signs that the
    /// keys have.
    pub(crate) fn signs_of(&self, track: Track<'_>) -> KeySigns {
        match self.method.signs {
            Some(prescribed) if !track.tangents.is_empty() => prescribed,
            _ => self.signs,
        }
    }

    /// As [`Interpolation::check`], and whether the track `index` of a set fits the ends.
    pub(crate) fn check_track(
        &self,
        keys: &[Quat],
        index: usize,
    ) -> Result<(), InterpolationError> {
        self.check()?;
        self.ends.check_loop(keys, index)
    }

    /// Warnings about the curves of a set that can be evaluated nevertheless: the keys at which the angular
    /// acceleration of [`C2`](crate::method::C2) jumps. This takes as long as preparing the tracks. Other methods
    /// have no warnings.
    ///
    /// ```
    /// use tumble::glam::Quat;
    /// use tumble::{Interpolation, TrackSet, method};
    /// let mut set = TrackSet::new();
    /// let keys = [0.0, 0.3, 0.7, 0.2].map(Quat::from_rotation_z);
    /// set.push("elbow", &[0.0, 1.0, 1.05, 2.0], &keys)?;
    /// assert!(Interpolation::from(method::C2).warnings(&set).is_empty());
    /// # Ok::<(), tumble::TrackError>(())
    /// ```
    #[must_use]
    pub fn warnings(&self, set: &TrackSet) -> Vec<InterpolationWarning> {
        let (CurveKind::Smooth(smooth) | CurveKind::Arcs(smooth)) = *self.method.curves else {
            return Vec::new();
        };
        let MethodInput::Velocities { jumps, .. } = smooth.input else {
            return Vec::new();
        };
        let of_track = |index: usize| {
            if self
                .check_track(set.times_and_keys(index).1, index)
                .is_err()
            {
                return None;
            }
            let track = set.track(index);
            let keys = jumps(track, self.signs_of(track).signs(set, index), self);
            Some(InterpolationWarning::AccelerationJumps {
                track: index,
                key: *keys.first()?,
                count: keys.len(),
            })
        };
        let tracks = 0..set.track_count();
        let together = || {
            tracks
                .clone()
                .into_par_iter()
                .filter_map(of_track)
                .collect()
        };
        // If no threads can be started, the calling thread does all the work.
        on_threads(together).unwrap_or_else(|_| tracks.clone().filter_map(of_track).collect())
    }

    /// The smooth curves with key times and shortest paths, if the options request these.
    pub(crate) fn plain(&self) -> Option<SmoothCurves> {
        let is_plain = self.signs == KeySigns::Shortest
            && self.quantity == Quantity::Rotation
            && self.speed == Speed::AsKeyed;
        match *self.method.curves {
            CurveKind::Smooth(smooth) if is_plain => Some(smooth),
            _ => None,
        }
    }

    /// Whether tracks of two keys rotate about one axis at constant speed.
    pub(crate) fn is_steady_alone(&self) -> bool {
        self.plain().is_some_and(|smooth| smooth.steady_alone)
    }

    /// Whether arcs are prepared by their formula, as other curves are. Velocities, accelerations, extrapolation and
    /// constant speed need the derivatives.
    pub(crate) fn is_by_formula(&self) -> bool {
        let extrapolates = [self.before, self.after].contains(&WrapMode::Extrapolate);
        let constant = self.speed == Speed::Constant;
        self.quantity != Quantity::Rotation || extrapolates || constant
    }

    /// Whether each key is held until the next one.
    pub(crate) fn steps(&self) -> bool {
        matches!(*self.method.curves, CurveKind::Steps)
    }

    pub(crate) fn wrap(&self) -> Wrap {
        Wrap {
            before: self.before,
            after: self.after,
        }
    }
}

impl ReferenceCurve {
    /// The textbook curve of a track of a set.
    #[must_use]
    pub fn of(interpolation: &Interpolation, track: Track<'_>) -> Self {
        let &Interpolation {
            method, ends, tcb, ..
        } = interpolation;
        let signs = interpolation.signs_of(track);
        let curve = Self::of_track(method.reference(), signs, ends, tcb, track);
        match interpolation.speed {
            Speed::AsKeyed => curve,
            Speed::Constant => curve.at_constant_speed(),
        }
    }
}

impl<I: Into<Interpolation>> From<I> for PerTrack<Interpolation> {
    fn from(interpolation: I) -> Self {
        Self::All(interpolation.into())
    }
}
