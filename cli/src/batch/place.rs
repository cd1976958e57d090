//! Where a file goes: checked before any work, written whole or not at all.

use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tumble_formats::output::{Output, check_target};

use crate::arguments::input;
use crate::batch::digest::Digest;
use crate::batch::stream::{Ended, Measured, Stream};
use crate::messages::exit::{BROKEN_PIPE, Failure, OUTPUT};
use crate::messages::signals::{self, Writing};

/// Where one file goes.
#[derive(Debug)]
pub(crate) struct Place {
    path: PathBuf,
    overwrite: bool,
    /// Files that it must not be.
    inputs: Vec<PathBuf>,
    /// Its bytes are hashed as they are written.
    hashed: bool,
    /// In the name of its temporary file.
    mark: String,
}

/// A file that is whole, and has not got its name yet. Dropped before
/// [`Written::commit`], it leaves nothing behind.
pub(crate) struct Written {
    output: Output,
    pub(crate) digest: Option<Digest>,
    _writing: Option<Writing>,
}

impl Written {
    /// Gives its buffer back, for files that get their names together with others.
    pub(crate) fn settle(self) -> Result<Self, Failure> {
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

impl Place {
    /// Checks everything that can be checked without writing.
    pub(crate) fn new(path: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, Failure> {
        if !input::is_standard(path) {
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

    /// Refuses a place where another file of the same command goes.
    pub(crate) fn refuse_same(&self, other: &Path) -> Result<(), Failure> {
        if self.is_standard() || !is_same(&self.path, other) {
            return Ok(());
        }
        let message = "is the place of two files of this command; give each a name of its own";
        Err(Failure::usage(format!("{self}: {message}")))
    }

    /// The same for a file of another name.
    pub(crate) fn renamed(&self, path: &Path) -> Result<Self, Failure> {
        let place = Self::new(path, self.overwrite, &self.inputs)?;
        Ok(Self {
            hashed: self.hashed,
            mark: self.mark.clone(),
            ..place
        })
    }

    /// The same place, its bytes hashed on their way.
    pub(crate) fn hashed(self) -> Self {
        Self {
            hashed: true,
            ..self
        }
    }

    /// The same place, its temporary file marked.
    pub(crate) fn marked(self, mark: &str) -> Self {
        let mark = mark.to_owned();
        Self { mark, ..self }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn is_standard(&self) -> bool {
        input::is_standard(&self.path)
    }

    /// Opens and drops the file: its directory may be read-only.
    pub(crate) fn try_out(&self) -> Result<(), Failure> {
        let _writing = Writing::begin();
        self.open().map(drop)
    }

    fn open(&self) -> Result<Output, Failure> {
        Output::create_marked(&self.path, self.overwrite, &self.inputs, &self.mark)
            .map_err(|error| Failure::output(&error))
    }

    /// Runs `write`; a file appears under its name once it is whole.
    pub(crate) fn write(
        &self,
        progress: Option<Measured>,
        write: impl FnOnce(&mut Stream) -> io::Result<()>,
    ) -> Result<(), Failure> {
        self.prepare(progress, write)?.commit()
    }

    /// As [`Place::write`], up to where the file gets its name.
    pub(crate) fn prepare(
        &self,
        progress: Option<Measured>,
        write: impl FnOnce(&mut Stream) -> io::Result<()>,
    ) -> Result<Written, Failure> {
        // Standard output has nothing to clean up: a signal may end it at once.
        let writing = (!self.is_standard()).then(Writing::begin);
        let digest = self.hashed.then(Digest::default);
        let mut stream = Stream::new(self.open()?, progress, digest);
        // What a buffer still holds can fail too.
        let result = write(&mut stream).and_then(|()| stream.flush());
        let Ended {
            output,
            digest,
            broken_pipe,
        } = stream.end();
        if let Some(stopped) = signals::stopped() {
            return Err(stopped);
        }
        match result {
            Ok(()) => Ok(Written {
                output,
                digest,
                _writing: writing,
            }),
            Err(_) if broken_pipe => Err(Failure::quiet(BROKEN_PIPE)),
            Err(error) => Err(Failure::writing(&self.to_string(), &error)),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_standard() {
            return f.write_str("standard output");
        }
        write!(f, "{}", self.path.display())
    }
}

/// Whether two names are those of one file, which need not be there.
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

/// Makes a directory for results where there is none. Another process may make it at the same
/// moment: shards begin together.
pub(crate) fn folder(path: &Path) -> Result<(), Failure> {
    match std::fs::create_dir(path) {
        Err(error) if !path.is_dir() => {
            let path = path.display();
            let message = format!("{path}: the directory could not be made: {error}");
            Err(Failure::new(OUTPUT, message))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    /// Shards that begin together all want the directory of their results.
    #[test]
    fn a_directory_may_be_made_by_many_at_once() {
        let place = tempfile::tempdir().unwrap();
        let together = Barrier::new(4);
        for round in 0..200 {
            let path = place.path().join(round.to_string());
            std::thread::scope(|scope| {
                for _ in 0..4 {
                    scope.spawn(|| {
                        together.wait();
                        assert!(folder(&path).is_ok());
                    });
                }
            });
        }
        assert!(folder(&place.path().join("no/such")).is_err());
    }
}
