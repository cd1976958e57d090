//! Data that is kept from process to process in the user's cache directory: the driver's compiled kernels, and
//! results of checks and measurements of devices. The cache is optional: errors in writing are ignored, and files
//! that cannot be read or are damaged count as missing.

use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{Read as _, Write as _};
#[cfg(test)]
use std::path::Path;
use std::path::PathBuf;
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};

/// The environment variable with the directory; an empty value disables the cache.
pub(crate) const VARIABLE: &str = "TUMBLE_CACHE_DIR";

/// The first bytes of every file, which are followed by the checksum of the rest.
const MARK: &[u8] = b"tumble cache 1\n";

/// A directory with files that this and other processes read and replace at any time.
///
/// It is `TUMBLE_CACHE_DIR`, else `tumble` in `XDG_CACHE_HOME`, in `~/.cache` (macOS:
/// `~/Library/Caches`), or in `LOCALAPPDATA` on Windows.
#[derive(Debug, Clone)]
pub(crate) struct Cache {
    /// `None` if the cache is disabled.
    folder: Option<PathBuf>,
}

impl Cache {
    /// The cache that the environment variables define.
    pub(crate) fn of_user() -> Self {
        let folder = folder(|name| env::var_os(name));
        Self { folder }
    }

    /// A cache in a directory, which is made when something is written.
    #[cfg(test)]
    pub(crate) fn within(folder: &Path) -> Self {
        let folder = Some(folder.to_owned());
        Self { folder }
    }

    /// The contents that were last written under a name, which is a file's name without a folder. `None` if there is
    /// no such file, it is longer than `max_bytes`, or it is damaged. The contents may come from another version,
    /// another machine or an attacker; the caller must check them.
    pub(crate) fn read(&self, name: &str, max_bytes: usize) -> Option<Vec<u8>> {
        let path = self.path(name)?;
        // What is no file might never end.
        if !fs::metadata(&path).ok()?.is_file() {
            return None;
        }
        let head = MARK.len() + size_of::<u64>();
        let limit = head.checked_add(max_bytes)?.checked_add(1)?;
        let mut bytes = Vec::new();
        let file = File::open(path).ok()?;
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
            fs::create_dir_all(path.parent()?).ok()?;
            let mut file = File::create_new(&temporary).ok()?;
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

/// The directory that environment variables define.
fn folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(named) = variable(VARIABLE) {
        return (!named.is_empty()).then(|| named.into());
    }
    // Relative paths mean nothing here, as the XDG base directory specification says.
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
        // No part is left behind.
        let path = cache.path("kernels").unwrap();
        let names = fs::read_dir(path.parent().unwrap()).unwrap();
        assert_eq!(names.count(), 2);
    }

    /// A file that was cut, changed, put under another name, or is none.
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
        // Where nothing can be written nothing happens.
        let nowhere = Cache::within(Path::new("/dev/null/tumble"));
        assert!(!nowhere.write("one", b"") && nowhere.read("one", 1).is_none());
        let off = Cache { folder: None };
        assert!(!off.write("one", b"") && off.read("one", 1).is_none());
    }
}
