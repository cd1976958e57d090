//! What the command line says, option by option: which options were given, and the values of all.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use clap::parser::ValueSource;
use clap::{ArgMatches, Command};

use crate::batch::digest::InputFile;

/// The options of a command. Stands as the first of the fields of its arguments: those behind it
/// take their values away.
#[derive(Debug, Clone, Default)]
pub(crate) struct Given {
    explicit: BTreeSet<String>,
    values: BTreeMap<String, Vec<String>>,
}

/// Options that decide over no byte of a result: which inputs and outputs there are, what may be
/// read and replaced, who computes, and what is said. Times may come from standard input, so that
/// who reads them says what they are.
const SILENT: [&str; 18] = [
    "allow_inexact",
    "device",
    "explain_route",
    "files_from",
    "format",
    "json",
    "max_memory",
    "max_size",
    "memory",
    "out",
    "overwrite",
    "paths",
    "pipes",
    "resume",
    "shard",
    "shard_bytes",
    "times",
    "times_out",
];

/// Options whose value is a file: what that holds decides, not what it is called.
const FILES: [&str; 3] = ["body_model", "offsets", "source_times"];

impl Given {
    /// Whether the command line names the option, rather than its default.
    pub(crate) fn has(&self, option: &str) -> bool {
        self.explicit.contains(option)
    }

    /// All that decides over a result besides its input: `layout=track method=slerp`. Options that
    /// have neither a value nor a default are left out.
    pub(crate) fn options(&self) -> String {
        let deciding = self.values.iter();
        let deciding = deciding.filter(|(name, _)| !SILENT.contains(&name.as_str()));
        let shown = deciding.map(|(name, values)| match FILES.contains(&name.as_str()) {
            true => {
                let content = values.iter().map(|file| content(file));
                format!("{name}={}", content.collect::<Vec<_>>().join(","))
            }
            false => format!("{name}={}", values.join(",")),
        });
        shown.collect::<Vec<_>>().join(" ")
    }
}

/// The hash of a file; nothing where it cannot be read again, as standard input cannot. A folder's name.
fn content(file: &str) -> String {
    if Path::new(file).is_dir() {
        return file.to_owned();
    }
    let file = InputFile::new(Path::new(file));
    file.sha256().unwrap_or_default().to_owned()
}

/// It has no options of its own.
impl clap::Args for Given {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl clap::FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Self::default();
        for id in matches.ids().map(clap::Id::as_str) {
            // Groups of options are called after their structs.
            if id.starts_with(char::is_uppercase) {
                continue;
            }
            if matches.value_source(id) == Some(ValueSource::CommandLine) {
                given.explicit.insert(id.to_owned());
            }
            let raw = matches.get_raw(id).into_iter().flatten();
            let values = raw.map(|value| value.to_string_lossy().into_owned());
            given.values.insert(id.to_owned(), values.collect());
        }
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
