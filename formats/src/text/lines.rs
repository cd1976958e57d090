//! Reads text line by line: line ends, encodings, and characters that do not belong in it.

use std::io::{BufRead, Read};

use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::foreign;
use crate::limits::Limits;
use crate::text::last_number::{self, LastNumbers};

/// The lines of one input, with their numbers; warnings about them are collected in `warnings`.
pub(crate) struct Lines<R> {
    file: String,
    reader: R,
    limits: Limits,
    /// Whether the text may contain names and comments in any language, not only numbers.
    names: bool,
    buffer: Vec<u8>,
    /// The number of the line in `buffer`, from 1.
    pub(crate) number: u64,
    read: u64,
    crlf: u64,
    lf: u64,
    /// Whether the line in `buffer` has a line end.
    pub(crate) ended: bool,
    last_numbers: LastNumbers,
    pub(crate) warnings: Vec<Diagnostic>,
    /// [`Limits::memory`]; `None` if there is no such limit.
    budget: Option<Budget>,
}

/// The bytes that a number takes at least: keys are f32.
const NUMBER: usize = 4;

/// The byte-order mark of UTF-8.
const MARK: &[u8] = b"\xef\xbb\xbf";

impl<R: BufRead> Lines<R> {
    /// For text of numbers. Checks the first bytes and skips a byte-order mark.
    pub(crate) fn new(file: &str, reader: R, limits: Limits) -> Result<Self, Diagnostic> {
        let (mut lines, start) = Self::start(file, reader, limits)?;
        if let Some(description) = foreign::description(file, &start) {
            let message = format!("this looks like {description}");
            return Err(lines.refuse_whole(Code::OtherFormat, message));
        }
        if start.starts_with(MARK) {
            lines.number = 1;
            lines.warn(1, Code::ByteOrderMark, "a byte-order mark; it is ignored");
            lines.number = 0;
        }
        Ok(lines)
    }

    /// For text with names or comments, in which letters of any language may occur, and a byte-order mark, which
    /// announces them.
    pub(crate) fn with_names(file: &str, reader: R, limits: Limits) -> Result<Self, Diagnostic> {
        let (mut lines, _) = Self::start(file, reader, limits)?;
        lines.names = true;
        Ok(lines)
    }

    /// The lines after a byte-order mark, and the first bytes with it.
    fn start(file: &str, mut reader: R, limits: Limits) -> Result<(Self, Vec<u8>), Diagnostic> {
        let start = reader
            .fill_buf()
            .map_err(|error| io_error(file, &error))?
            .to_vec();
        if start.starts_with(MARK) {
            reader.consume(MARK.len());
        }
        let lines = Self {
            file: file.to_owned(),
            reader,
            limits,
            names: false,
            buffer: Vec::new(),
            number: 0,
            read: 0,
            crlf: 0,
            lf: 0,
            ended: true,
            last_numbers: LastNumbers::default(),
            warnings: Vec::new(),
            // Without a limit, the length of text limits the memory for its numbers.
            budget: limits.memory.map(|_| Budget::of(0, limits)),
        };
        if start.starts_with(b"\xff\xfe") || start.starts_with(b"\xfe\xff") {
            let message = "this is UTF-16; save it as UTF-8 or ASCII".to_owned();
            return Err(lines.refuse_whole(Code::Encoding, message));
        }
        Ok((lines, start))
    }

    /// The input's name in messages.
    pub(crate) fn file(&self) -> &str {
        &self.file
    }

    /// The next line without its end; `None` at the end of the input. Return the line by [`Lines::reuse`]; the next
    /// one then needs no new memory.
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
            return Err(self.refuse_whole(Code::FileTooLong, message));
        }
        self.ended = self.buffer.last() == Some(&b'\n');
        if !self.ended && count > self.limits.line {
            let message = format!("the line is longer than {} bytes", self.limits.line);
            return Err(self.refuse(1, Code::LineTooLong, message));
        }
        if !self.ended && self.buffer.last() == Some(&b'\r') {
            // The input ends between the two bytes of its last line end, so all numbers are whole.
            self.buffer.push(b'\n');
            self.ended = true;
        }
        self.strip_line_end();
        self.check_characters()?;
        match self.ended {
            true => self.last_numbers.add(&self.buffer),
            false => {
                if let Some(column) = self.last_numbers.cut(&self.buffer) {
                    self.warn(column, Code::MaybeCut, last_number::MESSAGE);
                }
            }
        }
        if let Some(budget) = &self.budget {
            let is_between = |byte: &u8| byte.is_ascii_whitespace() || *byte == b',';
            let words = self.buffer.split(is_between);
            let charged = budget.take(words.filter(|word| !word.is_empty()).count(), NUMBER);
            charged.map_err(|error| self.refuse_whole(Code::Memory, error.to_string()))?;
        }
        // The bytes are valid text here, because the check refuses everything else.
        let line = String::from_utf8(std::mem::take(&mut self.buffer));
        Ok(Some(line.unwrap_or_default()))
    }

    /// Reuses the memory of a line.
    pub(crate) fn reuse(&mut self, line: String) {
        self.buffer = line.into_bytes();
    }

    /// Appends bytes to the buffer, up to the end of a line or to one more than a line may have; returns how many.
    /// The buffer grows by quarters, so that a long line is not copied to twice its memory.
    fn read_line(&mut self) -> std::io::Result<u64> {
        let limit = self.limits.line + 1;
        let mut count = 0;
        while count < limit && self.buffer.last() != Some(&b'\n') {
            let room = self.buffer.capacity() - self.buffer.len();
            if room == 0 {
                self.buffer.reserve_exact((self.buffer.len() / 4).max(256));
            }
            let room = self.buffer.capacity() - self.buffer.len();
            let mut limited = self
                .reader
                .by_ref()
                .take(room.min((limit - count) as usize) as u64);
            match limited.read_until(b'\n', &mut self.buffer)? {
                0 => break,
                read => count += read as u64,
            }
        }
        Ok(count)
    }

    /// An error at a column of the current line.
    pub(crate) fn refuse(&self, column: u64, code: Code, message: String) -> Diagnostic {
        Diagnostic {
            file: self.file.clone(),
            location: Some(Location::Text {
                line: self.number,
                column,
            }),
            code,
            message,
            count: 1,
        }
    }

    /// An error about the input as a whole.
    pub(crate) fn refuse_whole(&self, code: Code, message: String) -> Diagnostic {
        Diagnostic {
            location: None,
            ..self.refuse(1, code, message)
        }
    }

    /// An error at the end of the input: on the last line, unless that has a line end.
    pub(crate) fn refuse_end(&self, code: Code, message: String) -> Diagnostic {
        let mut refusal = self.refuse(1, code, message);
        if let Some(Location::Text { line, .. }) = &mut refusal.location {
            *line -= u64::from(!self.ended);
        }
        refusal
    }

    /// Counts a warning; the first of each code determines the location and the message.
    pub(crate) fn warn(&mut self, column: u64, code: Code, message: impl Into<String>) {
        if !self.counts_again(code) {
            let warning = self.refuse(column, code, message.into());
            self.warnings.push(warning);
        }
    }

    /// As [`Lines::warn`], about an earlier line as a whole.
    pub(crate) fn warn_line(&mut self, line: u64, code: Code, message: impl Into<String>) {
        if !self.counts_again(code) {
            let warning = Diagnostic {
                location: Some(Location::Text { line, column: 1 }),
                ..self.refuse(1, code, message.into())
            };
            self.warnings.push(warning);
        }
    }

    /// Counts a warning of a code that is known.
    fn counts_again(&mut self, code: Code) -> bool {
        let mut known = self.warnings.iter_mut();
        let known = known.find(|known| known.code == code);
        known.map(|known| known.count += 1).is_some()
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

    /// The offset of the first character that does not belong in the line.
    fn first_odd(&self) -> Option<usize> {
        // Without a branch for each byte the compiler compares many at once.
        let all_plain = |bytes: &[u8]| bytes.iter().fold(true, |all, &byte| all & is_plain(byte));
        let block = self.buffer.chunks(64).position(|block| !all_plain(block))?;
        let first = 64 * block;
        let plain = self.buffer[first..]
            .iter()
            .take_while(|&&byte| is_plain(byte));
        let first = first + plain.count();
        if !self.names {
            return Some(first);
        }
        let (text, valid) = match std::str::from_utf8(&self.buffer[first..]) {
            Ok(text) => (text, None),
            Err(error) => {
                let text = std::str::from_utf8(&self.buffer[first..][..error.valid_up_to()]);
                (text.unwrap_or_default(), Some(first + error.valid_up_to()))
            }
        };
        let mut odd = text.char_indices().filter(|&(_, c)| match u8::try_from(c) {
            Ok(byte) if c.is_ascii() => !is_plain(byte),
            _ => c.is_control() || c.is_whitespace(),
        });
        odd.next().map(|(index, _)| first + index).or(valid)
    }

    fn check_characters(&self) -> Result<(), Diagnostic> {
        let Some(offset) = self.first_odd() else {
            return Ok(());
        };
        let before = String::from_utf8_lossy(&self.buffer[..offset]);
        let column = before.chars().count() as u64 + 1;
        let rest = &self.buffer[offset..];
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
                "a NUL byte; this is not a text file".to_owned(),
            ),
            Some('\r') => (Code::Character, LONE_RETURN.to_owned()),
            Some('\u{a0}') => {
                let message = "a no-break space; use plain blanks between numbers";
                (Code::Character, message.to_owned())
            }
            Some(other) => {
                let point = other as u32;
                let message = format!("the character U+{point:04X} is not allowed; remove it");
                (Code::Character, message)
            }
            None => {
                let message = format!("byte 0x{:02x} is not UTF-8; save the file as text", rest[0]);
                (Code::Encoding, message)
            }
        };
        Err(self.refuse(column, code, message))
    }
}

const LONE_RETURN: &str = "a carriage return inside the line; end lines with LF or CR LF";

/// Refuses text in which a carriage return alone ends a line, as [`Lines`] does, for formats that other readers take apart:
/// these would count all of it as one line. Between quotes, as in cells of CSV, it ends no line.
pub(crate) fn refuse_lone_returns(
    file: &str,
    text: &[u8],
    quote: Option<u8>,
) -> Result<(), Diagnostic> {
    let (mut line, mut start, mut is_quoted) = (1, 0, false);
    for (index, &byte) in text.iter().enumerate() {
        match byte {
            b'\n' => (line, start) = (line + 1, index + 1),
            b'\r' if !is_quoted && text.get(index + 1).is_some_and(|&next| next != b'\n') => {
                let before = String::from_utf8_lossy(&text[start..index]);
                let column = before.chars().count() as u64 + 1;
                let mut refusal = Diagnostic::new(file, Code::Character, LONE_RETURN);
                refusal.location = Some(Location::Text { line, column });
                return Err(refusal);
            }
            _ if Some(byte) == quote => is_quoted = !is_quoted,
            _ => {}
        }
    }
    Ok(())
}

/// Whether a byte is printable ASCII or a tab.
fn is_plain(byte: u8) -> bool {
    byte == b'\t' || (b' '..=b'~').contains(&byte)
}

fn io_error(file: &str, error: &std::io::Error) -> Diagnostic {
    Diagnostic::new(file, Code::Open, format!("cannot be read: {error}"))
}

/// The tokens of a line with their columns, from 1. Columns are right if everything before them is ASCII.
pub(crate) fn tokens(line: &str) -> impl Iterator<Item = (u64, &str)> {
    let is_blank = |byte: u8| byte == b' ' || byte == b'\t';
    let bytes = line.as_bytes();
    let mut end = 0;
    std::iter::from_fn(move || {
        let start = end + bytes[end..].iter().position(|&byte| !is_blank(byte))?;
        let length = bytes[start..].iter().position(|&byte| is_blank(byte));
        end = length.map_or(bytes.len(), |length| start + length);
        Some((start as u64 + 1, &line[start..end]))
    })
}
