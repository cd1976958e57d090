//! Listings and JSON, on standard output.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use tumble_formats::Code;
use tumble_formats::printable::{printable, printable_lines};

use crate::batch::entry::InputEntry;
use crate::messages::exit::Failure;
use crate::messages::warnings::{self, NamedWarning};

/// Writes a listing to standard output. Names in it went through [`printable`], so that none begins a
/// line. A reader that has seen enough (`| head`) is no failure.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    styled(&printable_lines(text))
}

/// As [`text`], with colours: of names that all went through [`printable`].
pub(crate) fn styled(text: &str) -> Result<(), Failure> {
    let mut out = anstream::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::writing("standard output", &error))
        }
        _ => Ok(()),
    }
}

/// Whether JSON was printed, or begun.
static HAS_JSON: AtomicBool = AtomicBool::new(false);

/// As [`text`], for programs: an object as JSON, with the warnings of the command.
pub(crate) fn json(value: &impl serde::Serialize) -> Result<(), Failure> {
    #[derive(serde::Serialize)]
    struct WithWarnings<'a, T> {
        #[serde(flatten)]
        value: &'a T,
        warnings: Vec<NamedWarning>,
    }
    document(&WithWarnings {
        value,
        warnings: warnings::rest(),
    })
}

/// As [`json`], but exactly this value, without warnings: a list, or a document that is also written to a file.
pub(crate) fn document(value: &impl serde::Serialize) -> Result<(), Failure> {
    HAS_JSON.store(true, Ordering::Relaxed);
    let text =
        serde_json::to_string_pretty(value).expect("names are strings and numbers are numbers");
    styled(&format!("{}\n", json_printable(&text)))
}

/// As [`json`]: a list of results, and after them of the inputs that failed. A last record has the warnings that are not
/// about one of them, if there are any.
pub(crate) fn records(
    results: &[impl serde::Serialize],
    failed: &[InputEntry],
) -> Result<(), Failure> {
    let failed = failed.iter().map(serde_json::to_value);
    let results = results.iter().map(serde_json::to_value);
    let warned = warned_record();
    let warned = warned.iter().map(serde_json::to_value);
    let records: Result<Vec<_>, _> = results.chain(failed).chain(warned).collect();
    document(&records.expect("names are strings and numbers are numbers"))
}

/// The warnings that no record has, as a record.
#[derive(serde::Serialize)]
struct WarnedRecord {
    state: &'static str,
    warnings: Vec<NamedWarning>,
}

fn warned_record() -> Option<WarnedRecord> {
    let rest = warnings::rest();
    (!rest.is_empty()).then_some(WarnedRecord {
        state: "warned",
        warnings: rest,
    })
}

/// Prepares for a command's JSON.
pub(crate) fn begin() {
    HAS_JSON.store(false, Ordering::Relaxed);
    warnings::begin();
}

/// The form of the JSON that a command prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JsonForm {
    Object,
    /// A list of records.
    List,
}

/// The failure of a command, in the form of its JSON, if it ended before that was printed.
pub(crate) fn failed(failure: &Failure, form: JsonForm) -> Result<(), Failure> {
    #[derive(serde::Serialize)]
    struct FailedCommand<'a> {
        state: &'static str,
        code: u8,
        message: &'a str,
        /// The code of the error in an input, such as E021.
        diagnostic: Option<&'static str>,
    }
    if HAS_JSON.load(Ordering::Relaxed) || failure.message().is_empty() {
        return Ok(());
    }
    let failed = FailedCommand {
        state: "failed",
        code: failure.code,
        message: failure.message(),
        diagnostic: failure.input_code().map(Code::name),
    };
    match form {
        JsonForm::Object => json(&failed),
        JsonForm::List => records(&[failed], &[]),
    }
}

/// JSON with escapes for all characters that a terminal would obey: outside ASCII they stand in strings
/// alone, and serde escapes the ASCII controls.
fn json_printable(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        let mut units = [0; 2];
        if character == '\n'
            || printable(character.encode_utf8(&mut [0; 4])).len() == character.len_utf8()
        {
            shown.push(character);
        } else {
            for unit in character.encode_utf16(&mut units) {
                shown.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_says_the_same_without_what_a_terminal_obeys() {
        let names = [
            "plain ä",
            "\u{9b}2J",
            "\u{202e}x",
            "a\u{e0041}",
            "\x1b[1m\n",
        ];
        let text = json_printable(&serde_json::to_string_pretty(&names).unwrap());
        assert_eq!(serde_json::from_str::<Vec<String>>(&text).unwrap(), names);
        // A tag character is two units of UTF-16, and is escaped twice; a line end has a shorter escape.
        assert_eq!(text.matches("\\u").count(), 5, "{text}");
        assert_eq!(printable_lines(&text), text);
    }
}
