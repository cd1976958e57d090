//! Options of every command: how many messages there are, how they look, and how many threads work.

use std::num::NonZeroUsize;

use anstream::ColorChoice;
use clap::{Args, ValueEnum};

use crate::messages::progress::{self, ProgressStyleChoice};
use crate::messages::words;

/// See the module. None of them changes a byte of a result, and no manifest records them.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Options of every command")]
pub(crate) struct GlobalArguments {
    /// Print errors only: no notes, no warnings; manifests and JSON still have all of them
    #[arg(short, long, global = true)]
    quiet: bool,
    /// How many threads compute [default: `RAYON_NUM_THREADS`, else one for each core]
    #[arg(short = 'j', long, value_name = "COUNT", global = true, value_parser = thread_count)]
    threads: Option<NonZeroUsize>,
    /// When messages have colours
    #[arg(long, value_name = "WHEN", value_enum, default_value_t, global = true)]
    color: ColourChoice,
    /// How progress is shown
    #[arg(long, value_name = "HOW", value_enum, default_value_t, global = true)]
    progress: ProgressStyleChoice,
}

fn thread_count(text: &str) -> Result<NonZeroUsize, String> {
    let count = text.parse();
    count.map_err(|_| "expected a whole number of threads, 1 or more".to_owned())
}

/// The names of these options, which have no rule ([`OPTIONS`](crate::arguments::options::OPTIONS)).
pub(crate) const GLOBAL: [&str; 4] = ["quiet", "threads", "color", "progress"];

/// When messages have colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum ColourChoice {
    /// on a terminal, unless `NO_COLOR` is set
    #[default]
    Auto,
    /// always
    Always,
    /// never
    Never,
}

impl GlobalArguments {
    /// Applies them to this process.
    pub(crate) fn apply(&self) {
        words::set_quiet(self.quiet);
        progress::choose(self.progress);
        let colours = match self.color {
            ColourChoice::Auto => ColorChoice::Auto,
            ColourChoice::Always => ColorChoice::Always,
            ColourChoice::Never => ColorChoice::Never,
        };
        colours.write_global();
        if let Some(count) = self.threads
            && !tumble::set_thread_count(count)
        {
            // Happens only if this process ran a command before, as the Python package does.
            words::note("--threads has no effect: the threads of this process are running already");
        }
    }
}
