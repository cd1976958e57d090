//! What a shard leaves when it is done: its lines of the manifest, behind a line about itself.

use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::batch::manifest::{self, Entry, Lines};
use crate::batch::shards::plan::FOLDER;

/// The first line of a shard's file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Header {
    /// From 1.
    pub(crate) shard: usize,
    pub(crate) of: usize,
    /// As in `plan.json`.
    pub(crate) plan: String,
    pub(crate) inputs: usize,
    /// Inputs without a result.
    pub(crate) failed: Vec<Refusal>,
}

/// An input that was refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Refusal {
    pub(crate) input: String,
    /// The exit code of a command that has this input alone.
    pub(crate) code: u8,
    pub(crate) message: String,
}

/// The file of a shard.
pub(crate) fn path(folder: &Path, shard: usize) -> PathBuf {
    folder.join(FOLDER).join(format!("{shard:05}.jsonl"))
}

/// What the temporary files of a shard's results are called by.
pub(crate) fn mark(shard: usize) -> String {
    format!("{MARK}{shard:05}-")
}

/// What the temporary files of all shards' results are called by.
pub(crate) const MARK: &str = "shard";

/// A shard's file as text.
pub(crate) fn text<'a>(header: &Header, entries: impl IntoIterator<Item = &'a Entry>) -> String {
    let mut text = serde_json::to_string(header).expect("strings and numbers") + "\n";
    for entry in entries {
        text += &manifest::line(entry);
    }
    text
}

/// The line about a shard, and how long it is; nothing where the file is no shard's.
pub(crate) fn header(bytes: &[u8]) -> Option<(Header, usize)> {
    let end = bytes.iter().position(|&byte| byte == b'\n')? + 1;
    let header = serde_json::from_slice(&bytes[..end]).ok()?;
    bytes.ends_with(b"\n").then_some((header, end))
}

/// All results that done shards of a directory have made.
pub(crate) fn entries(folder: &Path) -> BTreeMap<String, Entry> {
    let mut all = BTreeMap::new();
    for file in std::fs::read_dir(folder.join(FOLDER))
        .into_iter()
        .flatten()
        .flatten()
    {
        let bytes = std::fs::read(file.path()).unwrap_or_default();
        if let Some((_, start)) = header(&bytes) {
            all.extend(Lines::parse(&bytes[start..]).entries);
        }
    }
    all
}

/// As much of a line as says whose it is.
#[derive(Deserialize)]
struct Owner {
    output: String,
    #[serde(default)]
    one_of: Option<(String, usize)>,
}

/// The results, and the results of all clips of an input together, that a directory's manifests name.
/// They may be a million: one line is in memory at a time.
pub(crate) fn names(folder: &Path) -> HashSet<String> {
    let shards = std::fs::read_dir(folder.join(FOLDER)).into_iter().flatten();
    let shards = shards.flatten().map(|file| file.path());
    let mut known = HashSet::new();
    for path in shards.chain([folder.join(manifest::NAME)]) {
        let Ok(file) = File::open(path) else {
            continue;
        };
        // A line that is no entry, such as that about the shard itself, has no output.
        for line in BufReader::new(file).lines().map_while(Result::ok) {
            if let Ok(Owner { output, one_of }) = serde_json::from_str(&line) {
                known.insert(output);
                known.extend(one_of.map(|(all, _)| all));
            }
        }
    }
    known
}

/// What manifests say of the results of one shard: the directory's, and the shard's own from an
/// earlier time, which is the later word.
pub(crate) fn previous(folder: &Path, shard: usize, names: &[&str]) -> BTreeMap<String, Entry> {
    let own: HashSet<&str> = names.iter().copied().collect();
    let mut found = BTreeMap::new();
    if let Ok(file) = File::open(folder.join(manifest::NAME)) {
        // The directory's may be of a million results: one line is in memory at a time.
        for line in BufReader::new(file).lines().map_while(Result::ok) {
            let Ok(owner) = serde_json::from_str::<Owner>(&line) else {
                continue;
            };
            let of_all = owner.one_of.as_ref().map(|(all, _)| &**all);
            let is_own =
                own.contains(&*owner.output) || of_all.is_some_and(|all| own.contains(all));
            if is_own && let Ok(entry) = serde_json::from_str::<Entry>(&line) {
                found.insert(owner.output, entry);
            }
        }
    }
    let bytes = std::fs::read(path(folder, shard)).unwrap_or_default();
    if let Some((_, start)) = header(&bytes) {
        found.extend(Lines::parse(&bytes[start..]).entries);
    }
    found
}
