//! SHA-256 of what is read and written, as `sha256sum` prints it.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::arguments::input;

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

/// The hash of an input, where it can be read twice: not of standard input, nor of a pipe. What
/// cannot be read is told about when it is opened.
pub(crate) fn of_input(path: &Path) -> Option<String> {
    let is_file = !input::is_standard(path) && path.is_file();
    is_file.then(|| of_file(path).ok()).flatten()
}

/// Of a whole file.
pub(crate) fn of_file(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
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
