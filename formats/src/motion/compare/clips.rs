//! Compares two clips at the same sample times.

use std::collections::HashSet;

use glam::{DVec3, Quat, Vec3};
use serde::Serialize;
use tumble::reference::angle_between;
use tumble::{Channel, Engine, FrameRate, JointMatchError, JointPairs, Joints, SampleTimes};

use crate::motion::Motion;
use crate::motion::compare::CompareError;
use crate::motion::compare::tally::{Spread, Tally};
use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::scalars::ScalarKind;
use crate::motion::world::world;
use crate::names::{TRAJECTORY_TRACK, distinct_names};
use crate::times::clock_text;

/// Time spans whose ends differ by less than this are equal, in seconds: f32 times of some hours are not more exact.
const SAME_END: f64 = 1e-3;

/// Two clips to compare.
#[derive(Debug, Clone, Copy)]
pub struct ClipPair<'a> {
    /// Names of the clips in messages.
    pub inputs: [&'a str; 2],
    /// The clips.
    pub clips: [&'a Motion; 2],
    /// Seconds to add to the times of the second clip, whose clock may be another.
    pub offset: f64,
}

/// The times that two clips have in common, in seconds, on the clock of the first clip.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CommonTimes {
    /// First common time, in seconds.
    pub start: f64,
    /// Last common time, in seconds.
    pub end: f64,
    /// A warning if the time spans of the clips differ; it names both spans and the common one.
    pub warning: Option<String>,
}

/// The tracks of two clips that belong together.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct MatchedTracks {
    /// The index of each pair's track in the first clip and in the second.
    pub pairs: Vec<[usize; 2]>,
    /// Names of the tracks that only the first clip has, and of those that only the second clip has.
    pub missing: [Vec<String>; 2],
}

/// The differences of two clips.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct ClipDifference {
    /// Names of the clips in messages.
    pub inputs: [String; 2],
    /// Number of tracks that both clips have.
    pub tracks: usize,
    /// Names of the tracks that only the first clip has, and of those that only the second clip has.
    pub missing: [Vec<String>; 2],
    /// Number of samples of each track.
    pub samples: usize,
    /// First and last sample time, in seconds, on the clock of the first clip.
    pub span: [f64; 2],
    /// Seconds that only one of the clips has, and which are not compared.
    pub unshared_seconds: f64,
    /// Number of rotations whose bits are equal, up to the sign of the quaternion.
    pub identical: u64,
    /// Angles between the rotations, in degrees; `None` if the clips have only scalars in common.
    pub rotation: Option<ChannelDifference>,
    /// Distances between the translations, in the files' unit of length; `None` if neither clip has translations.
    pub translation: Option<ChannelDifference>,
    /// Lengths of the differences of the scales; `None` if neither clip has scales.
    pub scale: Option<ChannelDifference>,
    /// Number of scalars that both clips have.
    pub scalar_count: usize,
    /// Names of the scalars that only the first clip has, and of those that only the second clip has.
    pub missing_scalars: [Vec<String>; 2],
    /// Differences of the scalars of each kind that both clips have: angles in degrees, lengths in the files' unit,
    /// others as they are.
    pub scalars: Vec<ScalarDifference>,
    /// The differences of each of these scalars, in the order of their kinds, then of the first clip.
    pub each_scalar: Vec<ScalarDifference>,
    /// The differences of each track that both clips have, in the order of the first clip.
    pub joints: Vec<JointDifference>,
}

/// The differences of one scalar, or of all scalars of one kind.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct ScalarDifference {
    /// The kind, by its name.
    pub kind: &'static str,
    /// The differences; their track is the scalar with the largest one.
    #[serde(flatten)]
    pub difference: ChannelDifference,
}

/// The differences of one track.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct JointDifference {
    /// Name of the track.
    pub track: String,
    /// Angles between the rotations, in degrees.
    pub rotation: TimedSpread,
    /// Distances between the translations, in the files' unit of length; `None` if neither clip has translations.
    pub translation: Option<TimedSpread>,
    /// Lengths of the differences of the scales; `None` if neither clip has scales.
    pub scale: Option<TimedSpread>,
}

/// Statistics of differences over time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TimedSpread {
    /// Mean, root mean square and maximum of the differences.
    #[serde(flatten)]
    pub spread: Spread,
    /// Time of the largest difference, in seconds, on the clock of the first clip.
    pub time: f64,
    /// The time in frames of the first clip, from 0 at its first key; half frames lie between two frames. `None` if
    /// its keys are not frames of a rate.
    pub frame: Option<f64>,
}

/// The differences of one channel.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct ChannelDifference {
    /// Mean, root mean square and maximum of the differences.
    #[serde(flatten)]
    pub spread: Spread,
    /// Name of the track with the largest difference.
    pub track: String,
    /// Time of the largest difference, in seconds, on the clock of the first clip.
    pub time: f64,
    /// The time in frames of the first clip, from 0 at its first key; half frames lie between two frames. `None` if
    /// its keys are not frames of a rate.
    pub frame: Option<f64>,
}

impl ChannelDifference {
    /// The differences of all tracks, `all`, where the largest is that of this track.
    fn with_largest(all: Spread, track: &str, of_track: TimedSpread) -> Self {
        Self {
            spread: all,
            track: track.to_owned(),
            time: of_track.time,
            frame: of_track.frame,
        }
    }
}

/// A channel of a joint in a comparison; `None` if neither clip has it.
type ChannelOf = fn(&JointDifference) -> Option<TimedSpread>;
const ANGLE: ChannelOf = |joint| Some(joint.rotation);
const DISTANCE: ChannelOf = |joint| joint.translation;
const SCALE: ChannelOf = |joint| joint.scale;

/// The joint with the largest difference of a channel, and this difference. Of joints with the same, it is the one with
/// the largest difference of the other channel, as in a table of the joints.
fn worst(joints: &[JointDifference], channels: [ChannelOf; 2]) -> Option<(&str, TimedSpread)> {
    let key = |joint: &JointDifference| {
        channels.map(|channel| channel(joint).map_or(0.0, |it| it.spread.largest))
    };
    let joint = joints
        .iter()
        .reduce(|worst, joint| match key(joint) > key(worst) {
            true => joint,
            false => worst,
        })?;
    Some((&joint.track, channels[0](joint)?))
}

/// The differences of one channel, of all tracks together and of each.
struct ChannelTallies {
    all: Tally,
    each: Vec<Tally>,
}

impl ChannelTallies {
    fn new(tracks: usize) -> Self {
        Self {
            all: Tally::default(),
            each: vec![Tally::default(); tracks],
        }
    }

    /// Adds the difference of a track at the next sample.
    fn add(&mut self, track: usize, difference: f64) {
        self.all.add(difference);
        self.each[track].add(difference);
    }
}

impl ClipPair<'_> {
    /// The first and the last time of each clip, on the clock of the first.
    fn spans(&self) -> [[f64; 2]; 2] {
        let shifts = [0.0, self.shift()];
        [0, 1].map(|side| {
            let (first, last) = self.clips[side].set.time_span().unwrap_or((0.0, 0.0));
            [first - shifts[side], last - shifts[side]]
        })
    }

    /// Seconds that only one of the clips has.
    fn unshared_seconds(&self) -> f64 {
        let [first, second] = self.spans();
        let shared = (first[1].min(second[1]) - first[0].max(second[0])).max(0.0);
        let all = first[1] - first[0] + second[1] - second[0];
        let unshared = all - 2.0 * shared;
        if unshared > SAME_END { unshared } else { 0.0 }
    }

    /// The times that lie in both clips.
    ///
    /// # Errors
    /// When the time spans of the clips do not overlap.
    pub fn common_times(&self) -> Result<CommonTimes, CompareError> {
        let spans = self.spans();
        let clock = self.clips[0].time_offset as f64;
        let on_clock = |span: [f64; 2]| span.map(|time| time + clock);
        let start = spans[0][0].max(spans[1][0]);
        let end = spans[0][1].min(spans[1][1]);
        let differs = |end: usize| (spans[0][end] - spans[1][end]).abs() > SAME_END;
        let is_longer = differs(0) || differs(1);
        if is_longer && start > end {
            return Err(CompareError::NoTimeInBoth {
                inputs: self.inputs.map(str::to_owned),
                spans: spans.map(on_clock),
            });
        }
        let warning = is_longer.then(|| {
            let of_clock = |time: f64| clock_text(self.clips[0].time_offset, time);
            let [first, second] = [0, 1].map(|side| {
                let [first, last] = spans[side].map(of_clock);
                format!("{} from {first} to {last} s", self.inputs[side])
            });
            let [start, end] = [start, end].map(of_clock);
            format!(
                "the clips have keys in different ranges of time: {first}, {second}; compared from {start} to {end} s"
            )
        });
        Ok(CommonTimes {
            start,
            end,
            warning,
        })
    }

    /// The sample times of a comparison: `common.start`, `common.end`, all key times of both clips between them, and
    /// the middle of each interval between these times.
    #[must_use]
    pub fn keys(&self, common: &CommonTimes) -> SampleTimes {
        let (start, end) = (common.start, common.end);
        let mut times: Vec<f64> = self.clips[0].key_times();
        let others = self.clips[1].key_times();
        times.extend(others.iter().map(|time| time - self.shift()));
        times.retain(|time| (start..=end).contains(time));
        times.extend([start, end]);
        times.sort_by(f64::total_cmp);
        times.dedup();
        let middles: Vec<f64> = (times.windows(2))
            .map(|pair| f64::midpoint(pair[0], pair[1]))
            .collect();
        times.extend(middles);
        times.sort_by(f64::total_cmp);
        times.dedup();
        SampleTimes::at(times)
    }

    /// The sample times of a comparison at a rate, from `start` to `end` on the clock of the first clip, or over all
    /// common times. A range that is longer than these is cut to them.
    ///
    /// # Errors
    /// When the range has no common time.
    pub fn frames(
        &self,
        common: &CommonTimes,
        rate: FrameRate,
        start: Option<f64>,
        end: Option<f64>,
    ) -> Result<SampleTimes, CompareError> {
        let whole = (common.start, common.end);
        let (start, end) = self.clips[0].range_in_set(start, end, whole);
        if start > common.end || end < common.start {
            return Err(self.no_common_time(common, start, end));
        }
        Ok(SampleTimes::rate(rate).between(start.max(common.start), end.min(common.end)))
    }

    /// The sample times of a comparison at these times, on the clock of the first clip; those that only one clip has
    /// are left out.
    ///
    /// # Errors
    /// When none of them is a common time.
    pub fn at(&self, common: &CommonTimes, times: &[f64]) -> Result<SampleTimes, CompareError> {
        let times = times.iter().map(|&time| self.clips[0].time_in_set(time));
        let times: Vec<f64> = times.collect();
        let low = times.iter().copied().fold(f64::INFINITY, f64::min);
        let high = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let within = common.start - SAME_END..=common.end + SAME_END;
        let shared: Vec<f64> = times.into_iter().filter(|it| within.contains(it)).collect();
        match shared.is_empty() {
            true => Err(self.no_common_time(common, low, high)),
            false => Ok(SampleTimes::at(shared)),
        }
    }

    fn no_common_time(&self, common: &CommonTimes, start: f64, end: f64) -> CompareError {
        let clock = self.clips[0].time_offset as f64;
        CompareError::RangeOutside {
            inputs: self.inputs.map(str::to_owned),
            range: [start, end].map(|time| time + clock),
            common: [common.start, common.end].map(|time| time + clock),
        }
    }

    /// Compares the clips at the times `frames`, in seconds, on the clock of the first clip. With `in_world` the
    /// poses are relative to the world, otherwise to the parents.
    ///
    /// # Errors
    /// * When no track and no scalar of one clip corresponds to one of the other.
    /// * When a track has another parent in the other clip, and the poses are relative to the parents.
    /// * When a clip cannot be sampled, or the poses in the world cannot be computed.
    pub fn differences(
        &self,
        engine: &Engine,
        frames: &SampleTimes,
        in_world: bool,
    ) -> Result<ClipDifference, CompareError> {
        let (inputs, motions) = (self.inputs, self.clips);
        let (scalar_pairs, missing_scalars) = self.scalar_pairs()?;
        let found = self.matched_joints()?;
        if scalar_pairs.is_empty() {
            self.check_any_pair(&found)?;
        }
        if in_world {
            self.check_known_parents(&found.matched.pairs)?;
        } else {
            let [first, second] = &found.joints;
            first.check_parents(second, &found.matched, inputs)?;
            self.check_spaces()?;
        }
        let missing = found.missing();
        let pairs = found.matched.pairs;
        let (first, of_first) = poses(engine, inputs[0], motions[0], frames, in_world)?;
        let shift = self.shift();
        let moved;
        let frames = match shift == 0.0 {
            true => frames,
            false => {
                let times = first.times.iter().map(|time| time + shift);
                moved = SampleTimes::at(times.collect::<Vec<_>>());
                &moved
            }
        };
        let (second, of_second) = poses(engine, inputs[1], motions[1], frames, in_world)?;
        let (sampled, origins) = ([first, second], [of_first, of_second]);
        let times = &sampled[0].times;
        let counts = motions.map(|clip| clip.set.track_count());
        // Computes the differences, ordered by sample, then by pair.
        let each = || {
            let samples = 0..times.len();
            samples.flat_map(|sample| {
                let pairs = pairs.iter().enumerate();
                pairs.map(move |(track, pair)| {
                    (track, [0, 1].map(|side| sample * counts[side] + pair[side]))
                })
            })
        };
        let mut angles = ChannelTallies::new(pairs.len());
        let mut identical = 0;
        for (track, [a, b]) in each() {
            let (a, b) = (sampled[0].rotations[a], sampled[1].rotations[b]);
            let bits = |q: Quat| q.to_array().map(f32::to_bits);
            identical += u64::from(bits(a) == bits(b) || bits(a) == bits(-b));
            angles.add(track, angle_between(a.as_dquat(), b.as_dquat()));
        }
        let clock = motions[0].time_offset as f64;
        let frames = FrameNumbers::of(motions[0]);
        let timed = |tally: Tally, sample: usize, factor| {
            let time = times.get(sample).copied().unwrap_or(0.0);
            TimedSpread {
                spread: tally.times(factor),
                time: time + clock,
                frame: frames.map(|frames| frames.of_time(time)),
            }
        };
        let name = |pair: &[usize; 2]| motions[0].set.track_name(pair[0]);
        let of_track = |tallies: &ChannelTallies, track: usize, factor| {
            let tally = tallies.each[track];
            timed(tally, tally.largest_at as usize, factor)
        };
        let apart = |values: fn(&Samples) -> &[Vec3], channel| {
            if sampled.iter().all(|samples| values(samples).is_empty()) {
                return None;
            }
            let value = |side: usize, index: usize| {
                let rest = || motions[side].rest(channel, index % counts[side]);
                let relative = values(&sampled[side]).get(index).copied();
                let origin = match channel {
                    Channel::Translation => origins[side].get(index % counts[side]).copied(),
                    Channel::Scale => None,
                };
                origin.unwrap_or_default() + relative.unwrap_or_else(rest).as_dvec3()
            };
            let mut tallies = ChannelTallies::new(pairs.len());
            for (track, [a, b]) in each() {
                tallies.add(track, value(0, a).distance(value(1, b)));
            }
            Some(tallies)
        };
        let translations = apart(|samples| &samples.translations, Channel::Translation);
        let scales = apart(|samples| &samples.scales, Channel::Scale);
        let degrees = 1f64.to_degrees();
        let joints = pairs.iter().enumerate().map(|(track, pair)| {
            let lengths = |tallies: &ChannelTallies| of_track(tallies, track, 1.0);
            JointDifference {
                track: name(pair),
                rotation: of_track(&angles, track, degrees),
                translation: translations.as_ref().map(lengths),
                scale: scales.as_ref().map(lengths),
            }
        });
        let joints: Vec<JointDifference> = joints.collect();
        let of_all = |tallies: &ChannelTallies, channels, factor| {
            let (track, largest) = worst(&joints, channels)?;
            let all = tallies.all.times(factor);
            Some(ChannelDifference::with_largest(all, track, largest))
        };
        let rotation = of_all(&angles, [ANGLE, DISTANCE], degrees);
        let translation =
            (translations.as_ref()).and_then(|found| of_all(found, [DISTANCE, ANGLE], 1.0));
        let scale = (scales.as_ref()).and_then(|found| of_all(found, [SCALE, ANGLE], 1.0));
        let mut each_scalar: Vec<ScalarDifference> = Vec::new();
        let scalars = ScalarKind::ALL.iter().filter_map(|&kind| {
            let of_kind = scalar_pairs
                .iter()
                .filter(|pair| motions[0].scalar(pair[0]).kind == kind);
            let of_kind: Vec<[usize; 2]> = of_kind.copied().collect();
            let mut tallies = ChannelTallies::new(of_kind.len());
            let counts = motions.map(|clip| clip.set.scalar_count());
            for sample in 0..times.len() {
                for (index, pair) in of_kind.iter().enumerate() {
                    let [a, b] = [0, 1].map(|side| {
                        let value = sampled[side].scalars[sample * counts[side] + pair[side]];
                        motions[side].scalar(pair[side]).origin + f64::from(value)
                    });
                    tallies.add(index, (a - b).abs());
                }
            }
            let factor = match kind {
                ScalarKind::Angle => degrees,
                _ => 1.0,
            };
            let each = of_kind.iter().enumerate().filter_map(|(index, pair)| {
                let found = of_track(&tallies, index, factor);
                let name = motions[0].set.scalar(pair[0])?.name;
                Some(ScalarDifference {
                    kind: kind.name(),
                    difference: ChannelDifference::with_largest(found.spread, name, found),
                })
            });
            let each: Vec<ScalarDifference> = each.collect();
            let largest = |scalar: &ScalarDifference| scalar.difference.spread.largest;
            let worst =
                each.iter()
                    .reduce(|worst, scalar| match largest(scalar) > largest(worst) {
                        true => scalar,
                        false => worst,
                    });
            let of_kind = worst.cloned().map(|mut worst| {
                worst.difference.spread = tallies.all.times(factor);
                worst
            });
            each_scalar.extend(each);
            of_kind
        });
        let scalars = scalars.collect();
        Ok(ClipDifference {
            inputs: inputs.map(str::to_owned),
            tracks: pairs.len(),
            missing,
            samples: times.len(),
            unshared_seconds: self.unshared_seconds(),
            span: [times.first(), times.last()].map(|time| time.copied().unwrap_or(0.0) + clock),
            identical,
            rotation,
            translation,
            scale,
            scalar_count: scalar_pairs.len(),
            missing_scalars,
            scalars,
            each_scalar,
            joints,
        })
    }

    /// The scalars of one name in both clips, by their indices, and the names of those that only one clip has.
    ///
    /// # Errors
    /// When scalars of one name are of different kinds, so that their difference has no unit.
    fn scalar_pairs(&self) -> Result<ScalarPairs, CompareError> {
        let names = self
            .clips
            .map(|clip| -> Vec<&str> { clip.scalar_keys().map(|keys| keys.name).collect() });
        let mut pairs = Vec::new();
        let mut missing = [Vec::new(), Vec::new()];
        for (first, name) in names[0].iter().enumerate() {
            match names[1].iter().position(|other| other == name) {
                Some(second) => pairs.push([first, second]),
                None => missing[0].push((*name).to_owned()),
            }
        }
        let lone = names[1].iter().filter(|name| !names[0].contains(name));
        missing[1].extend(lone.map(|name| (*name).to_owned()));
        let kinds = |pair: &[usize; 2]| [0, 1].map(|side| self.clips[side].scalar(pair[side]).kind);
        let mut others = pairs.iter().filter(|pair| kinds(pair)[0] != kinds(pair)[1]);
        match others.next() {
            None => Ok((pairs, missing)),
            Some(pair) => Err(CompareError::ScalarKinds {
                inputs: self.inputs.map(str::to_owned),
                name: names[0][pair[0]].to_owned(),
                kinds: kinds(pair),
            }),
        }
    }

    /// The seconds to add to a time of the first clip for the same time of the second. Their clocks count from
    /// different whole seconds, and may be apart by [`ClipPair::offset`].
    #[must_use]
    pub fn shift(&self) -> f64 {
        let [first, second] = self.clips;
        (first.time_offset - second.time_offset) as f64 - self.offset
    }

    /// Refuses to compare rotations relative to the parents with rotations relative to the world.
    ///
    /// # Errors
    /// When one clip has rotations relative to the parents and the other relative to the world; the error names both.
    pub fn check_spaces(&self) -> Result<(), CompareError> {
        let [first, second] = self.clips.map(|clip| clip.is_world);
        let has_parents = |clip: &&Motion| clip.skeleton.iter().any(|joint| joint.parent.is_some());
        if first == second || !self.clips.iter().any(has_parents) {
            return Ok(());
        }
        let world = usize::from(second);
        Err(CompareError::Spaces {
            world: self.inputs[world].to_owned(),
            local: self.inputs[1 - world].to_owned(),
        })
    }

    /// The assumptions by which the clips are compared, for warnings: that two tracks are the same although their names
    /// differ, because each clip has one track; that joints of one name have the same order in both clips.
    #[must_use]
    pub fn assumptions(&self) -> Vec<String> {
        let of_order = |side: usize| self.clips[side].order_assumption(self.inputs[side]);
        let by_order = of_order(0).or_else(|| of_order(1));
        self.single_track_assumption()
            .into_iter()
            .chain(by_order)
            .collect()
    }

    fn single_track_assumption(&self) -> Option<String> {
        let [first, second] = self.clips.map(|clip| {
            let name = clip.set.get(0)?.name?;
            // Readers of trajectories add this name, so it does not name a joint.
            (name != TRAJECTORY_TRACK && clip.set.track_count() == 1).then_some(name)
        });
        let (first, second) = (first?, second?);
        (first != second).then(|| {
            format!(
                "`{first}` of {} is compared with `{second}` of {}: each has one track",
                self.inputs[0], self.inputs[1]
            )
        })
    }

    /// Refuses tracks of `parts` whose parents in these clips are not the same: rotations relative to other parents
    /// cannot be compared. `parts` are selected tracks of these clips, or all of them.
    ///
    /// # Errors
    /// The first track with another parent.
    pub fn check_parents(&self, parts: [&Motion; 2]) -> Result<(), CompareError> {
        let MatchedJoints { joints, matched } = self.matched_joints()?;
        let selected = parts.map(|part| -> HashSet<String> {
            let tracks = 0..part.set.track_count();
            tracks.map(|track| part.set.track_name(track)).collect()
        });
        let is_selected = |pair: [usize; 2]| {
            (0..2).all(|side| selected[side].contains(&joints[side].names()[pair[side]]))
        };
        let [first, second] = &joints;
        first.check_parents_of(second, &matched, is_selected, self.inputs)?;
        Ok(())
    }

    /// The tracks of both clips, matched.
    fn matched_joints(&self) -> Result<MatchedJoints, JointMatchError> {
        let joints = self.clips.map(Motion::joints);
        // If both clips have one track, these are compared whatever their names are.
        let matched = if joints.iter().all(|side| side.len() == 1) {
            JointPairs::in_order(1)
        } else if joints.iter().any(Joints::is_empty) {
            JointPairs::in_order(0)
        } else {
            // Formats that require unique names number repeated names, so both clips are compared by numbered names.
            let [first, second] = self.clips.map(|clip| distinct_names(&clip.set));
            match first == second {
                true => JointPairs::in_order(first.len()),
                false => joints[0].pairs(&joints[1], self.inputs)?,
            }
        };
        Ok(MatchedJoints { joints, matched })
    }

    /// Refuses, in the world, pairs of tracks of which one has a parent and the other is of a clip without a skeleton.
    ///
    /// # Errors
    /// Names the first such pair.
    pub fn check_known_parents(&self, pairs: &[[usize; 2]]) -> Result<(), CompareError> {
        check_known_parents(self.inputs, self.clips, pairs)
    }

    /// The tracks that both clips have, by their names, and those that only one has.
    ///
    /// # Errors
    /// When the names do not tell the tracks apart, or when the clips have no track in common.
    pub fn tracks(&self) -> Result<MatchedTracks, CompareError> {
        let found = self.matched_joints()?;
        self.check_any_pair(&found)?;
        Ok(MatchedTracks {
            missing: found.missing(),
            pairs: found.matched.pairs,
        })
    }

    /// Refuses clips without a common track.
    fn check_any_pair(&self, found: &MatchedJoints) -> Result<(), CompareError> {
        if !found.matched.pairs.is_empty() {
            return Ok(());
        }
        let scalars = self.clips.map(|clip| clip.set.scalar_count());
        let [first, second] = &found.joints;
        if first.len() + second.len() == 0 && scalars != [0; 2] {
            return Err(CompareError::NoScalarInBoth {
                inputs: self.inputs.map(str::to_owned),
                scalars,
            });
        }
        let lone = [first, second].iter().position(|side| side.is_empty());
        if let Some(side) = lone.filter(|&side| scalars[side] > 0) {
            return Err(CompareError::OnlyScalars {
                input: self.inputs[side].to_owned(),
                other: self.inputs[1 - side].to_owned(),
            });
        }
        let error = first.order_of(second, self.inputs).err();
        if let Some(error @ JointMatchError::Unnamed { .. }) = error {
            return Err(error.into());
        }
        Err(CompareError::NoTrackInBoth {
            inputs: self.inputs.map(str::to_owned),
            tracks: [first.len(), second.len()],
            near: error.and_then(|error| match error {
                JointMatchError::Missing { name, near, .. } => Some([name, near?]),
                _ => None,
            }),
        })
    }
}

/// The scalars of one name in two clips, and the names of those that only one has.
type ScalarPairs = (Vec<[usize; 2]>, [Vec<String>; 2]);

/// The joints of two clips, and which are the same.
struct MatchedJoints {
    joints: [Joints; 2],
    matched: JointPairs,
}

impl MatchedJoints {
    /// The names of the joints that only one clip has.
    fn missing(&self) -> [Vec<String>; 2] {
        [0, 1].map(|side| {
            let lone = self.matched.missing[side].iter();
            lone.map(|&track| self.joints[side].names()[track].clone())
                .collect()
        })
    }
}

/// Refuses, in the world, pairs of tracks of which one has a parent and the other is of a clip without a skeleton: its
/// rotations may be relative to a parent that the clip does not know.
pub(super) fn check_known_parents(
    inputs: [&str; 2],
    clips: [&Motion; 2],
    pairs: &[[usize; 2]],
) -> Result<(), CompareError> {
    let has_parent = |side: usize, track: usize| {
        let joint = clips[side].skeleton.get(track);
        joint.is_some_and(|joint| joint.parent.is_some())
    };
    for without in [0, 1] {
        let with = 1 - without;
        let clip = clips[without];
        if !clip.skeleton.is_empty() || clip.is_world {
            continue;
        }
        if let Some(pair) = pairs.iter().find(|pair| has_parent(with, pair[with])) {
            return Err(CompareError::NoSkeleton {
                without: inputs[without].to_owned(),
                with: inputs[with].to_owned(),
                joint: clips[with].set.track_name(pair[with]),
            });
        }
    }
    Ok(())
}

/// Numbers the frames of a clip, from 0 at its first key.
#[derive(Debug, Clone, Copy)]
struct FrameNumbers {
    first: f64,
    per_second: f64,
}

impl FrameNumbers {
    /// `None` if the keys are not frames of a rate.
    fn of(clip: &Motion) -> Option<Self> {
        let rate = clip.rate.or_else(|| clip.rate_of_keys())?;
        Some(Self {
            first: clip.set.time_span()?.0,
            per_second: rate.per_second(),
        })
    }

    /// The frame of a time in the set, rounded to a thousandth.
    fn of_time(self, time: f64) -> f64 {
        let frame = (time - self.first) * self.per_second;
        (frame * 1e3).round() / 1e3
    }
}

/// All poses of a clip, and the origin to add to the translations of each track.
fn poses(
    engine: &Engine,
    input: &str,
    clip: &Motion,
    frames: &SampleTimes,
    in_world: bool,
) -> Result<(Samples, Vec<DVec3>), CompareError> {
    let mut samples = ChannelMethods::AUTHORED
        .sample(engine, clip, frames)
        .map_err(|error| CompareError::Evaluating {
            input: input.to_owned(),
            error,
        })?;
    if !in_world {
        return Ok((samples, clip.origins.clone()));
    }
    let poses = world(clip, &samples).map_err(|error| CompareError::Hierarchy {
        input: input.to_owned(),
        error,
    })?;
    samples.rotations = poses.iter().map(|pose| pose.rotation).collect();
    let tracks = clip.set.track_count();
    let mut origins = vec![DVec3::ZERO; tracks];
    if !clip.origins.is_empty() {
        let first = origins.iter_mut().zip(&poses);
        first.for_each(|(origin, pose)| *origin = pose.position);
    }
    let each = poses.iter().enumerate();
    samples.translations = each
        .map(|(index, pose)| (pose.position - origins[index % tracks]).as_vec3())
        .collect();
    samples.scales.clear();
    Ok((samples, origins))
}
