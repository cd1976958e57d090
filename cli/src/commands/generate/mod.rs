//! `tumble generate`: keyframe files and a landscape to try things with.

mod landscape;

use std::path::{Path, PathBuf};

use clap::Args;
use tumble_formats::generate::{Generate, KeySpacing};

use crate::batch::target::Destination;
use crate::commands::generate::landscape::{Landscape, SIZE};
use crate::messages::exit::Failure;
use crate::messages::words;

/// Write a keyframe file of swinging boxes, or a hill with rocks; the same seed gives the same file
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tumble generate -o chain.dat
  tumble generate --boxes 4096 --keys 260 --seconds 200 --random -o - | tumble info -
  tumble generate --hill -o hill.obj --rocks rocks.obj")]
pub(crate) struct Arguments {
    /// Where to write: a file (`-`: standard output)
    #[arg(short, long = "output", alias = "out", value_name = "FILE")]
    out: PathBuf,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Number of boxes: tracks
    #[arg(long, default_value = "4", value_parser = words::whole_number::<u32>(1, 65_536))]
    boxes: u32,
    /// Keys of each box
    #[arg(long, default_value = "26", value_parser = words::whole_number::<u32>(1, u64::from(u32::MAX)))]
    keys: u32,
    /// The duration in seconds: the time of the last key; the first is at 0
    #[arg(long, default_value = "20", value_parser = positive, allow_hyphen_values = true)]
    seconds: f64,
    /// Keys at even times (default)
    #[arg(long, conflicts_with = "random")]
    uniform: bool,
    /// Keys at random times
    #[arg(long)]
    random: bool,
    /// The seed of random numbers: the same seed gives the same file on every machine
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Length of a box
    #[arg(long, default_value = "3", value_parser = positive, allow_hyphen_values = true)]
    length: f64,
    /// Write a hill instead, as OBJ: over the square from 0,0,0 to 10,0,10, level at its rim
    #[arg(long, conflicts_with_all = ["boxes", "keys", "seconds", "uniform", "random", "length"])]
    hill: bool,
    /// Also write rocks that stand on the hill, as OBJ
    #[arg(long, value_name = "FILE", requires = "hill")]
    rocks: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.hill {
        return write_landscape(arguments);
    }
    let generate = Generate {
        box_count: arguments.boxes as usize,
        key_count: arguments.keys as usize,
        seconds: arguments.seconds,
        spacing: if arguments.random {
            KeySpacing::Random
        } else {
            KeySpacing::Uniform
        },
        length: arguments.length,
        seed: arguments.seed,
    };
    generate
        .check()
        .map_err(|error| Failure::usage(error.to_string()))?;
    let destination = Destination::new(&arguments.out, arguments.overwrite, &[])?;
    destination.write(None, |out| generate.write(out))?;
    words::note(&format!(
        "{} × {}, {} s, seed {} → {destination}",
        words::boxes(arguments.boxes as usize),
        words::count(arguments.keys as usize, "key"),
        arguments.seconds,
        arguments.seed,
    ));
    Ok(())
}

/// Writes the hill and its rocks.
fn write_landscape(arguments: &Arguments) -> Result<(), Failure> {
    let landscape = Landscape::new(arguments.seed);
    let destination = |path: &Path| Destination::new(path, arguments.overwrite, &[]);
    let rocks = arguments.rocks.as_deref().map(destination).transpose()?;
    let hill = destination(&arguments.out)?;
    if let Some(rocks) = &rocks {
        rocks.refuse_same(&arguments.out)?;
        rocks.check_writable()?;
    }
    hill.write(None, |out| landscape.write_hill(out))?;
    if let Some(rocks) = rocks {
        rocks.write(None, |out| landscape.write_rocks(out))?;
    }
    words::note(&format!(
        "a hill over {SIZE} × {SIZE}, seed {} → {hill}",
        arguments.seed
    ));
    Ok(())
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number above 0".to_owned()),
    }
}
