//! Which inputs a shard has, and what a directory's shards are of.

use std::collections::HashSet;
use std::io::{self, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tumble_formats::beneath::{open_beneath, parent_beneath};
use tumble_formats::format::Format;
use tumble_formats::output::{Output, remove_abandoned};

use crate::arguments::gather::Found;
use crate::arguments::input;
use crate::batch::digest::Digest;
use crate::batch::folder::{self, Name};
use crate::batch::manifest::kernels_sha256;
use crate::batch::place;
use crate::batch::shards::record;
use crate::messages::exit::{ALL_INPUTS, Failure};

/// The directory in that of results.
pub(crate) const FOLDER: &str = "manifest.d";

/// What the shards are of.
const STATED: &str = "plan.json";

/// No shard has more inputs: what a lost worker had done of one is done again.
const MOST_INPUTS: usize = 256;

/// Shards of a list, at most: whoever merges them looks for each.
const MOST_SHARDS: usize = 1 << 20;

/// A longer file says nothing of shards.
const LONGEST: u64 = 1 << 20;

/// All inputs of a request, cut into shards.
pub(crate) struct Plan {
    pub(crate) inputs: Vec<Found>,
    /// Of the results, in the order of their inputs.
    pub(crate) names: Vec<Name>,
    /// The inputs of each shard.
    pub(crate) cuts: Vec<Range<usize>>,
    pub(crate) format: &'static Format,
    pub(crate) stated: Stated,
}

/// What a directory says of its shards. Two of one plan are equal, wherever they were made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Stated {
    /// The hash of all that decides which shard has which inputs, and how they are evaluated.
    pub(crate) plan: String,
    pub(crate) shards: usize,
    pub(crate) inputs: usize,
    /// Of input in a shard, at most; one input may be larger.
    pub(crate) shard_bytes: u64,
    /// The hash of the names of all results.
    pub(crate) outputs_sha256: String,
    pub(crate) options: String,
    pub(crate) kernels_sha256: String,
    pub(crate) tumble: String,
}

/// The inputs of shards: in their order, until there are `MOST_INPUTS`, or would be more than
/// `most_bytes`.
pub(crate) fn cut(sizes: &[u64], most_bytes: u64) -> Vec<Range<usize>> {
    let mut cuts = Vec::new();
    let (mut first, mut bytes) = (0, 0_u128);
    for (place, size) in sizes.iter().map(|&size| u128::from(size)).enumerate() {
        let is_full = place - first == MOST_INPUTS || bytes + size > u128::from(most_bytes);
        if is_full && place > first {
            cuts.push(first..place);
            (first, bytes) = (place, 0);
        }
        bytes += size;
    }
    if first < sizes.len() {
        cuts.push(first..sizes.len());
    }
    cuts
}

/// The hash of a list of names; an input without one has none there.
pub(crate) fn hash_of(names: &[Name]) -> String {
    let mut digest = Digest::default();
    for name in names.iter().flatten() {
        digest.update(name.as_bytes());
        digest.update(b"\n"); // in a name it would be one of another list, which does no harm here
    }
    digest.finish()
}

impl Plan {
    /// Cuts inputs, of those sizes, into shards.
    pub(crate) fn new(
        inputs: Vec<Found>,
        sizes: &[u64],
        folder: &Path,
        format: Option<&'static Format>,
        options: String,
        shard_bytes: u64,
    ) -> Result<Self, Failure> {
        if let Some(pipe) = inputs.iter().find(|found| input::is_standard(&found.path)) {
            let name = input::name(&pipe.path);
            let message = format!("{name}: no other process can read it; give a file");
            return Err(Failure::usage(message));
        }
        let format = folder::format(folder, format)?;
        let names = folder::names(&inputs, folder, format);
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
        let stated = Stated {
            plan: digest.finish(),
            shards: cuts.len(),
            inputs: inputs.len(),
            shard_bytes,
            outputs_sha256: hash_of(&names),
            options,
            kernels_sha256: kernels_sha256().to_owned(),
            tumble: env!("CARGO_PKG_VERSION").to_owned(),
        };
        Ok(Self {
            inputs,
            names,
            cuts,
            format,
            stated,
        })
    }

    /// Says in the directory what its shards are of, before any result gets its name: from then on
    /// the results of the plan are no stranger's. Any number of processes may do so at once.
    pub(crate) fn claim(
        &self,
        folder: &Path,
        resume: bool,
        overwrite: bool,
    ) -> Result<(), Failure> {
        place::folder(folder)?;
        let found = Stated::read(folder)?;
        if found.as_ref() == Some(&self.stated) {
            return Ok(());
        }
        if found.is_some() && !resume && !overwrite {
            let shown = folder.display();
            return Err(Failure::usage(format!(
                "{shown}: has shards of another list, other options or another tumble; --resume keeps \
                 what is the same, --overwrite makes all again"
            )));
        }
        if let (false, Some(failure)) = (overwrite, self.stranger(folder, resume)) {
            // Another process of the same plan may have been quicker.
            return match Stated::read(folder)?.as_ref() == Some(&self.stated) {
                true => Ok(()),
                false => Err(failure),
            };
        }
        self.stated.write(folder)
    }

    /// A file under the name of a result, which no manifest names or nobody asked to go on with.
    fn stranger(&self, folder: &Path, resume: bool) -> Option<Failure> {
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
        Some(Failure::usage(format!(
            "{path}: exists; give --overwrite to replace it (--resume skips what is done)"
        )))
    }
}

impl Stated {
    /// Below the directory of results.
    fn name() -> PathBuf {
        Path::new(FOLDER).join(STATED)
    }

    fn path(folder: &Path) -> PathBuf {
        folder.join(Self::name())
    }

    /// What a directory says; nothing where it has no shards.
    pub(crate) fn read(folder: &Path) -> Result<Option<Self>, Failure> {
        let path = Self::path(folder);
        let refuse = |why: &dyn std::fmt::Display| {
            let path = path.display();
            Failure::new(ALL_INPUTS, format!("{path}: cannot be read: {why}"))
        };
        let mut bytes = Vec::new();
        let mut open = || {
            // What is in it is to be written and removed: it is no link.
            parent_beneath(folder, &Self::name())?;
            open_beneath(folder, &Self::name())?
                .take(LONGEST)
                .read_to_end(&mut bytes)
        };
        match open() {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => return Ok(None),
            Err(error) => return Err(refuse(&error)),
        }
        let stated: Self = serde_json::from_slice(&bytes).map_err(|error| refuse(&error))?;
        let Self { shards, inputs, .. } = stated;
        match (1..=inputs.min(MOST_SHARDS)).contains(&shards) {
            true => Ok(Some(stated)),
            false => Err(refuse(&format!(
                "it says {shards} shards of {inputs} inputs; each has one at least, and there are \
                 {MOST_SHARDS} at most; remove it"
            ))),
        }
    }

    /// Written whole, over what another process writes at the same time.
    fn write(&self, folder: &Path) -> Result<(), Failure> {
        let path = Self::path(folder);
        place::folder(&folder.join(FOLDER))?;
        let text = serde_json::to_string(self).expect("strings and numbers") + "\n";
        let output = Output::create(&path, true, &[]);
        let mut output = output.map_err(|error| Failure::output(&error))?;
        let written = output.write_all(text.as_bytes());
        written.map_err(|error| Failure::writing(&path.display().to_string(), &error))?;
        output.commit().map_err(|error| Failure::output(&error))
    }

    /// The shards are merged: nothing is said of them any more. What is left when this is stopped
    /// half-way says nothing without the plan, which goes first. Files that no shard has written stay.
    pub(crate) fn remove(folder: &Path) -> Result<(), Failure> {
        let failed = |error: io::Error| {
            let folder = folder.join(FOLDER);
            Failure::writing(&folder.display().to_string(), &error)
        };
        let gone = |removed: io::Result<()>| match removed {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(failed(error)),
            _ => Ok(()),
        };
        if Self::read(folder)?.is_none() {
            return Ok(());
        }
        gone(std::fs::remove_file(Self::path(folder)))?;
        for shard in record::numbers(folder) {
            let bytes = record::bytes(folder, shard).unwrap_or_default();
            if record::header(&bytes).is_some() {
                gone(std::fs::remove_file(record::path(folder, shard)))?;
            }
        }
        remove_abandoned(&folder.join(FOLDER));
        match std::fs::remove_dir(folder.join(FOLDER)) {
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => Ok(()),
            removed => gone(removed),
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
