//! An open directory, and operations on the files in it.
//!
//! While a program works, others may rename the directory of its results and put another one, or a link, in its place.
//! A program that opens the path again would then write into the wrong one. A [`Folder`] is opened once: files are
//! created, named and removed in the directory that was opened, wherever it is by now, and [`Folder::is_in_place`] says
//! whether its path still leads to it. On Windows, a directory that is open cannot be renamed.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::beneath::{leads_out, or_here, plain};

/// An open directory. Clones share it.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    handle: Arc<File>,
}

impl Folder {
    /// Opens the directory of a path, which may contain links.
    ///
    /// # Errors
    /// When there is no such directory, or when it cannot be opened.
    pub fn open(path: &Path) -> io::Result<Self> {
        let path = or_here(path).to_owned();
        let handle = Arc::new(system::open(&path)?);
        Ok(Self { path, handle })
    }

    /// The path by which it was opened.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether its path still leads to it.
    #[must_use]
    pub fn is_in_place(&self) -> bool {
        system::is_at(&self.handle, &self.path)
    }

    /// Opens the directory in which the file `name` is, below this one. No component of the name may be a link.
    ///
    /// # Errors
    /// When the name leads out of the directory, or when a component is a link or not a directory.
    pub fn parent_of(&self, name: &Path) -> io::Result<Self> {
        self.descend(name, |_, _| Ok(()))
    }

    /// As [`Folder::parent_of`]; creates directories that do not exist.
    ///
    /// # Errors
    /// As [`Folder::parent_of`], and when a directory cannot be created.
    pub fn create_parent_of(&self, name: &Path) -> io::Result<Self> {
        self.descend(name, |folder, part| {
            match system::create_folder(folder, part) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
                _ => Ok(()),
            }
        })
    }

    fn descend(
        &self,
        name: &Path,
        before: impl Fn(&Self, &OsStr) -> io::Result<()>,
    ) -> io::Result<Self> {
        let name = plain(name).ok_or_else(leads_out)?;
        let mut folder = self.clone();
        for part in name.parent().into_iter().flat_map(Path::iter) {
            before(&folder, part)?;
            let path = folder.path.join(part);
            let opened = system::open_below(&folder, part);
            let handle = opened.map_err(|error| match fs::symlink_metadata(&path) {
                Ok(found) if found.is_symlink() => leads_out(),
                _ => error,
            })?;
            folder = Self {
                handle: Arc::new(handle),
                path,
            };
        }
        Ok(folder)
    }

    /// Removes a file below the directory. No component of its name may be a link; a link of that name is removed
    /// itself.
    ///
    /// # Errors
    /// As [`Folder::parent_of`], and when the file cannot be removed.
    pub fn remove_file(&self, name: &Path) -> io::Result<()> {
        system::remove_file(&self.parent_of(name)?, last(name)?)
    }

    /// Removes an empty directory below the directory.
    ///
    /// # Errors
    /// As [`Folder::parent_of`], and when the directory cannot be removed: it may have files.
    pub fn remove_folder(&self, name: &Path) -> io::Result<()> {
        system::remove_folder(&self.parent_of(name)?, last(name)?)
    }

    /// Opens the directory itself as a file, which can be locked.
    ///
    /// # Errors
    /// When the user may not list it, or where the system does not open directories as files.
    pub fn to_lock(&self) -> io::Result<File> {
        system::to_lock(self)
    }

    /// Creates a file that must not exist yet.
    pub(crate) fn create_new(&self, name: &OsStr) -> io::Result<File> {
        system::create_new(self, name)
    }

    /// Opens a file for reading; not a link.
    pub(crate) fn open_file(&self, name: &OsStr) -> io::Result<File> {
        system::open_file(self, name)
    }

    /// Renames a file in the directory. `replaces`: whether a file of the new name is replaced, or is an error.
    pub(crate) fn rename(&self, from: &OsStr, to: &OsStr, replaces: bool) -> io::Result<()> {
        match replaces {
            true => system::replace(self, from, to),
            false => system::rename_new(self, from, to),
        }
    }

    /// Opens a file without a name. `None` if the file system does not support this, or if the directory has another
    /// fault, which the creation of a named file then reports.
    #[cfg(target_os = "linux")]
    pub(crate) fn create_unnamed(&self) -> Option<File> {
        use rustix::fs::{Mode, OFlags, openat};
        // The same permissions as `File::create`: readable by all, except for the umask.
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        let file = openat(&*self.handle, ".", flags, Mode::from_raw_mode(0o666)).ok()?;
        let file = File::from(file);
        // The file has no name yet, so it is accessed by the path of its descriptor.
        fs::symlink_metadata(descriptor(&file))
            .is_ok()
            .then_some(file)
    }

    /// Names a file of [`Folder::create_unnamed`], if no other file has the name.
    #[cfg(target_os = "linux")]
    pub(crate) fn name_new(&self, file: &File, name: &OsStr) -> io::Result<()> {
        use rustix::fs::{AtFlags, CWD, linkat};
        let path = descriptor(file);
        linkat(CWD, path, &*self.handle, name, AtFlags::SYMLINK_FOLLOW)?;
        Ok(())
    }
}

/// The path of an open file's descriptor.
#[cfg(target_os = "linux")]
fn descriptor(file: &File) -> PathBuf {
    use std::os::fd::AsRawFd;
    PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()))
}

fn last(name: &Path) -> io::Result<&OsStr> {
    name.file_name().ok_or_else(leads_out)
}

/// Access to files relative to the descriptor of an open directory.
#[cfg(unix)]
mod system {
    use std::os::unix::fs::MetadataExt;

    use rustix::fs::{
        AtFlags, Mode, OFlags, linkat, mkdirat, open as open_path, openat, renameat, unlinkat,
    };

    use super::{File, Folder, OsStr, Path, fs, io};

    /// The flags for a directory that may be entered but not listed.
    #[cfg(target_os = "linux")]
    const ENTERED: OFlags = OFlags::PATH;
    #[cfg(not(target_os = "linux"))]
    const ENTERED: OFlags = OFlags::RDONLY;

    pub(super) fn open(path: &Path) -> io::Result<File> {
        let flags = ENTERED | OFlags::DIRECTORY | OFlags::CLOEXEC;
        Ok(open_path(path, flags, Mode::empty())?.into())
    }

    pub(super) fn open_below(folder: &Folder, name: &OsStr) -> io::Result<File> {
        let flags = ENTERED | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        Ok(openat(&*folder.handle, name, flags, Mode::empty())?.into())
    }

    pub(super) fn is_at(handle: &File, path: &Path) -> bool {
        let of = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
        let opened = handle.metadata().map(of);
        opened.is_ok_and(|opened| fs::metadata(path).is_ok_and(|found| of(found) == opened))
    }

    pub(super) fn to_lock(folder: &Folder) -> io::Result<File> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        Ok(openat(&*folder.handle, ".", flags, Mode::empty())?.into())
    }

    pub(super) fn create_folder(folder: &Folder, name: &OsStr) -> io::Result<()> {
        Ok(mkdirat(&*folder.handle, name, Mode::from_raw_mode(0o777))?)
    }

    pub(super) fn create_new(folder: &Folder, name: &OsStr) -> io::Result<File> {
        let flags = OFlags::CREATE | OFlags::EXCL | OFlags::RDWR | OFlags::CLOEXEC;
        // The same permissions as `File::create`: readable by all, except for the umask.
        let mode = Mode::from_raw_mode(0o666);
        Ok(openat(&*folder.handle, name, flags, mode)?.into())
    }

    pub(super) fn open_file(folder: &Folder, name: &OsStr) -> io::Result<File> {
        // Without this flag, opening a pipe would wait for its writer.
        let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        Ok(openat(&*folder.handle, name, flags, Mode::empty())?.into())
    }

    pub(super) fn remove_file(folder: &Folder, name: &OsStr) -> io::Result<()> {
        Ok(unlinkat(&*folder.handle, name, AtFlags::empty())?)
    }

    pub(super) fn remove_folder(folder: &Folder, name: &OsStr) -> io::Result<()> {
        Ok(unlinkat(&*folder.handle, name, AtFlags::REMOVEDIR)?)
    }

    pub(super) fn replace(folder: &Folder, from: &OsStr, to: &OsStr) -> io::Result<()> {
        Ok(renameat(&*folder.handle, from, &*folder.handle, to)?)
    }

    pub(super) fn rename_new(folder: &Folder, from: &OsStr, to: &OsStr) -> io::Result<()> {
        #[cfg(any(target_os = "linux", target_vendor = "apple"))]
        {
            use rustix::fs::{RenameFlags, renameat_with};
            use rustix::io::Errno;
            let handle = &*folder.handle;
            match renameat_with(handle, from, handle, to, RenameFlags::NOREPLACE) {
                // The file system does not support this, or the system does not have the call.
                Err(Errno::INVAL | Errno::NOSYS | Errno::PERM | Errno::NOTSUP) => {}
                renamed => return Ok(renamed?),
            }
        }
        let handle = &*folder.handle;
        linkat(handle, from, handle, to, AtFlags::empty())?;
        remove_file(folder, from)
    }
}

/// By paths: where the system has no descriptors of directories. Windows refuses to rename an open directory.
#[cfg(not(unix))]
mod system {
    use super::{File, Folder, OsStr, Path, fs, io};

    pub(super) fn open(path: &Path) -> io::Result<File> {
        let mut options = File::options();
        options.read(true);
        #[cfg(windows)]
        {
            use std::os::windows::fs::OpenOptionsExt;
            const SHARE_READ_AND_WRITE: u32 = 1 | 2;
            const BACKUP_SEMANTICS: u32 = 0x0200_0000; // without it, directories are not opened
            options.share_mode(SHARE_READ_AND_WRITE);
            options.custom_flags(BACKUP_SEMANTICS);
        }
        let file = options.open(path)?;
        match file.metadata()?.is_dir() {
            true => Ok(file),
            false => Err(io::Error::from(io::ErrorKind::NotADirectory)),
        }
    }

    pub(super) fn open_below(folder: &Folder, name: &OsStr) -> io::Result<File> {
        let path = folder.path.join(name);
        match fs::symlink_metadata(&path)?.is_symlink() {
            true => Err(io::Error::from(io::ErrorKind::NotADirectory)),
            false => open(&path),
        }
    }

    pub(super) fn is_at(_: &File, path: &Path) -> bool {
        path.is_dir()
    }

    pub(super) fn to_lock(_: &Folder) -> io::Result<File> {
        Err(io::Error::from(io::ErrorKind::Unsupported))
    }

    pub(super) fn create_folder(folder: &Folder, name: &OsStr) -> io::Result<()> {
        fs::create_dir(folder.path.join(name))
    }

    pub(super) fn create_new(folder: &Folder, name: &OsStr) -> io::Result<File> {
        let mut options = File::options();
        options.read(true).write(true).create_new(true);
        options.open(folder.path.join(name))
    }

    pub(super) fn open_file(folder: &Folder, name: &OsStr) -> io::Result<File> {
        File::open(folder.path.join(name))
    }

    pub(super) fn remove_file(folder: &Folder, name: &OsStr) -> io::Result<()> {
        fs::remove_file(folder.path.join(name))
    }

    pub(super) fn remove_folder(folder: &Folder, name: &OsStr) -> io::Result<()> {
        fs::remove_dir(folder.path.join(name))
    }

    pub(super) fn replace(folder: &Folder, from: &OsStr, to: &OsStr) -> io::Result<()> {
        fs::rename(folder.path.join(from), folder.path.join(to))
    }

    pub(super) fn rename_new(folder: &Folder, from: &OsStr, to: &OsStr) -> io::Result<()> {
        let (from, to) = (folder.path.join(from), folder.path.join(to));
        match fs::hard_link(&from, &to) {
            Ok(()) => fs::remove_file(from),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Err(error),
            // The file system does not support links.
            Err(_) if fs::symlink_metadata(&to).is_ok() => {
                Err(io::Error::from(io::ErrorKind::AlreadyExists))
            }
            Err(_) => fs::rename(from, to),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beneath::is_refused;

    fn names(path: &Path) -> Vec<String> {
        let entries = fs::read_dir(path).unwrap().map(Result::unwrap);
        let mut names: Vec<String> = entries
            .map(|entry| entry.file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// Finds code that opens the directory a second time, by its path.
    #[cfg(unix)]
    #[test]
    fn files_stay_in_the_directory_that_was_opened() {
        let directory = tempfile::tempdir().unwrap();
        let [path, moved, foreign] =
            ["out", "moved", "foreign"].map(|name| directory.path().join(name));
        for path in [&path, &foreign] {
            fs::create_dir_all(path.join("deep")).unwrap();
            fs::write(path.join("old"), "old").unwrap();
            fs::write(path.join("deep/old"), "old").unwrap();
        }
        let folder = Folder::open(&path).unwrap();
        assert!(folder.is_in_place());
        fs::rename(&path, &moved).unwrap();
        assert!(!folder.is_in_place());
        std::os::unix::fs::symlink(&foreign, &path).unwrap();
        assert!(!folder.is_in_place());
        drop(folder.create_new(OsStr::new("new")).unwrap());
        folder
            .rename(OsStr::new("new"), OsStr::new("first"), false)
            .unwrap();
        let refused = folder.rename(OsStr::new("first"), OsStr::new("old"), false);
        assert_eq!(refused.unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        folder
            .rename(OsStr::new("first"), OsStr::new("old"), true)
            .unwrap();
        let deep = folder.create_parent_of(Path::new("a/b/file")).unwrap();
        assert!(!deep.is_in_place());
        folder.remove_file(Path::new("deep/old")).unwrap();
        folder.remove_folder(Path::new("deep")).unwrap();
        assert_eq!(names(&moved), ["a", "old"]);
        assert_eq!(names(&foreign), ["deep", "old"]);
        assert_eq!(names(&foreign.join("deep")), ["old"]);
        fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink(&moved, &path).unwrap();
        assert!(folder.is_in_place(), "a link that leads to it");
    }

    #[cfg(unix)]
    #[test]
    fn links_below_are_not_followed() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("out");
        fs::create_dir(&path).unwrap();
        std::os::unix::fs::symlink("..", path.join("up")).unwrap();
        let folder = Folder::open(&path).unwrap();
        for name in ["up/file", "../file", "/file"] {
            let name = Path::new(name);
            let refused = folder.parent_of(name).unwrap_err();
            assert!(is_refused(&refused), "{}: {refused}", name.display());
            assert!(folder.create_parent_of(name).is_err());
            assert!(folder.remove_file(name).is_err());
        }
        assert_eq!(names(directory.path()), ["out"]);
    }
}
