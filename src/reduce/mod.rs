//! Key reduction, the inverse of evaluation: few keys whose curve is near to dense samples.
//!
//! Keys are samples, with their values. [`ReducedCurve::Linear`] and [`ReducedCurve::GltfCubic`] have intervals that
//! are independent of each other: each interval reaches from one key to the last sample for which it is within the
//! tolerance. The curves of [`ReducedCurve::BesselOverhauser`] depend on neighbouring keys: keys are inserted where
//! the curve is farthest from samples until it is near everywhere, and then unnecessary keys are removed.
//!
//! All computations are in f64. Every sample is checked, and none is farther from the curve than the tolerance.
//! Cubics are also checked at the middles between samples. An evaluation in f32 adds about 3e-7 rad; the tolerance
//! does not include this.

mod inserted;
mod intervals;
mod value;

use std::ops::Range;

use glam::{DQuat, DVec3};

use crate::names::{counted, names};
use crate::reduce::inserted::inserted;
use crate::reduce::intervals::longest;
use crate::reduce::value::Value;

/// The curve through the remaining keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum ReducedCurve {
    /// Shorter arcs ([`slerp`](crate::method::slerp::SLERP)) for rotations, and straight lines for vectors.
    #[default]
    Linear,
    /// [`bessel-overhauser`](crate::method::bessel_overhauser::BESSEL_OVERHAUSER), with
    /// [parabolic ends](crate::Ends::Parabolic).
    BesselOverhauser,
    /// Hermite cubics whose tangents are fitted by least squares
    /// ([`gltf-cubic`](crate::method::gltf_cubic::GLTF_CUBIC)).
    GltfCubic,
}

names! {
    ReducedCurve, "curve",
    Linear => "linear",
    BesselOverhauser => "bessel-overhauser",
    GltfCubic => "cubic",
}

/// The remaining keys of a channel.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct ReducedKeys<T> {
    /// The indices of the samples that are keys, increasing. A constant channel has one; every other channel has at
    /// least the first and the last sample.
    pub indices: Vec<usize>,
    /// The values of the keys: those of the samples. A rotation has the sign that is nearer to the previous one.
    pub keys: Vec<T>,
    /// For [`ReducedCurve::GltfCubic`] the incoming and outgoing tangent of each key, per second; otherwise empty.
    pub tangents: Vec<[T; 2]>,
    /// The largest distance of a sample from the curve, in radians or in the samples' unit.
    pub error: f64,
}

/// Why samples cannot be reduced.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReduceError {
    /// The numbers of samples and of times differ.
    #[error("{} and {}; give a time for each sample", counted(*.samples, "sample"), counted(*.times, "time"))]
    Lengths {
        /// The number of samples.
        samples: usize,
        /// The number of times.
        times: usize,
    },
    /// A time is not finite, or not after the previous one.
    #[error("time {index} is {time} s; times must be finite and increase")]
    Time {
        /// The time's index, from 0.
        index: usize,
        /// The time in seconds.
        time: f64,
    },
    /// A sample is not finite, or is a rotation with norm 0.
    #[error("sample {index} is not finite")]
    Sample {
        /// The sample's index, from 0.
        index: usize,
    },
    /// A tolerance is negative or not finite.
    #[error("the tolerance is {tolerance}; give a finite number of 0 or more")]
    Tolerance {
        /// The tolerance.
        tolerance: f64,
    },
}

/// Reduces a channel of rotations: every sample is within `tolerance` radians of the curve through the keys. Times
/// are seconds.
///
/// ```
/// use glam::DQuat;
/// use tumble::reduce::{ReducedCurve, reduce_rotations};
/// let times: Vec<f64> = (0..100).map(|i| f64::from(i) / 100.0).collect();
/// let even: Vec<DQuat> = times.iter().map(|&t| DQuat::from_rotation_y(t)).collect();
/// let reduced = reduce_rotations(&times, &even, 1e-4, ReducedCurve::Linear)?;
/// assert_eq!(reduced.indices, [0, 99]);
/// # Ok::<(), tumble::reduce::ReduceError>(())
/// ```
///
/// # Errors
/// * When the numbers of times and samples differ, or the times are not finite and increasing.
/// * When a sample is not finite or has norm 0.
/// * When the tolerance is negative or not finite.
pub fn reduce_rotations(
    times: &[f64],
    samples: &[DQuat],
    tolerance: f64,
    curve: ReducedCurve,
) -> Result<ReducedKeys<DQuat>, ReduceError> {
    let unit_samples = continued(samples);
    let task = ReductionTask::new(times, &unit_samples, tolerance)?;
    let mut found = reduced(times.len(), &[task], &[], curve);
    Ok(found.rotations.pop().unwrap_or_default())
}

/// Reduces a channel of translations or scales; as [`reduce_rotations`], but the tolerance is a distance.
///
/// # Errors
/// As [`reduce_rotations`].
pub fn reduce_vectors(
    times: &[f64],
    samples: &[DVec3],
    tolerance: f64,
    curve: ReducedCurve,
) -> Result<ReducedKeys<DVec3>, ReduceError> {
    let task = ReductionTask::new(times, samples, tolerance)?;
    let mut found = reduced(times.len(), &[], &[task], curve);
    Ok(found.vectors.pop().unwrap_or_default())
}

/// Reduces several channels to keys at the same times: every sample of each channel is within the channel's
/// tolerance. For files in which all tracks have the same key times.
///
/// # Errors
/// As [`reduce_rotations`].
pub fn reduce_together(
    times: &[f64],
    rotations: &[(Vec<DQuat>, f64)],
    vectors: &[(Vec<DVec3>, f64)],
    curve: ReducedCurve,
) -> Result<ReducedTogether, ReduceError> {
    let unit_rotations: Vec<Vec<DQuat>> = rotations
        .iter()
        .map(|rotation| continued(&rotation.0))
        .collect();
    let rotation_tasks = (unit_rotations.iter().zip(rotations))
        .map(|(samples, rotation)| ReductionTask::new(times, samples, rotation.1))
        .collect::<Result<Vec<_>, _>>()?;
    let vector_tasks = (vectors.iter())
        .map(|(samples, tolerance)| ReductionTask::new(times, samples, *tolerance))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(reduced(times.len(), &rotation_tasks, &vector_tasks, curve))
}

/// The keys of channels with `samples` samples each.
fn reduced(
    samples: usize,
    rotation_tasks: &[ReductionTask<'_, DQuat>],
    vector_tasks: &[ReductionTask<'_, DVec3>],
    curve: ReducedCurve,
) -> ReducedTogether {
    if samples == 0 {
        return ReducedTogether::default();
    }
    let is_still = rotation_tasks
        .iter()
        .all(|task| task.constant_error().is_some())
        && vector_tasks
            .iter()
            .all(|task| task.constant_error().is_some());
    let by_intervals = |is_cubic| {
        longest(samples, |from, to| {
            rotation_tasks
                .iter()
                .all(|task| task.fits(from, to, is_cubic))
                && vector_tasks
                    .iter()
                    .all(|task| task.fits(from, to, is_cubic))
        })
    };
    let worst_of_each = |keys: &[usize], intervals: Range<usize>| {
        let all_intervals = || intervals.clone();
        let rotation_worst = rotation_tasks
            .iter()
            .map(|task| task.worst_of_each(keys, all_intervals()));
        let vector_worst = vector_tasks
            .iter()
            .map(|task| task.worst_of_each(keys, all_intervals()));
        let further = |(a, b): ((usize, f64), (usize, f64))| if b.1 > a.1 { b } else { a };
        let all = rotation_worst.chain(vector_worst);
        let all = all.reduce(|a, b| a.into_iter().zip(b).map(further).collect());
        all.unwrap_or_default()
    };
    let indices = match curve {
        _ if is_still => vec![0],
        ReducedCurve::BesselOverhauser => inserted(samples, by_intervals(true), &worst_of_each),
        ReducedCurve::Linear => by_intervals(false),
        ReducedCurve::GltfCubic => by_intervals(true),
    };
    ReducedTogether {
        rotations: rotation_tasks
            .iter()
            .map(|task| task.keys(&indices, curve))
            .collect(),
        vectors: vector_tasks
            .iter()
            .map(|task| task.keys(&indices, curve))
            .collect(),
    }
}

/// The keys of several channels at the same samples.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct ReducedTogether {
    /// The keys of each channel of rotations.
    pub rotations: Vec<ReducedKeys<DQuat>>,
    /// The keys of each channel of vectors.
    pub vectors: Vec<ReducedKeys<DVec3>>,
}

/// Unit quaternions, each with the sign that is nearer to the previous one.
fn continued(samples: &[DQuat]) -> Vec<DQuat> {
    let mut continuous: Vec<DQuat> = samples.to_vec();
    for i in 0..continuous.len() {
        let unit = continuous[i].normalize();
        let continues = i == 0 || continuous[i - 1].dot(unit) >= 0.0;
        continuous[i] = if continues { unit } else { -unit };
    }
    continuous
}

/// Samples that have been checked, and the tolerance.
pub(crate) struct ReductionTask<'a, T> {
    pub(crate) times: &'a [f64],
    pub(crate) samples: &'a [T],
    pub(crate) tolerance: f64,
}

impl<'a, T: Value> ReductionTask<'a, T> {
    fn new(times: &'a [f64], samples: &'a [T], tolerance: f64) -> Result<Self, ReduceError> {
        if samples.len() != times.len() {
            return Err(ReduceError::Lengths {
                samples: samples.len(),
                times: times.len(),
            });
        }
        if !(tolerance >= 0.0 && tolerance.is_finite()) {
            return Err(ReduceError::Tolerance { tolerance });
        }
        let is_bad = |sample: &T| !sample.numbers().is_finite();
        if let Some(index) = samples.iter().position(is_bad) {
            return Err(ReduceError::Sample { index });
        }
        let increases = |i: usize| i == 0 || times[i - 1] < times[i];
        if let Some(index) = (0..times.len()).find(|&i| !(times[i].is_finite() && increases(i))) {
            let time = times[index];
            return Err(ReduceError::Time { index, time });
        }
        Ok(Self {
            times,
            samples,
            tolerance,
        })
    }

    /// The largest distance of a sample from the first one, if it is within the tolerance.
    fn constant_error(&self) -> Option<f64> {
        let first = *self.samples.first()?;
        let apart = self.samples.iter().map(|sample| sample.apart(first));
        let farthest = apart.fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a });
        (farthest <= self.tolerance).then_some(farthest)
    }

    /// The keys at some samples.
    fn keys(&self, indices: &[usize], curve: ReducedCurve) -> ReducedKeys<T> {
        ReducedKeys {
            indices: indices.to_vec(),
            keys: indices.iter().map(|&i| self.samples[i]).collect(),
            tangents: match curve {
                ReducedCurve::GltfCubic => self.tangents_at(indices),
                _ => Vec::new(),
            },
            error: match curve {
                _ if indices.len() < 2 => self.constant_error().unwrap_or(f64::INFINITY),
                ReducedCurve::BesselOverhauser => {
                    let worst = self.worst_of_each(indices, 0..indices.len() - 1);
                    worst
                        .iter()
                        .map(|candidate| candidate.1)
                        .fold(0.0, f64::max)
                        * self.tolerance
                }
                ReducedCurve::Linear => self.interval_error(indices, false),
                ReducedCurve::GltfCubic => self.interval_error(indices, true),
            },
        }
    }
}
