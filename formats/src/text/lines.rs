//! Text line by line: line ends, encodings, and characters that do not belong.

use std::io::{BufRead, Read};

use crate::diagnostic::{Code, Diagnostic, Place};
use crate::source::MAX_BYTES;

/// Lines of one input, with their numbers; what is remarkable about them collects
/// in `warnings`.
pub(crate) struct Lines<R> {
    file: String,
    reader: R,
    limits: Limits,
    buffer: Vec<u8>,
    /// The number of the line in `buffer`, from 1.
    pub(crate) number: u64,
    read: u64,
    crlf: u64,
    lf: u64,
    /// Whether the line in `buffer` ended with a line end.
    pub(crate) ended: bool,
    pub(crate) warnings: Vec<Diagnostic>,
}

/// How much of an input is read before it is refused.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Bytes of one line.
    pub line: u64,
    /// Bytes of the whole input.
    pub file: u64,
}

impl Default for Limits {
    /// 64 MiB and 16 GiB.
    fn default() -> Self {
        Self {
            line: 1 << 26,
            file: MAX_BYTES,
        }
    }
}

/// First bytes of formats that end up under the name `.dat`.
const SIGNATURES: [(&[u8], &str); 6] = [
    (b"\x1f\x8b", "gzip; unpack it first"),
    (b"\x93NUMPY", "NPY; export the keys as text"),
    (b"HIERARCHY", "BVH motion capture; convert its rotations"),
    (b"glTF", "binary glTF; convert its rotation tracks"),
    (b"{", "JSON, perhaps glTF; convert its rotation tracks"),
    (b"PK\x03\x04", "a ZIP archive; unpack it first"),
];

impl<R: BufRead> Lines<R> {
    /// Looks at the first bytes and skips a byte-order mark.
    pub(crate) fn new(file: &str, mut reader: R, limits: Limits) -> Result<Self, Diagnostic> {
        let start = reader
            .fill_buf()
            .map_err(|error| io_error(file, &error))?
            .to_vec();
        let mut lines = Self {
            file: file.to_owned(),
            reader,
            limits,
            buffer: Vec::new(),
            number: 0,
            read: 0,
            crlf: 0,
            lf: 0,
            ended: true,
            warnings: Vec::new(),
        };
        if let Some((_, name)) = SIGNATURES
            .iter()
            .find(|(bytes, _)| start.starts_with(bytes))
        {
            let message = format!("this looks like {name}");
            return Err(lines.refuse_whole(Code::OtherFormat, message));
        }
        if start.starts_with(b"\xff\xfe") || start.starts_with(b"\xfe\xff") {
            let message = "this is UTF-16; save it as UTF-8 or ASCII".to_owned();
            return Err(lines.refuse_whole(Code::Encoding, message));
        }
        if start.starts_with(b"\xef\xbb\xbf") {
            lines.reader.consume(3);
            lines.number = 1;
            lines.warn(1, Code::ByteOrderMark, "a byte-order mark; it is skipped");
            lines.number = 0;
        }
        Ok(lines)
    }

    /// The next line without its end; `None` at the end of the input. Give it back
    /// ([`Lines::reuse`]), and the one after it needs no memory of its own.
    pub(crate) fn next(&mut self) -> Result<Option<String>, Diagnostic> {
        self.buffer.clear();
        self.number += 1;
        let count = self
            .read_line()
            .map_err(|error| io_error(&self.file, &error))?;
        if count == 0 {
            return Ok(None);
        }
        self.read += count;
        if self.read > self.limits.file {
            let message = format!("the input is longer than {} bytes", self.limits.file);
            return Err(self.refuse(1, Code::FileTooLong, message));
        }
        self.ended = self.buffer.last() == Some(&b'\n');
        if !self.ended && count > self.limits.line {
            let message = format!("the line is longer than {} bytes", self.limits.line);
            return Err(self.refuse(1, Code::LineTooLong, message));
        }
        self.strip_line_end();
        self.check_characters()?;
        // ASCII by now, apart from what the check refused.
        let line = String::from_utf8(std::mem::take(&mut self.buffer));
        Ok(Some(line.unwrap_or_default()))
    }

    /// Takes back the memory of a line.
    pub(crate) fn reuse(&mut self, line: String) {
        self.buffer = line.into_bytes();
    }

    /// Appends bytes to the buffer, up to the end of a line or one more than a line may
    /// have; how many. The buffer grows by quarters: a long line is not held twice.
    fn read_line(&mut self) -> std::io::Result<u64> {
        let most = self.limits.line + 1;
        let mut count = 0;
        while count < most && self.buffer.last() != Some(&b'\n') {
            let room = self.buffer.capacity() - self.buffer.len();
            if room == 0 {
                self.buffer.reserve_exact((self.buffer.len() / 4).max(256));
            }
            let room = self.buffer.capacity() - self.buffer.len();
            let mut limited = self
                .reader
                .by_ref()
                .take(room.min((most - count) as usize) as u64);
            match limited.read_until(b'\n', &mut self.buffer)? {
                0 => break,
                read => count += read as u64,
            }
        }
        Ok(count)
    }

    /// A refusal at a column of the current line.
    pub(crate) fn refuse(&self, column: u64, code: Code, message: String) -> Diagnostic {
        Diagnostic {
            file: self.file.clone(),
            place: Some(Place::Text {
                line: self.number,
                column,
            }),
            code,
            message,
            count: 1,
        }
    }

    /// A refusal of the input as a whole.
    pub(crate) fn refuse_whole(&self, code: Code, message: String) -> Diagnostic {
        Diagnostic {
            place: None,
            ..self.refuse(1, code, message)
        }
    }

    /// Counts a warning; the first of each code keeps its place and words.
    pub(crate) fn warn(&mut self, column: u64, code: Code, message: impl Into<String>) {
        match self.warnings.iter_mut().find(|w| w.code == code) {
            Some(known) => known.count += 1,
            None => {
                let warning = self.refuse(column, code, message.into());
                self.warnings.push(warning);
            }
        }
    }

    fn strip_line_end(&mut self) {
        if !self.ended {
            return;
        }
        self.buffer.pop();
        if self.buffer.last() == Some(&b'\r') {
            self.buffer.pop();
            self.crlf += 1;
        } else {
            self.lf += 1;
        }
        if self.crlf.min(self.lf) == 1 && self.crlf.max(self.lf) >= 1 {
            let mixed = self.warnings.iter().any(|w| w.code == Code::MixedLineEnds);
            if !mixed {
                self.warn(1, Code::MixedLineEnds, "line ends are CR LF and LF, mixed");
            }
        }
    }

    fn check_characters(&self) -> Result<(), Diagnostic> {
        let plain = |&b: &u8| b == b'\t' || (b' '..=b'~').contains(&b);
        let Some(place) = self.buffer.iter().position(|b| !plain(b)) else {
            return Ok(());
        };
        let column = place as u64 + 1; // all before it is ASCII
        let rest = &self.buffer[place..];
        let character = match std::str::from_utf8(&rest[..rest.len().min(4)]) {
            Ok(text) => text.chars().next(),
            Err(error) => std::str::from_utf8(&rest[..error.valid_up_to()])
                .unwrap_or_default()
                .chars()
                .next(),
        };
        let (code, message) = match character {
            Some('\0') => (
                Code::Encoding,
                "a NUL byte; this is no text file".to_owned(),
            ),
            Some('\r') => {
                let message = "a carriage return inside the line; end lines with LF or CR LF";
                (Code::Character, message.to_owned())
            }
            Some('\u{a0}') => {
                let message = "a no-break space; use plain blanks between numbers";
                (Code::Character, message.to_owned())
            }
            Some(other) => {
                let point = other as u32;
                let message = format!("the character U+{point:04X} does not belong; remove it");
                (Code::Character, message)
            }
            None => {
                let message = format!("byte 0x{:02x} is no UTF-8; save the file as text", rest[0]);
                (Code::Encoding, message)
            }
        };
        Err(self.refuse(column, code, message))
    }
}

fn io_error(file: &str, error: &std::io::Error) -> Diagnostic {
    Diagnostic::new(file, Code::Open, format!("cannot be read: {error}"))
}

/// The tokens of a line with their columns, both from 1.
pub(crate) fn tokens(line: &str) -> impl Iterator<Item = (u64, &str)> {
    let start = line.as_ptr() as usize;
    line.split([' ', '\t'])
        .filter(|token| !token.is_empty())
        .map(move |token| ((token.as_ptr() as usize - start) as u64 + 1, token))
}
