//! Warnings of one input, one for each kind.

use crate::diagnostic::{Code, Diagnostic, Location};

/// Names of what is left out, for a message; `None` where nothing is.
pub(crate) fn listed(mut names: Vec<String>) -> Option<String> {
    /// More names than anybody reads.
    const MAX_NAMES: usize = 12;
    let count = names.len();
    names.truncate(MAX_NAMES);
    let more = match count - names.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (count > 0).then(|| format!("{}{more}", names.join(", ")))
}

/// Collects what is remarkable about an input: the first of each code keeps its location and message,
/// the others are counted.
#[derive(Debug, Clone, Default)]
pub(crate) struct Warnings {
    file: String,
    list: Vec<Diagnostic>,
}

impl Warnings {
    /// Of an input that messages call `file`.
    pub(crate) fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            list: Vec::new(),
        }
    }

    /// Counts a warning; location and message are made only for the first of its code.
    pub(crate) fn warn<M: Into<String>>(
        &mut self,
        code: Code,
        describe: impl FnOnce() -> (Option<Location>, M),
    ) {
        if let Some(known) = self.list.iter_mut().find(|known| known.code == code) {
            known.count += 1;
            return;
        }
        let (location, message) = describe();
        let mut warning = Diagnostic::new(&self.file, code, message);
        warning.location = location;
        self.list.push(warning);
    }

    /// All of them, in the order in which their kinds came up.
    pub(crate) fn into_list(self) -> Vec<Diagnostic> {
        self.list
    }
}
