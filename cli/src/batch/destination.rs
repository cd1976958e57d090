//! The destination of a file: checked before any work, written completely or not at all.

use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tumble_formats::output::{Output, check_target};

use crate::batch::digest::Digest;
use crate::messages::exit::{BROKEN_PIPE, Failure, OUTPUT};
use crate::messages::names;
use crate::messages::progress::Progress;
use crate::messages::signals::{self, WritingGuard};

/// The destination of one file.
#[derive(Debug, Clone)]
pub(crate) struct Destination {
    path: PathBuf,
    overwrite: bool,
    /// Files that it must not replace.
    inputs: Vec<PathBuf>,
    /// Whether its bytes are hashed as they are written.
    hashed: bool,
    /// A part of the name of its temporary file.
    mark: String,
}

/// A complete file that has its temporary name. If it is dropped before [`WrittenFile::commit`], nothing
/// remains.
pub(crate) struct WrittenFile {
    output: Output,
    pub(crate) digest: Option<Digest>,
    _writing: Option<WritingGuard>,
}

impl WrittenFile {
    /// Frees its buffer, for files that are renamed together with others.
    pub(crate) fn free_buffer(self) -> Result<Self, Failure> {
        let output = self.output.settle();
        Ok(Self {
            output: output.map_err(|error| Failure::output(&error))?,
            ..self
        })
    }

    pub(crate) fn commit(self) -> Result<(), Failure> {
        self.output
            .commit()
            .map_err(|error| Failure::output(&error))
    }
}

impl Destination {
    /// Checks everything that can be checked without writing.
    pub(crate) fn new(path: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, Failure> {
        if !names::is_standard(path) {
            check_target(path, overwrite, inputs).map_err(|error| Failure::output(&error))?;
        }
        Ok(Self {
            path: path.to_owned(),
            overwrite,
            inputs: inputs.to_vec(),
            hashed: false,
            mark: String::new(),
        })
    }

    /// The same for a picture, whose name says its format.
    pub(crate) fn of_picture(
        path: &Path,
        overwrite: bool,
        inputs: &[PathBuf],
    ) -> Result<Self, Failure> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if extension != "svg" && extension != "png" {
            let path = path.display();
            let message = format!("{path}: end the picture in .svg or .png");
            return Err(Failure::usage(message));
        }
        Self::new(path, overwrite, inputs)
    }

    /// Refuses the destination of another file of the same command.
    pub(crate) fn refuse_same(&self, other: &Path) -> Result<(), Failure> {
        if self.is_standard() || !is_same(&self.path, other) {
            return Ok(());
        }
        let message = "would be written twice by this command; give each file a different name";
        Err(Failure::usage(format!("{self}: {message}")))
    }

    /// The same destination with another name.
    pub(crate) fn renamed(&self, path: &Path) -> Result<Self, Failure> {
        let destination = Self::new(path, self.overwrite, &self.inputs)?;
        Ok(Self {
            hashed: self.hashed,
            mark: self.mark.clone(),
            ..destination
        })
    }

    /// The same destination, with its bytes hashed.
    pub(crate) fn hashed(self) -> Self {
        Self {
            hashed: true,
            ..self
        }
    }

    /// The same destination, with `mark` in the name of its temporary file.
    pub(crate) fn marked(self, mark: &str) -> Self {
        let mark = mark.to_owned();
        Self { mark, ..self }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn is_standard(&self) -> bool {
        names::is_standard(&self.path)
    }

    /// Opens and drops the file: its directory may be read-only.
    pub(crate) fn check_writable(&self) -> Result<(), Failure> {
        let _writing = WritingGuard::begin();
        self.open().map(drop)
    }

    fn open(&self) -> Result<Output, Failure> {
        Output::create_marked(&self.path, self.overwrite, &self.inputs, &self.mark)
            .map_err(|error| Failure::output(&error))
    }

    /// Runs `write`; a file appears under its name once it is whole.
    pub(crate) fn write(
        &self,
        progress: Option<MeasuredProgress>,
        write: impl FnOnce(&mut OutputStream) -> io::Result<()>,
    ) -> Result<(), Failure> {
        self.prepare(progress, write)?.commit()
    }

    /// As [`Destination::write`], without the final rename.
    pub(crate) fn prepare(
        &self,
        progress: Option<MeasuredProgress>,
        write: impl FnOnce(&mut OutputStream) -> io::Result<()>,
    ) -> Result<WrittenFile, Failure> {
        // Standard output has nothing to clean up: a signal may end it at once.
        let writing = (!self.is_standard()).then(WritingGuard::begin);
        let digest = self.hashed.then(Digest::default);
        let mut stream = OutputStream::new(self.open()?, progress, digest);
        // Flushing the buffer can fail too.
        let result = write(&mut stream).and_then(|()| stream.flush());
        let FinishedStream {
            output,
            digest,
            broken_pipe,
        } = stream.end();
        if let Some(stopped) = signals::stopped() {
            return Err(stopped);
        }
        match result {
            Ok(()) => Ok(WrittenFile {
                output,
                digest,
                _writing: writing,
            }),
            Err(_) if broken_pipe => Err(Failure::quiet(BROKEN_PIPE)),
            Err(error) => Err(Failure::writing(&self.to_string(), &error)),
        }
    }
}

impl fmt::Display for Destination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_standard() {
            return f.write_str("standard output");
        }
        write!(f, "{}", self.path.display())
    }
}

/// Whether two paths name the same file, which need not exist.
fn is_same(one: &Path, other: &Path) -> bool {
    let real = |path: &Path| {
        let parent = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        Some(parent.canonicalize().ok()?.join(path.file_name()?))
    };
    one == other || real(one).is_some_and(|one| Some(one) == real(other))
}

/// Creates a directory for results if there is none. Other processes may create it at the same time:
/// shards start together.
pub(crate) fn create_folder(path: &Path) -> Result<(), Failure> {
    match std::fs::create_dir(path) {
        Err(error) if !path.is_dir() => {
            let path = path.display();
            let message = format!("{path}: the directory could not be made: {error}");
            Err(Failure::new(OUTPUT, message))
        }
        _ => Ok(()),
    }
}

/// A progress bar, and by how much bytes advance it.
pub(crate) type MeasuredProgress = (Progress, fn(&[u8]) -> u64);

/// The stream into an output: it stops after a signal, moves the progress bar, hashes what passes where that
/// is asked for, and remembers whether the reader went away.
pub(crate) struct OutputStream {
    output: Output,
    progress: Option<MeasuredProgress>,
    digest: Option<Digest>,
    /// Kept here because writers wrap the error in another kind.
    broken_pipe: bool,
}

/// A stream that has ended.
struct FinishedStream {
    output: Output,
    digest: Option<Digest>,
    /// Its reader went away.
    broken_pipe: bool,
}

impl OutputStream {
    fn new(output: Output, progress: Option<MeasuredProgress>, digest: Option<Digest>) -> Self {
        Self {
            output,
            progress,
            digest,
            broken_pipe: false,
        }
    }

    fn end(self) -> FinishedStream {
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

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    /// Shards that begin together all want the directory of their results.
    #[test]
    fn a_directory_may_be_made_by_many_at_once() {
        let directory = tempfile::tempdir().unwrap();
        let together = Barrier::new(4);
        for round in 0..200 {
            let path = directory.path().join(round.to_string());
            std::thread::scope(|scope| {
                for _ in 0..4 {
                    scope.spawn(|| {
                        together.wait();
                        assert!(create_folder(&path).is_ok());
                    });
                }
            });
        }
        assert!(create_folder(&directory.path().join("no/such")).is_err());
    }
}
