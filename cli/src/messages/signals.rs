//! Ctrl-C and SIGTERM: stop soon, and leave no half-written file.
//!
//! A thread waits for the signal. While no output file is open it ends the program
//! at once; while one is, it leaves a mark that the writer finds at its next
//! chunk, and the writer's temporary file is removed on the way out.

use std::sync::Mutex;

use crate::messages::exit::Failure;

struct State {
    /// Output files that are being written.
    writing: usize,
    /// The signal that came.
    signal: Option<i32>,
}

static STATE: Mutex<State> = Mutex::new(State {
    writing: 0,
    signal: None,
});

fn state() -> std::sync::MutexGuard<'static, State> {
    STATE
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn code(signal: i32) -> u8 {
    128 + signal as u8
}

/// Starts the waiting thread, once for the process. Without it (a system that refuses, or has no
/// such signals) they end the program in their default way.
#[cfg(unix)]
pub(crate) fn stop_on_signals() {
    static STARTED: std::sync::Once = std::sync::Once::new();
    STARTED.call_once(wait_for_signals);
}

#[cfg(unix)]
fn wait_for_signals() {
    use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;

    // A file that may not grow (`ulimit -f`) is an error of its writer's, who has it to tell
    // and a file to remove; the signal would end the program before that.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGXFSZ]) else {
        return;
    };
    std::thread::spawn(move || {
        for signal in signals.forever().filter(|&signal| signal != SIGXFSZ) {
            let mut state = state();
            // A second signal means it: do not wait for the writer.
            if state.writing == 0 || state.signal.is_some() {
                // The lock is held: no file can be opened meanwhile.
                signal_hook::low_level::exit(i32::from(code(signal)));
            }
            state.signal = Some(signal);
        }
    });
}

#[cfg(not(unix))]
pub(crate) fn stop_on_signals() {}

/// Held while an output file is open.
pub(crate) struct Writing(());

impl Writing {
    pub(crate) fn begin() -> Self {
        state().writing += 1;
        Self(())
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        state().writing -= 1;
    }
}

/// The failure that a signal asks for, once the writer has cleaned up.
pub(crate) fn stopped() -> Option<Failure> {
    state().signal.map(|signal| Failure::quiet(code(signal)))
}
