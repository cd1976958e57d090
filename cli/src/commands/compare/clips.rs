//! Two clips, sampled at the same times.

use std::collections::HashMap;

use glam::{DVec3, Quat, Vec3};
use serde::Serialize;
use tumble::reference::angle_between;
use tumble::{Channel, Engine, Frames};
use tumble_formats::motion::Motion;
use tumble_formats::printable::printable;
use tumble_formats::sample::{ChannelMethods, Samples};
use tumble_formats::world::world;

use crate::batch::room;
use crate::commands::compare::tally::{Spread, Tally};
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Spans whose ends are nearer than this are the same: times in f32 of some hours.
const SAME_TIME: f64 = 1e-3;

/// What two clips come to.
#[derive(Debug, Serialize)]
pub(crate) struct Compared {
    /// What messages call the clips.
    inputs: [String; 2],
    /// Tracks that both have.
    tracks: usize,
    /// Tracks that one alone has: of the first clip, and of the second.
    pub(crate) missing: [Vec<String>; 2],
    samples: usize,
    /// First and last time, seconds.
    span: [f64; 2],
    /// Rotations whose bits are the same.
    identical: u64,
    /// Degrees.
    pub(crate) rotation: Found,
    /// Lengths, as in the files; nothing where neither clip moves.
    pub(crate) translation: Option<Found>,
    /// Lengths of the differences of scales; nothing where neither clip scales.
    scale: Option<Found>,
}

/// Differences of one kind.
#[derive(Debug, Serialize)]
pub(crate) struct Found {
    #[serde(flatten)]
    pub(crate) spread: Spread,
    /// Where the largest is: the name of the track and the time.
    track: String,
    time: f64,
}

/// How clips are compared.
pub(crate) struct Comparison<'a> {
    pub(crate) engine: &'a Engine,
    /// Frames from a time to a time; where there are none, every key of both and the middle between
    /// neighbouring ones are taken.
    pub(crate) frames: &'a dyn Fn(f64, f64) -> Option<Frames>,
    /// Joints in the world instead of relative to their parents.
    pub(crate) in_world: bool,
}

impl Comparison<'_> {
    /// Compares two clips.
    pub(crate) fn compare(&self, clips: [(&str, &Motion); 2]) -> Result<Compared, Failure> {
        let names = clips.map(|(name, _)| name);
        let motions = clips.map(|(_, clip)| clip);
        let (pairs, missing) = pairs(motions).map_err(|message| {
            let message = format!("{} and {}: {message}", names[0], names[1]);
            Failure::new(ALL_INPUTS, message)
        })?;
        let frames = self.samples(names, motions)?;
        let (first, of_first) = self.poses(names[0], motions[0], &frames)?;
        let shift = shift(motions);
        let frames = match shift == 0.0 {
            true => frames,
            false => Frames::at(
                first
                    .times
                    .iter()
                    .map(|time| time + shift)
                    .collect::<Vec<_>>(),
            ),
        };
        let (second, of_second) = self.poses(names[1], motions[1], &frames)?;
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
        let mut turned = Tally::default();
        let mut identical = 0;
        for [a, b] in each() {
            let (a, b) = (sampled[0].rotations[a], sampled[1].rotations[b]);
            let bits = |q: Quat| q.to_array().map(f32::to_bits);
            identical += u64::from(bits(a) == bits(b) || bits(a) == bits(-b));
            turned.add(angle_between(a.as_dquat(), b.as_dquat()));
        }
        let found = |tally: Tally, factor| {
            let place = tally.place as usize;
            let pair = pairs.get(place % pairs.len().max(1));
            Found {
                spread: tally.times(factor),
                track: pair.map_or_else(String::new, |pair| motions[0].set.track_name(pair[0])),
                time: times
                    .get(place / pairs.len().max(1))
                    .copied()
                    .unwrap_or(0.0),
            }
        };
        let apart = |values: fn(&Samples) -> &[Vec3], channel| {
            if sampled.iter().all(|samples| values(samples).is_empty()) {
                return None;
            }
            let value = |side: usize, place: usize| {
                let rest = || motions[side].rest(channel, place % counts[side]);
                let relative = values(&sampled[side]).get(place).copied();
                let origin = match channel {
                    Channel::Translation => origins[side].get(place % counts[side]).copied(),
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
        Ok(Compared {
            inputs: names.map(str::to_owned),
            tracks: pairs.len(),
            missing,
            samples: times.len(),
            span: [times.first(), times.last()].map(|time| time.copied().unwrap_or(0.0)),
            identical,
            rotation: found(turned, 1f64.to_degrees()),
            translation: apart(|samples| &samples.translations, Channel::Translation),
            scale: apart(|samples| &samples.scales, Channel::Scale),
        })
    }

    /// The times to compare at: those that both clips have.
    fn samples(&self, names: [&str; 2], clips: [&Motion; 2]) -> Result<Frames, Failure> {
        let shifts = [0.0, shift(clips)];
        let spans = [0, 1].map(|side| {
            let (first, last) = clips[side].set.time_span().unwrap_or((0.0, 0.0));
            (first - shifts[side], last - shifts[side])
        });
        let start = spans[0].0.max(spans[1].0);
        let end = spans[0].1.min(spans[1].1);
        let far = |a: f64, b: f64| (a - b).abs() > SAME_TIME;
        if far(spans[0].0, spans[1].0) || far(spans[0].1, spans[1].1) {
            let texts = [0, 1].map(|side| {
                let (first, last) = spans[side];
                format!("{} from {first} to {last} s", names[side])
            });
            if start > end {
                return Err(Failure::new(
                    ALL_INPUTS,
                    format!("no time lies in both: {}, {}", texts[0], texts[1]),
                ));
            }
            words::warning(&format!(
                "the keys of both do not lie at the same times: {}, {}; compared from {start} to \
                 {end} s",
                texts[0], texts[1]
            ));
        }
        if let Some(frames) = (self.frames)(start, end) {
            return Ok(frames);
        }
        let mut times: Vec<f64> = clips[0].key_times();
        times.extend(clips[1].key_times().iter().map(|time| time - shifts[1]));
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
        Ok(Frames::at(times))
    }

    /// All poses of a clip, and what the translations of each track are to be moved by.
    fn poses(
        &self,
        name: &str,
        clip: &Motion,
        frames: &Frames,
    ) -> Result<(Samples, Vec<DVec3>), Failure> {
        room::in_memory(name, &clip.set, frames, 7)?;
        let mut samples = ChannelMethods::AUTHORED
            .sample(self.engine, clip, frames)
            .map_err(|error| Failure::evaluating(name, &error))?;
        if self.in_world {
            let poses = world(clip, &samples)
                .map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?;
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
            return Ok((samples, origins));
        }
        Ok((samples, clip.origins.clone()))
    }
}

/// What turns times of the first clip into times of the second: each counts from whole seconds of its own.
fn shift([first, second]: [&Motion; 2]) -> f64 {
    (first.time_offset - second.time_offset) as f64
}

/// The tracks that belong together, and the names of those that only one clip has: by their names,
/// where all have one of their own and any agree, else by their places.
#[expect(
    clippy::type_complexity,
    reason = "pairs, and a list of names for each side"
)]
fn pairs(clips: [&Motion; 2]) -> Result<(Vec<[usize; 2]>, [Vec<String>; 2]), String> {
    let names = clips.map(|clip| {
        let set = &clip.set;
        let all: Vec<String> = (0..set.track_count())
            .map(|track| set.track_name(track))
            .collect();
        all
    });
    let place = |side: usize| -> HashMap<&str, usize> {
        let all = names[side].iter().enumerate();
        all.map(|(place, name)| (&**name, place)).collect()
    };
    let places = [place(0), place(1)];
    let distinct = (0..2).all(|side| places[side].len() == names[side].len());
    let common: Vec<[usize; 2]> = (names[0].iter().enumerate())
        .filter_map(|(first, name)| Some([first, *places[1].get(&**name)?]))
        .collect();
    if distinct && !common.is_empty() {
        let missing = |side: usize| {
            let other = &places[1 - side];
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
                all.map(|place| [place; 2]).collect(),
                [Vec::new(), Vec::new()],
            ))
        }
        false => Err(format!(
            "have {} and {}, none of the same name; --tracks chooses some",
            words::count(names[0].len(), "track"),
            words::count(names[1].len(), "track")
        )),
    }
}

impl Compared {
    /// Lines that say it.
    pub(crate) fn told(&self) -> String {
        let mut text = format!(
            "{} and {}: {} × {} from {} to {} s\n",
            self.inputs[0],
            self.inputs[1],
            words::count(self.tracks, "track"),
            words::count(self.samples, "sample"),
            self.span[0],
            self.span[1]
        );
        let mut line = |what: &str, unit: &str, found: &Found| {
            let Spread { mean, rms, largest } = found.spread;
            let place = match largest > 0.0 {
                true => format!(" at {}, {:.4} s", printable(&found.track), found.time),
                false => String::new(),
            };
            text += &format!(
                "  {what:<12} mean {mean:.3e}{unit}, rms {rms:.3e}{unit}, largest \
                 {largest:.3e}{unit}{place}\n"
            );
        };
        line("rotation", "°", &self.rotation);
        for (what, found) in [("translation", &self.translation), ("scale", &self.scale)] {
            if let Some(found) = found {
                line(what, "", found);
            }
        }
        text += &format!(
            "  {} of {} rotations are the same, bit for bit\n",
            self.identical,
            self.tracks * self.samples
        );
        for (side, missing) in self.missing.iter().enumerate() {
            if !missing.is_empty() {
                text += &format!(
                    "  only in {}: {}\n",
                    self.inputs[side],
                    printable(&missing.join(", "))
                );
            }
        }
        text
    }
}
