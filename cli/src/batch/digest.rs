//! SHA-256 of inputs and results, as `sha256sum` prints it.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use sha2::{Digest as _, Sha256};
use tumble_formats::Limits;
use tumble_formats::beneath::open_beneath;
use tumble_formats::referred::{open_referred, referred_files};
use walkdir::WalkDir;

use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::names;

/// A hash that grows with the bytes.
#[derive(Default)]
pub(crate) struct Digest {
    state: Sha256,
}

impl Digest {
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        self.state.update(bytes);
    }

    /// 64 hexadecimal digits.
    pub(crate) fn finish(self) -> String {
        let hash = self.state.finalize();
        hash.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// An input and its hash, with the files that it refers to ([`referred_files`]). The identity of each file is checked
/// before and after reading, so that the hash is that of the evaluated bytes.
pub(crate) struct InputFile {
    path: PathBuf,
    /// Its identity before reading; `None` if it cannot be read twice, as standard input and pipes.
    before: Option<Identity>,
    /// The files that it refers to, relative to its folder, with their identities.
    referred: Vec<(PathBuf, Option<Identity>)>,
    sha256: OnceLock<Option<String>>,
}

impl InputFile {
    /// Identifies an input before it is read, within the limits of the program.
    pub(crate) fn new(path: &Path) -> Self {
        Self::within(path, Limits::default())
    }

    /// Before it is read. The files that it refers to are found within these limits; an input beyond them is refused
    /// when it is read.
    pub(crate) fn within(path: &Path, limits: Limits) -> Self {
        let before = Identity::of(path);
        let referred = match before {
            Some(_) => referred_files(path, limits),
            None => Vec::new(),
        };
        let identity = |name: PathBuf| (Identity::of(&folder(path).join(&name)), name);
        let referred = referred.into_iter().map(identity);
        Self {
            path: path.to_owned(),
            before,
            referred: referred.map(|(identity, name)| (name, identity)).collect(),
            sha256: OnceLock::new(),
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Its length with that of the files that it refers to; `None` if it cannot be read twice.
    pub(crate) fn bytes(&self) -> Option<u64> {
        let others = self
            .referred
            .iter()
            .filter_map(|(_, identity)| identity.as_ref());
        let all = std::iter::once(self.before.as_ref()?).chain(others);
        Some(all.map(|identity| identity.bytes).sum())
    }

    /// The input's hash, if it can be read twice. A file that cannot be read is reported when it is opened. If the
    /// input is one file, the hash is the SHA-256 of its bytes. If it is several files, it is the SHA-256 of a list as
    /// `sha256sum` prints it: the hash and the name of each file, the input first.
    pub(crate) fn sha256(&self) -> Option<&str> {
        let hash = || {
            self.before.as_ref()?;
            let of_input = of_file(File::open(&self.path).ok()?).ok()?;
            if self.referred.is_empty() {
                return Some(of_input);
            }
            let mut digest = Digest::default();
            digest.update(format!("{of_input}  \n").as_bytes());
            for (name, _) in &self.referred {
                let file = open_referred(folder(&self.path), name).and_then(of_file);
                let hash = file.unwrap_or_else(|_| "missing".to_owned());
                digest.update(format!("{hash}  {}\n", name.display()).as_bytes());
            }
            Some(digest.finish())
        };
        self.sha256.get_or_init(hash).as_deref()
    }

    /// Refuses an input that was replaced or changed since [`InputFile::new`], or one of its files.
    pub(crate) fn check_unchanged(&self) -> Result<(), Failure> {
        let mut referred = self.referred.iter();
        let is_changed = |path: &Path, before: &Option<Identity>| Identity::of(path) != *before;
        let changed = match &self.before {
            Some(_) if is_changed(&self.path, &self.before) => Some(self.path.clone()),
            _ => referred.find_map(|(name, before)| {
                let path = folder(&self.path).join(name);
                is_changed(&path, before).then_some(path)
            }),
        };
        let Some(changed) = changed else {
            return Ok(());
        };
        let message =
            "changed while it was read; try again when the other program has finished writing it";
        let name = names::input(&changed);
        Err(Failure::new(ALL_INPUTS, format!("{name}: {message}")))
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// The hash of all files that end in `extension` in a folder and in the folders in it, with their names.
pub(crate) fn of_folder(folder: &Path, extension: &str) -> String {
    let walk = WalkDir::new(folder).follow_links(true).max_depth(2);
    let mut digest = Digest::default();
    for entry in walk.sort_by_file_name().into_iter().flatten() {
        let ending = entry.path().extension().unwrap_or_default();
        if entry.file_type().is_file() && ending.eq_ignore_ascii_case(extension) {
            let name = entry.path().strip_prefix(folder).unwrap_or(entry.path());
            let hash = File::open(entry.path()).and_then(of_file);
            let hash = hash.unwrap_or_else(|_| "missing".to_owned());
            digest.update(format!("{hash}  {}\n", name.display()).as_bytes());
        }
    }
    digest.finish()
}

/// Which file a path names, and when it changed last.
#[derive(Debug, PartialEq, Eq)]
struct Identity {
    bytes: u64,
    /// The numbers by which the system distinguishes two files, or two states of one file.
    marks: [i128; 4],
}

impl Identity {
    fn of(path: &Path) -> Option<Self> {
        if names::is_standard(path) {
            return None;
        }
        let metadata = std::fs::metadata(path).ok()?;
        metadata.is_file().then(|| Self::new(&metadata))
    }

    #[cfg(unix)]
    fn new(metadata: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        let nanoseconds =
            |seconds: i64, rest: i64| i128::from(seconds) * 1_000_000_000 + i128::from(rest);
        Self {
            bytes: metadata.len(),
            marks: [
                metadata.dev().into(),
                metadata.ino().into(),
                nanoseconds(metadata.mtime(), metadata.mtime_nsec()),
                nanoseconds(metadata.ctime(), metadata.ctime_nsec()),
            ],
        }
    }

    #[cfg(not(unix))]
    fn new(metadata: &Metadata) -> Self {
        let since = |time: io::Result<std::time::SystemTime>| {
            let since = time.ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
            i128::try_from(since.as_nanos()).ok()
        };
        let modified = since(metadata.modified()).unwrap_or_default();
        let created = since(metadata.created()).unwrap_or_default();
        Self {
            bytes: metadata.len(),
            marks: [modified, created, 0, 0],
        }
    }
}

/// Whether a file that a manifest in `folder` names has that many bytes and that hash.
pub(crate) fn is_whole(folder: &Path, name: &str, bytes: u64, sha256: &str) -> io::Result<bool> {
    let file = open_beneath(folder, Path::new(name))?;
    Ok(file.metadata()?.len() == bytes && of_file(file)? == sha256)
}

/// Whether a link stands where a manifest in `folder` names a file.
pub(crate) fn is_link(folder: &Path, name: &str) -> bool {
    folder.join(name).is_symlink()
}

/// The SHA-256 of a whole file.
fn of_file(mut file: File) -> io::Result<String> {
    let mut digest = Digest::default();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(digest.finish()),
            Ok(read) => digest.update(&buffer[..read]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// The SHA-256 of bytes in memory.
pub(crate) fn of_bytes<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut digest = Digest::default();
    for piece in pieces {
        digest.update(piece);
    }
    digest.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A glTF with its buffer beside it is two files, and the clips depend on both.
    #[test]
    fn an_input_is_all_files_that_it_refers_to() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("walk.gltf");
        let other = directory.path().join("key 1.bin");
        let text =
            r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":3,"uri":"key%201.bin"}]}"#;
        std::fs::write(&path, text).unwrap();
        let hash = || InputFile::new(&path).sha256().unwrap().to_owned();
        let without = hash();
        std::fs::write(&other, "abc").unwrap();
        let input = InputFile::new(&path);
        let of_both = format!(
            "{}  \n{}  key 1.bin\n",
            of_bytes([text.as_bytes()]),
            of_bytes([&b"abc"[..]])
        );
        assert_eq!(input.sha256().unwrap(), of_bytes([of_both.as_bytes()]));
        assert_eq!(input.bytes(), Some(text.len() as u64 + 3));
        assert!(input.check_unchanged().is_ok());
        let with = hash();
        std::fs::write(&other, "abcd").unwrap();
        assert!(input.check_unchanged().is_err());
        let hashes = [without, with, hash()];
        assert!(
            hashes[0] != hashes[1] && hashes[1] != hashes[2],
            "{hashes:?}"
        );
        // An input above the limits is not searched for files that it refers to.
        let limits = Limits {
            file: 8,
            ..Limits::default()
        };
        let limited = InputFile::within(&path, limits);
        assert_eq!(limited.bytes(), Some(text.len() as u64));
        // One file alone is hashed as `sha256sum` does.
        std::fs::write(&path, "abc").unwrap();
        assert_eq!(hash(), of_bytes([&b"abc"[..]]));
    }

    /// The example of FIPS 180-4.
    #[test]
    fn abc_has_its_hash() {
        let hash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(of_bytes([&b"a"[..], b"bc"]), hash);
    }
}
