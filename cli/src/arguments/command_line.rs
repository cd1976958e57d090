//! The options of a command line: which are explicit, and the values of all.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use clap::parser::ValueSource;
use clap::{ArgMatches, Command};

use crate::arguments::options::{Bytes, rule};
use crate::batch::digest::InputFile;

/// The options of a command. It must be the first field of the command's arguments: clap removes the
/// values of the fields after it.
#[derive(Debug, Clone, Default)]
pub(crate) struct CommandLine {
    explicit: BTreeSet<String>,
    values: BTreeMap<String, Vec<String>>,
}

impl CommandLine {
    /// Whether the command line names the option, rather than its default.
    pub(crate) fn has(&self, option: &str) -> bool {
        self.explicit.contains(option)
    }

    /// Everything that determines a result besides its input: `layout=track method=slerp`. Options
    /// without a value or a default are left out.
    pub(crate) fn options(&self) -> String {
        let shown = self.values.iter().filter_map(|(name, values)| {
            let bytes = rule(name).map_or(Bytes::ByValue, |rule| rule.bytes);
            let values: Vec<String> = match bytes {
                Bytes::Unchanged => return None,
                Bytes::ByValue => values.clone(),
                Bytes::ByContent => values.iter().map(|file| content(file)).collect(),
            };
            Some(format!("{name}={}", values.join(",")))
        });
        shown.collect::<Vec<_>>().join(" ")
    }
}

/// The hash of a file; empty where it cannot be read again, as standard input. The name of a folder.
fn content(file: &str) -> String {
    if Path::new(file).is_dir() {
        return file.to_owned();
    }
    let file = InputFile::new(Path::new(file));
    file.sha256().unwrap_or_default().to_owned()
}

/// It adds no options.
impl clap::Args for CommandLine {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl clap::FromArgMatches for CommandLine {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut command_line = Self::default();
        for id in matches.ids().map(clap::Id::as_str) {
            // Groups of options are called after their structs.
            if id.starts_with(char::is_uppercase) {
                continue;
            }
            if matches.value_source(id) == Some(ValueSource::CommandLine) {
                command_line.explicit.insert(id.to_owned());
            }
            let raw = matches.get_raw(id).into_iter().flatten();
            let values = raw.map(|value| value.to_string_lossy().into_owned());
            command_line.values.insert(id.to_owned(), values.collect());
        }
        Ok(command_line)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
