//! Where a file goes: checked before any work, written whole or not at all.

use std::fmt;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tumble::formats::output::{Output, check_target};

use super::exit::{BROKEN_PIPE, Failure, OUTPUT};
use super::input;
use super::signals::{self, Writing};
use super::stream::{Measured, Stream};

/// Where one file goes.
#[derive(Debug)]
pub(crate) struct Place {
    path: PathBuf,
    overwrite: bool,
    /// Files that it must not be.
    inputs: Vec<PathBuf>,
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
        })
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
        Output::create(&self.path, self.overwrite, &self.inputs)
            .map_err(|error| Failure::output(&error))
    }

    /// Runs `write`; a file appears under its name once it is whole.
    pub(crate) fn write(
        &self,
        progress: Option<Measured>,
        write: impl FnOnce(&mut Stream) -> io::Result<()>,
    ) -> Result<(), Failure> {
        // Standard output has nothing to clean up: a signal may end it at once.
        let _writing = (!self.is_standard()).then(Writing::begin);
        let mut stream = Stream::new(self.open()?, progress);
        // What a buffer still holds can fail too.
        let result = write(&mut stream).and_then(|()| stream.flush());
        let (output, broken_pipe) = stream.into_output();
        if let Some(stopped) = signals::stopped() {
            return Err(stopped);
        }
        match result {
            Ok(()) => output.commit().map_err(|error| Failure::output(&error)),
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

/// Makes a directory for results where there is none.
pub(crate) fn folder(path: &Path) -> Result<(), Failure> {
    let made = if path.is_dir() {
        Ok(())
    } else {
        std::fs::create_dir(path)
    };
    made.map_err(|error| {
        let path = path.display();
        let message = format!("{path}: the directory could not be made: {error}");
        Failure::new(OUTPUT, message)
    })
}
