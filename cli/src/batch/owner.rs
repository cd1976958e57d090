//! Which input a result is of. A batch that is resumed makes results again if their inputs have changed, but does not
//! replace the result of another input that still exists.

use std::path::Path;

use crate::batch::digest::InputFile;
use crate::batch::entry::ManifestEntry;
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
    /// Whether this is an input: by its path, or, where there is no file of that path any more, by its bytes, as of a
    /// file that was moved. Another file with the same bytes is another input: its result may have other options.
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
