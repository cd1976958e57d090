//! Work that Ctrl-C can end: a separate thread does it, while the calling thread checks for
//! signals.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use tumble::vulkan::ExportedResult;
use tumble::{
    Encoding, Engine, Interpolation, Layout, PerTrack, SampleTimes, Speed, Stop, TrackSet,
};

use crate::errors::{guarded, of_engine};

/// Work that takes one thread less than this [ns] is done on the calling thread, because starting a thread would take
/// longer than many such calls.
const SHORT: f64 = 3e7;

/// The time that preparing a key for constant speed takes, nanoseconds.
const CONSTANT_SPEED: f64 = 3e6;

/// The interval in which Ctrl-C is checked.
const PATIENCE: Duration = Duration::from_millis(20);

/// The time that stopped work may take to end; after that, it is no longer waited for.
const GRACE: Duration = Duration::from_millis(40);

/// A set to evaluate, with the engine, the times and the form of the result.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) engine: &'a Engine,
    pub(crate) set: &'a TrackSet,
    pub(crate) interpolations: &'a PerTrack<Interpolation>,
    pub(crate) frames: &'a SampleTimes,
    /// The number of samples of each track.
    pub(crate) samples: usize,
    pub(crate) layout: Layout,
    pub(crate) encoding: Encoding,
}

/// Whether Ctrl-C was pressed.
#[allow(
    clippy::redundant_closure_for_method_calls,
    reason = "the path has one lifetime"
)]
pub(crate) fn check_signals() -> PyResult<()> {
    Python::attach(|py| py.check_signals())
}

/// Waits for the result of another thread, and for Ctrl-C, which stops its work. Ctrl-C that came while the last
/// of it was done is noticed, too: it would interrupt the first Python code that is called with the result.
fn wait<T>(receiver: &Receiver<PyResult<T>>, stop: &Stop) -> PyResult<T> {
    let early = || PyRuntimeError::new_err("internal error: a thread ended early");
    loop {
        match receiver.recv_timeout(PATIENCE) {
            Ok(found) => {
                check_signals()?;
                return found;
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(interrupted) = check_signals() {
                    stop.stop();
                    let _ = receiver.recv_timeout(GRACE); // the result is dropped: Ctrl-C ended the wait
                    return Err(interrupted);
                }
            }
            Err(RecvTimeoutError::Disconnected) => return Err(early()),
        }
    }
}

/// Does work without the GIL, which Ctrl-C stops. Work that does not end at once goes on to the next point where it
/// checks for a stop, and its result is dropped.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> PyResult<T> + Send + 'static,
) -> PyResult<T> {
    py.detach(|| {
        let stop = Stop::new();
        let flag = stop.clone();
        let (sender, receiver) = mpsc::sync_channel(1);
        let thread = thread::Builder::new().name("tumble".to_owned());
        thread.spawn(move || {
            let _ = sender.send(flag.during(|| guarded(work))); // fails if Ctrl-C ended the wait
        })?;
        wait(&receiver, &stop)
    })
}

/// As [`interruptible`], for work that borrows its data; therefore it always waits until the work has ended.
/// Call it without the GIL.
pub(crate) fn stoppable<T: Send>(work: impl FnOnce() -> PyResult<T> + Send) -> PyResult<T> {
    let stop = Stop::new();
    let flag = stop.clone();
    thread::scope(|scope| {
        let (sender, receiver) = mpsc::sync_channel(1);
        let thread = thread::Builder::new().name("tumble".to_owned());
        thread.spawn_scoped(scope, move || {
            let _ = sender.send(flag.during(|| guarded(work))); // fails if Ctrl-C ended the wait
        })?;
        wait(&receiver, &stop)
    })
}

/// From this number of values, work on arrays runs in a thread, so that Ctrl-C can stop it.
const MANY: usize = 1 << 16;

/// Runs work on this number of values without the GIL; if they are many, Ctrl-C ends it.
pub(crate) fn work<T: Send + 'static>(
    py: Python<'_>,
    values: usize,
    work: impl FnOnce() -> PyResult<T> + Send + 'static,
) -> PyResult<T> {
    match values < MANY {
        true => py.detach(|| guarded(work)),
        false => interruptible(py, work),
    }
}

impl Job<'_> {
    /// Evaluates the request into `output`.
    pub(crate) fn write(&self, output: &mut [u8]) -> PyResult<()> {
        match self.nanoseconds() < SHORT {
            true => self.evaluate(output),
            false => stoppable(|| self.evaluate(output)),
        }
    }

    fn evaluate(&self, output: &mut [u8]) -> PyResult<()> {
        let evaluated = self
            .engine
            .request(self.set, self.interpolations.clone(), self.frames)
            .layout(self.layout)
            .encoding(self.encoding)
            .evaluate_into(output);
        evaluated.map_err(|error| of_engine(&error))
    }

    /// Evaluates the request into memory of the engine's device, without a copy to the host.
    pub(crate) fn export(&self) -> PyResult<ExportedResult> {
        match self.nanoseconds() < SHORT {
            true => self.exported(),
            false => stoppable(|| self.exported()),
        }
    }

    fn exported(&self) -> PyResult<ExportedResult> {
        let clip = self.engine.upload(self.set, self.interpolations.clone());
        let exported = clip.and_then(|clip| {
            clip.request(self.frames)
                .layout(self.layout)
                .encoding(self.encoding)
                .export()
        });
        exported.map_err(|error| of_engine(&error))
    }

    /// Evaluates some of the tracks into `output`.
    pub(crate) fn tracks(&self, tracks: std::ops::Range<usize>, output: &mut [u8]) -> PyResult<()> {
        self.engine
            .request(self.set, self.interpolations.clone(), self.frames)
            .tracks(tracks)
            .encoding(self.encoding)
            .evaluate_into(output)
            .map_err(|error| of_engine(&error))
    }

    /// An upper estimate of the time on one thread [ns].
    fn nanoseconds(&self) -> f64 {
        let of_key = |interpolation: &Interpolation| match interpolation.speed {
            Speed::Constant => CONSTANT_SPEED,
            _ => interpolation.method.cost.key,
        };
        let all = self.interpolations.values();
        let key = all.iter().map(of_key).fold(0.0, f64::max);
        let rotation = all.iter().map(|one| one.method.cost.rotation);
        let rotations = self.set.track_count() as f64 * self.samples as f64;
        key * self.set.key_count() as f64 + rotation.fold(0.0, f64::max) * rotations
    }
}
