//! `tumble man`: manual pages.

use clap::{Args, CommandFactory};
use clap_mangen::Man;

use crate::messages::exit::Failure;
use crate::messages::{listing, words};

/// Print the manual page of the program, or of one of its commands
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tumble man > tumble.1                        for ~/.local/share/man/man1
  tumble man eval > tumble-eval.1")]
pub(crate) struct Arguments {
    /// The command [default: the program]
    #[arg(value_name = "COMMAND")]
    command: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut program = crate::Arguments::command();
    // `build` passes the help, names and global options on to the subcommands, which clap does only then.
    program.build();
    let command = match &arguments.command {
        None => program,
        Some(name) => {
            let listed = || program.get_subcommands().filter(|it| !it.is_hide_set());
            let found = listed().find(|command| command.get_name() == name);
            found.cloned().ok_or_else(|| {
                let nearest = words::nearest(name, listed().map(clap::Command::get_name));
                let hint = nearest.map_or(String::new(), |name| format!("; did you mean {name}?"));
                Failure::usage(format!("there is no command `{name}`{hint}"))
            })?
        }
    };
    let mut page = Vec::new();
    Man::new(command)
        .render(&mut page)
        .map_err(|error| Failure::writing("the manual page", &error))?;
    listing::text(&String::from_utf8_lossy(&page))
}
