//! The program `tumble`: it reads tracks of keys and writes interpolated rotations.
//!
//! Arguments are parsed into validated values (`arguments`), then one command runs (`commands`). An error becomes a
//! message on standard error and an exit code (`messages`). Data goes to standard output, and messages to standard
//! error. The program is a library, so that other front ends can run it. Its interface is not stable.

// Tests may use functions whose last bit differs between systems (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod arguments;
mod batch;
mod commands;
mod drivers;
pub mod host;
mod messages;
pub mod shards;
mod threads;

use std::process::ExitCode;

use clap::Parser;

use crate::arguments::global::GlobalArguments;
use crate::commands::Command;
use crate::messages::exit::BUG;

const ABOUT: &str = "Interpolate tracks of rotation keys in bulk, on Vulkan or the CPU, \
                     with the same bits";

const EXAMPLES: &str = "\
Examples:
  tumble generate -o chain.dat                 make an example file
  tumble info chain.dat                        show what it contains
  tumble eval chain.dat -o chain.npy           evaluate it: 25 fps, since its keys have no rate
  tumble eval chain.dat -m slerp -o chain.csv  slerp, as text
  tumble eval walks -o results --resume        a directory of files; skips results that are done
  tumble check results                         find results that changed since they were written
  tumble merge results                         combine the shards of several processes
  tumble verify chain.dat                      compare a device with the CPU, and both with f64
  tumble route hill.obj --start-point 0,0,0 --end-point 9,5,0 -o way.csv
  tumble view chain.dat --open                 show it in the browser
  tumble plot chain.dat -o chain.svg           plot every component
  tumble devices                               list the Vulkan devices
  tumble prove                                 check that a device gives the CPU's results
  tumble bench                                 measure the speed of this machine

Exit codes:
  0 success                        5 Vulkan is required, and there is no Vulkan device
  1 a bug in Tumble                6 the device failed, or its bits differ
  2 the command line is wrong      7 output could not be written
  3 some inputs failed             8 results differ or are missing, or nothing was proved
  4 all inputs failed              129 to 131, 141, 143 ended by a signal
If a result is too large, the exit code is 4 (memory) or 7 (disk). A batch continues with its other inputs.";

/// The command line.
#[derive(Debug, Parser)]
#[command(name = "tumble", version, about = ABOUT, after_help = EXAMPLES)]
#[command(max_term_width = 100)]
pub struct Arguments {
    #[command(flatten)]
    global: GlobalArguments,
    #[command(subcommand)]
    command: Command,
}

/// The stack of the program, bytes: as much as most systems give a program, also where a limit of the shell is lower.
const STACK: usize = 8 << 20;

/// Runs the program with the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    let run = || host::run(std::env::args_os());
    let thread = std::thread::Builder::new()
        .name("main".to_owned())
        .stack_size(STACK);
    // If no thread can be started, run on this thread.
    let code = match thread.spawn(run) {
        Ok(thread) => thread.join().unwrap_or(BUG),
        Err(_) => run(),
    };
    ExitCode::from(code)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use clap::{Arg, CommandFactory, Parser};

    use super::Arguments;

    /// clap checks its own definition: clashing flags, bad defaults.
    #[test]
    fn the_command_line_is_well_defined() {
        Arguments::command().debug_assert();
    }

    /// The meaning of an option in every command: its help before a colon, a semicolon or a bracket, after which a
    /// command may add something.
    fn meaning(option: &Arg) -> String {
        let help = option.get_help().unwrap_or_default().to_string();
        let end = help.find([':', ';', '[']).unwrap_or(help.len());
        help[..end].trim().to_owned()
    }

    /// One name, one meaning, in all commands; and one letter for one name.
    #[test]
    fn an_option_means_the_same_in_every_command() {
        let program = Arguments::command();
        let mut meanings: BTreeMap<&str, BTreeMap<String, Vec<&str>>> = BTreeMap::new();
        let mut letters: BTreeMap<char, &str> = BTreeMap::new();
        for command in program.get_subcommands() {
            for option in command.get_arguments() {
                let visible = option.get_visible_aliases().unwrap_or_default();
                for name in option.get_long().into_iter().chain(visible) {
                    let commands = meanings.entry(name).or_default();
                    let users = commands.entry(meaning(option)).or_default();
                    users.push(command.get_name());
                }
                if let (Some(letter), Some(name)) = (option.get_short(), option.get_long()) {
                    assert_eq!(*letters.entry(letter).or_insert(name), name, "-{letter}");
                }
            }
        }
        assert!(meanings.len() > 100, "{}", meanings.len());
        meanings.retain(|_, commands| commands.len() > 1 || commands.contains_key(""));
        assert!(
            meanings.is_empty(),
            "no help, or several meanings: {meanings:#?}"
        );
    }

    /// Options that once had a name of two meanings are still known by it, and go into manifests by their names now.
    #[test]
    fn older_names_of_options_are_the_same_options() {
        let route = "route hill.obj -o o.csv";
        for (old, new, recorded) in [
            (
                format!("{route} --from 0,0,0 --to 1,-1,1"),
                format!("{route} --start-point 0,0,0 --end-point 1,-1,1"),
                "",
            ),
            (
                "convert a -o b --up z".into(),
                "convert a -o b --up-axis z".into(),
                "\"up_axis\": [\"z\"]",
            ),
            (
                "smooth a -o b --ends loop".into(),
                "smooth a -o b --edges loop".into(),
                "\"edges\": [\"loop\"]",
            ),
            (
                "view a -o b --axes 9".into(),
                "view a -o b --drawn-frames 9".into(),
                "",
            ),
            (
                "render a -o b --axes 9".into(),
                "render a -o b --drawn-frames 9".into(),
                "",
            ),
            (
                "plot a -o b --picture-format png".into(),
                "plot a -o b --format png".into(),
                "",
            ),
            (
                "eval a -o b --path shortest".into(),
                "eval a -o b --signs shortest".into(),
                "\"signs\": [\"shortest\"]",
            ),
            (
                "eval a --out b".into(),
                "eval a --output b".into(),
                "\"out\": [\"b\"]",
            ),
            (
                "follow a -o b --rate 2 --frame fixed --up 0,0,1 --ends loop --speed constant -m linear --forward x".into(),
                "follow a -o b --pace 2 --path-frame fixed --path-up 0,0,1 --path-ends loop --path-speed constant \
                 --path-method linear --body-forward x"
                    .into(),
                "\"pace\": [\"2\"]",
            ),
            (
                "view a -o b --upward x --body 2".into(),
                "view a -o b --body-up x --body-length 2".into(),
                "",
            ),
            (
                "reduce a -o b --curve linear".into(),
                "reduce a -o b --method linear".into(),
                "\"method\": [\"linear\"]",
            ),
            (
                "prove --seconds 9".into(),
                "prove --time-limit 9".into(),
                "",
            ),
        ] {
            let [old, new] = [old, new].map(|line| {
                let words = ["tumble"].into_iter().chain(line.split(' '));
                let parsed = Arguments::try_parse_from(words);
                format!(
                    "{:?}",
                    parsed.unwrap_or_else(|error| panic!("{line}: {error}"))
                )
            });
            assert_eq!(old, new);
            assert!(new.contains(recorded), "{new}");
        }
    }
}
