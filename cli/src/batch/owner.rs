//! Which input a result is of. A batch that is resumed makes results again if their inputs have changed, but does not
//! replace the result of another input that still exists.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::batch::digest::InputFile;
use crate::batch::entry::{InputEntries, InputEntry, InputState, ManifestEntry};
use crate::messages::exit::Failure;
use crate::messages::{names, words};

/// The input of a result, as a manifest has it.
pub(crate) struct Owner {
    input: String,
    sha256: Option<String>,
}

impl From<&ManifestEntry> for Owner {
    fn from(entry: &ManifestEntry) -> Self {
        Self {
            input: entry.input.clone(),
            sha256: entry.input_sha256.clone(),
        }
    }
}

impl Owner {
    /// Whether the file at `path` is this input. It is if the paths are equal, or, if there is no file at the old path
    /// any more, if the bytes are equal: then the file was moved. As long as both files exist, they are different
    /// inputs, because their results may have other options.
    fn is(&self, path: &Path) -> bool {
        let real = |path: &Path| path.canonicalize().ok();
        let input = Path::new(&self.input);
        if self.input == path.display().to_string()
            || real(input).is_some_and(|input| Some(input) == real(path))
        {
            return true;
        }
        if input.exists() {
            return false;
        }
        let file = InputFile::new(path);
        self.sha256.is_some() && file.sha256() == self.sha256.as_deref()
    }
}

/// The commands that made the results of a directory.
pub(crate) struct CommandsOfResults<'a> {
    /// The command of each result of all clips of an input.
    of_results: BTreeMap<&'a str, &'a str>,
    /// The commands of the inputs that have no result.
    others: BTreeSet<&'a str>,
}

impl<'a> CommandsOfResults<'a> {
    /// Of the lines of a manifest.
    pub(crate) fn of(
        entries: &'a BTreeMap<String, ManifestEntry>,
        inputs: &'a InputEntries,
    ) -> Self {
        let of_results = entries.values();
        let processed = inputs
            .values()
            .filter(|entry| entry.state != InputState::Skipped);
        Self {
            of_results: of_results
                .map(|entry| (entry.whole().0, entry.command()))
                .collect(),
            others: processed.map(InputEntry::command).collect(),
        }
    }

    /// Refuses to resume results that another command made, or a directory of which this command made nothing.
    pub(crate) fn check<'b>(
        &self,
        folder: &Path,
        results: impl IntoIterator<Item = &'b String>,
        command: &str,
    ) -> Result<(), Failure> {
        let of_result = |name: &String| {
            let other = *self.of_results.get(&**name)?;
            (other != command).then(|| (folder.join(name), other))
        };
        let all = || self.of_results.values().chain(&self.others).copied();
        let of_folder = || {
            let other = all().next().filter(|_| all().all(|it| it != command))?;
            Some((folder.to_owned(), other))
        };
        let found = results.into_iter().find_map(of_result);
        let Some((path, other)) = found.or_else(of_folder) else {
            return Ok(());
        };
        let path = path.display();
        Err(Failure::usage(format!(
            "{path}: was made by `tumble {other}`, and `tumble {command} --resume` continues what `tumble {command}` \
             made; resume with `tumble {other}`, give another directory, or --overwrite to replace results of the same \
             names"
        )))
    }
}

/// Inputs whose results were made from others, which do not exist any more.
#[derive(Default)]
pub(crate) struct ReplacedOwners {
    count: usize,
    /// The first result, its input, and the input that it was made from.
    first: Option<[String; 3]>,
}

impl ReplacedOwners {
    /// Refuses an input if `target`, where its result would be, is the result of another one, `owner`, that exists.
    pub(crate) fn check(
        &mut self,
        path: &Path,
        target: &Path,
        owner: &Owner,
    ) -> Result<(), Failure> {
        if owner.is(path) {
            return Ok(());
        }
        let input = names::input(path);
        let (target, other) = (target.display(), Path::new(&owner.input));
        if !other.exists() {
            self.count += 1;
            self.first
                .get_or_insert_with(|| [target.to_string(), input, owner.input.clone()]);
            return Ok(());
        }
        let remedy = match other.file_name() == path.file_name() {
            true => "name their common directory (its tree is kept), or use --base",
            false => "give --names full, which names results after the whole names of inputs",
        };
        Err(Failure::usage(format!(
            "{input}: {target} is the result of {}; {remedy}, or another directory, or --overwrite to replace it",
            names::input(other)
        )))
    }

    /// Says how many results are replaced that were made from other inputs.
    pub(crate) fn note(&self) {
        if let Some([target, input, other]) = &self.first {
            let results = words::count(self.count, "result");
            let are = if self.count == 1 { "was" } else { "were" };
            words::note(&format!(
                "{results} {are} made from other inputs, which do not exist any more; the first is {target}, made from \
                 {other}, now from {input}"
            ));
        }
    }
}
