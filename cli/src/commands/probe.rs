//! A driver may end the process that loads it. So a process of its own loads them first.

use std::ffi::OsString;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use clap::Args;
use tumble::{Device, VulkanError};

use crate::host;
use crate::messages::exit::Failure;

/// Load the Vulkan drivers, and say nothing
#[derive(Debug, Args)]
pub(crate) struct Arguments {}

/// The command's name.
const COMMAND: &str = "probe-drivers";

/// Drivers answer in tens of milliseconds; one that has not by now does not.
const PATIENCE: Duration = Duration::from_secs(10);

pub(crate) fn run(_: &Arguments) -> Result<(), Failure> {
    host::load_drivers();
    Ok(())
}

/// Every Vulkan device, once a process has come through loading their drivers.
pub(crate) fn devices() -> Result<Vec<Device>, VulkanError> {
    drivers()?;
    Device::list()
}

/// Whether a process comes through loading the drivers.
pub(crate) fn drivers() -> Result<(), VulkanError> {
    static OUTCOME: OnceLock<Result<(), VulkanError>> = OnceLock::new();
    OUTCOME
        .get_or_init(|| match load_elsewhere() {
            Some(how) => Err(VulkanError::Driver { how }),
            None => Ok(()),
        })
        .clone()
}

/// The command of a front end whose executable is not this program.
static OTHER_COMMAND: OnceLock<Vec<OsString>> = OnceLock::new();

/// Lets that command load the drivers. What is said first counts.
pub(crate) fn set_command(command: Vec<OsString>) {
    let _ = OTHER_COMMAND.set(command);
}

/// The command that loads the drivers.
fn command() -> Option<Command> {
    if let Some([program, arguments @ ..]) = OTHER_COMMAND.get().map(Vec::as_slice) {
        let mut command = Command::new(program);
        command.args(arguments);
        return Some(command);
    }
    let mut command = Command::new(std::env::current_exe().ok()?);
    command.arg(COMMAND);
    Some(command)
}

/// What became of a process that did not come through.
fn load_elsewhere() -> Option<String> {
    let mut child = command()?
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .ok()?; // without processes there is nothing to learn
    let started = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return fate(status),
            Ok(None) if started.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(1));
            }
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return Some(format!("no answer within {} s", PATIENCE.as_secs()));
            }
        }
    }
}

fn fate(status: ExitStatus) -> Option<String> {
    (!status.success()).then(|| format!("the process that tried ended with {status}"))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_command_is_there_and_hidden() {
        let program = crate::Arguments::command();
        let command = program.find_subcommand(super::COMMAND).unwrap();
        assert!(command.is_hide_set());
    }
}
