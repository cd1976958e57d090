//! `tumble generate`: keyframe files to try things with.

use std::path::PathBuf;

use clap::Args;
use tumble_formats::generate::{Generate, Steps};

use crate::batch::place::Place;
use crate::messages::exit::Failure;
use crate::messages::words;

/// Write a keyframe file of swinging boxes; the same seed gives the same file
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tumble generate -o chain.dat
  tumble generate --boxes 4096 --keys 260 --seconds 200 --random -o - | tumble info -")]
pub(crate) struct Arguments {
    /// Where to write (`-`: standard output)
    #[arg(short, long = "out", value_name = "FILE")]
    out: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    overwrite: bool,
    /// Number of boxes: tracks
    #[arg(long, default_value = "4", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    boxes: u32,
    /// Keys of each box
    #[arg(long, default_value = "26", value_parser = clap::value_parser!(u32).range(1..))]
    keys: u32,
    /// Time of the last key; the first is at 0
    #[arg(long, default_value = "20", value_parser = positive, allow_hyphen_values = true)]
    seconds: f64,
    /// Keys at even times (default)
    #[arg(long, conflicts_with = "random")]
    uniform: bool,
    /// Keys at random times
    #[arg(long)]
    random: bool,
    /// Seed of the random numbers
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Length of a box
    #[arg(long, default_value = "3", value_parser = positive, allow_hyphen_values = true)]
    length: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let generate = Generate {
        boxes: arguments.boxes as usize,
        keys: arguments.keys as usize,
        seconds: arguments.seconds,
        steps: if arguments.random {
            Steps::Random
        } else {
            Steps::Uniform
        },
        length: arguments.length,
        seed: arguments.seed,
    };
    generate
        .check()
        .map_err(|error| Failure::usage(error.to_string()))?;
    let place = Place::new(&arguments.out, arguments.overwrite, &[])?;
    place.write(None, |out| generate.write(out))?;
    words::note(&format!(
        "{} × {}, {} s, seed {} → {place}",
        words::boxes(arguments.boxes as usize),
        words::count(arguments.keys as usize, "key"),
        arguments.seconds,
        arguments.seed,
    ));
    Ok(())
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(format!("`{text}` is not a positive number")),
    }
}
