//! `tumble info`: what is in a keyframe file.

use std::fmt::Write;

use clap::Args;
use serde::Serialize;
use tumble::TrackSet;
use tumble::reference::angle_between;
use tumble_formats::Loaded;

use crate::arguments::input;
use crate::arguments::input::Inputs;
use crate::messages::exit::{Failure, for_each};
use crate::messages::words;

/// Steps that differ by less than this (relative) are even: decimal times are
/// rarely even to the last bit.
const EVEN: f64 = 1e-6;

/// Say what is in keyframe files: tracks, keys, times, largest rotation
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tumble info data/pendulum.dat
  tumble info --json *.dat | jq '.[].tracks'")]
pub(crate) struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What is told of one input; also the form of the JSON.
#[derive(Serialize)]
struct Summary {
    input: String,
    tracks: usize,
    /// Of all tracks together.
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
    box_length: f64,
    /// `FILE:LINE:COLUMN: warning[CODE]: …`
    warnings: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut summaries = Vec::new();
    let inputs = arguments.inputs.distinct(false)?;
    let outcome = for_each(&inputs, |path| {
        let loaded = arguments.inputs.load_quietly(path)?;
        summaries.push(Summary::new(input::name(path), &loaded));
        Ok(())
    });
    if arguments.json {
        words::json(&summaries)?;
    } else {
        let texts: Vec<String> = summaries.iter().map(Summary::text).collect();
        words::listing(&texts.join("\n"))?;
    }
    outcome
}

/// The times between neighbouring keys, seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steps {
    pub(crate) shortest: f64,
    pub(crate) longest: f64,
}

impl Steps {
    /// Of all tracks; nothing where no track has two keys.
    pub(crate) fn of(set: &TrackSet) -> Option<Self> {
        let steps = set.tracks().flat_map(|track| track.times.windows(2));
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
    fn new(input: String, loaded: &Loaded) -> Self {
        let Loaded {
            set,
            box_length,
            warnings,
            ..
        } = loaded;
        let steps = Steps::of(set);
        let (first_time, last_time) = set.time_span().unwrap_or_default();
        let rotation = set
            .tracks()
            .flat_map(|track| track.keys.windows(2))
            .map(|keys| angle_between(keys[0].as_dquat(), keys[1].as_dquat()))
            .fold(0.0, f64::max);
        Self {
            input,
            tracks: set.track_count(),
            keys: set.key_count(),
            first_time,
            last_time,
            shortest_step: steps.map(|steps| steps.shortest),
            longest_step: steps.map(|steps| steps.longest),
            uniform: steps.is_none_or(Steps::are_even),
            largest_rotation_degrees: rotation.to_degrees(),
            box_length: *box_length,
            warnings: warnings.iter().map(ToString::to_string).collect(),
        }
    }

    fn text(&self) -> String {
        let mut text = format!("{}\n", self.input);
        let mut line = |what: &str, value: String| {
            let _ = writeln!(text, "  {what:18} {value}");
        };
        line("tracks", self.tracks.to_string());
        line("keys", self.keys.to_string());
        line(
            "time",
            format!("{} to {} s", self.first_time, self.last_time),
        );
        if let (Some(shortest), Some(longest)) = (self.shortest_step, self.longest_step) {
            line(
                "steps",
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
        line("box length", self.box_length.to_string());
        for warning in &self.warnings {
            line("warning", warning.clone());
        }
        text
    }
}
