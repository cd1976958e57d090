//! `tumble probe-drivers`, which is hidden: loads the Vulkan drivers for the process that starts it.

use clap::Args;

use crate::drivers;
use crate::messages::exit::Failure;

/// Load the Vulkan drivers, and print nothing else
#[derive(Debug, Args)]
pub(crate) struct Arguments {}

pub(crate) fn run(_: &Arguments) -> Result<(), Failure> {
    drivers::load();
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_command_is_there_and_hidden() {
        let program = crate::Arguments::command();
        let command = program.find_subcommand(crate::drivers::COMMAND).unwrap();
        assert!(command.is_hide_set());
    }
}
