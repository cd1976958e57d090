//! Runs the program inside another program: for front ends without an executable, such as the Python package.

use std::ffi::OsString;
use std::path::Path;

use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser};
use tumble::{Device, Engine, EngineOptions, Interpolation};
use tumble_formats::Diagnostic;
use tumble_formats::motion::Motion;

use crate::Arguments;
use crate::arguments::device::DeviceArguments;
use crate::arguments::interpolation;
use crate::commands::view;
use crate::drivers;
use crate::messages::exit::{self, Failure};
use crate::messages::listing::{self, JsonForm};
use crate::messages::{signals, words};

/// Why a call failed.
#[derive(Debug)]
pub struct Refused {
    /// The error in words for people.
    pub message: String,
    /// Whether the request is wrong, rather than a device or the system.
    pub is_usage: bool,
    /// The exit code of the program for this error.
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

/// Runs the program with these arguments, the first of which is its name. Returns its exit code.
#[must_use]
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    words::explain_panics();
    let raw: Vec<OsString> = arguments.into_iter().collect();
    let mut command = Arguments::command();
    let parsed = command
        .try_get_matches_from_mut(&raw)
        .and_then(|matches| Ok((Arguments::from_arg_matches(&matches)?, json_form(&matches))));
    let (arguments, json_form) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            let mut error = error.format(&mut command);
            words::usage(&mut error, &raw);
            return error.exit_code() as u8;
        }
    };
    let outcome = std::panic::catch_unwind(|| {
        arguments.global.apply();
        signals::stop_on_signals();
        listing::begin();
        arguments.command.run()
    });
    match outcome {
        Ok(Ok(())) => exit::DONE,
        Ok(Err(failure)) => {
            let printed = json_form.map_or(Ok(()), |form| listing::failed(&failure, form));
            let code = failure.report();
            printed.map_or_else(|failure| failure.report(), |()| code)
        }
        Err(_) => exit::BUG, // the hook has reported it
    }
}

/// The form of the JSON that the command prints; `None` without `--json`.
fn json_form(matches: &ArgMatches) -> Option<JsonForm> {
    const OBJECTS: [&str; 6] = ["bench", "check", "compare", "devices", "merge", "prove"];
    let (name, matches) = matches.subcommand()?;
    let is_set = matches!(matches.try_get_one("json"), Ok(Some(true)));
    is_set.then_some(match OBJECTS.contains(&name) {
        true => JsonForm::Object,
        false => JsonForm::List,
    })
}

/// Sets the command of the child process that loads the Vulkan drivers, instead of this executable; see
/// [`load_drivers`]. Only the first call has an effect.
pub fn set_probe(command: Vec<OsString>) {
    drivers::set_command(command);
}

/// Loads the Vulkan drivers, and then prints a line to standard output. A driver may end the process that loads it.
/// Therefore a child process calls this before the parent opens a device, and the line shows that no driver ended it.
pub fn load_drivers() {
    drivers::load();
}

/// All Vulkan devices, in the order of their indices.
///
/// # Errors
/// When Vulkan is not available, or a driver fails.
pub fn devices() -> Result<Vec<Device>, Refused> {
    drivers::devices().map_err(|error| Refused {
        message: error.to_string(),
        is_usage: false,
        code: exit::DEVICE,
    })
}

/// Opens the device with this name, as the option `--device` does: `first`, `cpu`, `vulkan`, an index, a device's
/// name or a part of it. Here, `auto` is the CPU; see [`auto`].
///
/// # Errors
/// When there is no such device, or when it cannot be opened.
pub fn open(name: &str, options: &EngineOptions) -> Result<Engine, Refused> {
    let opened = DeviceArguments::of(name, options).open_any()?;
    Ok(opened.engine)
}

/// Opens the device that is the fastest for calls with this number of rotations, with options. `None` if loading the
/// drivers ends the process that loads them.
///
/// # Errors
/// When no device, not even the CPU, can be opened.
pub fn auto(rotations: usize, options: &EngineOptions) -> Result<Option<Engine>, Refused> {
    if drivers::drivers().is_err() {
        return Ok(None);
    }
    let engine = Engine::auto_with(rotations, options).map_err(|error| Refused {
        message: error.to_string(),
        is_usage: false,
        code: exit::DEVICE,
    })?;
    Ok(Some(engine))
}

/// The known name that is most similar to a misspelt one, which the program suggests; `None` if none is similar.
pub fn nearest_name<'a>(
    misspelt: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    words::nearest(misspelt, known)
}

/// A warning about `name` if curves of a clip are less smooth than their method promises: their angular acceleration
/// jumps at a key. `None` if there are none.
#[must_use]
pub fn curve_warning(
    name: &str,
    clip: &Motion,
    interpolation: &Interpolation,
) -> Option<Diagnostic> {
    interpolation::curve_warning(name, clip, interpolation)
}

/// The HTML page of `tumble view` for some clips, which are called `path` in messages and titles. `box_length` is the
/// length of each box of a chain. `options` are those of `tumble view` except inputs and output.
///
/// # Errors
/// When the options are wrong, or when the clips cannot be displayed.
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
    let fixed = ["view", "-", "--output", "-"].map(str::to_owned);
    let parsed = Options::try_parse_from(fixed.iter().chain(options)).map_err(|error| Refused {
        message: error.to_string(),
        is_usage: true,
        code: exit::USAGE,
    })?;
    Ok(parsed.view.html(path, clips, box_length)?)
}
