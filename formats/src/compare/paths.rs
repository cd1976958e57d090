//! Compares an estimated path with its reference: errors after an alignment, at the poses of the reference.

use serde::Serialize;
use tumble::{Engine, Interpolation, SampleTimes, method};

use crate::compare::CompareError;
use crate::motion::Motion;
use crate::sample::ChannelMethods;
use crate::trajectory::{Align, Alignment, Errors, Pose, Statistics, Step};
use crate::world::world;

/// How an estimate is compared with its reference.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PathMeasure {
    /// The degrees of freedom with which the estimate is aligned to the reference.
    pub align: Align,
    /// Whether absolute errors are computed, pose by pose.
    pub is_absolute: bool,
    /// The step of relative errors; `None` if they are not computed.
    pub step: Option<Step>,
    /// The longest interval between neighbouring keys of the estimate that is interpolated, in seconds; `None` for no
    /// limit.
    pub max_gap: Option<f64>,
}

/// The errors of an estimate against its reference.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct PathDifference {
    /// Names of the clips in messages.
    pub inputs: [String; 2],
    /// Number of poses of the reference for which the estimate has a pose.
    pub poses: usize,
    /// Number of poses of the reference before the first or after the last key of the estimate.
    pub outside: usize,
    /// Number of poses of the reference in intervals of the estimate longer than [`PathMeasure::max_gap`].
    pub in_gaps: usize,
    /// First and last time of the compared poses, in seconds, with the reference's time offset added.
    pub span: [f64; 2],
    /// The alignment of the estimate to the reference.
    pub alignment: AlignmentSummary,
    /// Absolute errors, if they are computed.
    pub ape: Option<PathErrors>,
    /// Relative errors, if they are computed.
    pub rpe: Option<PathErrors>,
}

/// The alignment of an estimate to its reference: first the scale, then the rotation, then the translation.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct AlignmentSummary {
    /// Name of the [`Align`] that was used.
    pub by: &'static str,
    /// The scale.
    pub scale: f64,
    /// The rotation as a quaternion x y z w.
    pub rotation: [f64; 4],
    /// Angle of the rotation, in degrees.
    pub degrees: f64,
    /// The translation.
    pub translation: [f64; 3],
}

/// The errors of one kind, absolute or relative.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct PathErrors {
    /// Number of errors.
    pub count: usize,
    /// Distances, in the files' unit of length.
    pub translation: PathStatistics,
    /// Angles, in degrees.
    pub rotation: PathStatistics,
}

/// Statistics of errors, named as in `evo`.
#[derive(Debug, Clone, Copy, Serialize)]
#[non_exhaustive]
pub struct PathStatistics {
    /// Root mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// Standard deviation.
    pub std: f64,
    /// Smallest error.
    pub min: f64,
    /// Largest error.
    pub max: f64,
}

impl PathStatistics {
    fn of(errors: &[f64], factor: f64) -> Option<Self> {
        let found = Statistics::of(errors)?;
        Some(Self {
            rmse: found.rmse * factor,
            mean: found.mean * factor,
            median: found.median * factor,
            std: found.deviation * factor,
            min: found.smallest * factor,
            max: found.largest * factor,
        })
    }
}

impl PathErrors {
    fn of(errors: &Errors) -> Option<Self> {
        Some(Self {
            count: errors.distances.len(),
            translation: PathStatistics::of(&errors.distances, 1.0)?,
            rotation: PathStatistics::of(&errors.angles, 1f64.to_degrees())?,
        })
    }
}

impl PathDifference {
    /// Compares one track of each of two clips: the second is an estimate of the path of the first. `clips` contains
    /// for each the name in messages, the clip and the index of the track. The estimate is interpolated at the times
    /// of the reference's poses, by straight lines and arcs.
    ///
    /// # Errors
    /// When the estimate has no pose at the time of any pose of the reference, when the step of relative errors is
    /// longer than the path, when a clip cannot be sampled, or when its poses in the world cannot be computed.
    pub fn of(
        engine: &Engine,
        clips: [(&str, &Motion, usize); 2],
        measure: &PathMeasure,
    ) -> Result<Self, CompareError> {
        let [
            (first_name, first, first_track),
            (second_name, second, second_track),
        ] = clips;
        let inputs = || [first_name, second_name].map(str::to_owned);
        // Each clip counts from whole seconds of its own.
        let shift = (first.time_offset - second.time_offset) as f64;
        let keys = second.set.track(second_track).times;
        let (mut outside, mut in_gaps) = (0, 0);
        let mut times = Vec::new();
        for &time in first.set.track(first_track).times {
            let there = time + shift;
            let next = keys.partition_point(|&key| key < there);
            let is_key = keys.get(next) == Some(&there);
            let gap = || keys[next] - keys[next - 1];
            if !is_key && (next == 0 || next == keys.len()) {
                outside += 1;
            } else if !is_key && measure.max_gap.is_some_and(|limit| gap() > limit) {
                in_gaps += 1;
            } else {
                times.push(time);
            }
        }
        if times.is_empty() {
            return Err(CompareError::NoPoseInBoth { inputs: inputs() });
        }
        let lines = ChannelMethods {
            method: Some(method::SLERP),
            with: &|method| Interpolation::from(method),
        };
        let poses = |input: &str, clip: &Motion, track: usize, by: &ChannelMethods<'_>, shift| {
            let frames = SampleTimes::at(times.iter().map(|time| time + shift).collect::<Vec<_>>());
            let samples = by.sample(engine, clip, &frames);
            let samples = samples.map_err(|error| CompareError::Evaluating {
                input: input.to_owned(),
                error,
            })?;
            let poses = world(clip, &samples).map_err(|error| CompareError::Hierarchy {
                input: input.to_owned(),
                error,
            })?;
            let tracks = clip.set.track_count();
            let poses = poses.iter().skip(track).step_by(tracks).map(|pose| Pose {
                position: pose.position,
                rotation: pose.rotation.as_dquat().normalize(),
            });
            Ok::<_, CompareError>(poses.collect::<Vec<_>>())
        };
        let authored = &ChannelMethods::AUTHORED;
        let reference = poses(first_name, first, first_track, authored, 0.0)?;
        let estimate = poses(second_name, second, second_track, &lines, shift)?;
        let alignment = Alignment::of(&reference, &estimate, measure.align);
        let estimate: Vec<Pose> = estimate.iter().map(|&pose| alignment.apply(pose)).collect();
        let ape = (measure.is_absolute).then(|| Errors::absolute(&reference, &estimate));
        let rpe = measure
            .step
            .map(|step| Errors::relative(&reference, &estimate, &times, step));
        if rpe
            .as_ref()
            .is_some_and(|errors| errors.distances.is_empty())
        {
            return Err(CompareError::StepTooLong { inputs: inputs() });
        }
        Ok(Self {
            inputs: inputs(),
            poses: times.len(),
            outside,
            in_gaps,
            span: [times[0], times[times.len() - 1]].map(|time| time + first.time_offset as f64),
            alignment: AlignmentSummary {
                by: measure.align.name(),
                scale: alignment.scale,
                rotation: alignment.rotation.to_array(),
                degrees: alignment.angle().to_degrees(),
                translation: alignment.translation.to_array(),
            },
            ape: ape.as_ref().and_then(PathErrors::of),
            rpe: rpe.as_ref().and_then(PathErrors::of),
        })
    }
}
