//! Writes files completely or not at all. A file that is being written has no name or a temporary one, in the
//! directory of the output; it gets its name at the end. Standard output is the exception, for pipes.
//!
//! On Linux, a file that is being written has no name (`O_TMPFILE`), so that nothing remains if its writer is ended.
//! If the file system does not support this, the file is called `.tumble-….part` and locked. A file without a lock
//! has no writer any more, and the next writer removes it.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

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
    /// Standard output is closed, so that what is written to it would be lost.
    #[error("standard output is closed; give a file, or leave standard output open")]
    Closed,
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
        overwrite: bool,
    },
    Standard(BufWriter<io::Stdout>),
}

const BUFFER: usize = 1 << 18;

/// The prefix and the suffix of the names of temporary files.
const PREFIX: &str = ".tumble-";
const SUFFIX: &str = ".part";

/// Number of random letters and digits before the suffix. A mark before them ends in `-`.
const RANDOM: usize = 6;

/// The temporary files that this process is writing.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The entry of a temporary file in [`UNFINISHED`], removed when this is dropped.
struct UnfinishedEntry(PathBuf);

impl Drop for UnfinishedEntry {
    fn drop(&mut self) {
        unfinished().remove(&self.0);
    }
}

/// A guard: while it lives, this process creates no temporary file.
pub struct NoMoreOutputs {
    _unfinished: MutexGuard<'static, BTreeSet<PathBuf>>,
}

/// Removes all temporary files of this process, which is about to end. The returned guard must live until then.
#[must_use]
pub fn remove_unfinished() -> NoMoreOutputs {
    let unfinished = unfinished();
    for path in &*unfinished {
        let _ = fs::remove_file(path); // it has its name, or its writer was quicker
    }
    NoMoreOutputs {
        _unfinished: unfinished,
    }
}

/// Removes the temporary files in a directory whose writers were killed. Files that are being written are locked, and
/// remain.
pub fn remove_abandoned(directory: &Path) {
    for path in temporary_files(directory, |_| true) {
        if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(path); // the next run tries again
        }
    }
}

/// Removes the temporary files in a directory that were created with `mark`, whether or not they are locked: locks
/// have no effect on other machines.
pub fn remove_marked(directory: &Path, mark: &str) {
    for path in temporary_files(directory, |name| name.starts_with(mark)) {
        let _ = fs::remove_file(path); // the next run tries again
    }
}

/// The files in a directory with names of temporary files and with a mark for which `is_good` is true. Links, pipes
/// and directories are left out.
fn temporary_files(directory: &Path, is_good: impl Fn(&str) -> bool) -> Vec<PathBuf> {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    let temporary = entries.filter(|entry| {
        let name = entry.file_name();
        let name = name.to_str().and_then(|name| name.strip_prefix(PREFIX));
        let Some(stem) = name.and_then(|name| name.strip_suffix(SUFFIX)) else {
            return false;
        };
        let (mark, random) = stem.split_at(stem.rfind('-').map_or(0, |at| at + 1));
        // Python's temporary files have eight, underscores among them.
        let is_random = random.len() == RANDOM || !mark.is_empty() && random.len() == 8;
        is_random
            && random
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
            && (mark.is_empty() || mark.starts_with("shard"))
            && is_good(mark)
            && entry.file_type().is_ok_and(|kind| kind.is_file())
    });
    temporary.map(|entry| entry.path()).collect()
}

impl Output {
    /// Checks whether the output can be written, and opens a temporary file in its directory; `-` is standard output.
    /// The output must not be one of `inputs`.
    ///
    /// # Errors
    /// An [`OutputError`]; no file has been changed then.
    pub fn create(path: &Path, overwrite: bool, inputs: &[PathBuf]) -> Result<Self, OutputError> {
        Self::create_marked(path, overwrite, inputs, "")
    }

    /// As [`Output::create`], with a mark in the name of the temporary file, by which [`remove_marked`] finds it.
    ///
    /// # Errors
    /// An [`OutputError`]; no file has been changed then.
    pub fn create_marked(
        path: &Path,
        overwrite: bool,
        inputs: &[PathBuf],
        mark: &str,
    ) -> Result<Self, OutputError> {
        let path = path.to_owned();
        if path.as_os_str() == "-" {
            if is_standard_closed() {
                return Err(OutputError::Closed);
            }
            let writer = OutputSink::Standard(BufWriter::with_capacity(BUFFER, io::stdout()));
            return Ok(Self { path, writer });
        }
        check_target(&path, overwrite, inputs)?;
        let failed = |source| OutputError::Write {
            path: path.clone(),
            source,
        };
        let temporary = Temporary::new(&parent(&path), mark).map_err(failed)?;
        let temporary = BufWriter::with_capacity(BUFFER, temporary);
        Ok(Self {
            path,
            writer: OutputSink::File {
                temporary,
                overwrite,
            },
        })
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
                overwrite,
            } => {
                let file = temporary.into_inner().map_err(|e| OutputError::Write {
                    path: path.clone(),
                    source: e.into_error(),
                })?;
                OutputSink::File {
                    temporary: BufWriter::with_capacity(0, file),
                    overwrite,
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
                overwrite,
            } => {
                let temporary = temporary.into_inner().map_err(|e| named(e.into_error()))?;
                match temporary.persist(&path, overwrite) {
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
    /// A file with a temporary name. It is removed before its entry.
    Named(NamedTempFile, UnfinishedEntry),
}

impl Temporary {
    fn new(parent: &Path, mark: &str) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = unnamed_in(parent) {
            let _ = file.try_lock(); // for the moment between its two names
            let mark = mark.to_owned();
            return Ok(Self::Unnamed { file, mark });
        }
        remove_abandoned_once(parent);
        named_in(parent, mark)
    }

    fn file(&mut self) -> &mut File {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed { file, .. } => file,
            Self::Named(file, _) => file.as_file_mut(),
        }
    }

    fn persist(mut self, path: &Path, overwrite: bool) -> io::Result<File> {
        self.file().sync_all()?;
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed { file, .. } if !overwrite => link(&file, path).map(|()| file),
            #[cfg(target_os = "linux")]
            Self::Unnamed { file, mark } => {
                // Only a file that has a name can replace another one.
                let prefix = format!("{PREFIX}{mark}");
                let mut unfinished = unfinished();
                let named = builder(&prefix).make_in(parent(path), |name| link(&file, name))?;
                let name = named.path().to_owned();
                unfinished.insert(name.clone());
                drop(unfinished);
                let _listed = UnfinishedEntry(name);
                named.persist(path).map_err(|error| error.error)?;
                Ok(file)
            }
            Self::Named(file, _listed) => {
                let persisted = match overwrite {
                    true => file.persist(path),
                    false => file.persist_noclobber(path),
                };
                let file = persisted.map_err(|error| error.error)?;
                // It has a writer still, perhaps, but nobody looks for it any more. Windows lets nobody else
                // read what is locked.
                let _ = file.unlock();
                Ok(file)
            }
        }
    }
}

impl Write for Temporary {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file().flush()
    }
}

fn builder(prefix: &str) -> tempfile::Builder<'_, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix).suffix(SUFFIX).rand_bytes(RANDOM);
    builder
}

/// A file without a name; `None` if the file system does not support this, or if the directory has another fault,
/// which the creation of a named file then reports.
#[cfg(target_os = "linux")]
fn unnamed_in(parent: &Path) -> Option<File> {
    use rustix::fs::{Mode, OFlags, open};

    // As `File::create` does: readable by all, less the umask.
    let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
    let file = File::from(open(parent, flags, Mode::from_raw_mode(0o666)).ok()?);
    fs::symlink_metadata(descriptor(&file))
        .is_ok()
        .then_some(file)
}

/// The path of an open file's descriptor.
#[cfg(target_os = "linux")]
fn descriptor(file: &File) -> PathBuf {
    use std::os::fd::AsRawFd;
    PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()))
}

/// Names a file, if no other file has the name.
#[cfg(target_os = "linux")]
fn link(file: &File, path: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    linkat(CWD, descriptor(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?;
    Ok(())
}

/// A locked file with a temporary name: a process with the lock is still writing; see `remove_abandoned`. On a file
/// system without locks, such files are not removed.
fn named_in(parent: &Path, mark: &str) -> io::Result<Temporary> {
    let prefix = format!("{PREFIX}{mark}");
    #[cfg_attr(not(unix), expect(unused_mut, reason = "Unix alone has permissions"))]
    let mut builder = builder(&prefix);
    #[cfg(unix)]
    {
        // As `File::create` does: readable by all, less the umask.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    loop {
        // A process that is about to end waits until the new file is listed.
        let mut unfinished = unfinished();
        let temporary = builder.tempfile_in(parent)?;
        let path = temporary.path().to_owned();
        unfinished.insert(path.clone());
        drop(unfinished);
        let listed = UnfinishedEntry(path);
        // Whoever looks for abandoned files may have met it before it was locked.
        let is_locked = matches!(
            temporary.as_file().try_lock(),
            Err(fs::TryLockError::WouldBlock)
        );
        if !is_locked && is_there(&temporary) {
            return Ok(Temporary::Named(temporary, listed));
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
fn is_there(temporary: &NamedTempFile) -> bool {
    use std::os::unix::fs::MetadataExt;
    let file = temporary.as_file().metadata();
    file.is_ok_and(|file| file.nlink() > 0)
}

#[cfg(not(unix))]
fn is_there(_: &NamedTempFile) -> bool {
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
    // A rename would replace it by a file.
    if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
        return Err(OutputError::NotAFile {
            path: path.to_owned(),
        });
    }
    // Also through links: both names lead to one file.
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
        // Its name is too long, or has what no name may have.
        Err(source) if source.kind() == io::ErrorKind::InvalidFilename => Err(OutputError::Write {
            path: path.to_owned(),
            source,
        }),
        _ => Ok(()),
    }
}

/// Whether this process was started with its standard output closed. Rust's runtime then opens `/dev/null` in its
/// place, for reading and writing; redirections to `/dev/null` open it for writing alone.
#[cfg(target_os = "linux")]
fn is_standard_closed() -> bool {
    use rustix::fs::{OFlags, fcntl_getfl, fstat, stat};

    let out = io::stdout();
    let is_null = fstat(&out)
        .ok()
        .zip(stat("/dev/null").ok())
        .is_some_and(|(out, null)| (out.st_dev, out.st_ino) == (null.st_dev, null.st_ino));
    is_null && fcntl_getfl(&out).is_ok_and(|flags| flags & OFlags::RWMODE == OFlags::RDWR)
}

#[cfg(not(target_os = "linux"))]
fn is_standard_closed() -> bool {
    false
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
        let current = named_in(directory.path(), "").unwrap();
        #[cfg_attr(not(target_os = "linux"), allow(irrefutable_let_patterns))]
        let Temporary::Named(current, _) = &current else {
            panic!("it has a name");
        };
        let current_name = current.path().file_name().unwrap();
        remove_abandoned(directory.path());
        let left = names(directory.path());
        assert_eq!(left.len(), 4);
        assert!(mine.iter().all(|name| left.contains(&(*name).to_owned())));
        assert!(left.contains(&current_name.to_str().unwrap().to_owned()));
    }

    /// Writers and those who look for abandoned files run at once.
    #[test]
    fn what_is_being_written_is_never_removed() {
        let directory = tempfile::tempdir().unwrap();
        let done = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(std::sync::atomic::Ordering::Relaxed) {
                    remove_abandoned(directory.path());
                }
            });
            for number in 0..300 {
                let path = directory.path().join(number.to_string());
                let mut file = named_in(directory.path(), "").unwrap();
                file.write_all(b"whole").unwrap();
                file.persist(&path, number % 2 == 0).unwrap();
            }
            done.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        assert_eq!(names(directory.path()).len(), 300);
    }

    #[test]
    fn marked_files_are_removed_by_their_mark() {
        let directory = tempfile::tempdir().unwrap();
        let first = named_in(directory.path(), "shard1-").unwrap();
        let second = named_in(directory.path(), "shard2-").unwrap();
        remove_marked(directory.path(), "shard1-");
        if cfg!(unix) {
            assert_eq!(names(directory.path()).len(), 1);
            assert!(first.persist(&directory.path().join("out"), false).is_err());
        } else {
            // Windows keeps the name of an open file until it is closed.
            drop(first);
            remove_marked(directory.path(), "shard1-");
            assert_eq!(names(directory.path()).len(), 1);
        }
        second
            .persist(&directory.path().join("out"), false)
            .unwrap();
        assert_eq!(names(directory.path()), ["out"]);
    }

    /// Whatever ends the writer of a file without a name leaves nothing.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_without_a_name_gets_one_at_the_end() {
        use std::os::unix::fs::PermissionsExt;

        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out");
        let Some(file) = unnamed_in(directory.path()) else {
            return; // this file system has none
        };
        let unnamed = |file: File| Temporary::Unnamed {
            file,
            mark: String::new(),
        };
        let mut first = unnamed(file);
        first.write_all(b"first").unwrap();
        assert_eq!(names(directory.path()), Vec::<String>::new());
        first.persist(&path, false).unwrap();
        let second = || unnamed(unnamed_in(directory.path()).unwrap());
        let refused = second().persist(&path, false).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&path).unwrap(), b"first");
        second().persist(&path, true).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"");
        assert_eq!(names(directory.path()), ["out"]);
        let created = directory.path().join("created");
        File::create(&created).unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&created));
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
