//! `tumble info` of a pickle: its values by their names, whether or not they are a motion.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;
use tumble_formats::pickle::{Contents, Entry};
use tumble_formats::printable::printable;
use tumble_formats::{Diagnostic, ReadOptions};

use crate::messages::names;

/// The report of a pickle; also the form of the JSON.
#[derive(Serialize)]
pub(super) struct PickleSummary {
    input: String,
    values: Vec<ValueSummary>,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct ValueSummary {
    /// The path of the value: `a.b` for the entry `b` of a dict that is the entry `a`.
    name: String,
    /// Its shape and its type as in NumPy, or its class.
    kind: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<String>,
}

impl PickleSummary {
    pub(super) fn read(path: &Path, options: &ReadOptions) -> Result<Self, Diagnostic> {
        let contents = Contents::open(path, options)?;
        let summary = |Entry { name, kind, value }| ValueSummary { name, kind, value };
        Ok(Self {
            input: names::input(path),
            values: contents.entries().into_iter().map(summary).collect(),
            warnings: contents.warnings.iter().map(ToString::to_string).collect(),
        })
    }

    pub(super) fn text(&self) -> String {
        let mut text = format!("{}\n", self.input);
        let count = self.values.len();
        let _ = writeln!(text, "  {:18} {count}: name, shape and type", "values");
        for value in &self.values {
            let [name, kind] = [&value.name, &value.kind].map(|text| printable(text));
            let _ = write!(text, "    {name}  {kind}");
            if let Some(value) = &value.value {
                let _ = write!(text, "  {}", printable(value));
            }
            text.push('\n');
        }
        for warning in &self.warnings {
            let _ = writeln!(text, "  {:18} {warning}", "warning");
        }
        text
    }
}
