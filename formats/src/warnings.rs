//! Collects warnings about one input, one for each kind.

use crate::diagnostic::{Code, Diagnostic, Location};

/// The names of data that is left out, for a message; `None` if there are none.
pub(crate) fn listed(mut names: Vec<String>) -> Option<String> {
    /// The largest number of names in a message.
    const MAX_NAMES: usize = 12;
    let count = names.len();
    names.truncate(MAX_NAMES);
    let more = match count - names.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (count > 0).then(|| format!("{}{more}", names.join(", ")))
}

/// Collects warnings about an input: the first of each code determines the location and the message, and the others
/// are counted.
#[derive(Debug, Clone, Default)]
pub(crate) struct Warnings {
    file: String,
    list: Vec<Diagnostic>,
}

impl Warnings {
    /// For an input whose name in messages is `file`.
    pub(crate) fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            list: Vec::new(),
        }
    }

    /// Counts a warning; `describe` is called only for the first of its code.
    pub(crate) fn warn<M: Into<String>>(
        &mut self,
        code: Code,
        describe: impl FnOnce() -> (Option<Location>, M),
    ) {
        self.warn_of(1, code, describe);
    }

    /// Counts a warning of `count` keys, if these are any.
    pub(crate) fn warn_of<M: Into<String>>(
        &mut self,
        count: usize,
        code: Code,
        describe: impl FnOnce() -> (Option<Location>, M),
    ) {
        if let Some(known) = self.list.iter_mut().find(|known| known.code == code) {
            known.count += count as u64;
        } else if count > 0 {
            let (location, message) = describe();
            let mut warning = Diagnostic::new(&self.file, code, message);
            (warning.location, warning.count) = (location, count as u64);
            self.list.push(warning);
        }
    }

    /// All warnings, in the order in which their codes first occurred.
    pub(crate) fn into_list(self) -> Vec<Diagnostic> {
        self.list
    }
}
