//! `tumble completions`: scripts that complete this command line in a shell.

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::messages::exit::Failure;
use crate::messages::listing;

/// Print a completion script for a shell
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tumble completions bash > ~/.local/share/bash-completion/completions/tumble
  tumble completions fish > ~/.config/fish/completions/tumble.fish")]
pub(crate) struct Arguments {
    /// The shell
    shell: Shell,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    let mut command = crate::Arguments::command();
    clap_complete::generate(arguments.shell, &mut command, "tumble", &mut script);
    listing::text(&String::from_utf8_lossy(&script))
}
