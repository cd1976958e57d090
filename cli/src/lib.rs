//! The program `tumble`: keyframe tracks in, interpolated rotations out.
//!
//! Arguments are parsed into validated values (`arguments`), one command runs
//! (`commands`), and what went wrong becomes a message on standard error and an exit code
//! (`messages`). Data goes to standard output and words to standard error. A library, so
//! that other front ends run the same program; it promises no stable interface.

// Tests may use what systems round differently (clippy.toml).
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

use crate::commands::Command;

const ABOUT: &str = "Interpolate tracks of rotation keys in bulk, on Vulkan or the CPU, \
                     with the same bits";

const EXAMPLES: &str = "\
Examples:
  tumble generate -o chain.dat                 make a file to play with
  tumble info chain.dat                        what is in it
  tumble eval chain.dat -o chain.npy           25 frames per second, Bessel-Overhauser
  tumble eval chain.dat -m slerp -o chain.csv  slerp, as text
  tumble eval walks -o results                 a directory of files; --resume goes on
  tumble check results                         are its bits still what they were?
  tumble merge results                         shards of many processes become one manifest
  tumble verify chain.dat                      device = CPU, and both against f64
  tumble route hill.obj --from 0,0,0 --to 9,5,0 -o way.csv
  tumble view chain.dat --open                 see the boxes turn
  tumble plot chain.dat -o chain.svg           see every component
  tumble devices                               what Vulkan offers here
  tumble prove                                 does a device keep what is promised?
  tumble bench                                 how fast this machine is

Exit codes:
  0 done                           5 a Vulkan device was demanded, there is none
  1 a bug in tumble                6 the device failed, or is not exact
  2 the command line is wrong      7 output could not be written
  3 some inputs failed             8 a difference was found, or nothing proved
  4 all inputs failed              129 to 131, 141, 143 by a signal";

/// The command line.
#[derive(Debug, Parser)]
#[command(name = "tumble", version, about = ABOUT, after_help = EXAMPLES)]
#[command(max_term_width = 100)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// Runs the program with this process's arguments.
#[must_use]
pub fn main() -> ExitCode {
    ExitCode::from(host::run(std::env::args_os()))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    /// clap checks its own definition: clashing flags, bad defaults.
    #[test]
    fn the_command_line_is_well_defined() {
        super::Arguments::command().debug_assert();
    }
}
