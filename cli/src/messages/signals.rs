//! Ctrl-C, SIGTERM, SIGHUP and SIGQUIT, on Windows Ctrl-C, Ctrl-Break and a closed window: stop soon, and
//! leave no half-written file.
//!
//! A thread waits for the signal, and prints a line about it. While no output file is open and no batch runs, it ends
//! the program at once. Otherwise it sets a mark. The writer of a file checks the mark before its next chunk, and
//! removes its temporary file; a batch checks it before its next input, and prints how far it has come. If a batch does
//! not check the mark within [`GRACE`], it is ended without this line, unless a file is open. A second signal removes
//! the file itself, and ends the program at once. Signals that this process was started to ignore, as by `nohup`, are
//! ignored.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tumble_formats::output::remove_unfinished;

use crate::messages::exit::Failure;
use crate::messages::words;

struct SignalState {
    /// Output files that are being written.
    writing: usize,
    /// Batches that run.
    batches: usize,
    /// The signal that came.
    signal: Option<i32>,
}

/// The time that a batch has to react to a signal. After it, the signal ends the program, unless an output file is
/// open.
const GRACE: Duration = Duration::from_secs(2);

static STATE: Mutex<SignalState> = Mutex::new(SignalState {
    writing: 0,
    batches: 0,
    signal: None,
});

fn state() -> MutexGuard<'static, SignalState> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn code(signal: i32) -> u8 {
    128 + signal as u8
}

/// Ends the program. If a file is being written or a batch runs, records the signal instead, and they stop.
fn handle_signal(signal: i32) {
    // Print without holding the lock: printing may have to wait for a reader, and the main thread needs the lock.
    if stopped().is_none() {
        let name = signal_hook::low_level::signal_name(signal).unwrap_or("a signal");
        words::line(&format!("interrupted by {name}"));
    }
    let mut state = state();
    // On a second signal, do not wait for the writer.
    if state.writing + state.batches == 0 || state.signal.is_some() {
        end(&state, signal);
    }
    state.signal = Some(signal);
    let wait = move || {
        std::thread::sleep(GRACE);
        let state = self::state();
        if state.writing == 0 {
            end(&state, signal);
        }
    };
    // If the thread cannot be started, a signal ends the batch at its next input, and a second signal at once.
    let _ = std::thread::Builder::new().spawn(wait);
}

/// Ends the program at once. The state is locked, so that no file is opened meanwhile.
fn end(_locked: &MutexGuard<'_, SignalState>, signal: i32) -> ! {
    let _no_more = remove_unfinished();
    signal_hook::low_level::exit(i32::from(code(signal)))
}

/// Starts the waiting thread, once for the process. Without it (a system that refuses) they end the
/// program in their default way.
pub(crate) fn stop_on_signals() {
    static STARTED: std::sync::Once = std::sync::Once::new();
    STARTED.call_once(wait_for_signals);
}

#[cfg(unix)]
fn wait_for_signals() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;

    // With `ulimit -f`, a write beyond the limit sends this signal, which would end the program. If it is ignored, the
    // write fails instead, and the writer reports this and removes the file.
    let ignored = ignored();
    let all = [SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXFSZ];
    let heeded = all
        .into_iter()
        .filter(|signal| ignored >> (signal - 1) & 1 == 0);
    // The signals are registered before the thread is started, because starting takes time, and the first file may be
    // opened meanwhile.
    let Ok(mut signals) = Signals::new(heeded) else {
        return;
    };
    let wait = move || {
        for signal in signals.forever().filter(|&signal| signal != SIGXFSZ) {
            handle_signal(signal);
        }
    };
    let _ = std::thread::Builder::new().spawn(wait); // see `stop_on_signals`
}

/// The signals that this process was started to ignore, a bit each from that of 1 on; none where
/// the system does not say.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    ignored_in(&status).unwrap_or(0)
}

#[cfg(unix)]
fn ignored_in(status: &str) -> Option<u64> {
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

/// Windows runs a handler on a thread of its own: it is the waiting thread.
#[cfg(windows)]
fn wait_for_signals() {
    let _ = ctrlc::set_handler(|| handle_signal(signal_hook::consts::SIGINT)); // see `stop_on_signals`
}

#[cfg(not(any(unix, windows)))]
fn wait_for_signals() {}

/// Held while an output file is open.
pub(crate) struct WritingGuard(());

impl WritingGuard {
    pub(crate) fn begin() -> Self {
        state().writing += 1;
        Self(())
    }
}

impl Drop for WritingGuard {
    fn drop(&mut self) {
        state().writing -= 1;
    }
}

/// Held while a batch runs.
pub(crate) struct BatchGuard(());

impl BatchGuard {
    pub(crate) fn begin() -> Self {
        state().batches += 1;
        Self(())
    }
}

impl Drop for BatchGuard {
    fn drop(&mut self) {
        state().batches -= 1;
    }
}

/// The failure that a signal asks for, once the writer has cleaned up.
pub(crate) fn stopped() -> Option<Failure> {
    state().signal.map(|signal| Failure::quiet(code(signal)))
}

#[cfg(all(test, unix))]
mod tests {
    #[test]
    fn ignored_signals_are_read_as_linux_says_them() {
        let status = "SigBlk:\t0000000000000000\nSigIgn:\t0000000000001003\n";
        assert_eq!(super::ignored_in(status), Some(1 << 12 | 0b11));
        assert_eq!(super::ignored_in("Name:\ttumble\n"), None);
    }
}
