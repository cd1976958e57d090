//! Verification: whether a device gives the CPU's bits, and how far both are from the f64 reference.
//!
//! Verification does not rely on the engine's reports about itself. The reference shares no code with the kernels.

mod buffers;
mod comparison;
pub(crate) mod outputs;

pub use crate::verify::buffers::{
    BufferComparison, BufferLengthError, DifferenceKind, UNWRITTEN, WordBound, WordDifference,
    WordType, compare_buffers,
};
pub use crate::verify::comparison::{Agreement, Comparison, compare};
pub use crate::verify::outputs::OutputVerification;
use bytemuck::NoUninit;
use glam::Quat;
use rayon::prelude::*;

use crate::device::Device;
use crate::engine::Engine;
use crate::error::Error;
use crate::method::interpolation::Interpolation;
use crate::reference;
use crate::reference::quaternion::angle_between;
use crate::shader::Form;
use crate::threads::{on_threads, stop};
use crate::time::frame_clock::rounding;
use crate::time::frames::{SampleTimes, Timeline};
use crate::tracks::set::{Track, TrackSet};

/// The bound of a quaternion norm's distance from 1.
pub const NORM_BOUND: f64 = 4e-7;

/// The bound of errors of angular velocities and accelerations against the reference, relative to the largest value
/// near them. At constant speed the bounds are larger ([`OutputVerification::error_bound`]).
pub const RATE_BOUND: f64 = 2e-6;

/// The bound in radians of errors against the reference for a form.
#[must_use]
pub fn error_bound(form: Form) -> f64 {
    match form {
        Form::Arc => 6e-7,
        Form::Polynomial => 1e-6,
    }
}

/// The result of [`verify`] for one set and one method.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Verification {
    /// The method's name.
    pub method: &'static str,
    /// The Vulkan device; `None` if the engine is the CPU, so that no devices were compared.
    pub device: Option<String>,
    /// The number of compared rotations.
    pub rotations: u64,
    /// The number of rotations whose bits differ between the device and the CPU.
    pub differing: u64,
    /// The first rotation whose bits differ.
    pub first_difference: Option<SamplePosition>,
    /// The largest angle in radians between a result and the reference.
    pub max_error: f64,
    /// The root mean square of that angle in radians.
    pub rms_error: f64,
    /// The sample with the largest error.
    pub worst: Option<SamplePosition>,
    /// The largest | |q| - 1 |.
    pub max_norm_error: f64,
    /// The bound of `max_error` in radians.
    pub error_bound: f64,
    /// The bound of `max_norm_error`: [`NORM_BOUND`], plus the excess of the keys' norm errors over rounding to f32.
    pub norm_bound: f64,
    /// The results for all outputs that are computed from the rotations.
    pub outputs: Vec<OutputVerification>,
}

/// The location of a rotation in a result.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SamplePosition {
    /// The index of the track in the set.
    pub track: usize,
    /// The index of the sample.
    pub frame: usize,
    /// The time of the sample in seconds.
    pub time: f64,
}

impl SamplePosition {
    /// The location of the rotation at an index of a track-major result.
    fn new(timeline: &Timeline, index: usize) -> Self {
        let (track, frame) = (index / timeline.len(), index % timeline.len());
        let time = timeline.time_at(track, frame);
        Self { track, frame, time }
    }
}

/// The verdict of a comparison. The verdict of several comparisons is the greatest of theirs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Verdict {
    /// A Vulkan device gives the CPU's bits, and the errors against the f64 reference are within their bounds.
    Passed,
    /// The errors of the CPU's results against the f64 reference are within their bounds. No Vulkan device was
    /// compared.
    ReferenceOnly,
    /// There were no samples, so nothing was compared.
    Nothing,
    /// Bits differ between the device and the CPU, or an error exceeds its bound.
    Failed,
}

impl Verdict {
    /// `passed`, `reference-only`, `nothing` or `failed`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::ReferenceOnly => "reference-only",
            Self::Nothing => "nothing",
            Self::Failed => "failed",
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl Verification {
    /// The verdict that these numbers show.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let is_within_bounds = self.max_error <= self.error_bound
            && self.max_norm_error <= self.norm_bound
            && self.outputs.iter().all(OutputVerification::passes);
        match self.device {
            _ if self.rotations == 0 => Verdict::Nothing,
            _ if self.differing > 0 || !is_within_bounds => Verdict::Failed,
            Some(_) => Verdict::Passed,
            None => Verdict::ReferenceOnly,
        }
    }

    /// Whether a Vulkan device was compared with the CPU, all bits agree, and all errors are within their bounds.
    /// `false` for an engine on the CPU, and if there were no samples; see [`Verification::verdict`].
    #[must_use]
    pub fn passes(&self) -> bool {
        self.verdict() == Verdict::Passed
    }
}

/// Evaluates a set on the engine's device, on the CPU and with the reference, and compares every rotation and all
/// outputs that are computed from it: velocities, accelerations, encodings.
///
/// ```
/// use tumble::{Engine, SampleTimes, TrackSet, method};
/// use tumble::verify::{Verdict, verify};
/// # use glam::Quat;
/// # let mut set = TrackSet::new();
/// # set.push("", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(1.0)])?;
/// let engine = Engine::auto()?;
/// let found = verify(&engine, &set, method::SLERP.into(), &SampleTimes::fps(25))?;
/// match found.verdict() {
///     Verdict::Passed => println!("{} gives the CPU's bits", engine.device_name()),
///     Verdict::ReferenceOnly => println!("no Vulkan device took part"),
///     verdict => panic!("{verdict}: {found:?}"),
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`Engine::evaluate`].
pub fn verify(
    engine: &Engine,
    set: &TrackSet,
    interpolation: Interpolation,
    frames: &SampleTimes,
) -> Result<Verification, Error> {
    let timeline = frames.resolve(set.track_count(), set.time_span())?;
    let found = engine.evaluate(set, interpolation, frames)?;
    let device = engine.device_info().map(|info| info.name.clone());
    let (differing, first) = match device {
        Some(_) => {
            let cpu = Engine::new(Device::Cpu)?.evaluate(set, interpolation, frames)?;
            differences(found.as_quats(), cpu.as_quats(), 1)
        }
        None => (0, None),
    };
    let errors = Errors::measure(set, interpolation, &timeline, found.as_quats())?;
    let outputs = outputs::verify(engine, set, interpolation, frames, &timeline)?;
    stop::check()?;
    Ok(Verification {
        method: interpolation.method.name,
        device,
        rotations: found.as_quats().len() as u64,
        differing,
        first_difference: first.map(|index| SamplePosition::new(&timeline, index)),
        max_error: errors.max,
        rms_error: errors.rms,
        worst: errors.worst,
        max_norm_error: errors.norm,
        error_bound: error_bound(interpolation.form()),
        norm_bound: NORM_BOUND + norm_excess(set),
        outputs,
    })
}

/// The largest excess of the keys' norm errors over that of a unit quaternion rounded to f32. Keys within
/// [`UNIT_TOLERANCE`](crate::tracks::set::UNIT_TOLERANCE) keep their norm, and curves through them have it too.
fn norm_excess(set: &TrackSet) -> f64 {
    let keys = set.tracks().flat_map(|track| track.keys);
    let off = keys.map(|key| (key.as_dquat().length() - 1.0).abs());
    (off.fold(0.0, f64::max) - f64::from(f32::EPSILON)).max(0.0)
}

/// The times of a track's keys, relative to a whole second near the first one, so that key times and sample times are
/// exact in f64 even if they are large.
struct KeyTimes {
    from: f64,
    times: Vec<f64>,
    /// The largest magnitude of an absolute time.
    latest: f64,
    steps: bool,
}

impl KeyTimes {
    fn new(track: &Track<'_>, interpolation: &Interpolation) -> Self {
        let (first, last) = (track.times[0], track.times[track.times.len() - 1]);
        let from = first.floor();
        Self {
            from,
            times: track.times.iter().map(|time| time - from).collect(),
            latest: first.abs().max(last.abs()),
            steps: interpolation.steps(),
        }
    }

    /// The exact time of a sample.
    fn of_sample(&self, timeline: &Timeline, track: usize, sample: usize) -> f64 {
        timeline.moment_at(track, sample).since(self.from)
    }

    /// The smallest error at the times that a sample may represent: its time, and the time of a key that is equal to
    /// it within rounding ([`rounding`]), because the curve or its velocity may jump there.
    fn least_error(&self, time: f64, error: impl Fn(f64) -> f64) -> f64 {
        let latest = self.latest.max((time + self.from).abs());
        let rounding = 2.0 * rounding(latest, self.steps);
        let keys = &self.times;
        let near = keys.get(keys.partition_point(|&key| key < time - rounding));
        let near = near.filter(|&&key| key <= time + rounding);
        worse(error(time).min(near.map_or(f64::INFINITY, |&key| error(key))))
    }
}

/// The error, or infinity for NaN, which would pass comparisons.
fn worse(error: f64) -> f64 {
    if error.is_nan() { f64::INFINITY } else { error }
}

/// The number of values, of `size` elements each, whose bits differ, and the index of the first one.
fn differences<T: NoUninit>(a: &[T], b: &[T], size: usize) -> (u64, Option<usize>) {
    let values = |all| bytemuck::cast_slice::<T, u8>(all).chunks(size * size_of::<T>());
    let mut differing = (0..)
        .zip(values(a).zip(values(b)))
        .filter(|(_, (a, b))| a != b);
    let first = differing.next().map(|(index, _)| index);
    (u64::from(first.is_some()) + differing.count() as u64, first)
}

/// The errors of a result against the reference.
struct Errors {
    /// The largest angle, and the root mean square in radians.
    max: f64,
    rms: f64,
    worst: Option<SamplePosition>,
    /// The largest | |q| - 1 |.
    norm: f64,
}

impl Errors {
    /// Measures the errors of a track-major result.
    fn measure(
        set: &TrackSet,
        interpolation: Interpolation,
        timeline: &Timeline,
        found: &[Quat],
    ) -> Result<Self, Error> {
        let stop = stop::current();
        let measured = |track| {
            stop::during(stop.clone(), || {
                TrackErrors::measure(set, interpolation, timeline, found, track)
            })
        };
        let tracks = 0..set.track_count();
        let tracks: Vec<TrackErrors> =
            on_threads(|| tracks.into_par_iter().map(measured).collect())?;
        stop::check()?;
        let worst = tracks
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.max.total_cmp(&b.1.max));
        let squares: f64 = tracks.iter().map(|track| track.squares).sum();
        Ok(Self {
            max: worst.map_or(0.0, |(_, track)| track.max),
            rms: (squares / found.len().max(1) as f64).sqrt(),
            worst: worst.filter(|_| !found.is_empty()).map(|(track, errors)| {
                SamplePosition::new(timeline, track * timeline.len() + errors.worst)
            }),
            norm: tracks.iter().map(|track| track.norm).fold(0.0, f64::max),
        })
    }
}

/// The errors of one track against the reference.
#[derive(Default)]
struct TrackErrors {
    /// The largest angle in radians, and its sample.
    max: f64,
    worst: usize,
    /// The sum of the squared angles.
    squares: f64,
    /// The largest | |q| - 1 |.
    norm: f64,
}

impl TrackErrors {
    fn measure(
        set: &TrackSet,
        interpolation: Interpolation,
        timeline: &Timeline,
        found: &[Quat],
        index: usize,
    ) -> Self {
        let track = set.track(index);
        let keys = KeyTimes::new(&track, &interpolation);
        let times = &*keys.times;
        let curve = reference::ReferenceCurve::of(&interpolation, Track { times, ..track });
        let samples = timeline.len();
        let row = &found[index * samples..(index + 1) * samples];
        let mut errors = Self::default();
        for (sample, quat) in row.iter().enumerate() {
            if sample % 64 == 0 && stop::is_stopped() {
                return errors; // the caller checks for the stop again
            }
            let quat = quat.as_dquat();
            let norm = worse((quat.length() - 1.0).abs());
            let time = keys.of_sample(timeline, index, sample);
            let angle = keys.least_error(time, |time| angle_between(quat, curve.rotation(time)));
            if angle > errors.max {
                (errors.max, errors.worst) = (angle, sample);
            }
            errors.squares += angle * angle;
            errors.norm = errors.norm.max(norm);
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::slerp::SLERP;
    use crate::reference::ReferenceCurve;

    fn set() -> TrackSet {
        let keys = [0.0, 1.0, -0.4, 2.0].map(Quat::from_rotation_z);
        let tilted = keys.map(|key| key * Quat::from_rotation_x(1.2));
        TrackSet::with_shared_times(&[0.0, 0.5, 2.0, 2.5], &[keys, tilted].concat()).unwrap()
    }

    #[test]
    fn a_wrong_result_is_noticed() {
        let set = set();
        let timeline = SampleTimes::fps(10).resolve(2, set.time_span()).unwrap();
        let rows = set.tracks().flat_map(|track| {
            let curve = ReferenceCurve::of(&SLERP.into(), track);
            (0..26).map(move |sample| curve.rotation(0.1 * f64::from(sample)).as_quat())
        });
        let good: Vec<Quat> = rows.collect();
        for wrong in [
            Quat::from_xyzw(0.0, 0.0, 0.0, 1.001),
            Quat::NAN,
            Quat::from_rotation_x(0.5),
        ] {
            let mut bad = good.clone();
            bad[26 + 7] = wrong;
            let found = differences(&good, &bad, 1);
            assert_eq!(found, (1, Some(33)));
            let errors = TrackErrors::measure(&set, SLERP.into(), &timeline, &bad, 1);
            assert!(errors.max > 1e-3 && errors.worst == 7, "{}", errors.max);
        }
    }
}
