//! Progress of long work: a bar, once work has lasted a second and standard error is a terminal; a line of JSON a second
//! for programs that supervise this one (`--progress json`); nothing elsewhere.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use tumble_formats::printable::printable;

/// Work that shows no bar before this is over.
const PATIENCE: Duration = Duration::from_secs(1);

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum ProgressStyleChoice {
    /// a bar on a terminal, nothing elsewhere
    #[default]
    Auto,
    /// a line of JSON each second on standard error: progress (its label), done, total, failed, bytes, seconds, `seconds_left`
    Json,
    /// nothing
    Never,
}

/// How this process shows progress, and the bar that is on the terminal.
struct Shown {
    style: ProgressStyleChoice,
    bar: Option<ProgressBar>,
}

static SHOWN: Mutex<Shown> = Mutex::new(Shown {
    style: ProgressStyleChoice::Auto,
    bar: None,
});

fn shown() -> MutexGuard<'static, Shown> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Chooses how progress is shown from now on.
pub(crate) fn choose(style: ProgressStyleChoice) {
    shown().style = style;
}

/// Prints to the terminal without tearing the bar that is there.
pub(crate) fn beside_bar<T>(print: impl FnOnce() -> T) -> T {
    let bar = shown().bar.clone();
    match bar {
        Some(bar) => bar.suspend(print),
        None => print(),
    }
}

/// The progress of work of a known number of steps.
pub(crate) struct Progress {
    label: &'static str,
    total: u64,
    done: u64,
    failed: u64,
    bytes: u64,
    started: Instant,
    /// The time when the last line of JSON was written.
    last_line: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    pub(crate) fn new(label: &'static str, total: u64) -> Self {
        let now = Instant::now();
        Self {
            label,
            total,
            done: 0,
            failed: 0,
            bytes: 0,
            started: now,
            last_line: now,
            bar: None,
        }
    }

    /// Counts bytes that were written.
    pub(crate) fn add_bytes(&mut self, bytes: u64) {
        self.bytes += bytes;
    }

    /// Counts steps that are done, among them those that failed.
    pub(crate) fn fail(&mut self, steps: u64) {
        self.failed += steps;
        self.advance(steps);
    }

    pub(crate) fn advance(&mut self, steps: u64) {
        self.done += steps;
        match shown().style {
            ProgressStyleChoice::Never => return,
            ProgressStyleChoice::Json => {
                if self.last_line.elapsed() >= PATIENCE {
                    self.last_line = Instant::now();
                    self.line();
                }
                return;
            }
            ProgressStyleChoice::Auto => {}
        }
        if self.bar.is_none()
            && self.started.elapsed() > PATIENCE
            && std::io::stderr().is_terminal()
        {
            let bar = bar(self.label, self.total);
            shown().bar = Some(bar.clone());
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_position(self.done);
        }
    }

    /// A line for a supervisor.
    fn line(&self) {
        let seconds = self.started.elapsed().as_secs_f64();
        let left = self.total.saturating_sub(self.done) as f64;
        let seconds_left = (self.done > 0).then(|| seconds / self.done as f64 * left);
        let line = json!({
            "progress": self.label,
            // A file has some bytes in addition to its numbers, so more than the total may have been read.
            "done": self.done.min(self.total),
            "total": self.total,
            "failed": self.failed,
            "bytes": self.bytes,
            "seconds": seconds,
            "seconds_left": seconds_left,
        });
        // A failed write is ignored: if standard error is closed, the work continues.
        let _ = writeln!(std::io::stderr(), "{line}");
    }
}

fn bar(label: &'static str, total: u64) -> ProgressBar {
    // The template contains no colours, so `NO_COLOR` needs no code.
    let style =
        ProgressStyle::with_template("{msg} [{bar:30}] {pos} of {len} {percent}% {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(total)
        .with_style(style)
        .with_message(label)
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            shown().bar = None;
            bar.finish_and_clear();
        }
        // The last line has the final counts.
        if shown().style == ProgressStyleChoice::Json {
            self.line();
        }
    }
}

/// Runs work that is one call, and shows that it is alive.
pub(crate) fn busy<T>(label: &str, work: impl FnOnce() -> T) -> T {
    if shown().style != ProgressStyleChoice::Auto || !std::io::stderr().is_terminal() {
        return work();
    }
    let (done, finished) = mpsc::channel::<()>();
    thread::scope(|scope| {
        // If no thread can be started, no spinner is shown.
        let _ = thread::Builder::new().spawn_scoped(scope, move || {
            // The sender is dropped at the end of the work, also after a panic; this ends the wait.
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
