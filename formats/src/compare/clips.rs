//! Two clips, sampled at the same times.

use std::collections::HashMap;

use glam::{DVec3, Quat, Vec3};
use serde::Serialize;
use tumble::reference::angle_between;
use tumble::{Channel, Engine, SampleTimes};

use crate::compare::CompareError;
use crate::compare::tally::{Spread, Tally};
use crate::motion::Motion;
use crate::sample::{ChannelMethods, Samples};
use crate::world::world;

/// Spans whose ends are nearer than this are the same: times in f32 of some hours.
const SAME_TIME: f64 = 1e-3;

/// Two clips that are compared.
#[derive(Debug, Clone, Copy)]
pub struct ClipPair<'a> {
    /// What messages call them.
    pub inputs: [&'a str; 2],
    /// The clips.
    pub clips: [&'a Motion; 2],
}

/// The times that two clips have in common, seconds of the first one.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CommonTimes {
    /// The first time.
    pub start: f64,
    /// The last time.
    pub end: f64,
    /// That one of the clips is longer, and where it is compared.
    pub warning: Option<String>,
}

/// How far two clips are apart.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct ClipDifference {
    /// What messages call the clips.
    pub inputs: [String; 2],
    /// Tracks that both have.
    pub tracks: usize,
    /// Tracks that one alone has: of the first clip, and of the second.
    pub missing: [Vec<String>; 2],
    /// Samples of each track.
    pub samples: usize,
    /// First and last time, seconds.
    pub span: [f64; 2],
    /// Rotations whose bits are the same.
    pub identical: u64,
    /// Degrees.
    pub rotation: ChannelDifference,
    /// Lengths, as in the files; nothing where neither clip moves.
    pub translation: Option<ChannelDifference>,
    /// Lengths of the differences of scales; nothing where neither clip scales.
    pub scale: Option<ChannelDifference>,
}

/// The differences of a channel.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct ChannelDifference {
    /// What they come to.
    #[serde(flatten)]
    pub spread: Spread,
    /// The name of the track with the largest.
    pub track: String,
    /// When it is, seconds.
    pub time: f64,
}

impl ClipPair<'_> {
    /// The times that both have.
    ///
    /// # Errors
    /// When there is none.
    pub fn common_times(&self) -> Result<CommonTimes, CompareError> {
        let shifts = [0.0, self.shift()];
        let spans = [0, 1].map(|side| {
            let (first, last) = self.clips[side].set.time_span().unwrap_or((0.0, 0.0));
            [first - shifts[side], last - shifts[side]]
        });
        let start = spans[0][0].max(spans[1][0]);
        let end = spans[0][1].min(spans[1][1]);
        let differs = |end: usize| (spans[0][end] - spans[1][end]).abs() > SAME_TIME;
        let is_longer = differs(0) || differs(1);
        if is_longer && start > end {
            return Err(CompareError::NoTimeInBoth {
                inputs: self.inputs.map(str::to_owned),
                spans,
            });
        }
        let warning = is_longer.then(|| {
            let [first, second] = [0, 1].map(|side| {
                let [first, last] = spans[side];
                format!("{} from {first} to {last} s", self.inputs[side])
            });
            format!(
                "the keys of both do not lie at the same times: {first}, {second}; compared from {start} to \
                 {end} s"
            )
        });
        Ok(CommonTimes {
            start,
            end,
            warning,
        })
    }

    /// Every key of both between these times, and the middle between neighbouring ones.
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

    /// Compares them at some times, seconds of the first one: joints relative to their parents, or in the world.
    ///
    /// # Errors
    /// When no track belongs to one of the other, or one cannot be sampled.
    pub fn differences(
        &self,
        engine: &Engine,
        frames: &SampleTimes,
        in_world: bool,
    ) -> Result<ClipDifference, CompareError> {
        let (inputs, motions) = (self.inputs, self.clips);
        let (pairs, missing) = self.tracks()?;
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
        // Differences at [sample][pair].
        let each = || {
            let samples = 0..times.len();
            samples.flat_map(|sample| {
                pairs
                    .iter()
                    .map(move |&pair| [0, 1].map(|side| sample * counts[side] + pair[side]))
            })
        };
        let mut angles = Tally::default();
        let mut identical = 0;
        for [a, b] in each() {
            let (a, b) = (sampled[0].rotations[a], sampled[1].rotations[b]);
            let bits = |q: Quat| q.to_array().map(f32::to_bits);
            identical += u64::from(bits(a) == bits(b) || bits(a) == bits(-b));
            angles.add(angle_between(a.as_dquat(), b.as_dquat()));
        }
        let found = |tally: Tally, factor| {
            let index = tally.largest_at as usize;
            let pair = pairs.get(index % pairs.len().max(1));
            ChannelDifference {
                spread: tally.times(factor),
                track: pair.map_or_else(String::new, |pair| motions[0].set.track_name(pair[0])),
                time: times
                    .get(index / pairs.len().max(1))
                    .copied()
                    .unwrap_or(0.0),
            }
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
            let mut tally = Tally::default();
            for [a, b] in each() {
                tally.add(value(0, a).distance(value(1, b)));
            }
            Some(found(tally, 1.0))
        };
        Ok(ClipDifference {
            inputs: inputs.map(str::to_owned),
            tracks: pairs.len(),
            missing,
            samples: times.len(),
            span: [times.first(), times.last()].map(|time| time.copied().unwrap_or(0.0)),
            identical,
            rotation: found(angles, 1f64.to_degrees()),
            translation: apart(|samples| &samples.translations, Channel::Translation),
            scale: apart(|samples| &samples.scales, Channel::Scale),
        })
    }

    /// What makes times of the first clip times of the second: each counts from whole seconds of its own.
    fn shift(&self) -> f64 {
        let [first, second] = self.clips;
        (first.time_offset - second.time_offset) as f64
    }

    /// The tracks that belong together, and the names of those that only one clip has: by their names,
    /// where all have one of their own and any agree, else by their order.
    #[expect(
        clippy::type_complexity,
        reason = "pairs, and a list of names for each side"
    )]
    fn tracks(&self) -> Result<(Vec<[usize; 2]>, [Vec<String>; 2]), CompareError> {
        let names = self.clips.map(|clip| {
            let set = &clip.set;
            let all: Vec<String> = (0..set.track_count())
                .map(|track| set.track_name(track))
                .collect();
            all
        });
        let indices = |side: usize| -> HashMap<&str, usize> {
            let all = names[side].iter().enumerate();
            all.map(|(index, name)| (&**name, index)).collect()
        };
        let by_name = [indices(0), indices(1)];
        let distinct = (0..2).all(|side| by_name[side].len() == names[side].len());
        let common: Vec<[usize; 2]> = (names[0].iter().enumerate())
            .filter_map(|(first, name)| Some([first, *by_name[1].get(&**name)?]))
            .collect();
        if distinct && !common.is_empty() {
            let missing = |side: usize| {
                let other = &by_name[1 - side];
                let lone = names[side]
                    .iter()
                    .filter(|name| !other.contains_key(&***name));
                lone.cloned().collect()
            };
            let missing = [missing(0), missing(1)];
            return Ok((common, missing));
        }
        match names[0].len() == names[1].len() && !names[0].is_empty() {
            true => {
                let all = 0..names[0].len();
                Ok((
                    all.map(|index| [index; 2]).collect(),
                    [Vec::new(), Vec::new()],
                ))
            }
            false => Err(CompareError::NoTrackInBoth {
                inputs: self.inputs.map(str::to_owned),
                tracks: [0, 1].map(|side| names[side].len()),
            }),
        }
    }
}

/// All poses of a clip, and what the translations of each track are to be moved by.
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
