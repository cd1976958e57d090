//! Opens inputs, and checks the kind of a path (file, directory, pipe, device) before a byte is read.

use std::fs::{File, Metadata};
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

use crate::beneath::{is_refused, open_beneath};
use crate::diagnostic::{Code, Diagnostic};

/// An open input. Its length and modification time are compared at the start and at the end.
pub(super) struct Source {
    pub(super) name: String,
    pub(super) reader: BufReader<Box<dyn Read>>,
    file: Option<(Arc<File>, Metadata)>,
}

impl Source {
    /// Opens an input; `-` is standard input. A named pipe is opened only if `pipes` is set.
    pub(super) fn open(path: &Path, pipes: bool) -> Result<Self, Diagnostic> {
        let name = path.display().to_string();
        let refuse = |code, message: String| Diagnostic::new(&name, code, message);
        let unreadable = |error: io::Error| refuse(Code::Open, format!("cannot be read: {error}"));
        if path.as_os_str() == "-" {
            let reader: Box<dyn Read> = Box::new(io::stdin().lock());
            return Ok(Self {
                name: "standard input".to_owned(),
                reader: BufReader::with_capacity(BUFFER, reader),
                file: None,
            });
        }
        // The type is checked before opening, because opening a pipe waits for its writer.
        let metadata = std::fs::metadata(path).map_err(unreadable)?;
        let kind = file_kind(&metadata);
        let readable = kind == "a file" || kind == "a named pipe" && pipes;
        if !readable {
            let hint = if kind == "a named pipe" {
                "; give `-` and send it to standard input"
            } else {
                "; give a file"
            };
            return Err(refuse(Code::NotAFile, format!("is {kind}{hint}")));
        }
        let file = File::open(path).map_err(unreadable)?;
        Self::of_file(file, name.clone()).map_err(unreadable)
    }

    /// Opens a file and reads it by a function, which gets the name for messages. Refuses the file if it is empty, or
    /// was changed meanwhile.
    pub(super) fn read_by<T>(
        path: &Path,
        pipes: bool,
        read: impl FnOnce(&str, &mut BufReader<Box<dyn Read>>) -> Result<T, Diagnostic>,
    ) -> Result<T, Diagnostic> {
        let mut source = Self::open(path, pipes)?;
        if source.reader.fill_buf().is_ok_and(<[u8]>::is_empty) {
            return Err(Diagnostic::empty(source.name));
        }
        let found = read(&source.name, &mut source.reader)?;
        source.check_unchanged()?;
        Ok(found)
    }

    /// Opens a file that a file in `folder` names; see [`open_beneath`].
    pub(super) fn open_beneath(folder: &Path, named: &Path) -> Result<Self, Diagnostic> {
        let name = folder.join(named).display().to_string();
        let unreadable = |error: io::Error| match is_refused(&error) {
            true => Diagnostic::new(&name, Code::Uri, error.to_string()),
            false => Diagnostic::new(&name, Code::Open, format!("cannot be read: {error}")),
        };
        let file = open_beneath(folder, named).map_err(unreadable)?;
        Self::of_file(file, name.clone()).map_err(unreadable)
    }

    fn of_file(file: File, name: String) -> io::Result<Self> {
        let metadata = file.metadata()?;
        let file = Arc::new(file);
        let reader: Box<dyn Read> = Box::new(Arc::clone(&file));
        Ok(Self {
            name,
            reader: BufReader::with_capacity(BUFFER, reader),
            file: metadata.is_file().then_some((file, metadata)),
        })
    }

    /// The first bytes of a file, up to 512; none if it is not a file or cannot be read, which opening it reports.
    /// The first bytes of standard input stay in its buffer for the reader.
    pub(super) fn start(path: &Path) -> Vec<u8> {
        if path.as_os_str() == "-" {
            let mut input = io::stdin().lock();
            let start = input.fill_buf().unwrap_or_default();
            return start[..start.len().min(START)].to_vec();
        }
        let mut start = Vec::new();
        let is_file = std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file());
        if is_file && let Ok(file) = File::open(path) {
            let read = file.take(START as u64).read_to_end(&mut start);
            if read.is_err() {
                start.clear();
            }
        }
        start
    }

    /// All bytes of a file that is not longer than `limit`.
    ///
    /// # Errors
    /// When reading fails, when the file is longer or empty, or when it changes meanwhile.
    pub(super) fn into_bytes(mut self, limit: u64) -> Result<Vec<u8>, Diagnostic> {
        let known = self.file.as_ref().map_or(0, |(_, metadata)| metadata.len());
        let refuse = |code, message: String| Diagnostic::new(&self.name, code, message);
        let too_long = || {
            refuse(
                Code::FileTooLong,
                format!("the input is longer than {limit} bytes"),
            )
        };
        if known > limit {
            return Err(too_long());
        }
        let mut bytes = Vec::new();
        let reserved = bytes.try_reserve_exact(known as usize);
        let read = reserved.map_err(io::Error::from).and_then(|()| {
            // First the bytes in the buffer. The other bytes are read without the buffer, which would copy them once
            // more.
            bytes.extend_from_slice(self.reader.buffer());
            let rest = (limit + 1).saturating_sub(bytes.len() as u64);
            self.reader.get_mut().take(rest).read_to_end(&mut bytes)
        });
        read.map_err(|error| refuse(Code::Open, format!("cannot be read: {error}")))?;
        if bytes.len() as u64 > limit {
            return Err(too_long());
        }
        self.check_unchanged()?;
        match bytes.is_empty() {
            true => Err(Diagnostic::empty(self.name)),
            false => Ok(bytes),
        }
    }

    /// Refuses a file that was changed while it was read.
    pub(super) fn check_unchanged(&self) -> Result<(), Diagnostic> {
        let Some((file, before)) = &self.file else {
            return Ok(());
        };
        let after = file.metadata();
        let same = after.is_ok_and(|after| {
            after.len() == before.len() && after.modified().ok() == before.modified().ok()
        });
        if same {
            return Ok(());
        }
        let message =
            "changed while it was read; try again when the other program has finished writing it";
        Err(Diagnostic::new(&self.name, Code::Changed, message))
    }
}

/// The first bytes of data that zstd compressed.
pub(super) const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// How many first bytes are enough to recognise a format.
pub(super) const START: usize = 512;

/// Size of the buffer, large enough for the cost of system calls not to matter.
const BUFFER: usize = 1 << 18;

/// The length above which an input is refused, unless the caller raises the limit.
pub(super) const MAX_BYTES: u64 = 16 << 30;

/// The kind of entry that a path names, in words: `a file`, `a directory`, `a named pipe`, `a socket` or `a device`.
#[cfg(unix)]
#[must_use]
pub fn file_kind(metadata: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    let kind = metadata.file_type();
    if kind.is_dir() {
        "a directory"
    } else if kind.is_fifo() {
        "a named pipe"
    } else if kind.is_socket() {
        "a socket"
    } else if kind.is_char_device() || kind.is_block_device() {
        "a device"
    } else {
        "a file"
    }
}

/// The kind of entry that a path names, in words: `a file` or `a directory`.
#[cfg(not(unix))]
#[must_use]
pub fn file_kind(metadata: &Metadata) -> &'static str {
    if metadata.is_dir() {
        "a directory"
    } else {
        "a file"
    }
}
