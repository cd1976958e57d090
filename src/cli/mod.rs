//! The commands. Each file holds one: its arguments and what it does with them.
//!
//! Data goes to standard output and words to standard error; [`exit`] says what
//! the exit codes mean.

mod batch;
mod bench;
mod check;
mod colours;
mod completions;
mod device;
mod devices;
mod digest;
mod eval;
pub(crate) mod exit;
mod explain;
mod gather;
mod generate;
mod info;
mod input;
mod interpolation;
mod manifest;
mod methods;
mod output;
mod picture;
mod place;
mod plot;
mod probe;
mod progress;
mod render;
mod room;
mod signals;
mod stream;
mod time;
mod verify;
mod view;
mod what;
mod words;

pub(crate) use signals::stop_on_signals;
pub(crate) use words::explain_panics;

use clap::{Parser, Subcommand};

use exit::Failure;

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
  tumble verify chain.dat                      device = CPU, and both against f64
  tumble view chain.dat --open                 see the boxes turn
  tumble plot chain.dat -o chain.svg           see every component
  tumble devices                               what Vulkan offers here
  tumble bench                                 how fast this machine is

Exit codes:
  0 done                           5 a Vulkan device was demanded, there is none
  1 a bug in tumble                6 the device failed, or is not exact
  2 the command line is wrong      7 output could not be written
  3 some inputs failed             8 verification found a difference
  4 all inputs failed              130, 141, 143 stopped by a signal";

/// What the command line says.
#[derive(Debug, Parser)]
#[command(name = "tumble", version, about = ABOUT, after_help = EXAMPLES)]
#[command(max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Eval(Box<eval::Arguments>),
    Verify(verify::Arguments),
    Devices(devices::Arguments),
    Info(info::Arguments),
    Generate(generate::Arguments),
    Methods(methods::Arguments),
    Plot(Box<plot::Arguments>),
    View(Box<view::Arguments>),
    Render(Box<render::Arguments>),
    Bench(bench::Arguments),
    Check(check::Arguments),
    Explain(explain::Arguments),
    Completions(completions::Arguments),
    #[command(hide = true)]
    ProbeDrivers(probe::Arguments),
}

impl Command {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self {
            Self::Eval(arguments) => eval::run(&arguments),
            Self::Verify(arguments) => verify::run(&arguments),
            Self::Devices(arguments) => devices::run(&arguments),
            Self::Info(arguments) => info::run(&arguments),
            Self::Generate(arguments) => generate::run(&arguments),
            Self::Methods(arguments) => methods::run(&arguments),
            Self::Plot(arguments) => plot::run(&arguments),
            Self::View(arguments) => view::run(&arguments),
            Self::Render(arguments) => render::run(&arguments),
            Self::Bench(arguments) => bench::run(&arguments),
            Self::Check(arguments) => check::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
            Self::Completions(arguments) => completions::run(&arguments),
            Self::ProbeDrivers(arguments) => probe::run(&arguments),
        }
    }
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
