//! The stream into an output: it stops after a signal, moves the progress bar, hashes
//! what passes where that is asked for, and remembers whether the reader went away.

use std::io::{self, Write};

use tumble_formats::output::Output;

use crate::batch::digest::Digest;
use crate::messages::progress::Progress;
use crate::messages::signals;

/// A progress bar, and by how much bytes advance it.
pub(crate) type MeasuredProgress = (Progress, fn(&[u8]) -> u64);

pub(crate) struct OutputStream {
    output: Output,
    progress: Option<MeasuredProgress>,
    digest: Option<Digest>,
    /// Kept here because writers wrap the error in one of their own kind.
    broken_pipe: bool,
}

/// A stream that has ended.
pub(crate) struct FinishedStream {
    pub(crate) output: Output,
    pub(crate) digest: Option<Digest>,
    /// Its reader went away.
    pub(crate) broken_pipe: bool,
}

impl OutputStream {
    pub(crate) fn new(
        output: Output,
        progress: Option<MeasuredProgress>,
        digest: Option<Digest>,
    ) -> Self {
        Self {
            output,
            progress,
            digest,
            broken_pipe: false,
        }
    }

    pub(crate) fn end(self) -> FinishedStream {
        FinishedStream {
            output: self.output,
            digest: self.digest,
            broken_pipe: self.broken_pipe,
        }
    }

    fn watch<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        self.broken_pipe |= result
            .as_ref()
            .is_err_and(|error| error.kind() == io::ErrorKind::BrokenPipe);
        result
    }
}

impl Write for OutputStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if signals::stopped().is_some() {
            // Not `Interrupted`, which would be tried again.
            return Err(io::Error::other("stopped by a signal"));
        }
        let result = self.output.write(bytes);
        let written = self.watch(result)?;
        if let Some(digest) = &mut self.digest {
            digest.update(&bytes[..written]);
        }
        if let Some((progress, measure)) = &mut self.progress {
            progress.advance(measure(&bytes[..written]));
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.output.flush();
        self.watch(result)
    }
}
