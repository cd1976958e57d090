//! The Vulkan drivers of this machine. A driver may end the process that loads it, so a child process
//! loads them first.

use std::cell::Cell;
use std::ffi::OsString;
use std::io::Read;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use tumble::Device;
use tumble::vulkan::VulkanError;

use crate::messages::listing;

/// The name of the command that loads the drivers, and does nothing else.
pub(crate) const COMMAND: &str = "probe-drivers";

/// The output of a process that has loaded the drivers. A process that a driver has ended does not print it.
const LOADED: &str = "tumble: the Vulkan drivers are loaded";

/// The most output that is read from it: as much as a pipe holds.
const MAX_OUTPUT: u64 = 1 << 16;

/// Seconds that drivers have to answer. Most take tens of milliseconds; cards without the persistence
/// daemon, and machines with eight of them, take tens of seconds.
const PATIENCE: u64 = 60;

/// The environment variable that overrides it.
const PATIENCE_VARIABLE: &str = "TUMBLE_DRIVER_SECONDS";

fn patience() -> u64 {
    let named = std::env::var(PATIENCE_VARIABLE).ok();
    named
        .and_then(|seconds| seconds.parse().ok())
        .unwrap_or(PATIENCE)
}

/// Ends the process at once when a driver calls `exit`. Otherwise, functions that run at the end of a process would
/// wait for the loader's lock, which the driver's caller holds, and the parent would wait until its time limit.
/// Destructors of thread-local values, such as this one, run before these functions.
struct EndAtOnce {
    is_loading: Cell<bool>,
}

impl Drop for EndAtOnce {
    fn drop(&mut self) {
        #[cfg(unix)]
        if self.is_loading.get() {
            signal_hook::low_level::exit(0);
        }
    }
}

thread_local! {
    static END_AT_ONCE: EndAtOnce = const {
        EndAtOnce { is_loading: Cell::new(false) }
    };
}

/// Loads the drivers in this process, and then prints a line to standard output: no driver has ended the process.
pub(crate) fn load() {
    END_AT_ONCE.with(|end| end.is_loading.set(true));
    let _ = Device::list(); // errors occur again where they are reported
    END_AT_ONCE.with(|end| end.is_loading.set(false));
    let _ = listing::text(&format!("{LOADED}\n")); // the parent may have ended
}

/// All Vulkan devices, after another process has loaded their drivers without being ended by one.
pub(crate) fn devices() -> Result<Vec<Device>, VulkanError> {
    drivers()?;
    Device::list()
}

/// Returns an error if loading the drivers ends the process that loads them.
pub(crate) fn drivers() -> Result<(), VulkanError> {
    static OUTCOME: OnceLock<Result<(), VulkanError>> = OnceLock::new();
    OUTCOME
        .get_or_init(|| load_elsewhere(patience()).map_or(Ok(()), Err))
        .clone()
}

/// The command of a front end whose executable is not this program.
static OTHER_COMMAND: OnceLock<Vec<OsString>> = OnceLock::new();

/// Sets the command that loads the drivers. Only the first call counts.
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

/// Loads the drivers in another process; returns the error if this ended the process.
fn load_elsewhere(seconds: u64) -> Option<VulkanError> {
    let mut child = command()?
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?; // without processes there is nothing to learn
    let started = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => {
                let mut said = String::new();
                // A driver may have printed a lot, or may have left a process that keeps the pipe open.
                let out = child.stdout.take().map(|out| out.take(MAX_OUTPUT));
                let _ = out.map(|mut out| out.read_to_string(&mut said));
                return failure_of(status, said.contains(LOADED));
            }
            Ok(None) if started.elapsed() < Duration::from_secs(seconds) => {
                std::thread::sleep(Duration::from_millis(1));
            }
            _ => {
                let _ = child.kill();
                let _ = child.wait();
                return Some(VulkanError::SlowDriver { seconds });
            }
        }
    }
}

/// The error if a driver has ended the process that loaded it. `has_come_through`: whether the process printed
/// [`LOADED`]. Its status is not enough, because a driver may end the process with any status, 0 too.
fn failure_of(status: ExitStatus, has_come_through: bool) -> Option<VulkanError> {
    let how = format!("the process that tried ended with {status}");
    (!status.success() || !has_come_through).then_some(VulkanError::Driver { how })
}
