//! The warnings of a command. Each is printed, unless `--quiet` is set, and kept: the JSON of the command has it, and
//! in a batch the manifest's line about the input.
//!
//! [`words::warning`] and [`words::warn_of`] warn, from anywhere in the work of a command. A pipeline takes the warnings
//! of each of its inputs, other commands those of each record of their JSON; the JSON has all that are left, too.
//!
//! [`words::warning`]: crate::messages::words::warning
//! [`words::warn_of`]: crate::messages::words::warn_of

use std::cell::RefCell;

use serde::{Deserialize, Serialize};
use tumble_formats::Diagnostic;

/// A warning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Warning {
    /// About an input or its result.
    OfInput(Diagnostic),
    /// About the command line, the device or the directory of results.
    Other(String),
}

/// A warning in a manifest and in JSON.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RecordedWarning {
    /// The code of a warning about an input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) code: Option<String>,
    /// Line and column, or the place inside the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) location: Option<String>,
    pub(crate) message: String,
}

impl From<&Diagnostic> for RecordedWarning {
    fn from(warning: &Diagnostic) -> Self {
        Self {
            code: Some(warning.code.name().to_owned()),
            location: warning.location.as_ref().map(ToString::to_string),
            message: warning.message.clone(),
        }
    }
}

impl From<&Warning> for RecordedWarning {
    fn from(warning: &Warning) -> Self {
        match warning {
            Warning::OfInput(diagnostic) => diagnostic.into(),
            Warning::Other(message) => Self {
                code: None,
                location: None,
                message: message.clone(),
            },
        }
    }
}

/// A warning in JSON that is not in the record of its input.
#[derive(Debug, Serialize)]
pub(crate) struct NamedWarning {
    /// The input, or the file of an option.
    #[serde(skip_serializing_if = "Option::is_none")]
    input: Option<String>,
    #[serde(flatten)]
    warning: RecordedWarning,
}

impl From<&Warning> for NamedWarning {
    fn from(warning: &Warning) -> Self {
        let input = match warning {
            Warning::OfInput(diagnostic) => Some(diagnostic.file.clone()),
            Warning::Other(_) => None,
        };
        Self {
            input,
            warning: warning.into(),
        }
    }
}

/// The warnings of a command that nothing has taken yet.
#[derive(Default)]
struct KeptWarnings {
    all: Vec<Warning>,
    /// Whether warnings about inputs are printed later, in the summary of a batch.
    are_summed: bool,
}

thread_local! {
    /// A command works on one thread. Other programs may run several commands at once.
    static KEPT: RefCell<KeptWarnings> = RefCell::default();
}

/// Forgets the warnings of an earlier command.
pub(crate) fn begin() {
    KEPT.with_borrow_mut(|kept| *kept = KeptWarnings::default());
}

/// Whether warnings about inputs are printed in the summary of a batch, and not when they come.
pub(crate) fn sum(are_summed: bool) {
    KEPT.with_borrow_mut(|kept| kept.are_summed = are_summed);
}

/// Keeps a warning; returns whether it is printed now.
pub(super) fn keep(warning: Warning) -> bool {
    KEPT.with_borrow_mut(|kept| {
        let is_summed = kept.are_summed && matches!(warning, Warning::OfInput(_));
        kept.all.push(warning);
        !is_summed
    })
}

/// A point in time of the command, for [`since`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WarningMark(usize);

/// This point in time.
pub(crate) fn mark() -> WarningMark {
    WarningMark(KEPT.with_borrow(|kept| kept.all.len()))
}

/// Takes the warnings since a point in time.
pub(crate) fn since(WarningMark(start): WarningMark) -> Vec<Warning> {
    KEPT.with_borrow_mut(|kept| kept.all.split_off(start.min(kept.all.len())))
}

/// As [`since`], in the form of JSON and manifests.
pub(crate) fn recorded_since(mark: WarningMark) -> Vec<RecordedWarning> {
    since(mark).iter().map(RecordedWarning::from).collect()
}

/// Takes the warnings that are in no record.
pub(crate) fn rest() -> Vec<NamedWarning> {
    let all = since(WarningMark::default());
    all.iter().map(NamedWarning::from).collect()
}

#[cfg(test)]
mod tests {
    use tumble_formats::Code;

    use super::*;

    /// Each warning is taken once: by the record that was made after it, or with the rest.
    #[test]
    fn no_warning_is_lost_or_taken_twice() {
        begin();
        let of_input = || Warning::OfInput(Diagnostic::new("a", Code::OneKey, "one"));
        let other = |text: &str| Warning::Other(text.to_owned());
        assert!(keep(other("first")));
        let mark = mark();
        sum(true);
        assert!(!keep(of_input()), "the summary prints it");
        assert!(keep(other("second")));
        sum(false);
        assert_eq!(since(mark), [of_input(), other("second")]);
        assert!(keep(of_input()));
        let rest = serde_json::to_value(rest()).unwrap();
        let expected = serde_json::json!([
            {"message": "first"},
            {"input": "a", "code": "W011", "message": "one"},
        ]);
        assert_eq!(rest, expected);
        assert_eq!(since(WarningMark::default()), []);
    }
}
