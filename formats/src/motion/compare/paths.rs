//! Compares an estimated path with its reference: errors after an alignment, at the poses of the sparser of both.

use serde::Serialize;
use tumble::{Channel, Engine, SampleTimes, method};

use crate::motion::Motion;
use crate::motion::compare::CompareError;
use crate::motion::compare::clips::check_known_parents;
use crate::motion::sample::ChannelMethods;
use crate::motion::trajectory::{
    Align, Alignment, Associate, Errors, Pose, Statistics, Step, Undetermined,
};
use crate::motion::world::world;

/// How an estimate is compared with its reference.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PathMeasure {
    /// The degrees of freedom with which the estimate is aligned to the reference.
    pub align: Align,
    /// Whether absolute errors are computed, pose by pose.
    pub is_absolute: bool,
    /// The step of relative errors; `None` if they are not computed.
    pub step: Option<Step>,
    /// How the poses of both paths are associated.
    pub associate: Associate,
    /// The longest interval between neighbouring keys that is interpolated, in seconds; `None` for no limit.
    pub max_gap: Option<f64>,
    /// Seconds to add to the times of the estimate, whose clock may be another.
    pub offset: f64,
}

/// The errors of an estimate against its reference.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct PathDifference {
    /// Names of the clips in messages.
    pub inputs: [String; 2],
    /// The input at whose poses both are compared, 0 or 1: the one with fewer poses.
    pub times_of: usize,
    /// Number of poses that are compared.
    pub poses: usize,
    /// Number of poses of the sparser path before the first or after the last pose of the other, or without a pose
    /// of the other that is near enough.
    pub outside: usize,
    /// Number of poses of the sparser path in intervals of the other longer than [`PathMeasure::max_gap`].
    pub in_gaps: usize,
    /// First and last time of the compared poses, in seconds, with the reference's time offset added.
    pub span: [f64; 2],
    /// The alignment of the estimate to the reference.
    pub alignment: AlignmentSummary,
    /// Absolute errors, if they are computed.
    pub ape: Option<PathErrors>,
    /// Relative errors, if they are computed.
    pub rpe: Option<PathErrors>,
    /// Warnings about the meaning of the errors: gaps, and an alignment that the positions do not determine.
    pub warnings: Vec<String>,
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
    /// Why the positions do not determine the rotation, which is then the smallest of the best.
    pub undetermined: Option<&'static str>,
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
    /// for each the name in messages, the clip and the index of the track. Poses are associated by
    /// [`PathMeasure::associate`], at the times of the path with fewer poses.
    ///
    /// # Errors
    /// When no poses can be associated, when the step of relative errors is longer than the path, when a clip cannot
    /// be sampled, or when its poses in the world cannot be computed.
    pub fn of(
        engine: &Engine,
        clips: [(&str, &Motion, usize); 2],
        measure: &PathMeasure,
    ) -> Result<Self, CompareError> {
        let names = clips.map(|(name, _, _)| name);
        let inputs = || names.map(str::to_owned);
        let first = clips[0].1;
        // A single track is a body in the world, so parents matter only if there are several tracks.
        if clips.iter().all(|(_, clip, _)| clip.set.track_count() > 1) {
            let motions = clips.map(|(_, clip, _)| clip);
            check_known_parents(names, motions, &[clips.map(|(_, _, track)| track)])?;
        }
        for (input, clip, track) in clips {
            let moves = clip.set.vector_keys(Channel::Translation, track).is_some();
            if !moves && clip.skeleton.is_empty() {
                let input = input.to_owned();
                return Err(CompareError::NoPositions { input });
            }
        }
        // Each clip has its own time offset, in whole seconds.
        let shift = (first.time_offset - clips[1].1.time_offset) as f64 - measure.offset;
        let times = [0, 1].map(|side| {
            let (_, clip, track) = clips[side];
            let back = [0.0, shift][side];
            let times = clip.set.track(track).times.iter();
            times.map(|time| time - back).collect::<Vec<_>>()
        });
        let found = associate([&times[0], &times[1]], measure);
        if found.pairs.is_empty() {
            return Err(CompareError::NoPoseInBoth {
                inputs: inputs(),
                spans: [0, 1].map(|side| {
                    let (_, clip, track) = clips[side];
                    let times = clip.set.track(track).times;
                    let clock = clip.time_offset as f64 + [0.0, measure.offset][side];
                    let ends = [times.first(), times.last()];
                    ends.map(|time| clock + time.copied().unwrap_or_default())
                }),
            });
        }
        let poses = |side: usize| {
            let (name, clip, track) = clips[side];
            let there = [0.0, shift][side];
            let times = found.pairs.iter().map(|pair| pair[side] + there);
            path_poses(name, clip, track, engine, times.collect())
        };
        let (reference, estimate) = (poses(0)?, poses(1)?);
        let alignment = Alignment::of(&reference, &estimate, measure.align);
        let estimate: Vec<Pose> = estimate.iter().map(|&pose| alignment.apply(pose)).collect();
        let ape = (measure.is_absolute).then(|| Errors::absolute(&reference, &estimate));
        let at: Vec<f64> = found.pairs.iter().map(|pair| pair[0]).collect();
        let rpe = measure
            .step
            .map(|step| Errors::relative(&reference, &estimate, &at, step));
        if rpe
            .as_ref()
            .is_some_and(|errors| errors.distances.is_empty())
        {
            return Err(CompareError::StepTooLong { inputs: inputs() });
        }
        let clock = first.time_offset as f64;
        let mut warnings: Vec<String> = (0..2)
            .filter_map(|side| {
                let gap = longest_gap(&times[side], [at[0], at[at.len() - 1]])?;
                let is_interpolated =
                    side != found.times_of && measure.associate == Associate::Interpolated;
                let poses_in_it = match measure.max_gap {
                    _ if !is_interpolated => PosesInGap::None,
                    Some(limit) if limit < gap.seconds => PosesInGap::LeftOut,
                    _ => PosesInGap::Interpolated,
                };
                Some(gap.warning(names[side], clock, poses_in_it))
            })
            .collect();
        warnings.extend(alignment.undetermined.map(|why| {
            format!(
                "{why}, so an alignment by {} does not determine the rotation; the smallest rotation is used, \
                 and rotation errors have no meaning",
                measure.align.name()
            )
        }));
        Ok(Self {
            inputs: inputs(),
            times_of: found.times_of,
            poses: at.len(),
            outside: found.outside,
            in_gaps: found.in_gaps,
            span: [at[0], at[at.len() - 1]].map(|time| time + clock),
            alignment: AlignmentSummary {
                by: measure.align.name(),
                scale: alignment.scale,
                rotation: alignment.rotation.to_array(),
                degrees: alignment.angle().to_degrees(),
                translation: alignment.translation.to_array(),
                undetermined: alignment.undetermined.map(Undetermined::name),
            },
            ape: ape.as_ref().and_then(PathErrors::of),
            rpe: rpe.as_ref().and_then(PathErrors::of),
            warnings,
        })
    }
}

/// The poses of a track in the world, between its keys on lines and arcs.
fn path_poses(
    input: &str,
    clip: &Motion,
    track: usize,
    engine: &Engine,
    times: Vec<f64>,
) -> Result<Vec<Pose>, CompareError> {
    let lines = ChannelMethods::by(method::SLERP);
    let samples = lines.sample(engine, clip, &SampleTimes::at(times));
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
    Ok(poses.collect())
}

/// Times at which two paths are compared.
#[derive(Debug, Clone, PartialEq)]
struct Association {
    /// The path whose times are used.
    times_of: usize,
    /// The time in each path, on the clock of the first.
    pairs: Vec<[f64; 2]>,
    outside: usize,
    in_gaps: usize,
}

/// Two times count as one if they are not further apart than this, in seconds, because times that count from different
/// seconds are rounded differently.
const SAME_TIME: f64 = 1e-9;

/// A pose beyond the ends of the other path belongs to its end if it is not further away than this, in seconds. The
/// reason is rounding: an f64 of seconds since 1970 has steps of 0.2 µs, and formats that store times as f32 round them
/// further.
fn same_end(time: f64) -> f64 {
    (time.abs() * f64::from(f32::EPSILON)).clamp(5e-7, 1e-4)
}

/// Associates the poses of two paths by their times.
fn associate(times: [&[f64]; 2], measure: &PathMeasure) -> Association {
    let start = times.map(|times| times.first().copied().unwrap_or(f64::INFINITY));
    let end = times.map(|times| times.last().copied().unwrap_or(f64::NEG_INFINITY));
    let common = start[0].max(start[1])..=end[0].min(end[1]);
    // As in evo: all poses of the shorter trajectory count; if both have equally many, those of the second.
    let counts = match measure.associate {
        Associate::Nearest(_) => times.map(<[f64]>::len),
        Associate::Interpolated => {
            times.map(|times| times.iter().filter(|it| common.contains(it)).count())
        }
    };
    let is_second = match measure.associate {
        Associate::Nearest(_) => counts[1] <= counts[0],
        Associate::Interpolated => counts[1] < counts[0],
    };
    let times_of = usize::from(is_second);
    let dense = times[1 - times_of];
    let mut found = Association {
        times_of,
        pairs: Vec::new(),
        outside: 0,
        in_gaps: 0,
    };
    for &time in times[times_of] {
        let next = dense.partition_point(|&key| key < time);
        let before = next.checked_sub(1).map(|index| dense[index]);
        let after = dense.get(next).copied();
        let neighbours = [before, after].into_iter().flatten();
        let nearest = neighbours.min_by(|a, b| (a - time).abs().total_cmp(&(b - time).abs()));
        let Some(nearest) = nearest else { continue };
        let apart = (nearest - time).abs();
        let other = match (measure.associate, before, after) {
            (Associate::Nearest(limit), _, _) if apart > limit + SAME_TIME => None,
            (Associate::Nearest(_), _, _) => Some(nearest),
            _ if apart <= SAME_TIME => Some(nearest),
            (Associate::Interpolated, Some(before), Some(after)) => {
                if measure.max_gap.is_some_and(|limit| after - before > limit) {
                    found.in_gaps += 1;
                    continue;
                }
                Some(time)
            }
            (Associate::Interpolated, _, _) if apart <= same_end(time) => Some(nearest),
            (Associate::Interpolated, _, _) => None,
        };
        match other {
            Some(other) if is_second => found.pairs.push([other, time]),
            Some(other) => found.pairs.push([time, other]),
            None => found.outside += 1,
        }
    }
    found
}

/// The longest interval between two poses of a path.
struct PathGap {
    start: f64,
    seconds: f64,
    median: f64,
}

/// An interval this many times as long as the median one is a gap.
const GAP: f64 = 5.0;

/// The longest interval in `span`, if it is a gap.
fn longest_gap(times: &[f64], [start, end]: [f64; 2]) -> Option<PathGap> {
    let steps = times.windows(2).map(|pair| (pair[1] - pair[0], pair[0]));
    let mut steps: Vec<(f64, f64)> = steps
        .filter(|&(seconds, from)| from + seconds > start && from < end)
        .collect();
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (seconds, from) = *steps.last()?;
    let median = steps[steps.len() / 2].0;
    (seconds >= GAP * median).then_some(PathGap {
        start: from,
        seconds,
        median,
    })
}

/// The poses of the other path at times in a gap.
enum PosesInGap {
    /// None is compared there.
    None,
    /// They are left out.
    LeftOut,
    /// They are compared with a straight line through the gap.
    Interpolated,
}

impl PathGap {
    fn warning(&self, name: &str, clock: f64, poses_in_it: PosesInGap) -> String {
        let Self {
            start,
            seconds,
            median,
        } = self;
        let done = match poses_in_it {
            PosesInGap::None => "no pose in it is compared",
            PosesInGap::LeftOut => "poses in it are left out",
            PosesInGap::Interpolated => {
                "poses in it are compared with a straight line; --max-gap leaves them out"
            }
        };
        format!(
            "{name}: has no pose for {seconds:.3} s from {:.3} s on, where its poses are mostly {median:.3} s apart; \
             {done}",
            start + clock
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(associate_by: Associate, times: [&[f64]; 2]) -> Association {
        let measure = PathMeasure {
            associate: associate_by,
            max_gap: Some(2.0),
            ..PathMeasure::default()
        };
        associate(times, &measure)
    }

    /// The times are those of the path with fewer poses, as far as the other path has poses there.
    #[test]
    fn the_denser_path_is_interpolated() {
        let dense = [0.0, 0.5, 1.0, 1.5, 5.0];
        let sparse = [-1.0, 0.25, 1.5, 3.0, 9.0];
        let found = pairs(Associate::Interpolated, [&dense, &sparse]);
        assert_eq!(found.times_of, 1);
        assert_eq!(found.pairs, [[0.25, 0.25], [1.5, 1.5]]);
        assert_eq!((found.outside, found.in_gaps), (2, 1));
        let found = pairs(Associate::Interpolated, [&sparse, &dense]);
        assert_eq!((found.times_of, found.pairs.len()), (0, 2));
    }

    /// A path whose times are f32 ends a little before or after the other.
    #[test]
    fn ends_may_be_rounded() {
        let end = f64::from(30.089_601_f32);
        let (first, second) = ([0.0, 15.0, 30.0896], [0.0, 10.0, 20.0, end]);
        assert!(first[2] != end);
        let found = pairs(Associate::Interpolated, [&second, &first]);
        assert_eq!((found.pairs.len(), found.outside), (2, 0));
        assert_eq!(found.pairs[1], [end, 30.0896]);
        let found = pairs(Associate::Interpolated, [&first, &[0.0, 10.0, 20.0, 30.0]]);
        assert_eq!(found.outside, 1);
    }

    /// By `evo.core.sync.matching_time_indices`: the nearest pose of the longer trajectory within the limit.
    #[test]
    fn the_nearest_poses_are_pairs() {
        let (first, second) = ([0.0, 0.1, 0.2, 0.3], [0.009, 0.111, 0.21]);
        let found = pairs(Associate::Nearest(0.01), [&first, &second]);
        assert_eq!(found.pairs, [[0.0, 0.009], [0.2, 0.21]]);
        assert_eq!((found.times_of, found.outside), (1, 1));
        let found = pairs(Associate::Nearest(0.01), [&second, &first]);
        assert_eq!(found.pairs, [[0.009, 0.0], [0.21, 0.2]]);
        assert_eq!(found.times_of, 0);
    }

    #[test]
    fn a_gap_is_five_times_as_long_as_the_usual_interval() {
        let times = [0.0, 1.0, 2.0, 3.0, 8.0, 9.0];
        let gap = longest_gap(&times, [0.0, 9.0]).unwrap();
        assert_eq!((gap.start, gap.seconds, gap.median), (3.0, 5.0, 1.0));
        assert!(longest_gap(&times, [0.0, 3.0]).is_none());
        assert!(longest_gap(&times[..1], [0.0, 0.0]).is_none());
    }
}
