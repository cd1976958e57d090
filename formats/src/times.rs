//! Lists of times: numbers of seconds, separated by blanks, commas or line ends, with `#` comments.

use std::io::BufRead;
use std::path::Path;

use crate::decimal::Decimal;
use crate::diagnostic::{Code, Diagnostic};
use crate::source::Source;
use crate::text::lines::{Limits, Lines, tokens};
use crate::text::number;

/// The times of frames with the digits of their file.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTimes {
    pub(crate) times: Vec<Decimal>,
    /// The largest number of decimals of a time.
    pub(crate) decimals: u32,
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
        let plain = line.split('#').next().unwrap_or_default().replace(',', " ");
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
}
