//! Evaluation into memory, in windows between which Ctrl-C is seen.

use std::ops::Range;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use tumble::{Encoding, Engine, Frames, Interpolation, Layout, Speed, TrackSet};

use crate::errors::{guarded, of_engine};

/// The longest that a window may take one thread, nanoseconds.
const WINDOW: f64 = 1e8;

/// What preparing a key for constant speed takes, nanoseconds.
const CONSTANT_SPEED: f64 = 3e6;

/// What to evaluate.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) engine: &'a Engine,
    pub(crate) set: &'a TrackSet,
    pub(crate) interpolation: Interpolation,
    pub(crate) frames: &'a Frames,
    /// Samples of each track.
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

/// How long Ctrl-C may go unseen.
const PATIENCE: Duration = Duration::from_millis(50);

/// Does work that cannot be stopped, without the GIL. Ctrl-C does not wait for it: it goes on to its end
/// by itself, and nobody gets its result.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> PyResult<T> + Send + 'static,
) -> PyResult<T> {
    py.detach(|| {
        let (sender, receiver) = mpsc::sync_channel(1);
        let thread = std::thread::Builder::new().name("tumble".to_owned());
        thread.spawn(move || {
            let _ = sender.send(guarded(work)); // nobody listens after Ctrl-C
        })?;
        loop {
            match receiver.recv_timeout(PATIENCE) {
                Ok(found) => return found,
                Err(RecvTimeoutError::Timeout) => check_signals()?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err(
                        "internal error: a thread ended early",
                    ));
                }
            }
        }
    })
}

impl Job<'_> {
    /// Writes all of it to `output`.
    pub(crate) fn write(&self, output: &mut [u8]) -> PyResult<()> {
        let tracks = self.set.track_count();
        let cost = self.cost();
        if self.layout == Layout::TrackMajor && cost.samples <= WINDOW {
            let each = rows(WINDOW, cost.keys + cost.samples);
            return self.in_pieces(tracks, each, self.samples, output, |tracks, output| {
                self.tracks(tracks, output)
            });
        }
        let clip = self.engine.upload(self.set, self.interpolation);
        let clip = clip.map_err(|error| of_engine(&error))?;
        let part = |tracks: Range<usize>, samples: Range<usize>, output: &mut [u8]| {
            clip.evaluate_part_into(
                self.frames,
                self.layout,
                (tracks, samples),
                self.encoding,
                output,
            )
            .map_err(|error| of_engine(&error))
        };
        match self.layout {
            Layout::FrameMajor => {
                let frame = cost.samples * tracks as f64 / self.samples.max(1) as f64;
                let each = rows(WINDOW, frame);
                self.in_pieces(self.samples, each, tracks, output, |samples, output| {
                    part(0..tracks, samples, output)
                })
            }
            Layout::TrackMajor => {
                let each = rows(WINDOW, cost.samples / self.samples.max(1) as f64);
                let track = self.samples * self.encoding.bytes();
                for (track, output) in output.chunks_mut(track.max(1)).enumerate() {
                    self.in_pieces(self.samples, each, 1, output, |samples, output| {
                        part(track..track + 1, samples, output)
                    })?;
                }
                Ok(())
            }
        }
    }

    /// Some tracks.
    pub(crate) fn tracks(&self, tracks: Range<usize>, output: &mut [u8]) -> PyResult<()> {
        self.engine
            .evaluate_tracks_into(
                self.set,
                self.interpolation,
                self.frames,
                tracks,
                self.encoding,
                output,
            )
            .map_err(|error| of_engine(&error))
    }

    /// Does `work` on `each` rows at a time; a row has so many `columns`.
    fn in_pieces(
        &self,
        rows: usize,
        each: usize,
        columns: usize,
        mut output: &mut [u8],
        mut work: impl FnMut(Range<usize>, &mut [u8]) -> PyResult<()>,
    ) -> PyResult<()> {
        let mut first = 0;
        while first < rows {
            let end = rows.min(first.saturating_add(each));
            let bytes = (end - first) * columns * self.encoding.bytes();
            let (own, rest) = output.split_at_mut(bytes);
            if first > 0 {
                check_signals()?;
            }
            work(first..end, own)?;
            (first, output) = (end, rest);
        }
        Ok(())
    }

    /// What an average track costs.
    fn cost(&self) -> Cost {
        let tracks = self.set.track_count().max(1) as f64;
        let own = self.interpolation.method.cost;
        let key = match self.interpolation.speed {
            Speed::Constant => CONSTANT_SPEED,
            Speed::AsKeyed => own.key,
        };
        Cost {
            keys: key * self.set.key_count() as f64 / tracks,
            samples: own.rotation * self.samples as f64,
        }
    }
}

/// Nanoseconds for one track, one thread.
struct Cost {
    keys: f64,
    samples: f64,
}

/// How many rows that cost so much each fit into a window.
fn rows(window: f64, each: f64) -> usize {
    (window / each.max(1.0)).max(1.0) as usize
}
