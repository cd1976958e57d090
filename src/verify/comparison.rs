//! Comparison of another implementation's results with the engine's bits and with the f64 reference.

use std::borrow::Cow;

use glam::Quat;

use crate::device::Device;
use crate::engine::Engine;
use crate::error::Error;
use crate::memory::{OutOfMemoryError, reserved};
use crate::method::interpolation::Interpolation;
use crate::time::frames::SampleTimes;
use crate::tracks::rotation::Rotation;
use crate::tracks::set::TrackSet;
use crate::verify::{Errors, NORM_BOUND, SamplePosition, differences, error_bound, norm_excess};

/// The result of [`compare`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Comparison {
    /// The method's name.
    pub method: &'static str,
    /// The number of compared rotations.
    pub rotations: u64,
    /// The number of rotations whose bits differ from the engine's (which are the same on every device).
    pub differing: u64,
    /// The number of those rotations that equal the engine's with the other sign: `q` and `-q` are the same rotation.
    pub of_other_sign: u64,
    /// The first rotation whose bits differ.
    pub first_difference: Option<SamplePosition>,
    /// The largest angle in radians between the compared rotations and the reference.
    pub max_error: f64,
    /// The root mean square of that angle in radians.
    pub rms_error: f64,
    /// The sample with the largest error.
    pub worst: Option<SamplePosition>,
    /// The largest | |q| - 1 | of the compared rotations.
    pub max_norm_error: f64,
    /// The largest angle in radians between the engine's result and the reference.
    pub engine_error: f64,
    /// The bound in radians of `max_error` for the engine.
    pub error_bound: f64,
    /// The bound of `max_norm_error` for the engine.
    pub norm_bound: f64,
}

/// The agreement of results with the engine and the reference. The agreement of several comparisons is the greatest
/// of theirs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Agreement {
    /// The bits are the engine's, and the errors are within the bounds.
    SameBits,
    /// Some bits differ, but the errors are within the bounds: those of the engine against the f64 reference, or those
    /// that the caller gave.
    WithinBounds,
    /// There was nothing to compare, or nothing was written ([`UNWRITTEN`](crate::verify::UNWRITTEN)).
    Nothing,
    /// An error exceeds its bound, or a number is NaN.
    OutsideBounds,
}

impl Comparison {
    /// The agreement that these numbers show, with the bounds that the engine must meet.
    #[must_use]
    pub fn agreement(&self) -> Agreement {
        self.judged(self.error_bound, self.norm_bound)
    }

    /// The agreement with a bound of your choice for the angle to the reference in radians. Norms may differ from 1 by
    /// as much, or by as much as the engine's.
    #[must_use]
    pub fn agreement_within(&self, radians: f64) -> Agreement {
        self.judged(radians, self.norm_bound.max(radians))
    }

    fn judged(&self, error_bound: f64, norm_bound: f64) -> Agreement {
        let is_within_bounds = self.max_error <= error_bound && self.max_norm_error <= norm_bound;
        match self.differing {
            _ if self.rotations == 0 => Agreement::Nothing,
            _ if !is_within_bounds => Agreement::OutsideBounds,
            0 => Agreement::SameBits,
            _ => Agreement::WithinBounds,
        }
    }
}

/// The comparison and its result, in one line.
impl std::fmt::Display for Comparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            method, rotations, ..
        } = self;
        if self.rotations == 0 {
            return write!(f, "{method}: there was no rotation, nothing was compared");
        }
        let verdict = match self.agreement() {
            Agreement::OutsideBounds => "outside the bounds",
            _ => "within the bounds",
        };
        write!(
            f,
            "{method}: {rotations} rotations, {} with other bits than the engine's CPU ({} of them with the other \
             sign), {verdict}: {:.2e} rad from the f64 reference (bound {:.0e}, the engine itself {:.2e}), norms \
             within {:.1e} of 1 (bound {:.1e})",
            self.differing,
            self.of_other_sign,
            self.max_error,
            self.error_bound,
            self.engine_error,
            self.max_norm_error,
            self.norm_bound
        )?;
        match self.worst {
            Some(SamplePosition { track, frame, time }) if self.max_error > self.error_bound => {
                write!(f, "; worst at track {track}, frame {frame}, {time} s")
            }
            _ => Ok(()),
        }
    }
}

/// Compares results of another implementation with the engine's bits, which the CPU computes, and with the f64
/// reference. It is for tests of a renderer's or game's code that samples clips. `theirs` has the samples of the
/// first track, then those of the second, and so on, `x y z w`.
///
/// This function does not know which device computed `theirs`. A test of a GPU should call
/// [`Device::first_vulkan`](crate::Device::first_vulkan), which fails if there is no Vulkan device.
///
/// ```
/// use tumble::{SampleTimes, TrackSet, method};
/// use tumble::verify::{Agreement, compare};
/// # use glam::Quat;
/// # let mut set = TrackSet::new();
/// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)])?;
/// // In place of this: read the buffer of your kernel.
/// let theirs: Vec<[f32; 4]> = (0..=25)
///     .map(|frame| Quat::IDENTITY.slerp(Quat::from_rotation_x(1.0), frame as f32 / 25.0).into())
///     .collect();
/// let found = compare(&set, method::SLERP.into(), &SampleTimes::fps(25), &theirs)?;
/// assert!(found.agreement() <= Agreement::WithinBounds, "{found}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`Engine::evaluate`]; and [`Error::ComparedLength`] when `theirs` has not one rotation for each sample of each
/// track.
pub fn compare<R: Rotation>(
    set: &TrackSet,
    interpolation: Interpolation,
    frames: &SampleTimes,
    theirs: &[R],
) -> Result<Comparison, Error> {
    let theirs = quats(theirs)?;
    let theirs = &*theirs;
    let timeline = frames.resolve(set.track_count(), set.time_span())?;
    let engine = Engine::new(Device::Cpu)?.evaluate(set, interpolation, frames)?;
    let engine = engine.as_quats();
    if theirs.len() != engine.len() {
        return Err(Error::ComparedLength {
            length: theirs.len(),
            needed: engine.len(),
        });
    }
    let (differing, first) = differences(theirs, engine, 1);
    let bits = |quat: Quat| quat.to_array().map(f32::to_bits);
    let pairs = theirs.iter().zip(engine);
    let of_other_sign = pairs
        .filter(|&(&their, &our)| bits(their) != bits(our) && their == -our)
        .count();
    let found = Errors::measure(set, interpolation, &timeline, theirs)?;
    Ok(Comparison {
        method: interpolation.method.name,
        rotations: theirs.len() as u64,
        differing,
        of_other_sign: of_other_sign as u64,
        first_difference: first.map(|index| SamplePosition::new(&timeline, index)),
        max_error: found.max,
        rms_error: found.rms,
        worst: found.worst,
        max_norm_error: found.norm,
        engine_error: Errors::measure(set, interpolation, &timeline, engine)?.max,
        error_bound: error_bound(interpolation.form()),
        norm_bound: NORM_BOUND + norm_excess(set),
    })
}

/// The rotations as quaternions, aligned to 16 bytes; copied if they are not aligned.
fn quats<R: Rotation>(rotations: &[R]) -> Result<Cow<'_, [Quat]>, OutOfMemoryError> {
    if let Ok(quats) = bytemuck::try_cast_slice(rotations) {
        return Ok(Cow::Borrowed(quats));
    }
    let mut quats = reserved(rotations.len(), "the rotations to compare")?;
    quats.extend(rotations.iter().map(|rotation| rotation.quat()));
    Ok(Cow::Owned(quats))
}
