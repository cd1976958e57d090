//! Lists of times: numbers of seconds, separated by blanks, commas or line ends, with `#` comments. A line such as `0,5`
//! is refused: it may be one time with a decimal comma.

use std::io::BufRead;
use std::path::Path;

use crate::decimal::{Decimal, time_text};
use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::source::Source;
use crate::text::lines::{Lines, tokens};
use crate::text::number;

/// The times of frames with the digits of their file.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTimes {
    pub(crate) times: Vec<Decimal>,
    /// The largest number of decimals of a time.
    pub(crate) decimals: u32,
    /// The warnings about the file.
    pub(crate) warnings: Vec<Diagnostic>,
}

/// A time in seconds on the clock of a clip's file, for messages: to a microsecond, and very large ones with an
/// exponent. `time_offset` is the clip's whole second from which `time` counts.
#[must_use]
pub fn clock_text(time_offset: i64, time: f64) -> String {
    /// From here on, the step of an f64 is longer than a microsecond by far.
    const EXPONENT: f64 = 1e15;
    if time.abs() >= EXPONENT {
        return format!("{time:e}");
    }
    time_text(time_offset, (time * 1e6).round() / 1e6)
}

/// Reads the times in a file, in seconds; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_times(path: &Path) -> Result<Vec<f64>, Diagnostic> {
    Source::read_by(path, true, |name, reader| read_times(name, reader))
}

/// Reads times, in seconds; `name` is the input's name in messages.
///
/// # Errors
/// When the input is invalid or contains no time; the first error is returned.
pub fn read_times(name: &str, reader: impl BufRead) -> Result<Vec<f64>, Diagnostic> {
    let mut lines = Lines::new(name, reader, Limits::default())?;
    let mut times = Vec::new();
    while let Some(line) = lines.next()? {
        let plain = line.split('#').next().unwrap_or_default();
        if let Some((whole, rest)) = two_meanings(plain) {
            let column = 1 + plain.chars().take_while(|c| c.is_whitespace()).count() as u64;
            let message = format!(
                "`{whole},{rest}` may be one time with a decimal comma or two times; write `{whole}.{rest}` or \
                 `{whole} {rest}`"
            );
            return Err(lines.refuse(column, Code::Number, message));
        }
        let plain = plain.replace(',', " ");
        for (column, token) in tokens(&plain) {
            let number = number::parse(token)
                .map_err(|(code, message)| lines.refuse(column, code, message))?;
            times.push(number.value);
        }
        lines.reuse(line);
    }
    if times.is_empty() {
        let message = "no times; write numbers of seconds, one a line".to_owned();
        return Err(lines.refuse_whole(Code::Time, message));
    }
    Ok(times)
}

/// The parts of a line of two whole numbers with nothing but a comma between them.
fn two_meanings(line: &str) -> Option<(&str, &str)> {
    let (whole, rest) = line.trim().split_once(',')?;
    let is_whole = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let digits = whole.strip_prefix(['-', '+']).unwrap_or(whole);
    (is_whole(digits) && is_whole(rest)).then_some((whole, rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Location;

    #[test]
    fn blanks_commas_lines_and_comments_separate() {
        let text = "# half a second\n0 0.5,1.25\n\t-2 # before\r\n7e0";
        let times = read_times("t", text.as_bytes()).unwrap();
        assert_eq!(times, [0.0, 0.5, 1.25, -2.0, 7.0]);
    }

    #[test]
    fn faults_have_their_place() {
        let error = read_times("t", "0\n 1 x".as_bytes()).unwrap_err();
        let location = Location::Text { line: 2, column: 4 };
        assert_eq!((error.location, error.code), (Some(location), Code::Number));
        assert_eq!(
            read_times("t", "#\n".as_bytes()).unwrap_err().code,
            Code::Time
        );
    }

    #[test]
    fn a_decimal_comma_is_not_taken_for_two_times() {
        for (text, line) in [("0,5\n1,5\n", 1), ("0\n -1,25 # s\n", 2)] {
            let error = read_times("t", text.as_bytes()).unwrap_err();
            let location = Location::Text { line, column: line };
            assert_eq!((error.location, error.code), (Some(location), Code::Number));
        }
        for text in ["0, 5", "0,5,7", "0.0,5"] {
            assert!(read_times("t", text.as_bytes()).is_ok(), "{text}");
        }
    }
}
