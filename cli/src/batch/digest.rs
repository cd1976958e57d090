//! SHA-256 of what is read and written, as `sha256sum` prints it.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use sha2::{Digest as _, Sha256};
use tumble_formats::beneath::open_beneath;

use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::names;

/// A hash that grows with the bytes.
#[derive(Default)]
pub(crate) struct Digest {
    state: Sha256,
    bytes: u64,
}

impl Digest {
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        self.state.update(bytes);
        self.bytes += bytes.len() as u64;
    }

    /// Bytes so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// 64 hexadecimal digits.
    pub(crate) fn finish(self) -> String {
        let hash = self.state.finalize();
        hash.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// An input file and its hash. The file's identity is checked before and after reading, so that the hash
/// is that of the evaluated bytes.
pub(crate) struct InputFile {
    path: PathBuf,
    /// Its identity before reading; `None` where it cannot be read twice, as standard input and pipes.
    before: Option<Identity>,
    sha256: OnceLock<Option<String>>,
}

impl InputFile {
    /// Before it is read.
    pub(crate) fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            before: Identity::of(path),
            sha256: OnceLock::new(),
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Its hash, if it can be read twice. A file that cannot be read is reported when it is opened.
    pub(crate) fn sha256(&self) -> Option<&str> {
        let hash = || {
            self.before.as_ref()?;
            of_file(File::open(&self.path).ok()?).ok()
        };
        self.sha256.get_or_init(hash).as_deref()
    }

    /// Refuses an input that was replaced or changed since [`InputFile::new`].
    pub(crate) fn check_unchanged(&self) -> Result<(), Failure> {
        if self.before.is_none() || Identity::of(&self.path) == self.before {
            return Ok(());
        }
        let message = "changed while it was read; read it again when its writer is done";
        let name = names::input(&self.path);
        Err(Failure::new(ALL_INPUTS, format!("{name}: {message}")))
    }
}

/// Which file a path names, and when it changed last.
#[derive(Debug, PartialEq, Eq)]
struct Identity([i128; 6]);

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
        Self([
            metadata.dev().into(),
            metadata.ino().into(),
            metadata.len().into(),
            nanoseconds(metadata.mtime(), metadata.mtime_nsec()),
            nanoseconds(metadata.ctime(), metadata.ctime_nsec()),
            0,
        ])
    }

    #[cfg(not(unix))]
    fn new(metadata: &Metadata) -> Self {
        let since = |time: io::Result<std::time::SystemTime>| {
            let since = time.ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
            i128::try_from(since.as_nanos()).ok()
        };
        Self([
            metadata.len().into(),
            since(metadata.modified()).unwrap_or_default(),
            since(metadata.created()).unwrap_or_default(),
            0,
            0,
            0,
        ])
    }
}

/// Whether a file that a manifest in `folder` names has that many bytes and that hash.
pub(crate) fn is_whole(folder: &Path, name: &str, bytes: u64, sha256: &str) -> io::Result<bool> {
    let file = open_beneath(folder, Path::new(name))?;
    Ok(file.metadata()?.len() == bytes && of_file(file)? == sha256)
}

/// Of a whole file.
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

/// Of bytes in memory.
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

    /// The example of FIPS 180-4.
    #[test]
    fn abc_has_its_hash() {
        let hash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(of_bytes([&b"a"[..], b"bc"]), hash);
    }
}
