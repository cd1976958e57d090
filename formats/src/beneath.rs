//! Opens files that other files name. Such a file must be a regular file below the folder of the file that names it,
//! and no link may lead out of that folder.

use std::fs::File;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Opens the file `name`, a relative path that a file in `folder` contains. On Linux, one system call resolves the
/// path below the folder, so that no other process can insert a link meanwhile. On other systems each component of
/// the path is checked, and none may be a link. The function does not wait for pipes or devices.
///
/// # Errors
/// When the name leads out of the folder or is not that of a regular file, or when the file cannot be opened.
pub fn open_beneath(folder: &Path, name: &Path) -> io::Result<File> {
    let name = plain(name).ok_or_else(leads_out)?;
    let file = open(or_here(folder), &name)?;
    let metadata = file.metadata()?;
    match metadata.is_file() {
        true => Ok(file),
        false => Err(no_file()),
    }
}

/// The directory in which the file `name` is to be written, below `folder`. No component of it is a link; components
/// that do not exist yet are allowed.
///
/// # Errors
/// When the name leads out of the folder, or a component is a link or is not a directory.
pub fn parent_beneath(folder: &Path, name: &Path) -> io::Result<PathBuf> {
    let name = plain(name).ok_or_else(leads_out)?;
    let mut path = folder.to_owned();
    for part in name.parent().into_iter().flat_map(Path::components) {
        path.push(part);
        match std::fs::symlink_metadata(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
            Ok(found) if found.is_symlink() => return Err(leads_out()),
            Ok(found) if !found.is_dir() => {
                return Err(io::Error::from(io::ErrorKind::NotADirectory));
            }
            Ok(_) => {}
        }
    }
    Ok(path)
}

/// Whether a name stays below the folder of the file that contains it. This is judged by the name alone; links are
/// not looked up.
#[must_use]
pub fn is_beneath(name: &str) -> bool {
    plain(Path::new(name)).is_some()
}

/// Whether an error of this module's functions means that the name leads out of the folder, or is not that of a
/// regular file.
#[must_use]
pub fn is_refused(error: &io::Error) -> bool {
    error
        .get_ref()
        .is_some_and(<dyn std::error::Error + Send + Sync>::is::<OpenRefusal>)
}

#[derive(Debug, thiserror::Error)]
enum OpenRefusal {
    #[error("leads out of its folder and is not followed; put the file itself into the folder")]
    LeadsOut,
    #[error("is not a regular file; give a file")]
    NoFile,
}

pub(crate) fn leads_out() -> io::Error {
    io::Error::other(OpenRefusal::LeadsOut)
}

fn no_file() -> io::Error {
    io::Error::other(OpenRefusal::NoFile)
}

/// The name without `.` and `..`; `None` if it is absolute, is empty or leads out of the folder.
pub(crate) fn plain(name: &Path) -> Option<PathBuf> {
    let mut path = PathBuf::new();
    for part in name.components() {
        match part {
            Component::Normal(part) => path.push(part),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            Component::ParentDir | Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    (!path.as_os_str().is_empty()).then_some(path)
}

pub(crate) fn or_here(folder: &Path) -> &Path {
    match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    }
}

#[cfg(target_os = "linux")]
fn open(folder: &Path, name: &Path) -> io::Result<File> {
    use rustix::fs::{Mode, OFlags, ResolveFlags, open, openat2};
    use rustix::io::Errno;

    let root = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
    let root = open(folder, root, Mode::empty())?;
    // `NONBLOCK`: without it, opening a pipe would wait for the pipe's writer.
    let flags = OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NONBLOCK | OFlags::NOCTTY;
    let resolve = ResolveFlags::BENEATH | ResolveFlags::NO_MAGICLINKS;
    for _ in 0..100 {
        match openat2(&root, name, flags, Mode::empty(), resolve) {
            Ok(file) => return Ok(File::from(file)),
            // A part of the path was renamed while it was opened: try again.
            Err(Errno::AGAIN) => {}
            Err(Errno::XDEV | Errno::LOOP) => return Err(leads_out()),
            // The name is that of a socket, or of a device without a driver.
            Err(Errno::NXIO | Errno::NODEV) => return Err(no_file()),
            // The call does not exist before Linux 5.6, and some sandboxes forbid it.
            Err(Errno::NOSYS | Errno::PERM) => break,
            Err(error) => return Err(error.into()),
        }
    }
    open_by_steps(folder, name)
}

#[cfg(not(target_os = "linux"))]
fn open(folder: &Path, name: &Path) -> io::Result<File> {
    open_by_steps(folder, name)
}

/// Opens a file after checking each component of its path.
fn open_by_steps(folder: &Path, name: &Path) -> io::Result<File> {
    let path = parent_beneath(folder, name)?;
    let Some(name) = name.file_name() else {
        return Err(leads_out());
    };
    let path = path.join(name);
    let found = std::fs::symlink_metadata(&path)?;
    if found.is_symlink() {
        return Err(leads_out());
    }
    // The type is checked before opening, because opening a pipe waits for its writer.
    if !found.is_file() {
        return Err(no_file());
    }
    File::open(path)
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    type Open = fn(&Path, &Path) -> io::Result<File>;

    /// As the system has it, and by steps.
    const IMPLEMENTATIONS: [(&str, Open); 2] = [
        ("the system", open_beneath),
        ("by steps", |folder, name| {
            let name = plain(name).ok_or_else(leads_out)?;
            open_by_steps(or_here(folder), &name)
        }),
    ];

    fn content(file: io::Result<File>) -> String {
        let mut text = String::new();
        file.unwrap().read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn files_beneath_are_opened_and_no_others() {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path().join("folder");
        std::fs::create_dir_all(folder.join("deep")).unwrap();
        std::fs::write(folder.join("deep/a"), "beneath").unwrap();
        std::fs::write(directory.path().join("secret"), "outside").unwrap();
        let absolute = directory.path().join("secret");
        for (implementation, open) in IMPLEMENTATIONS {
            for name in ["deep/a", "./deep/a", "deep/../deep/a", "deep//a"] {
                assert_eq!(
                    content(open(&folder, Path::new(name))),
                    "beneath",
                    "{implementation}"
                );
            }
            let outside = [
                "../secret",
                "deep/../../secret",
                "..",
                ".",
                "",
                absolute.to_str().unwrap(),
            ];
            for name in outside {
                let error = open(&folder, Path::new(name)).unwrap_err();
                assert!(is_refused(&error), "{implementation}, {name}: {error}");
            }
            assert!(is_refused(&open(&folder, Path::new("deep")).unwrap_err()));
            let missing = open(&folder, Path::new("deep/b")).unwrap_err();
            assert_eq!(missing.kind(), io::ErrorKind::NotFound, "{implementation}");
        }
        assert!(is_beneath("deep/a") && !is_beneath("../a") && !is_beneath("/a"));
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_out_pipes_and_devices_are_refused() {
        use std::os::unix::fs::symlink;

        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path().join("folder");
        std::fs::create_dir_all(folder.join("deep")).unwrap();
        std::fs::write(directory.path().join("secret"), "outside").unwrap();
        symlink("../secret", folder.join("up")).unwrap();
        symlink(directory.path().join("secret"), folder.join("absolute")).unwrap();
        symlink(directory.path(), folder.join("out")).unwrap();
        symlink("/dev/zero", folder.join("zeros")).unwrap();
        symlink("/proc/self/root/etc/passwd", folder.join("magic")).unwrap();
        symlink("circle", folder.join("circle")).unwrap();
        let pipe = std::process::Command::new("mkfifo")
            .arg(folder.join("pipe"))
            .status();
        assert!(pipe.unwrap().success());
        let _socket = std::os::unix::net::UnixListener::bind(folder.join("socket")).unwrap();
        let names = [
            "up",
            "absolute",
            "out/secret",
            "zeros",
            "magic",
            "circle",
            "pipe",
            "socket",
        ];
        for (implementation, open) in IMPLEMENTATIONS {
            for name in names {
                let error = open(&folder, Path::new(name)).unwrap_err();
                assert!(is_refused(&error), "{implementation}, {name}: {error}");
            }
        }
        assert!(parent_beneath(&folder, Path::new("out/new")).is_err());
        assert!(parent_beneath(&folder, Path::new("deep/new")).is_ok());
    }
}
