//! `tumble info`: the contents of a keyframe file, or of a file with a robot.

mod pickle;
mod robot;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use clap::Args;
use glam::DVec3;
use serde::Serialize;
use tumble::method::C2;
use tumble::reference::angle_between;
use tumble::{Channel, Interpolation, TrackSet};
use tumble_formats::motion::Motion;
use tumble_formats::printable::printable;
use tumble_formats::robot::Robot;
use tumble_formats::{Code, Loaded, Location};

use crate::arguments::input::{self, Inputs};
use crate::arguments::interpolation::curve_warning;
use crate::batch::entry::InputEntry;
use crate::messages::exit::{Failure, for_each};
use crate::messages::{listing, names, words};
use pickle::PickleSummary;
use robot::RobotSummary;

/// Steps that differ by less than this (relative) are even: decimal times are
/// rarely even to the last bit.
const EVEN: f64 = 1e-6;

/// Show what files contain: tracks, keys, times, the largest rotation; of robots (MJCF, URDF) bodies and joints; of pickles the values
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tumble info data/pendulum.dat
  tumble info --json *.dat | jq '.[].tracks'
  tumble info arm.xml")]
pub(crate) struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The report of one input.
#[derive(Serialize)]
#[serde(untagged)]
enum Report {
    Clip(Box<Summary>),
    Pickle(PickleSummary),
    Robot(RobotSummary),
}

impl Report {
    fn text(&self) -> String {
        match self {
            Self::Clip(summary) => summary.text(),
            Self::Pickle(summary) => summary.text(),
            Self::Robot(summary) => summary.text(),
        }
    }
}

/// The report of one clip; also the form of the JSON.
#[derive(Serialize)]
struct Summary {
    input: String,
    /// The name or the place of one of several animations in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    animation: Option<String>,
    tracks: usize,
    /// The names of the tracks; absent if none has one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    names: Vec<String>,
    /// The parent of each track, for files with a skeleton.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    parents: Vec<Option<usize>>,
    /// The number of keys of all tracks together.
    keys: usize,
    /// Seconds.
    first_time: f64,
    last_time: f64,
    /// Seconds between neighbouring keys; absent when no track has two.
    shortest_step: Option<f64>,
    longest_step: Option<f64>,
    uniform: bool,
    /// Between neighbouring keys, the shorter way.
    largest_rotation_degrees: f64,
    /// Tracks with keys of their translations, and of their scales.
    #[serde(skip_serializing_if = "is_zero")]
    moved: usize,
    #[serde(skip_serializing_if = "is_zero")]
    scaled: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    scalars: Vec<ScalarSummary>,
    /// Whole seconds that all times are to be moved by, as those of clocks that count from 1970 are.
    #[serde(skip_serializing_if = "is_second_zero")]
    time_offset: i64,
    /// The vector to add in f64 to the positions of each track; empty if it is 0 for all tracks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    origins: Vec<[f64; 3]>,
    /// The rate on whose frames all key times lie: a number or a ratio.
    #[serde(skip_serializing_if = "Option::is_none")]
    rate: Option<String>,
    /// The number of frames of this rate from the first key to the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<u64>,
    /// How many channels each of glTF's samplers interpolates.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    samplers: BTreeMap<&'static str, usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    box_length: Option<f64>,
    /// A unit of length, metres, and the axis that is up, where the file says them.
    #[serde(skip_serializing_if = "Option::is_none")]
    metres: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    up: Option<[f64; 3]>,
    /// The warnings about the animation and its curves, and with the first one those about the whole file:
    /// `FILE:PLACE: warning[CODE]: …`
    warnings: Vec<String>,
}

/// A number over time beside the tracks, such as the angle of a joint.
#[derive(Serialize)]
struct ScalarSummary {
    name: String,
    /// `angle`, `length`, `plain` or `contact`.
    kind: &'static str,
    keys: usize,
    /// The smallest and the largest key.
    range: [f64; 2],
    /// The smallest and the largest value that the joint allows.
    #[serde(skip_serializing_if = "Option::is_none")]
    limits: Option<[f64; 2]>,
}

impl ScalarSummary {
    fn of(clip: &Motion, index: usize) -> Option<Self> {
        let (keys, scalar) = (clip.set.scalar(index)?, clip.scalar(index));
        let values = keys.keys.iter().map(|&key| f64::from(key) + scalar.origin);
        let range = values.fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[least, largest], value| [least.min(value), largest.max(value)],
        );
        Some(Self {
            name: keys.name.to_owned(),
            kind: scalar.kind.name(),
            keys: keys.keys.len(),
            range,
            limits: scalar.limits,
        })
    }

    fn text(&self) -> String {
        let range = |ends: [f64; 2]| ends.map(words::decimals).join(" to ");
        let (name, kind) = (printable(&self.name), self.kind);
        let mut text = format!(
            "{name}  {kind}  {}  {}",
            words::count(self.keys, "key"),
            range(self.range)
        );
        if let Some(limits) = self.limits {
            let _ = write!(text, ", limits {}", range(limits));
        }
        text
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (mut summaries, mut failed) = (Vec::new(), Vec::new());
    let inputs = arguments.inputs.distinct(false)?;
    let outcome = for_each(&inputs, |path| {
        let outcome = summarise(arguments, path, &mut summaries);
        outcome.inspect_err(|failure| failed.push(InputEntry::failed(path, None, failure)))
    });
    if arguments.json {
        listing::records(&summaries, &failed)?;
    } else {
        let texts: Vec<String> = summaries.iter().map(Report::text).collect();
        listing::text(&texts.join("\n"))?;
    }
    outcome
}

/// Adds a summary of each clip of an input.
fn summarise(
    arguments: &Arguments,
    path: &Path,
    summaries: &mut Vec<Report>,
) -> Result<(), Failure> {
    if Robot::has_extension(path) {
        summaries.push(Report::Robot(RobotSummary::read(path)?));
        return Ok(());
    }
    let format = arguments.inputs.format(path);
    if tumble_formats::pickle::is_pickle(format) && path.is_file() {
        let options = arguments.inputs.options()?;
        let refused = |error| arguments.inputs.refused(&error);
        let contents = PickleSummary::read(path, &options).map_err(refused)?;
        summaries.push(Report::Pickle(contents));
        // A pickle may contain anything, so its values are listed even if they are not a motion.
        let clips = format.open(path, &options);
        if clips.is_err_and(|error| error.code == Code::UnknownArrays) {
            return Ok(());
        }
    }
    let loaded = arguments.inputs.load_quietly(path)?;
    let name = names::input(path);
    let several = loaded.clips.len() + loaded.refused.len() > 1;
    for (index, clip) in loaded.clips.iter().enumerate() {
        let animation = several.then(|| names::clip(clip));
        let clip = arguments.inputs.tracks.select(clip, &name)?;
        let mut summary = Summary::new(name.clone(), animation, &clip, &loaded);
        // Each warning is listed once.
        let warnings = loaded.warnings.iter().filter(|warning| {
            let animation = warning.location.as_ref().and_then(Location::animation);
            let clips = &mut loaded.clips.iter();
            animation
                .and_then(|it| clips.position(|clip| clip.index == it))
                .unwrap_or(0)
                == index
        });
        summary.warnings = warnings.map(ToString::to_string).collect();
        // Keys that were added to follow the curves of a file are not meant for c2, so there is no warning about c2.
        let follows = arguments.inputs.follows_curves(path);
        let smoothest = Interpolation::from(C2);
        let of_curves = (!follows)
            .then(|| curve_warning(&name, &clip, &smoothest))
            .flatten();
        summary
            .warnings
            .extend(of_curves.map(|warning| warning.to_string()));
        summaries.push(Report::Clip(Box::new(summary)));
    }
    for refused in &loaded.refused {
        words::line(&refused.to_string());
    }
    input::check_complete(&name, &loaded)
}

/// The times between neighbouring keys, seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steps {
    pub(crate) shortest: f64,
    pub(crate) longest: f64,
}

impl Steps {
    /// The steps of all rotations and scalars; `None` if none has two keys.
    pub(crate) fn of(set: &TrackSet) -> Option<Self> {
        let scalars = (0..set.scalar_count()).filter_map(|index| set.scalar(index));
        let times = (set.tracks().map(|track| track.times)).chain(scalars.map(|keys| keys.times));
        let steps = times.flat_map(|times| times.windows(2));
        let each = steps.map(|times| Self {
            shortest: times[1] - times[0],
            longest: times[1] - times[0],
        });
        each.reduce(|a, b| Self {
            shortest: a.shortest.min(b.shortest),
            longest: a.longest.max(b.longest),
        })
    }

    pub(crate) fn are_even(self) -> bool {
        self.longest - self.shortest <= EVEN * self.longest
    }
}

impl Summary {
    fn new(input: String, animation: Option<String>, clip: &Motion, loaded: &Loaded) -> Self {
        let set = &clip.set;
        let with = |channel| {
            let tracks = 0..set.track_count();
            tracks
                .filter(move |&track| set.vector_keys(channel, track).is_some())
                .count()
        };
        let mut samplers = BTreeMap::new();
        for channels in &clip.channels {
            let all = [channels.rotation, channels.translation, channels.scale];
            for sampler in all.into_iter().flatten() {
                *samplers.entry(sampler.name()).or_default() += 1;
            }
        }
        let steps = Steps::of(set);
        let (first_time, last_time) = set.time_span().unwrap_or_default();
        let rotation = set
            .tracks()
            .flat_map(|track| track.keys.windows(2))
            .map(|keys| angle_between(keys[0].as_dquat(), keys[1].as_dquat()))
            .fold(0.0, f64::max);
        Self {
            input,
            animation,
            tracks: set.track_count(),
            names: set
                .tracks()
                .filter_map(|track| track.name.map(str::to_owned))
                .collect(),
            parents: clip.skeleton.iter().map(|joint| joint.parent).collect(),
            keys: set.key_count(),
            first_time,
            last_time,
            shortest_step: steps.map(|steps| steps.shortest),
            longest_step: steps.map(|steps| steps.longest),
            uniform: steps.is_none_or(Steps::are_even),
            largest_rotation_degrees: rotation.to_degrees(),
            moved: with(Channel::Translation),
            scaled: with(Channel::Scale),
            scalars: (0..set.scalar_count())
                .filter_map(|index| ScalarSummary::of(clip, index))
                .collect(),
            time_offset: clip.time_offset,
            origins: clip.origins.iter().map(DVec3::to_array).collect(),
            rate: clip.rate.map(|rate| rate.to_string()),
            frames: clip.rate.zip(set.time_span()).map(|(rate, (first, last))| {
                ((last - first) * rate.per_second()).round() as u64 + 1
            }),
            samplers,
            box_length: loaded.box_length,
            metres: loaded.space.map(|space| space.metres),
            up: loaded.space.map(|space| space.up.to_array()),
            warnings: Vec::new(),
        }
    }

    fn text(&self) -> String {
        let mut text = self.input.clone();
        if let Some(animation) = &self.animation {
            let _ = write!(text, ", animation {animation}");
        }
        text.push('\n');
        let mut line = |label: &str, value: String| {
            let _ = writeln!(text, "  {label:18} {value}");
        };
        line("tracks", self.tracks.to_string());
        line(
            "keys",
            match self.moved + self.scaled {
                0 => self.keys.to_string(),
                _ => format!("{} of rotations", self.keys),
            },
        );
        line(
            "time",
            match self.time_offset {
                0 => format!("{} to {} s", self.first_time, self.last_time),
                from => format!(
                    "{} to {} s, counted from second {from}",
                    self.first_time, self.last_time
                ),
            },
        );
        if let (Some(shortest), Some(longest)) = (self.shortest_step, self.longest_step) {
            line(
                "key spacing",
                match self.uniform {
                    true => format!("uniform, {shortest:.6} s"),
                    false => format!("{shortest:.6} to {longest:.6} s"),
                },
            );
        }
        line(
            "largest rotation",
            format!("{:.3}° between keys", self.largest_rotation_degrees),
        );
        if self.moved + self.scaled > 0 {
            let (moved, scaled) = (self.moved, self.scaled);
            line(
                "also",
                format!("{moved} with translations, {scaled} with scales"),
            );
        }
        if let Some([x, y, z]) = self.origins.iter().find(|origin| **origin != [0.0; 3]) {
            line("positions", format!("about {x} {y} {z}, in f64"));
        }
        if let Some(rate) = &self.rate {
            let frames = self
                .frames
                .map(|count| format!(" ({count} from the first key to the last)"));
            line(
                "on frames of",
                format!("{rate} fps{}", frames.unwrap_or_default()),
            );
        }
        if !self.samplers.is_empty() {
            let samplers = self
                .samplers
                .iter()
                .map(|(name, count)| format!("{count} {name}"));
            line("samplers", samplers.collect::<Vec<_>>().join(", "));
        }
        if !self.parents.is_empty() {
            let roots = self
                .parents
                .iter()
                .filter(|parent| parent.is_none())
                .count();
            line(
                "skeleton",
                format!(
                    "{}, {}",
                    words::count(self.parents.len(), "joint"),
                    words::count(roots, "root")
                ),
            );
        }
        if let (Some(metres), Some(up)) = (self.metres, self.up) {
            let axes = ["x", "y", "z"].into_iter().zip(up);
            let axis = axes.map(|(name, number)| match number {
                0.0 => String::new(),
                1.0.. => name.to_owned(),
                _ => format!("-{name}"),
            });
            let axis: String = axis.collect();
            line("space", format!("{metres} m per unit, {axis} is up"));
        }
        if let Some(length) = self.box_length {
            line("box length", length.to_string());
        }
        for warning in &self.warnings {
            line("warning", warning.clone());
        }
        if !self.scalars.is_empty() {
            let count = self.scalars.len();
            line(
                "scalars",
                format!("{count}: name, kind, number of keys, smallest and largest key"),
            );
        }
        for scalar in &self.scalars {
            let _ = writeln!(text, "    {}", scalar.text());
        }
        text
    }
}

fn is_second_zero(seconds: &i64) -> bool {
    *seconds == 0
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}
