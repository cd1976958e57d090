//! Files are written whole or not at all: under a temporary name in their own
//! directory, then renamed. Standard output is the exception, for pipes.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Why an output cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// It is there already.
    #[error("{}: exists; give --overwrite to replace it", path.display())]
    Exists {
        /// The output.
        path: PathBuf,
    },
    /// It is a directory.
    #[error("{}: is a directory; give a file in it", path.display())]
    Directory {
        /// The output.
        path: PathBuf,
    },
    /// It is a device, a pipe or a socket.
    #[error("{}: is no file; give a file, or `-` for standard output", path.display())]
    NotAFile {
        /// The output.
        path: PathBuf,
    },
    /// Its directory is not there.
    #[error("{}: its directory {} does not exist; create it first", path.display(), parent.display())]
    NoDirectory {
        /// The output.
        path: PathBuf,
        /// The directory.
        parent: PathBuf,
    },
    /// It is one of the inputs, perhaps by another name.
    #[error("{}: is the input {}; give another output", path.display(), input.display())]
    IsInput {
        /// The output.
        path: PathBuf,
        /// The input.
        input: PathBuf,
    },
    /// Writing failed; what was there before is untouched.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The output.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

impl OutputError {
    /// Whether the reader of a pipe went away.
    #[must_use]
    pub fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::Write { source, .. } if source.kind() == io::ErrorKind::BrokenPipe)
    }
}

/// An output being written. Dropped before [`Output::commit`], it leaves nothing
/// behind.
pub struct Output {
    path: PathBuf,
    writer: Sink,
}

enum Sink {
    File {
        temporary: BufWriter<NamedTempFile>,
        overwrite: bool,
    },
    Standard(BufWriter<io::Stdout>),
}

const BUFFER: usize = 1 << 18;

/// Names of temporary files begin and end so.
const PREFIX: &str = ".tumble-";
const SUFFIX: &str = ".part";

/// Removes the temporary files in a directory whose writers were killed; those that are
/// being written are locked, and stay.
pub fn remove_abandoned(directory: &Path) {
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(PREFIX)
            && name.ends_with(SUFFIX)
            && fs::File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok())
        {
            let _ = fs::remove_file(entry.path()); // the next run tries again
        }
    }
}

/// Removes the temporary files in a directory that were created with that mark, whether or not they
/// are locked: locks do not reach other machines.
pub fn remove_marked(directory: &Path, mark: &str) {
    let prefix = format!("{PREFIX}{mark}");
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(&prefix) && name.ends_with(SUFFIX) {
            let _ = fs::remove_file(entry.path()); // the next run tries again
        }
    }
}

impl Output {
    /// Opens a temporary file beside `path`, after every check that can be made
    /// before any work; `-` is standard output.
    ///
    /// # Errors
    /// An [`OutputError`]; nothing has been touched then.
    pub fn create(path: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        Self::create_marked(path, overwrite, inputs, "")
    }

    /// As [`Output::create`], with a mark in the temporary file's name that [`remove_marked`] knows
    /// it by.
    ///
    /// # Errors
    /// An [`OutputError`]; nothing has been touched then.
    pub fn create_marked(
        path: &Path,
        overwrite: bool,
        inputs: &[PathBuf],
        mark: &str,
    ) -> Result<Self, OutputError> {
        let path = path.to_owned();
        if path.as_os_str() == "-" {
            let writer = Sink::Standard(BufWriter::with_capacity(BUFFER, io::stdout()));
            return Ok(Self { path, writer });
        }
        check_target(&path, overwrite, inputs)?;
        let parent = parent(&path);
        let mut builder = tempfile::Builder::new();
        let prefix = format!("{PREFIX}{mark}");
        builder.prefix(&prefix).suffix(SUFFIX);
        #[cfg(unix)]
        {
            // As `File::create` does: readable by all, less the umask.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let temporary = builder
            .tempfile_in(&parent)
            .map_err(|source| OutputError::Write {
                path: path.clone(),
                source,
            })?;
        // Who holds the lock is still writing; see `remove_abandoned`. A file system
        // without locks has no such files removed.
        let _ = temporary.as_file().try_lock();
        let temporary = BufWriter::with_capacity(BUFFER, temporary);
        Ok(Self {
            path,
            writer: Sink::File {
                temporary,
                overwrite,
            },
        })
    }

    /// The temporary file, to remove when the process is stopped by a signal.
    #[must_use]
    pub fn temporary_path(&self) -> Option<&Path> {
        match &self.writer {
            Sink::File { temporary, .. } => Some(temporary.get_ref().path()),
            Sink::Standard(_) => None,
        }
    }

    /// Hands everything to the system and gives the buffer's memory back, for files that wait for
    /// others before they get their names.
    ///
    /// # Errors
    /// When the system refuses what was still in the buffer.
    pub fn settle(self) -> Result<Self, OutputError> {
        let Self { path, writer } = self;
        let writer = match writer {
            Sink::File {
                temporary,
                overwrite,
            } => {
                let file = temporary.into_inner().map_err(|e| OutputError::Write {
                    path: path.clone(),
                    source: e.into_error(),
                })?;
                Sink::File {
                    temporary: BufWriter::with_capacity(0, file),
                    overwrite,
                }
            }
            standard @ Sink::Standard(_) => standard,
        };
        Ok(Self { path, writer })
    }

    /// Writes out everything and gives the file its name.
    ///
    /// # Errors
    /// When the system cannot; the old file, if any, is intact then.
    pub fn commit(self) -> Result<(), OutputError> {
        let Self { path, writer } = self;
        let named = |source| OutputError::Write {
            path: path.clone(),
            source,
        };
        match writer {
            Sink::Standard(mut writer) => writer.flush().map_err(named),
            Sink::File {
                temporary,
                overwrite,
            } => {
                let temporary = temporary.into_inner().map_err(|e| named(e.into_error()))?;
                temporary.as_file().sync_all().map_err(named)?;
                let persisted = if overwrite {
                    temporary.persist(&path)
                } else {
                    temporary.persist_noclobber(&path)
                };
                match persisted {
                    Ok(_) => Ok(()),
                    Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => {
                        Err(OutputError::Exists { path: path.clone() })
                    }
                    Err(error) => Err(named(error.error)),
                }
            }
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.writer {
            Sink::File { temporary, .. } => temporary.write(bytes),
            Sink::Standard(writer) => writer.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.writer {
            Sink::File { temporary, .. } => temporary.flush(),
            Sink::Standard(writer) => writer.flush(),
        }
    }
}

/// Every check that needs no writing.
///
/// # Errors
/// An [`OutputError`].
pub fn check_target(path: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<(), OutputError> {
    let parent = parent(path);
    if !parent.is_dir() {
        let path = path.to_owned();
        return Err(OutputError::NoDirectory { path, parent });
    }
    if path.is_dir() {
        return Err(OutputError::Directory {
            path: path.to_owned(),
        });
    }
    // A rename would put a file in its place.
    if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
        return Err(OutputError::NotAFile {
            path: path.to_owned(),
        });
    }
    // Also through links: both names lead to one file.
    if let Ok(own) = fs::canonicalize(path) {
        let same = |input: &&PathBuf| fs::canonicalize(input).is_ok_and(|input| input == own);
        if let Some(input) = inputs.iter().find(same) {
            return Err(OutputError::IsInput {
                path: path.to_owned(),
                input: input.clone(),
            });
        }
    }
    if !overwrite && fs::symlink_metadata(path).is_ok() {
        return Err(OutputError::Exists {
            path: path.to_owned(),
        });
    }
    Ok(())
}

fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).unwrap();
        entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out");
        let mut output = Output::create(&path, false, &[]).unwrap();
        output.write_all(b"half").unwrap();
        drop(output);
        assert_eq!(names(directory.path()), Vec::<String>::new());
        let mut output = Output::create(&path, false, &[]).unwrap();
        output.write_all(b"whole").unwrap();
        output.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(names(directory.path()), ["out"]);
    }

    #[test]
    fn what_a_killed_writer_left_is_removed_and_no_more() {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join(".tumble-x1y2z3.part"), "half").unwrap();
        fs::write(directory.path().join(".tumble-notes"), "mine").unwrap();
        let output = Output::create(&directory.path().join("out"), false, &[]).unwrap();
        remove_abandoned(directory.path());
        let mut left = names(directory.path());
        left.sort();
        let own = output.temporary_path().unwrap().file_name().unwrap();
        assert_eq!(left.len(), 2);
        assert!(left.contains(&".tumble-notes".to_owned()));
        assert!(left.contains(&own.to_str().unwrap().to_owned()));
    }

    #[test]
    fn marked_files_are_removed_by_their_mark() {
        let directory = tempfile::tempdir().unwrap();
        let create = |mark| {
            let path = directory.path().join("out");
            let output = Output::create_marked(&path, false, &[], mark).unwrap();
            let temporary = output.temporary_path().unwrap().to_owned();
            (output.settle().unwrap(), temporary)
        };
        let (_one, first) = create("shard1-");
        let (two, second) = create("shard2-");
        remove_marked(directory.path(), "shard1-");
        assert!(!first.exists() && second.exists());
        two.commit().unwrap();
        assert_eq!(names(directory.path()), ["out"]);
    }

    #[test]
    fn an_existing_file_survives_unless_overwriting_succeeds() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out");
        fs::write(&path, "old").unwrap();
        let refused = Output::create(&path, false, &[]);
        assert!(matches!(refused, Err(OutputError::Exists { .. })));
        let mut output = Output::create(&path, true, &[]).unwrap();
        output.write_all(b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        output.commit().unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn impossible_targets_are_refused_before_any_work() {
        let directory = tempfile::tempdir().unwrap();
        let input = directory.path().join("in");
        fs::write(&input, "keys").unwrap();
        let inputs = [input.clone()];
        let create = |path: &Path| Output::create(path, true, &inputs).err();
        assert!(matches!(
            create(directory.path()),
            Some(OutputError::Directory { .. })
        ));
        let missing = directory.path().join("none/out");
        assert!(matches!(
            create(&missing),
            Some(OutputError::NoDirectory { .. })
        ));
        assert!(matches!(create(&input), Some(OutputError::IsInput { .. })));
        #[cfg(unix)]
        {
            let link = directory.path().join("link");
            std::os::unix::fs::symlink(&input, &link).unwrap();
            assert!(matches!(create(&link), Some(OutputError::IsInput { .. })));
        }
    }
}
