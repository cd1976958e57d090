//! An estimated path beside its reference: errors after an alignment, at the poses of the reference.

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
    /// What is free when it is laid over the reference.
    pub align: Align,
    /// Absolute errors, pose by pose.
    pub is_absolute: bool,
    /// The step of relative errors.
    pub step: Option<Step>,
    /// Seconds between neighbouring keys of the estimate beyond which it is not interpolated.
    pub max_gap: Option<f64>,
}

/// How far an estimate is from its reference.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct PathDifference {
    /// What messages call the clips.
    pub inputs: [String; 2],
    /// Poses of the reference that have one of the estimate.
    pub poses: usize,
    /// Poses of the reference before or after the estimate.
    pub outside: usize,
    /// Poses of the reference in gaps of the estimate.
    pub in_gaps: usize,
    /// First and last time, seconds.
    pub span: [f64; 2],
    /// What lays the estimate over the reference.
    pub alignment: AlignmentSummary,
    /// Absolute errors.
    pub ape: Option<PathErrors>,
    /// Relative errors.
    pub rpe: Option<PathErrors>,
}

/// What lays an estimate over its reference: scale, then rotation, then translation.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct AlignmentSummary {
    /// What was free in it: its name.
    pub by: &'static str,
    /// The scale.
    pub scale: f64,
    /// x y z w.
    pub rotation: [f64; 4],
    /// By how much it turns, degrees.
    pub degrees: f64,
    /// The translation.
    pub translation: [f64; 3],
}

/// Errors of one kind.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct PathErrors {
    /// How many.
    pub count: usize,
    /// Lengths, as in the files.
    pub translation: PathStatistics,
    /// Degrees.
    pub rotation: PathStatistics,
}

/// What some errors come to, by the names of `evo`.
#[derive(Debug, Clone, Copy, Serialize)]
#[non_exhaustive]
pub struct PathStatistics {
    /// The root of the mean square.
    pub rmse: f64,
    /// The mean.
    pub mean: f64,
    /// The median.
    pub median: f64,
    /// The deviation from the mean.
    pub std: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
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
    /// Compares a track of each of two clips, of which the second is an estimate of the path of the first: it is
    /// interpolated by lines and arcs at the times of the first one's poses.
    ///
    /// # Errors
    /// When no pose of the first lies at a time of the second, no step fits into the path, or a clip cannot be
    /// sampled.
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
