//! Which inputs each shard has, and the record of this in the directory of results.

use std::collections::{HashMap, HashSet};
use std::io::{self, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tumble_formats::beneath::{open_beneath, parent_beneath};
use tumble_formats::folder::Folder;
use tumble_formats::format::Format;
use tumble_formats::output::{Output, remove_abandoned};

use crate::arguments::input::{FoundInput, GatheredInputs};
use crate::arguments::options::changed_options;
use crate::batch::digest::Digest;
use crate::batch::entry::{InputEntry, NAME, kernels_sha256};
use crate::batch::owner::ReplacedOwners;
use crate::batch::result_names::{self, ResultName, ResultNaming};
use crate::batch::shards::record::{self, FOLDER};
use crate::batch::target;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::{names, words};

/// The file that records the plan.
const PLAN_FILE: &str = "plan.json";

/// The command that writes a lost plan again.
const WRITTEN_AGAIN: &str = "`tumble eval … --shard 1/1 --resume`, with the same inputs and options, writes it again and \
                             keeps the results that are complete";

/// The most inputs of a shard: if a worker is lost, its shard is evaluated again.
const MAX_INPUTS: usize = 256;

/// The most shards of a plan: merging looks for each.
const MAX_SHARDS: usize = 1 << 20;

/// The longest plan that is read, in bytes.
const MAX_PLAN_BYTES: u64 = 1 << 20;

/// All inputs of a request, cut into shards.
pub(crate) struct ShardPlan {
    pub(crate) inputs: Vec<FoundInput>,
    /// The names of the results, in the order of their inputs.
    pub(crate) names: Vec<ResultName>,
    /// The inputs of each shard.
    pub(crate) cuts: Vec<Range<usize>>,
    pub(crate) format: &'static Format,
    pub(crate) recorded: RecordedPlan,
}

/// The record of a plan in a directory of results. Two records of one plan are equal, wherever they were made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RecordedPlan {
    /// The hash of everything that determines the shards and how they are evaluated.
    pub(crate) plan: String,
    pub(crate) shards: usize,
    pub(crate) inputs: usize,
    /// The most bytes of input in a shard; a single input may be larger.
    pub(crate) shard_bytes: u64,
    /// The hash of the names of all results.
    pub(crate) outputs_sha256: String,
    pub(crate) options: String,
    pub(crate) kernels_sha256: String,
    pub(crate) tumble: String,
    /// Skipped entries of the directories of inputs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) skipped: Vec<InputEntry>,
}

/// The inputs of each shard: in their order, at most `MAX_INPUTS`, and at most `max_bytes` unless one
/// input is larger.
pub(crate) fn cut(sizes: &[u64], max_bytes: u64) -> Vec<Range<usize>> {
    let mut cuts = Vec::new();
    let (mut first, mut bytes) = (0, 0_u128);
    for (index, size) in sizes.iter().map(|&size| u128::from(size)).enumerate() {
        let is_full = index - first == MAX_INPUTS || bytes + size > u128::from(max_bytes);
        if is_full && index > first {
            cuts.push(first..index);
            (first, bytes) = (index, 0);
        }
        bytes += size;
    }
    if first < sizes.len() {
        cuts.push(first..sizes.len());
    }
    cuts
}

/// The hash of the names in a list.
pub(crate) fn hash_of(names: &[ResultName]) -> String {
    let mut digest = Digest::default();
    for name in names.iter().flatten() {
        digest.update(name.as_bytes());
        digest.update(b"\n"); // in a name it would be one of another list, which does no harm here
    }
    digest.finish()
}

/// How a library is divided, and the format and names of its results.
pub(crate) struct ShardOptions {
    /// The format of the results, if the command line names one.
    pub(crate) format: Option<&'static Format>,
    pub(crate) naming: ResultNaming,
    /// Everything that determines a result besides its input.
    pub(crate) options: String,
    /// The most bytes of input in a shard.
    pub(crate) shard_bytes: u64,
}

impl ShardPlan {
    /// Divides inputs with these sizes into shards.
    pub(crate) fn new(
        inputs: GatheredInputs,
        sizes: &[u64],
        folder: &Path,
        request: ShardOptions,
    ) -> Result<Self, Failure> {
        let ShardOptions {
            format,
            naming,
            options,
            shard_bytes,
        } = request;
        let files = inputs.files;
        if let Some(pipe) = files.iter().find(|found| names::is_standard(&found.path)) {
            let name = names::input(&pipe.path);
            let message =
                format!("{name}: the other processes of the shards cannot read it; give a file");
            return Err(Failure::usage(message));
        }
        let format = result_names::format(folder, format)?;
        let names = result_names::name_results(&files, folder, format, naming);
        let cuts = cut(sizes, shard_bytes);
        let mut digest = Digest::default();
        let mut say = |text: &str| {
            digest.update(&(text.len() as u64).to_le_bytes());
            digest.update(text.as_bytes());
        };
        for text in [&options, kernels_sha256(), env!("CARGO_PKG_VERSION")] {
            say(text);
        }
        say(&shard_bytes.to_string());
        for (name, size) in names.iter().zip(sizes) {
            say(name.as_deref().unwrap_or_default());
            say(&size.to_string());
        }
        let recorded = RecordedPlan {
            plan: digest.finish(),
            shards: cuts.len(),
            inputs: files.len(),
            shard_bytes,
            outputs_sha256: hash_of(&names),
            options,
            kernels_sha256: kernels_sha256().to_owned(),
            tumble: env!("CARGO_PKG_VERSION").to_owned(),
            skipped: inputs.skipped,
        };
        Ok(Self {
            inputs: files,
            names,
            cuts,
            format,
            recorded,
        })
    }

    /// Records the plan in the directory before any result is renamed: from then on files with the names
    /// of its results may be replaced. Any number of processes may do so at once. Where the record of this plan was lost,
    /// the file of one of its shards proves that the results are those of the plan.
    pub(crate) fn claim(
        &self,
        folder: &Path,
        resume: bool,
        overwrite: bool,
    ) -> Result<(), Failure> {
        let opened = target::open_folder(folder)?;
        let found = RecordedPlan::read(folder)?;
        if found.as_ref() == Some(&self.recorded) {
            return Ok(());
        }
        if found.is_none() && self.has_shard(folder) {
            return self.recorded.write(&opened);
        }
        if let Some(found) = found.filter(|_| !overwrite) {
            let shown = folder.display();
            if found.options != self.recorded.options {
                let changed = changed_options(&found.options, &self.recorded.options);
                return Err(Failure::usage(format!(
                    "{shown}: has shards that were made with another value of {changed}; use the same value, give another \
                     directory, or --overwrite to make all again"
                )));
            }
            if !resume {
                return Err(Failure::usage(format!(
                    "{shown}: has shards of another list of inputs, or of another version of tumble; \
                     --resume keeps the shards that are the same, --overwrite makes all again"
                )));
            }
        }
        if let (false, Some(failure)) = (overwrite, self.existing_file(folder, resume)) {
            // Another process may have recorded the same plan meanwhile.
            return match RecordedPlan::read(folder)?.as_ref() == Some(&self.recorded) {
                true => Ok(()),
                false => Err(failure),
            };
        }
        if resume && !overwrite {
            let names = self.names.iter().map(|name| name.as_deref().ok());
            let found = names.zip(&self.inputs);
            let found = found.filter_map(|(name, found)| Some((name?, found)));
            let found: HashMap<&str, &FoundInput> = found.collect();
            if let Some((result, command)) = record::of_other_command(folder, &found) {
                let path = folder.join(result);
                return Err(Failure::usage(format!(
                    "{}: was made by `tumble {command}`; give another directory, or --overwrite to replace it",
                    path.display()
                )));
            }
            let mut replaced = ReplacedOwners::default();
            for (result, owner) in record::other_owners(folder, &found) {
                replaced.check(&found[&*result].path, &folder.join(&result), &owner)?;
            }
            replaced.note();
        }
        self.recorded.write(&opened)
    }

    /// Whether the directory has the file of a shard of this plan.
    fn has_shard(&self, folder: &Path) -> bool {
        record::numbers(folder).into_iter().any(|shard| {
            let bytes = record::bytes(folder, shard).unwrap_or_default();
            record::header(&bytes).is_some_and(|(header, _)| header.plan == self.recorded.plan)
        })
    }

    /// The failure for a file with the name of a result that no manifest lists, or that exists without
    /// `resume`.
    fn existing_file(&self, folder: &Path, resume: bool) -> Option<Failure> {
        let known: HashSet<String> = match resume {
            true => record::names(folder),
            false => HashSet::new(),
        };
        let there = |name: &&String| {
            !known.contains(*name) && std::fs::symlink_metadata(folder.join(name)).is_ok()
        };
        let name = self.names.iter().flatten().find(there)?;
        let path = folder.join(name);
        let path = path.display();
        Some(Failure::usage(match resume {
            true => {
                format!("{path}: exists, and no manifest lists it; give --overwrite to replace it")
            }
            false => format!(
                "{path}: exists; give --overwrite to replace it (--resume skips what is done)"
            ),
        }))
    }
}

impl RecordedPlan {
    /// Below the directory of results.
    fn name() -> PathBuf {
        Path::new(FOLDER).join(PLAN_FILE)
    }

    fn path(folder: &Path) -> PathBuf {
        folder.join(Self::name())
    }

    /// Reads the record of a directory; `None` if it has no shards.
    pub(crate) fn read(folder: &Path) -> Result<Option<Self>, Failure> {
        let path = Self::path(folder);
        let refuse = |why: &dyn std::fmt::Display| {
            let path = path.display();
            Failure::new(ALL_INPUTS, format!("{path}: cannot be read: {why}"))
        };
        let damaged = |why: &dyn std::fmt::Display| {
            let remedy = match Self::count_shards(folder) {
                0 => "`tumble eval … --shard 1/1 --overwrite` makes all results again",
                _ => WRITTEN_AGAIN,
            };
            refuse(why).hinted(&format!("; remove it; then {remedy}"))
        };
        let mut bytes = Vec::new();
        let mut open = || {
            // Files in this folder are written and removed, so it must not be a link.
            parent_beneath(folder, &Self::name())?;
            open_beneath(folder, &Self::name())?
                .take(MAX_PLAN_BYTES)
                .read_to_end(&mut bytes)
        };
        match open() {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => return Ok(None),
            Err(error) => return Err(refuse(&error)),
        }
        let recorded: Self = serde_json::from_slice(&bytes).map_err(|error| damaged(&error))?;
        let Self { shards, inputs, .. } = recorded;
        match (1..=inputs.min(MAX_SHARDS)).contains(&shards) {
            true => Ok(Some(recorded)),
            false => Err(damaged(&format!(
                "it states {shards} shards of {inputs} inputs; a shard has at least one input, and there \
                 are at most {MAX_SHARDS} shards"
            ))),
        }
    }

    /// The message about a directory that has files of shards but no record of their plan. If a manifest lists the
    /// results, an interrupted merge has left these files.
    pub(crate) fn lost(folder: &Path) -> Option<String> {
        let path = Self::path(folder);
        let is_there = |path: &Path| std::fs::symlink_metadata(path).is_ok();
        if is_there(&path) || is_there(&folder.join(NAME)) {
            return None;
        }
        let shards = Self::count_shards(folder);
        (shards > 0).then(|| {
            format!(
                "{}: is missing, and there are files of {}; {WRITTEN_AGAIN}",
                path.display(),
                words::count(shards, "shard")
            )
        })
    }

    /// The number of files of shards in a directory.
    fn count_shards(folder: &Path) -> usize {
        let is_of_shard = |&shard: &usize| {
            let bytes = record::bytes(folder, shard);
            bytes.is_ok_and(|bytes| record::header(&bytes).is_some())
        };
        let shards = record::numbers(folder).into_iter().filter(is_of_shard);
        shards.count()
    }

    /// Writes the record completely; it may replace the same one of another process.
    fn write(&self, folder: &Folder) -> Result<(), Failure> {
        let name = Self::name();
        let failed = |error: io::Error| {
            let path = folder.path().join(&name);
            Failure::writing(&path.display().to_string(), &error)
        };
        folder.create_parent_of(&name).map_err(failed)?;
        let text = serde_json::to_string(self).expect("strings and numbers") + "\n";
        let output = Output::create_in(folder, &name, true, "");
        let mut output = output.map_err(|error| Failure::output(&error))?;
        output.write_all(text.as_bytes()).map_err(failed)?;
        output.commit().map_err(|error| Failure::output(&error))
    }

    /// Removes the record and the files of merged shards. The record is removed first, because without it the files
    /// that an interruption leaves are ignored. Files that no shard has written are kept.
    pub(crate) fn remove(opened: &Folder) -> Result<(), Failure> {
        let folder = opened.path();
        let failed = |error: io::Error| {
            let folder = folder.join(FOLDER);
            Failure::writing(&folder.display().to_string(), &error)
        };
        let ignore_missing = |removed: io::Result<()>| match removed {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(failed(error)),
            _ => Ok(()),
        };
        if Self::read(folder)?.is_none() {
            return Ok(());
        }
        ignore_missing(opened.remove_file(&Self::name()))?;
        for shard in record::numbers(folder) {
            let bytes = record::bytes(folder, shard).unwrap_or_default();
            if record::header(&bytes).is_some() {
                ignore_missing(opened.remove_file(&record::name(shard)))?;
            }
        }
        remove_abandoned(&folder.join(FOLDER));
        match opened.remove_folder(Path::new(FOLDER)) {
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => Ok(()),
            removed => ignore_missing(removed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_depend_on_sizes_alone() {
        assert_eq!(cut(&[], 10), []);
        assert_eq!(cut(&[20, 1], 10), [0..1, 1..2], "one input may be larger");
        assert_eq!(cut(&[4, 6, 1, 20, 3], 10), [0..2, 2..3, 3..4, 4..5]);
        assert_eq!(cut(&[0; 600], 10), [0..256, 256..512, 512..600]);
        assert_eq!(cut(&[u64::MAX, u64::MAX], u64::MAX), [0..1, 1..2]);
    }
}
