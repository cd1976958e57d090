//! Data that is kept from process to process in the user's cache directory: the driver's compiled kernels, and
//! results of checks and measurements of devices. The cache is optional: errors in writing are ignored, and files
//! that cannot be read or are damaged count as missing.

use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::machine::options::CacheFiles;

/// The environment variable with the directory; an empty value disables the cache.
pub(crate) const VARIABLE: &str = "TUMBLE_CACHE_DIR";

/// The first bytes of every file, which are followed by the checksum of the rest.
const MARK: &[u8] = b"tumble cache 1\n";

/// A directory with files that this and other processes read and replace at any time.
///
/// It is `TUMBLE_CACHE_DIR`, else `tumble` in `XDG_CACHE_HOME`, in `~/.cache` (macOS:
/// `~/Library/Caches`), or in `LOCALAPPDATA` on Windows.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Cache {
    /// `None` if the cache is disabled.
    folder: Option<PathBuf>,
}

impl Cache {
    pub(crate) fn new(files: &CacheFiles) -> Self {
        let folder = match files {
            CacheFiles::OfUser => folder(|name| env::var_os(name)),
            CacheFiles::Within(folder) => Some(folder.clone()),
            CacheFiles::Off => None,
        };
        Self { folder }
    }

    /// A cache in a directory, which is made when something is written.
    #[cfg(test)]
    pub(crate) fn within(folder: &Path) -> Self {
        Self::new(&CacheFiles::Within(folder.to_owned()))
    }

    /// The contents that were last written under a name, which is a file's name without a folder. `None` if there is
    /// no such file, it is longer than `max_bytes`, it is damaged, or another user could have written it. The contents
    /// may come from another version or another machine; the caller must check them.
    pub(crate) fn read(&self, name: &str, max_bytes: usize) -> Option<Vec<u8>> {
        let path = self.path(name)?;
        // A pipe or a device might never end.
        if !fs::metadata(&path).ok()?.is_file() {
            return None;
        }
        let head = MARK.len() + size_of::<u64>();
        let limit = head.checked_add(max_bytes)?.checked_add(1)?;
        let mut bytes = Vec::new();
        let file = File::open(path).ok()?;
        if !is_trusted(&file.metadata().ok()?) {
            return None;
        }
        file.take(limit as u64).read_to_end(&mut bytes).ok()?;
        if bytes.len() == limit {
            return None;
        }
        let (stored_sum, contents) = bytes.strip_prefix(MARK)?.split_first_chunk()?;
        (u64::from_le_bytes(*stored_sum) == sum(name, contents)).then(|| contents.to_owned())
    }

    /// Replaces the file with this name atomically: other readers get the old or the new contents. Returns whether it
    /// was written, for tests.
    pub(crate) fn write(&self, name: &str, contents: &[u8]) -> bool {
        let Some(path) = self.path(name) else {
            return false;
        };
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let temporary = path.with_file_name(format!("{name}.{}.{number}.part", process::id()));
        let write = || {
            private_folder(path.parent()?).ok()?;
            let mut file = private_file(&temporary).ok()?;
            let written = [MARK, &sum(name, contents).to_le_bytes(), contents]
                .iter()
                .try_for_each(|part| file.write_all(part));
            drop(file);
            let replaced = written.and_then(|()| fs::rename(&temporary, &path));
            if replaced.is_err() {
                let _ = fs::remove_file(&temporary); // nothing more can be done
            }
            replaced.ok()
        };
        write().is_some()
    }

    fn path(&self, name: &str) -> Option<PathBuf> {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let is_plain = !name.is_empty() && !name.starts_with('.') && name.chars().all(is_plain);
        debug_assert!(is_plain, "{name}");
        Some(self.folder.as_ref()?.join(name)).filter(|_| is_plain)
    }
}

/// Whether only this process's user and the system's administrator could have written a file. This is required because
/// a driver gets the compiled kernels in the file. A checksum is no protection, because anyone can compute it.
#[cfg(unix)]
fn is_trusted(metadata: &fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    // If the process must not be dumped, `/proc/self` belongs to root, so the owner is read from its status.
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    is_private(metadata.uid(), metadata.mode(), effective_user(&status))
}

/// Whether a file's permissions let only its owner write it, and the owner is this user or the system's administrator.
/// If the user of the process is unknown, only the permissions count.
#[cfg(unix)]
fn is_private(owner: u32, mode: u32, user: Option<u32>) -> bool {
    let is_of_user = user.is_none_or(|user| [user, 0].contains(&owner));
    is_of_user && mode & 0o022 == 0
}

/// The user with whose rights a process runs, from its `/proc/self/status`: the second number of the line `Uid:`.
#[cfg(unix)]
fn effective_user(status: &str) -> Option<u32> {
    let users = status.lines().find_map(|line| line.strip_prefix("Uid:"))?;
    users.split_whitespace().nth(1)?.parse().ok()
}

#[cfg(not(unix))]
fn is_trusted(_: &fs::Metadata) -> bool {
    true
}

/// Creates a file that other users cannot write, also if the umask of the process would allow it.
fn private_file(path: &Path) -> std::io::Result<File> {
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)
}

/// Makes a folder, and those above it, that others cannot write.
fn private_folder(path: &Path) -> std::io::Result<()> {
    let mut folder = fs::DirBuilder::new();
    folder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut folder, 0o700);
    folder.create(path)
}

/// The directory that environment variables define.
fn folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(named) = variable(VARIABLE) {
        return (!named.is_empty()).then(|| named.into());
    }
    // The XDG base directory specification requires that relative paths are ignored.
    let absolute = |name: &str| {
        let path = PathBuf::from(variable(name)?);
        path.is_absolute().then_some(path)
    };
    let of_system = match env::consts::OS {
        "windows" => absolute("LOCALAPPDATA"),
        "macos" => absolute("HOME").map(|home| home.join("Library/Caches")),
        _ => absolute("HOME").map(|home| home.join(".cache")),
    };
    let all = absolute("XDG_CACHE_HOME").or(of_system)?;
    Some(all.join("tumble"))
}

/// A checksum (64-bit FNV-1a) that detects files which were cut short or overwritten. It does not protect against
/// intent.
pub(crate) fn sum(name: &str, contents: &[u8]) -> u64 {
    let all = name.bytes().chain(contents.iter().copied());
    all.fold(0xcbf2_9ce4_8422_2325, |sum, byte| {
        (sum ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(variables: &[(&str, &str)]) -> Option<PathBuf> {
        folder(|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| value.into())
        })
    }

    #[test]
    fn the_environment_says_where_it_is_and_may_turn_it_off() {
        let home = ("HOME", "/home/me");
        let xdg = ("XDG_CACHE_HOME", "/fast");
        let path = |text: &str| Some(PathBuf::from(text));
        assert_eq!(of(&[home, xdg, (VARIABLE, "here")]), path("here"));
        assert_eq!(of(&[home, xdg, (VARIABLE, "")]), None);
        assert_eq!(of(&[]), None);
        if cfg!(target_os = "linux") {
            assert_eq!(of(&[home, xdg]), path("/fast/tumble"));
            assert_eq!(of(&[home]), path("/home/me/.cache/tumble"));
            let relative = ("XDG_CACHE_HOME", "fast");
            assert_eq!(of(&[home, relative]), path("/home/me/.cache/tumble"));
            assert_eq!(of(&[("HOME", "")]), None);
        }
    }

    #[test]
    fn what_was_written_is_read_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::within(&folder.path().join("made/when/needed"));
        assert_eq!(cache.read("kernels", 100), None);
        assert!(cache.write("kernels", b"first") && cache.write("kernels", b"second"));
        assert_eq!(cache.read("kernels", 100).unwrap(), b"second");
        assert_eq!(cache.read("kernels", 6).unwrap(), b"second");
        assert_eq!(cache.read("kernels", 5), None);
        assert!(cache.write("nothing", b""));
        assert_eq!(cache.read("nothing", 0).unwrap(), b"");
        // No temporary file is left.
        let path = cache.path("kernels").unwrap();
        let names = fs::read_dir(path.parent().unwrap()).unwrap();
        assert_eq!(names.count(), 2);
    }

    /// Without `/proc`, as in some sandboxes, permissions are all that is known.
    #[cfg(unix)]
    #[test]
    fn a_file_counts_if_its_owner_may_be_trusted() {
        let status = "Name:\ttumble\nUid:\t1000\t1001\t1000\t1000\nGid:\t7\t7\t7\t7\n";
        assert_eq!(effective_user(status), Some(1001));
        assert_eq!(effective_user(""), None);
        for (owner, mode, user, is_trusted) in [
            (1001, 0o100_600, Some(1001), true),
            (0, 0o100_644, Some(1001), true),
            (1000, 0o100_600, Some(1001), false),
            (1001, 0o100_620, Some(1001), false),
            (1000, 0o100_600, None, true),
            (1000, 0o100_602, None, false),
        ] {
            let found = is_private(owner, mode, user);
            assert_eq!(found, is_trusted, "{owner} {mode:o} {user:?}");
        }
    }

    /// Files that others may write, or have written.
    #[cfg(unix)]
    #[test]
    fn what_another_user_could_have_written_is_not_there() {
        use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown};
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::within(&folder.path().join("made"));
        assert!(cache.write("one", b"contents"));
        let path = cache.path("one").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().mode() & 0o777;
        assert_eq!((mode(&path), mode(path.parent().unwrap())), (0o600, 0o700));
        for (mode, is_read) in [(0o644, true), (0o664, false), (0o602, false), (0o600, true)] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            assert_eq!(cache.read("one", 100).is_some(), is_read, "{mode:o}");
        }
        // Only root may change the owner of a file.
        if cfg!(target_os = "linux") && chown(&path, Some(54_321), None).is_ok() {
            assert_eq!(cache.read("one", 100), None);
            assert!(cache.write("one", b"again"), "it is replaced");
            assert_eq!(cache.read("one", 100).unwrap(), b"again");
        }
    }

    /// Catches a damaged file that is used: one that was cut, was changed, has another name, or is a folder.
    #[test]
    fn what_is_damaged_is_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::within(folder.path());
        assert!(cache.write("one", b"some contents"));
        let (path, other) = (cache.path("one").unwrap(), cache.path("two").unwrap());
        let sound = fs::read(&path).unwrap();
        fs::write(&other, &sound).unwrap();
        assert_eq!(cache.read("two", 100), None);
        for length in 0..sound.len() {
            fs::write(&path, &sound[..length]).unwrap();
            assert_eq!(cache.read("one", 100), None, "{length}");
            let mut changed = sound.clone();
            changed[length] ^= 1;
            fs::write(&path, changed).unwrap();
            assert_eq!(cache.read("one", 100), None, "{length}");
        }
        fs::write(&path, &sound).unwrap();
        assert_eq!(cache.read("one", 100).unwrap(), b"some contents");
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        assert_eq!(cache.read("one", 100), None);
        assert!(!cache.write("one", b"in the place of a folder"));
        // If nothing can be written, this is not an error.
        let nowhere = Cache::within(Path::new("/dev/null/tumble"));
        assert!(!nowhere.write("one", b"") && nowhere.read("one", 1).is_none());
        let off = Cache { folder: None };
        assert!(!off.write("one", b"") && off.read("one", 1).is_none());
    }
}
