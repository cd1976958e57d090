//! The program inside another: for front ends that have no executable of their own, such as the
//! package for Python.

use std::ffi::OsString;
use std::path::Path;

use clap::Parser;
use tumble::{Device, Engine, EngineOptions, Interpolation, TrackSet};
use tumble_formats::Diagnostic;
use tumble_formats::motion::Motion;

use crate::Arguments;
use crate::arguments::device::DeviceArguments;
use crate::arguments::interpolation;
use crate::commands::view;
use crate::drivers;
use crate::messages::exit::{self, Failure};
use crate::messages::{signals, words};

/// Why something was refused.
#[derive(Debug)]
pub struct Refused {
    /// In words for people.
    pub message: String,
    /// Whether the request is at fault, rather than a device or the system.
    pub is_usage: bool,
    /// The program's exit code.
    pub code: u8,
}

impl From<Failure> for Refused {
    fn from(failure: Failure) -> Self {
        Self {
            is_usage: matches!(failure.code, exit::USAGE | exit::ALL_INPUTS),
            code: failure.code,
            message: failure.into_message(),
        }
    }
}

/// Runs the program with these arguments, the first of which is its name, and gives its exit code.
#[must_use]
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    words::explain_panics();
    let raw: Vec<OsString> = arguments.into_iter().collect();
    let arguments = match Arguments::try_parse_from(&raw) {
        Ok(arguments) => arguments,
        Err(error) => {
            words::usage(&error, &raw);
            return error.exit_code() as u8;
        }
    };
    let outcome = std::panic::catch_unwind(|| {
        signals::stop_on_signals();
        arguments.command.run()
    });
    match outcome {
        Ok(Ok(())) => exit::DONE,
        Ok(Err(failure)) => failure.report(),
        Err(_) => exit::BUG, // the hook has reported it
    }
}

/// Sets the command that loads the Vulkan drivers in a child process, instead of this executable: see
/// [`load_drivers`]. Only the first call counts.
pub fn set_probe(command: Vec<OsString>) {
    drivers::set_command(command);
}

/// Loads the Vulkan drivers. A driver may end the process that loads it, so that a child process
/// does this before anything else opens a device, and says on standard output that it came through.
pub fn load_drivers() {
    drivers::load();
}

/// The names of all Vulkan devices, in the order of their indices.
///
/// # Errors
/// When there is no Vulkan, or a driver fails.
pub fn devices() -> Result<Vec<Device>, Refused> {
    drivers::devices().map_err(|error| Refused {
        message: error.to_string(),
        is_usage: false,
        code: exit::DEVICE,
    })
}

/// Opens the device of that name, as in `--device`: `first`, `cpu`, `vulkan`, an index, a name
/// or part of it; `auto` is the CPU here, see [`auto`].
///
/// # Errors
/// When there is no such device, or it cannot be opened.
pub fn open(name: &str, options: &EngineOptions) -> Result<Engine, Refused> {
    let opened = DeviceArguments::of(name, options).open_any()?;
    Ok(opened.engine)
}

/// The device that is the fastest for calls of so many rotations; `None` where loading the drivers
/// ends the process that tries.
///
/// # Errors
/// When the system refuses what the CPU needs.
pub fn auto(rotations: usize) -> Result<Option<Engine>, Refused> {
    if drivers::drivers().is_err() {
        return Ok(None);
    }
    let engine = Engine::auto_for(rotations).map_err(|error| Refused {
        message: error.to_string(),
        is_usage: false,
        code: exit::DEVICE,
    })?;
    Ok(Some(engine))
}

/// Where the curves of a set are less smooth than their method promises, as a warning about `name`.
#[must_use]
pub fn curve_warning(
    name: &str,
    set: &TrackSet,
    interpolation: &Interpolation,
) -> Option<Diagnostic> {
    interpolation::curve_warning(name, set, interpolation)
}

/// The page of `tumble view` with some clips, which messages and titles call by `path`. `options`
/// are those of `tumble view` but inputs and output.
///
/// # Errors
/// When the options are wrong, or the clips cannot be shown.
pub fn page(
    path: &Path,
    clips: Vec<Motion>,
    box_length: Option<f64>,
    options: &[String],
) -> Result<String, Refused> {
    /// Parses the options.
    #[derive(Parser)]
    #[command(name = "view", disable_help_flag = true)]
    struct Options {
        #[command(flatten)]
        view: view::Arguments,
    }
    let fixed = ["view", "-", "--out", "-"].map(str::to_owned);
    let parsed = Options::try_parse_from(fixed.iter().chain(options)).map_err(|error| Refused {
        message: error.to_string(),
        is_usage: true,
        code: exit::USAGE,
    })?;
    Ok(parsed.view.html(path, clips, box_length)?)
}
