//! A progress bar, once work has taken a second and someone is watching; a line
//! that moves where the amount of work is unknown.

use std::io::IsTerminal;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use tumble_formats::printable::printable;

/// Work that shows no bar before this is over.
const PATIENCE: Duration = Duration::from_secs(1);

pub(crate) struct Progress {
    label: &'static str,
    total: u64,
    done: u64,
    started: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    pub(crate) fn new(label: &'static str, total: u64) -> Self {
        Self {
            label,
            total,
            done: 0,
            started: Instant::now(),
            bar: None,
        }
    }

    pub(crate) fn advance(&mut self, steps: u64) {
        self.done += steps;
        if self.bar.is_none()
            && self.started.elapsed() > PATIENCE
            && std::io::stderr().is_terminal()
        {
            self.bar = Some(bar(self.label, self.total));
        }
        if let Some(bar) = &self.bar {
            bar.set_position(self.done);
        }
    }

    /// Prints without tearing the bar.
    pub(crate) fn suspend<T>(&self, print: impl FnOnce() -> T) -> T {
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }
}

fn bar(label: &'static str, total: u64) -> ProgressBar {
    // No colours in the template, so `NO_COLOR` holds.
    let style = ProgressStyle::with_template("{msg} [{bar:30}] {percent}% {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(total)
        .with_style(style)
        .with_message(label)
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Runs work that is one call, and shows that it is alive.
pub(crate) fn busy<T>(label: &str, work: impl FnOnce() -> T) -> T {
    if !std::io::stderr().is_terminal() {
        return work();
    }
    let (done, finished) = mpsc::channel::<()>();
    thread::scope(|scope| {
        // Without a thread for it there is no spinner.
        let _ = thread::Builder::new().spawn_scoped(scope, move || {
            // A sender that is dropped ends the wait, also when the work panics.
            if finished.recv_timeout(PATIENCE) == Err(mpsc::RecvTimeoutError::Timeout) {
                let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}")
                    .unwrap_or_else(|_| ProgressStyle::default_spinner());
                let spinner = ProgressBar::new_spinner().with_style(style);
                spinner.set_message(printable(label).into_owned());
                spinner.enable_steady_tick(Duration::from_millis(100));
                let _ = finished.recv();
                spinner.finish_and_clear();
            }
        });
        let _done = done;
        work()
    })
}
