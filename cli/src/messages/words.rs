//! Words for people, on standard error.
//!
//! `anstream` drops the colours when the stream is no terminal or `NO_COLOR` is set. A closed standard error must not
//! end the program, so lines that cannot be written are dropped.

use std::any::Any;
use std::ffi::OsString;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::error::{ContextKind, ContextValue};
use tumble::names::by_meaning;
pub(crate) use tumble::names::counted as count;
use tumble_formats::guarded::is_guarded;
use tumble_formats::printable::printable;
use tumble_formats::{Diagnostic, Severity};

use crate::messages::progress;
use crate::messages::warnings::{self, Warning};

/// Whether notes and warnings are left out.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Leaves out notes and warnings from now on, or prints them again.
pub(crate) fn set_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints a line that `--quiet` does not leave out: a part of an error.
pub(crate) fn line(message: &str) {
    let message = printable(message);
    progress::beside_bar(|| {
        let _ = writeln!(anstream::stderr(), "{message}");
    });
}

pub(crate) fn error(message: &str) {
    let message = printable(message);
    progress::beside_bar(|| {
        let _ = writeln!(anstream::stderr(), "\x1b[1;31merror:\x1b[0m {message}");
    });
}

/// Warns of something that is not about a single input: the command line, the device, the directory of results.
pub(crate) fn warning(message: &str) {
    if !warnings::keep(Warning::Other(message.to_owned())) || is_quiet() {
        return;
    }
    let message = printable(message);
    progress::beside_bar(|| {
        let _ = writeln!(anstream::stderr(), "\x1b[1;33mwarning:\x1b[0m {message}");
    });
}

/// Prints a note as one line, also if names in it contain line ends.
pub(crate) fn note(message: &str) {
    if !is_quiet() {
        line(message);
    }
}

/// Warns of something in an input, or about its result. A batch prints it in its summary.
pub(crate) fn warn_of(warning: Diagnostic) {
    let text = warning.to_string();
    if warnings::keep(Warning::OfInput(warning)) {
        note(&text);
    }
}

/// Prints warnings that a batch or a pipeline keeps itself, or errors of parts of an input.
pub(crate) fn print_kept<'a>(warnings: impl IntoIterator<Item = &'a Diagnostic>) {
    for warning in warnings {
        match warning.code.severity() {
            Severity::Error => line(&warning.to_string()),
            Severity::Warning => note(&warning.to_string()),
        }
    }
}

/// Prints an error of the command line, or help. clap prints arguments unescaped, and a shell's pattern
/// may put names of files among them.
pub(crate) fn usage(error: &mut clap::Error, arguments: &[OsString]) {
    suggest_by_meaning(error);
    let mut text = error.render().ansi().to_string();
    for word in arguments {
        let word = word.to_string_lossy();
        let shown = printable(&word);
        // The part of a word after `--option=` is printed safely, too.
        let parts = word.split('=').zip(shown.split('='));
        for (word, shown) in std::iter::once((&*word, &*shown)).chain(parts) {
            if word != shown {
                text = text.replace(word, shown);
            }
        }
    }
    // Errors of writing are ignored: if the stream is closed, nobody reads it.
    let _ = match error.use_stderr() {
        true => write!(anstream::stderr(), "{text}"),
        false => write!(anstream::stdout(), "{text}"),
    };
}

/// Suggests the value that another program's name stands for, instead of those that are spelt alike.
fn suggest_by_meaning(error: &mut clap::Error) {
    let (Some(ContextValue::String(value)), Some(ContextValue::Strings(known))) = (
        error.get(ContextKind::InvalidValue),
        error.get(ContextKind::ValidValue),
    ) else {
        return;
    };
    if let Some(meant) = by_meaning(value, known.iter().map(String::as_str)) {
        let meant = ContextValue::String(meant.to_owned());
        error.insert(ContextKind::SuggestedValue, meant);
    }
}

/// The message of a panic, which is text unless a crate panics with another type.
fn reason(payload: &(dyn Any + Send)) -> &str {
    let literal = payload.downcast_ref::<&str>().copied();
    let text = literal.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no reason given")
}

/// Reports a panic as a bug of tumble, and asks the user to send the command line and the input.
pub(crate) fn explain_panics() {
    std::panic::set_hook(Box::new(|info| {
        let message = reason(info.payload());
        // A library panicked on damaged bytes. This is reported as an error of the input, so nothing is printed here.
        if is_guarded() {
            return;
        }
        let location = info.location().map(ToString::to_string).unwrap_or_default();
        let words: Vec<String> = std::env::args_os()
            .map(|a| a.to_string_lossy().into_owned())
            .collect();
        error(&format!("internal error at {location}: {message}"));
        line(&format!(
            "  this is a bug in tumble {}; please report it with the command line and, if it can be \
             shared, the input:",
            env!("CARGO_PKG_VERSION"),
        ));
        line(&format!("  {}", words.join(" ")));
    }));
}

/// `1 box`, `4 boxes`.
pub(crate) fn boxes(number: usize) -> String {
    match number {
        1 => "1 box".to_owned(),
        _ => format!("{number} boxes"),
    }
}

/// `78.6 MB`, in decimal units, as file managers and drives count.
pub(crate) fn bytes(bytes: f64) -> String {
    let units = ["bytes", "kB", "MB", "GB", "TB", "PB", "EB"];
    let (mut value, mut power) = (bytes, 0);
    while value >= 1000.0 && power < units.len() - 1 {
        (value, power) = (value / 1000.0, power + 1);
    }
    if power == 0 {
        format!("{value} bytes")
    } else {
        format!("{value:.1} {}", units[power])
    }
}

/// A number of four significant digits in plain decimals: `17.04`, `0.0001661`, `0`. Below 1e-9 it has an exponent.
pub(crate) fn decimals(number: f64) -> String {
    let number = number + 0.0; // -0 is 0
    let size = number.abs();
    if size > 0.0 && size < 1e-9 {
        return format!("{number:.3e}");
    }
    let scientific = format!("{size:.3e}");
    let exponent = scientific
        .rsplit('e')
        .next()
        .and_then(|it| it.parse::<i64>().ok());
    let digits = exponent.map_or(0, |exponent| (3 - exponent).clamp(0, 12) as usize);
    trimmed(format!("{number:.digits$}"))
}

/// A time in seconds to a tenth of a millisecond: `22.925`, `0.0042`.
pub(crate) fn seconds(time: f64) -> String {
    trimmed(format!("{time:.4}"))
}

/// Without the zeros at the end of decimals.
fn trimmed(number: String) -> String {
    match number.contains('.') {
        true => number
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned(),
        false => number,
    }
}

/// `3.1 ms`.
pub(crate) fn duration(duration: Duration) -> String {
    let seconds = duration.as_secs_f64();
    match seconds {
        0.0..1e-3 => format!("{:.0} µs", seconds * 1e6),
        1e-3..1.0 => format!("{:.1} ms", seconds * 1e3),
        _ => format!("{seconds:.2} s"),
    }
}

/// The known name that another program's name stands for, or that is nearest to a misspelt one, if any is near.
pub(crate) fn nearest<'a>(
    misspelt: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let known: Vec<&str> = known.into_iter().collect();
    let meant = by_meaning(misspelt, known.iter().copied());
    if meant.is_some() {
        return meant;
    }
    let lowercase = misspelt.to_lowercase();
    // A part of a name is a name too: `llvmpipe` of `llvmpipe (LLVM 15.0.6)`.
    let score = |name: &str| {
        let name = name.to_lowercase();
        let parts = name.split_whitespace().chain([&*name]);
        parts
            .map(|part| strsim::jaro_winkler(&lowercase, part))
            .fold(0.0, f64::max)
    };
    known
        .into_iter()
        .map(|name| (score(name), name))
        .filter(|&(score, _)| score > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

/// A parser of whole numbers from `minimum` to `maximum`. The message of clap's parser shows the range in Rust's syntax.
pub(crate) fn whole_number<T>(
    minimum: u64,
    maximum: u64,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: TryFrom<u64> + 'static,
{
    move |text: &str| {
        let number: Option<u64> = text.parse().ok();
        let number = number.filter(|number| (minimum..=maximum).contains(number));
        let found = number.and_then(|number| T::try_from(number).ok());
        found.ok_or_else(|| format!("give a whole number from {minimum} to {maximum}"))
    }
}

/// `256MiB`, `1.5 GB`, `1000000`: bytes.
pub(crate) fn parse_bytes(text: &str) -> Result<u64, String> {
    let refuse =
        || format!("invalid size `{text}`: expected bytes with a unit, such as 256MiB or 2GB");
    let digits = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let number: f64 = number.parse().map_err(|_| refuse())?;
    let unit: f64 = match unit.trim().to_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kib" => 1024.0,
        "kb" => 1e3,
        "m" | "mib" => 1024.0 * 1024.0,
        "mb" => 1e6,
        "g" | "gib" => 1024.0 * 1024.0 * 1024.0,
        "gb" => 1e9,
        _ => return Err(refuse()),
    };
    let bytes = number * unit;
    if !(1.0..9e18).contains(&bytes) {
        return Err(refuse());
    }
    Ok(bytes as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        for (text, bytes) in [
            ("256MiB", 256 << 20),
            ("2GB", 2_000_000_000),
            ("1.5k", 1536),
            ("64", 64),
            ("8 kb", 8000),
        ] {
            assert_eq!(parse_bytes(text), Ok(bytes), "{text}");
        }
        for text in [
            "",
            "MiB",
            "-1",
            "0",
            "1e3",
            "12 parsecs",
            "1..5",
            "nan",
            "99999999999GB",
        ] {
            assert!(parse_bytes(text).is_err(), "{text}");
        }
    }
}
