//! Writes files completely or not at all. A file that is being written has no name or a temporary one, in the
//! directory of the output; it gets its name at the end. Standard output is the exception, for pipes.
//!
//! The directory is opened once ([`Folder`]): if another one or a link is put in its place, nothing is written there,
//! and the output fails.
//!
//! On Linux, a file that is being written has no name (`O_TMPFILE`), so that nothing remains if its writer is ended.
//! If the file system does not support this, the file is called `.tumble-….part` and locked. A file without a lock
//! has no writer any more, and the next writer removes it.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::beneath::is_refused;
use crate::folder::Folder;

/// Why an output cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The output exists already.
    #[error("{}: exists; give --overwrite to replace it", path.display())]
    Exists {
        /// Path of the output.
        path: PathBuf,
    },
    /// The output is a directory.
    #[error("{}: is a directory; give a file in it", path.display())]
    Directory {
        /// Path of the output.
        path: PathBuf,
    },
    /// The output is a device, a pipe or a socket.
    #[error("{}: is not a file; give a file, or `-` for standard output", path.display())]
    NotAFile {
        /// Path of the output.
        path: PathBuf,
    },
    /// The directory of the output does not exist.
    #[error("{}: its directory {} does not exist; create it first", path.display(), parent.display())]
    NoDirectory {
        /// Path of the output.
        path: PathBuf,
        /// Path of the directory.
        parent: PathBuf,
    },
    /// The output is one of the inputs, perhaps by another name.
    #[error("{}: is the input {}; give another output", path.display(), input.display())]
    IsInput {
        /// Path of the output.
        path: PathBuf,
        /// Path of the input.
        input: PathBuf,
    },
    /// The directory of the output was renamed, removed or replaced since it was opened. Nothing was written into the
    /// one that has its path now.
    #[error(
        "{}: is not written, because its directory {} was moved or replaced meanwhile; put it back and repeat this",
        path.display(),
        folder.display()
    )]
    Moved {
        /// Path of the output.
        path: PathBuf,
        /// Path of the directory.
        folder: PathBuf,
    },
    /// Writing failed; an existing file is unchanged.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// Path of the output.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

impl OutputError {
    /// Whether the error is that of a pipe whose reader has ended.
    #[must_use]
    pub fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::Write { source, .. } if source.kind() == io::ErrorKind::BrokenPipe)
    }
}

/// An output that is being written. If it is dropped before [`Output::commit`], no file remains.
pub struct Output {
    path: PathBuf,
    writer: OutputSink,
}

enum OutputSink {
    File {
        temporary: BufWriter<Temporary>,
        location: OutputLocation,
    },
    Standard(BufWriter<io::Stdout>),
}

/// The name that an output gets.
struct OutputLocation {
    folder: Folder,
    /// Below the folder.
    name: PathBuf,
    overwrite: bool,
}

impl OutputLocation {
    /// The directory of the file; opened again, because many files may wait for their names.
    fn parent(&self, path: &Path) -> Result<Folder, OutputError> {
        let moved = |folder: &Path| OutputError::Moved {
            path: path.to_owned(),
            folder: folder.to_owned(),
        };
        if !self.folder.is_in_place() {
            return Err(moved(self.folder.path()));
        }
        match self.folder.parent_of(&self.name) {
            Ok(parent) if parent.is_in_place() => Ok(parent),
            Ok(parent) => Err(moved(parent.path())),
            // The directory existed when the output was planned, but it does not any more.
            Err(error)
                if is_refused(&error)
                    || matches!(
                        error.kind(),
                        io::ErrorKind::NotADirectory | io::ErrorKind::NotFound
                    ) =>
            {
                Err(moved(&parent(path)))
            }
            Err(source) => Err(OutputError::Write {
                path: path.to_owned(),
                source,
            }),
        }
    }

    fn file_name(&self) -> &OsStr {
        self.name.file_name().unwrap_or_default()
    }
}

const BUFFER: usize = 1 << 18;

/// The prefix and the suffix of the names of temporary files.
const PREFIX: &str = ".tumble-";
const SUFFIX: &str = ".part";

/// Number of random letters and digits before the suffix. A mark before them ends in `-`.
const RANDOM: usize = 6;

/// The temporary files that this process is writing, with their directories.
static UNFINISHED: Mutex<BTreeMap<PathBuf, Folder>> = Mutex::new(BTreeMap::new());

type Unfinished = MutexGuard<'static, BTreeMap<PathBuf, Folder>>;

fn unfinished() -> Unfinished {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The temporary name of a file. When this is dropped, a file that still has it is removed.
struct TemporaryName {
    folder: Folder,
    name: OsString,
    is_renamed: bool,
}

impl TemporaryName {
    /// A new file; `create` makes it by the name that it is given, unless there is one.
    fn new<T>(
        folder: &Folder,
        mark: &str,
        create: impl Fn(&OsStr) -> io::Result<T>,
    ) -> io::Result<(Self, T)> {
        const LETTERS: &[u8] = b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
        const TRIES: usize = 1000;
        for _ in 0..TRIES {
            // `RandomState` is seeded by the system and gives a different number each time.
            let mut number = RandomState::new().hash_one(std::process::id());
            let mut random = String::new();
            for _ in 0..RANDOM {
                random.push(char::from(
                    LETTERS[(number % LETTERS.len() as u64) as usize],
                ));
                number /= LETTERS.len() as u64;
            }
            let name = OsString::from(format!("{PREFIX}{mark}{random}{SUFFIX}"));
            // A process that is about to end must wait until the new file is in the list, so that it is removed.
            let mut unfinished = unfinished();
            match create(&name) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
                Ok(created) => {
                    let folder = folder.clone();
                    unfinished.insert(folder.path().join(&name), folder.clone());
                    let is_renamed = false;
                    let name = Self {
                        folder,
                        name,
                        is_renamed,
                    };
                    return Ok((name, created));
                }
            }
        }
        Err(io::Error::from(io::ErrorKind::AlreadyExists))
    }

    /// Gives the file its final name.
    fn rename(mut self, to: &OsStr, overwrite: bool) -> io::Result<()> {
        self.folder.rename(&self.name, to, overwrite)?;
        self.is_renamed = true;
        Ok(())
    }
}

impl Drop for TemporaryName {
    fn drop(&mut self) {
        if !self.is_renamed {
            let _ = self.folder.remove_file(Path::new(&self.name)); // a signal was quicker
        }
        unfinished().remove(&self.folder.path().join(&self.name));
    }
}

/// A guard: while it lives, this process creates no temporary file.
pub struct NoMoreOutputs {
    _unfinished: Unfinished,
}

/// Removes all temporary files of this process, which is about to end. The returned guard must live until then.
#[must_use]
pub fn remove_unfinished() -> NoMoreOutputs {
    let unfinished = unfinished();
    for (path, folder) in &*unfinished {
        let name = Path::new(path.file_name().unwrap_or_default());
        let _ = folder.remove_file(name); // it has its name, or its writer was quicker
    }
    NoMoreOutputs {
        _unfinished: unfinished,
    }
}

/// Removes the temporary files in a directory whose writers were killed. Files that are being written are locked, and
/// remain.
pub fn remove_abandoned(directory: &Path) {
    remove_temporary(directory, |folder, name, _| unlocked(folder, name));
}

/// A file with a temporary name, locked, if it was not.
fn unlocked(folder: &Folder, name: &OsStr) -> Option<File> {
    let file = folder.open_file(name).ok()?;
    file.try_lock().ok()?;
    Some(file)
}

/// Removes the temporary files in a directory that were created with `mark`, whether or not they are locked: locks
/// have no effect on other machines.
pub fn remove_marked(directory: &Path, mark: &str) {
    remove_temporary(directory, |_, _, of_file| {
        of_file.starts_with(mark).then_some(())
    });
}

/// As [`remove_abandoned`], but only for temporary files that were created with `mark`. Files of a worker that still
/// runs on this machine are kept; those of a worker that was killed are removed.
pub fn remove_abandoned_marked(directory: &Path, mark: &str) {
    remove_temporary(directory, |folder, name, of_file| {
        let is_marked = of_file.starts_with(mark);
        is_marked.then(|| unlocked(folder, name))?
    });
}

/// Removes the temporary files of a directory for which `claim` returns a value, such as a lock. The value lives until
/// the file is removed. Otherwise a writer could lock its new file meanwhile, and would lose it. `claim` gets the
/// directory, the name and the mark in the name.
fn remove_temporary<T>(directory: &Path, claim: impl Fn(&Folder, &OsStr, &str) -> Option<T>) {
    let Ok(folder) = Folder::open(directory) else {
        return;
    };
    for (name, mark) in temporary_files(directory) {
        if let Some(_claimed) = claim(&folder, &name, &mark) {
            let _ = folder.remove_file(Path::new(&name)); // the next run tries again
        }
    }
}

/// The files in a directory with names of temporary files, and the marks in their names. Links, pipes and directories
/// are left out.
fn temporary_files(directory: &Path) -> Vec<(OsString, String)> {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    let temporary = entries.filter_map(|entry| {
        let name = entry.file_name();
        let stem = name.to_str()?.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
        let (mark, random) = stem.split_at(stem.rfind('-').map_or(0, |at| at + 1));
        // The random part of our names has this length; Python's temporary files have eight characters, which may be
        // underscores.
        let is_random = random.len() == RANDOM || !mark.is_empty() && random.len() == 8;
        let is_temporary = is_random
            && random
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
            && (mark.is_empty() || mark.starts_with("shard"))
            && entry.file_type().is_ok_and(|kind| kind.is_file());
        let mark = mark.to_owned();
        is_temporary.then_some((name, mark))
    });
    temporary.collect()
}

impl Output {
    /// Checks whether the output can be written, and opens a temporary file in its directory; `-` is standard output.
    /// The output must not be one of `inputs`.
    ///
    /// # Errors
    /// An [`OutputError`]; no file has been changed then.
    pub fn create(path: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        if path.as_os_str() == "-" {
            let writer = OutputSink::Standard(BufWriter::with_capacity(BUFFER, io::stdout()));
            let path = path.to_owned();
            return Ok(Self { path, writer });
        }
        check_target(path, overwrite, inputs)?;
        let folder = Folder::open(&parent(path)).map_err(|source| OutputError::Write {
            path: path.to_owned(),
            source,
        })?;
        let name = PathBuf::from(path.file_name().unwrap_or_default());
        let location = OutputLocation {
            folder,
            name,
            overwrite,
        };
        Self::begin(path.to_owned(), location, "")
    }

    /// As [`Output::create`], of a file below an open directory, and with a mark in the name of the temporary file, by
    /// which [`remove_marked`] finds it. If the directory was moved or replaced, nothing is written.
    ///
    /// # Errors
    /// An [`OutputError`]; no file has been changed then.
    pub fn create_in(
        folder: &Folder,
        name: &Path,
        overwrite: bool,
        mark: &str,
    ) -> Result<Self, OutputError> {
        let location = OutputLocation {
            folder: folder.clone(),
            name: name.to_owned(),
            overwrite,
        };
        let path = folder.path().join(name);
        location.parent(&path)?;
        check_target(&path, overwrite, &[])?;
        Self::begin(path, location, mark)
    }

    fn begin(path: PathBuf, location: OutputLocation, mark: &str) -> Result<Self, OutputError> {
        let parent = location.parent(&path)?;
        let temporary = Temporary::new(&parent, mark).map_err(|source| OutputError::Write {
            path: path.clone(),
            source,
        })?;
        let temporary = BufWriter::with_capacity(BUFFER, temporary);
        let writer = OutputSink::File {
            temporary,
            location,
        };
        Ok(Self { path, writer })
    }

    /// Passes everything to the system and frees the buffer, for files that get their names later, together with
    /// others.
    ///
    /// # Errors
    /// When the system cannot write the rest of the buffer.
    pub fn settle(self) -> Result<Self, OutputError> {
        let Self { path, writer } = self;
        let writer = match writer {
            OutputSink::File {
                temporary,
                location,
            } => {
                let file = temporary.into_inner().map_err(|e| OutputError::Write {
                    path: path.clone(),
                    source: e.into_error(),
                })?;
                OutputSink::File {
                    temporary: BufWriter::with_capacity(0, file),
                    location,
                }
            }
            standard @ OutputSink::Standard(_) => standard,
        };
        Ok(Self { path, writer })
    }

    /// Writes everything to the disk and names the file.
    ///
    /// # Errors
    /// When the system cannot; an existing file is unchanged then.
    pub fn commit(self) -> Result<(), OutputError> {
        self.commit_open().map(drop)
    }

    /// As [`Output::commit`]; returns the file, which is still open, or `None` for standard output.
    ///
    /// # Errors
    /// As [`Output::commit`].
    pub fn commit_open(self) -> Result<Option<File>, OutputError> {
        let Self { path, writer } = self;
        let named = |source| OutputError::Write {
            path: path.clone(),
            source,
        };
        match writer {
            OutputSink::Standard(mut writer) => writer.flush().map(|()| None).map_err(named),
            OutputSink::File {
                temporary,
                location,
            } => {
                let temporary = temporary.into_inner().map_err(|e| named(e.into_error()))?;
                let parent = location.parent(&path)?;
                match temporary.persist(&parent, location.file_name(), location.overwrite) {
                    Ok(file) => Ok(Some(file)),
                    Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                        Err(OutputError::Exists { path: path.clone() })
                    }
                    Err(error) => Err(named(error)),
                }
            }
        }
    }
}

/// A file that does not have its final name.
enum Temporary {
    /// A file without a name.
    #[cfg(target_os = "linux")]
    Unnamed { file: File, mark: String },
    /// A file with a temporary name.
    Named { file: File, name: TemporaryName },
}

impl Temporary {
    fn new(parent: &Folder, mark: &str) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = parent.create_unnamed() {
            let _ = file.try_lock(); // for the moment between its two names
            let mark = mark.to_owned();
            return Ok(Self::Unnamed { file, mark });
        }
        remove_abandoned_once(parent.path());
        named_in(parent, mark)
    }

    fn file(&mut self) -> &mut File {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed { file, .. } => file,
            Self::Named { file, .. } => file,
        }
    }

    fn persist(mut self, parent: &Folder, to: &OsStr, overwrite: bool) -> io::Result<File> {
        self.file().sync_all()?;
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed { file, mark } => {
                match name_unnamed(&file, parent, &mark, to, overwrite) {
                    // Sandboxes and Android forbid links, so the nameless file cannot get a name.
                    Err(error)
                        if matches!(
                            error.kind(),
                            io::ErrorKind::PermissionDenied | io::ErrorKind::Unsupported
                        ) =>
                    {
                        copied(file, parent, &mark)?.persist(parent, to, overwrite)
                    }
                    named => named.map(|()| file),
                }
            }
            Self::Named { file, name } => {
                name.rename(to, overwrite)?;
                // The file may still have a writer, but nobody opens it by its name any more, so the lock has no use.
                // On Windows, other processes cannot read a locked file.
                let _ = file.unlock();
                Ok(file)
            }
        }
    }
}

/// Names a file that has no name.
#[cfg(target_os = "linux")]
fn name_unnamed(
    file: &File,
    parent: &Folder,
    mark: &str,
    to: &OsStr,
    overwrite: bool,
) -> io::Result<()> {
    if !overwrite {
        return parent.name_new(file, to);
    }
    // Only a file with a name can replace another file.
    let create = |name: &OsStr| parent.name_new(file, name);
    let (name, ()) = TemporaryName::new(parent, mark, create)?;
    name.rename(to, overwrite)
}

/// A copy of a file without a name that has a temporary one.
#[cfg(target_os = "linux")]
fn copied(mut file: File, parent: &Folder, mark: &str) -> io::Result<Temporary> {
    let mut copy = named_in(parent, mark)?;
    io::Seek::rewind(&mut file)?;
    io::copy(&mut file, copy.file())?;
    Ok(copy)
}

impl Write for Temporary {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

/// A locked file with a temporary name: a process with the lock is still writing; see `remove_abandoned`. On a file
/// system without locks, such files are not removed.
fn named_in(parent: &Folder, mark: &str) -> io::Result<Temporary> {
    loop {
        let (name, file) = TemporaryName::new(parent, mark, |name| parent.create_new(name))?;
        // Before the lock was taken, a process that removes abandoned files may have removed the file; then a new one
        // is made.
        let is_locked = matches!(file.try_lock(), Err(fs::TryLockError::WouldBlock));
        if !is_locked && is_there(&file) {
            return Ok(Temporary::Named { file, name });
        }
    }
}

/// Removes the files of killed writers in a directory, once for each directory, unless it has too many files to read
/// it for each of many results.
fn remove_abandoned_once(parent: &Path) {
    static SEEN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    const MAX_ENTRIES: usize = 4096;
    let is_new = (SEEN.lock().unwrap_or_else(PoisonError::into_inner)).insert(parent.to_owned());
    let entries = fs::read_dir(parent).into_iter().flatten();
    if is_new && entries.take(MAX_ENTRIES).count() < MAX_ENTRIES {
        remove_abandoned(parent);
    }
}

#[cfg(unix)]
fn is_there(file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    let file = file.metadata();
    file.is_ok_and(|file| file.nlink() > 0)
}

#[cfg(not(unix))]
fn is_there(_: &File) -> bool {
    true
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.writer {
            OutputSink::File { temporary, .. } => temporary.write(bytes),
            OutputSink::Standard(writer) => writer.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.writer {
            OutputSink::File { temporary, .. } => temporary.flush(),
            OutputSink::Standard(writer) => writer.flush(),
        }
    }
}

/// Checks, without writing, whether an output can be written.
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
    // A rename would replace a pipe or a device by a file, so it is opened and written directly.
    if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
        return Err(OutputError::NotAFile {
            path: path.to_owned(),
        });
    }
    // Links are resolved, because two names may lead to one file.
    if let Ok(target) = fs::canonicalize(path) {
        let same = |input: &&PathBuf| fs::canonicalize(input).is_ok_and(|input| input == target);
        if let Some(input) = inputs.iter().find(same) {
            return Err(OutputError::IsInput {
                path: path.to_owned(),
                input: input.clone(),
            });
        }
    }
    match fs::symlink_metadata(path) {
        Ok(_) if !overwrite => Err(OutputError::Exists {
            path: path.to_owned(),
        }),
        // The name is too long, or contains characters that the system forbids in names.
        Err(source) if source.kind() == io::ErrorKind::InvalidFilename => Err(OutputError::Write {
            path: path.to_owned(),
            source,
        }),
        _ => Ok(()),
    }
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
        fs::write(
            directory.path().join(".tumble-shard00001-x1y2z3.part"),
            "half",
        )
        .unwrap();
        let mine = [
            ".tumble-notes",
            ".tumble-notes.part",
            ".tumble-my.notes.part",
        ];
        for name in mine {
            fs::write(directory.path().join(name), "mine").unwrap();
        }
        let folder = Folder::open(directory.path()).unwrap();
        let current = named_in(&folder, "").unwrap();
        #[cfg_attr(not(target_os = "linux"), allow(irrefutable_let_patterns))]
        let Temporary::Named { name: current, .. } = &current else {
            panic!("it has a name");
        };
        remove_abandoned(directory.path());
        let left = names(directory.path());
        assert_eq!(left.len(), 4);
        assert!(mine.iter().all(|name| left.contains(&(*name).to_owned())));
        assert!(left.contains(&current.name.to_str().unwrap().to_owned()));
    }

    /// A writer locks its file just after someone found it without a lock.
    #[test]
    fn a_file_that_is_found_without_a_lock_cannot_be_locked_before_it_is_removed() {
        let directory = tempfile::tempdir().unwrap();
        let folder = Folder::open(directory.path()).unwrap();
        let name = OsStr::new(".tumble-x1y2z3.part");
        let written = folder.create_new(name).unwrap();
        remove_temporary(directory.path(), |folder, name, _| {
            let claimed = unlocked(folder, name);
            assert!(claimed.is_some() && written.try_lock().is_err());
            claimed
        });
        assert_eq!(names(directory.path()), Vec::<String>::new());
        written.try_lock().unwrap();
    }

    /// Processes that write and processes that look for abandoned files run at once.
    #[test]
    fn what_is_being_written_is_never_removed() {
        use std::sync::mpsc::{TryRecvError, channel};

        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        let (writing, ended) = channel::<()>();
        std::thread::scope(|scope| {
            scope.spawn(move || {
                // If the writer fails, its end of the channel is dropped, too.
                while ended.try_recv() != Err(TryRecvError::Disconnected) {
                    remove_abandoned(path);
                }
            });
            let _writing = writing;
            let folder = Folder::open(directory.path()).unwrap();
            for number in 0..300 {
                let name = number.to_string();
                let mut file = named_in(&folder, "").unwrap();
                file.write_all(b"whole").unwrap();
                file.persist(&folder, OsStr::new(&name), number % 2 == 0)
                    .unwrap();
            }
        });
        assert_eq!(names(directory.path()).len(), 300);
    }

    #[test]
    fn marked_files_are_removed_by_their_mark() {
        let directory = tempfile::tempdir().unwrap();
        let folder = Folder::open(directory.path()).unwrap();
        let first = named_in(&folder, "shard1-").unwrap();
        let second = named_in(&folder, "shard2-").unwrap();
        remove_marked(directory.path(), "shard1-");
        if cfg!(unix) {
            assert_eq!(names(directory.path()).len(), 1);
            assert!(first.persist(&folder, OsStr::new("out"), false).is_err());
        } else {
            // Windows keeps the name of an open file until it is closed.
            drop(first);
            remove_marked(directory.path(), "shard1-");
            assert_eq!(names(directory.path()).len(), 1);
        }
        second.persist(&folder, OsStr::new("out"), false).unwrap();
        assert_eq!(names(directory.path()), ["out"]);
    }

    /// A file without a name disappears, however the process ends that writes it.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_without_a_name_gets_one_at_the_end() {
        use std::os::unix::fs::PermissionsExt;

        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out");
        let folder = Folder::open(directory.path()).unwrap();
        let out = OsStr::new("out");
        let Some(file) = folder.create_unnamed() else {
            return; // this file system has none
        };
        let unnamed = |file: File| Temporary::Unnamed {
            file,
            mark: String::new(),
        };
        let mut first = unnamed(file);
        first.write_all(b"first").unwrap();
        assert_eq!(names(directory.path()), Vec::<String>::new());
        first.persist(&folder, out, false).unwrap();
        let second = || unnamed(folder.create_unnamed().unwrap());
        let refused = second().persist(&folder, out, false).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"first");
        second().persist(&folder, out, true).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"");
        assert_eq!(names(directory.path()), ["out"]);
        let created = directory.path().join("created");
        File::create(&created).unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&created));
    }

    /// Catches outputs that are named by a path that leads elsewhere by then.
    #[cfg(unix)]
    #[test]
    fn nothing_is_written_through_a_link_in_the_place_of_the_directory() {
        for (overwrite, is_deep) in [(false, false), (true, false), (false, true), (true, true)] {
            let directory = tempfile::tempdir().unwrap();
            let [path, moved, foreign] =
                ["out", "moved", "foreign"].map(|name| directory.path().join(name));
            fs::create_dir_all(path.join("deep")).unwrap();
            fs::create_dir_all(foreign.join("deep")).unwrap();
            fs::write(foreign.join("file"), "theirs").unwrap();
            fs::write(foreign.join("deep/file"), "theirs").unwrap();
            let folder = Folder::open(&path).unwrap();
            let name = Path::new(if is_deep { "deep/file" } else { "file" });
            let begin = || {
                let mut output = Output::create_in(&folder, name, overwrite, "").unwrap();
                output.write_all(b"ours").unwrap();
                output
            };
            let alone = Output::create(&path.join(name), overwrite, &[]).unwrap();
            let named = Output {
                writer: OutputSink::File {
                    temporary: BufWriter::new(named_in(&folder, "").unwrap()),
                    location: OutputLocation {
                        folder: folder.clone(),
                        name: name.to_owned(),
                        overwrite,
                    },
                },
                path: path.join(name),
            };
            let waiting = [begin(), alone, named];
            fs::rename(&path, &moved).unwrap();
            std::os::unix::fs::symlink(&foreign, &path).unwrap();
            for output in waiting {
                let refused = output.commit().unwrap_err();
                assert!(matches!(refused, OutputError::Moved { .. }), "{refused}");
            }
            let refused = Output::create_in(&folder, name, overwrite, "").err();
            assert!(matches!(refused, Some(OutputError::Moved { .. })));
            let all = |path: &Path| {
                let mut all = names(path);
                all.sort();
                all
            };
            assert_eq!(all(&moved), ["deep"]);
            assert_eq!(all(&foreign), ["deep", "file"]);
            assert_eq!(fs::read(foreign.join(name)).unwrap(), b"theirs");
        }
    }

    /// As where a sandbox forbids links.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_cannot_be_linked_is_copied() {
        let directory = tempfile::tempdir().unwrap();
        let folder = Folder::open(directory.path()).unwrap();
        let Some(mut file) = folder.create_unnamed() else {
            return; // this file system has none
        };
        file.write_all(b"whole").unwrap();
        let copy = copied(file, &folder, "").unwrap();
        copy.persist(&folder, OsStr::new("out"), false).unwrap();
        assert_eq!(fs::read(directory.path().join("out")).unwrap(), b"whole");
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
