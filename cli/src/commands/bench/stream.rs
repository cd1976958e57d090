//! Results larger than memory: measures whether evaluation takes longer than writing.

use std::fs::File;
use std::io::{Seek, Write};

use glam::Quat;
use tumble::{Device, Engine, Error, Layout, Method};

use crate::commands::bench::race::{Contestant, Repetitions, race};
use crate::commands::bench::report::Section;
use crate::commands::bench::workload::{Workload, WorkloadKind};
use crate::messages::exit::{Failure, OUTPUT};

/// Rotations of a chunk: 16 MB.
const CHUNK: usize = 1 << 20;

/// The errors that can end a stream.
#[derive(Debug)]
enum StreamError {
    Writing(std::io::Error),
    Evaluating(Error),
}

impl From<Error> for StreamError {
    fn from(error: Error) -> Self {
        Self::Evaluating(error)
    }
}

/// A file on the disk, written anew each time.
struct TemporaryFile(File);

impl TemporaryFile {
    fn write(&mut self, rotations: &[Quat]) -> Result<(), StreamError> {
        let written = self.0.write_all(bytemuck::cast_slice(rotations));
        written.map_err(StreamError::Writing)
    }

    /// Waits until the whole file is on the disk, and drops it from the cache.
    fn finish(&mut self) -> Result<(), StreamError> {
        let mut finish = || {
            self.0.sync_data()?;
            self.0.rewind()?;
            self.0.set_len(0)
        };
        finish().map_err(StreamError::Writing)
    }
}

pub(crate) fn measure(
    workload: &Workload,
    method: Method,
    repetitions: Repetitions,
) -> Result<Section, Failure> {
    let (set, frames) = (&workload.set, &workload.frames);
    let count = set.track_count() * workload.times.len();
    let engine =
        Engine::new(Device::Cpu).map_err(|error| crate::arguments::device::refused(&error))?;
    let sink = || -> Result<TemporaryFile, Failure> {
        let file = tempfile::tempfile().map_err(|error| Failure::writing("a file", &error))?;
        Ok(TemporaryFile(file))
    };
    let stream = |emit: &mut dyn FnMut(&[Quat]) -> Result<(), StreamError>| {
        engine
            .request(set, method, frames)
            .layout(Layout::TrackMajor)
            .stream(CHUNK, |chunk| emit(chunk.rotations().unwrap_or_default()))
    };
    let (mut alone, mut with) = (sink()?, sink()?);
    let chunk = vec![Quat::IDENTITY; CHUNK];
    let contestants = vec![
        Contestant::new("writing alone", |_: &mut [Quat]| {
            for start in (0..count).step_by(CHUNK) {
                alone.write(&chunk[..CHUNK.min(count - start)])?;
            }
            alone.finish()?;
            Ok(Vec::new())
        }),
        Contestant::new("CPU, evaluation alone", |_: &mut [Quat]| {
            stream(&mut |rotations| {
                std::hint::black_box(rotations);
                Ok(())
            })?;
            Ok(Vec::new())
        }),
        Contestant::new("CPU, streamed", |_: &mut [Quat]| {
            stream(&mut |rotations| with.write(rotations))?;
            with.finish()?;
            Ok(Vec::new())
        }),
    ];
    let rows = race(contestants, &mut [], repetitions).map_err(|ended| match ended {
        StreamError::Writing(error) => Failure::new(OUTPUT, format!("a temporary file: {error}")),
        StreamError::Evaluating(error) => crate::arguments::device::refused(&error),
    })?;
    Ok(Section::new(WorkloadKind::Stream, method, count, rows))
}
