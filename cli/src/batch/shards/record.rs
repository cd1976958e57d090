//! The file of a shard that is done: a header line, then its lines of the manifest.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tumble_formats::beneath::{is_beneath, open_beneath};

use crate::arguments::input::FoundInput;
use crate::arguments::options::DEFAULT_COMMAND;
use crate::batch::digest;
use crate::batch::entry::{
    self, InputEntry, InputState, ManifestEntry, ManifestLines, PreviousEntries,
};
use crate::batch::owner::Owner;
use crate::messages::warnings::RecordedWarning;

/// The subdirectory of shards in a directory of results.
pub(crate) const FOLDER: &str = "manifest.d";

/// The first line of a shard's file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ShardHeader {
    /// From 1.
    pub(crate) shard: usize,
    pub(crate) of: usize,
    /// As in `plan.json`.
    pub(crate) plan: String,
    pub(crate) inputs: usize,
    /// Inputs without a result.
    pub(crate) failed: Vec<RefusedInput>,
    /// How many lines follow this one, and their hash: a file that differs belongs to a shard that is not done.
    #[serde(default)]
    pub(crate) results: usize,
    #[serde(default)]
    pub(crate) results_sha256: String,
}

/// An input that was refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RefusedInput {
    pub(crate) input: String,
    /// The exit code of a command that has only this input.
    pub(crate) code: u8,
    pub(crate) message: String,
    /// The result that it would have, if one is possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) result: Option<String>,
    /// As in [`InputEntry`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) diagnostic: Option<String>,
    /// As in [`InputEntry`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) causes: Vec<String>,
    /// As in [`InputEntry`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) warnings: Vec<RecordedWarning>,
}

impl RefusedInput {
    /// Its entry in a manifest.
    pub(crate) fn entry(&self) -> InputEntry {
        InputEntry {
            state: InputState::Failed,
            input: self.input.clone(),
            result: self.result.clone().filter(|result| is_beneath(result)),
            code: Some(self.code),
            message: Some(self.message.clone()),
            diagnostic: self.diagnostic.clone(),
            causes: self.causes.clone(),
            warnings: self.warnings.clone(),
            command: None,
        }
    }
}

/// The file of a shard, below the directory of results.
pub(crate) fn name(shard: usize) -> PathBuf {
    Path::new(FOLDER).join(format!("{shard:05}.jsonl"))
}

/// The file of a shard.
pub(crate) fn path(folder: &Path, shard: usize) -> PathBuf {
    folder.join(name(shard))
}

/// The numbers of the shards that a directory has files of, in order.
pub(crate) fn numbers(folder: &Path) -> Vec<usize> {
    let files = std::fs::read_dir(folder.join(FOLDER)).into_iter().flatten();
    let numbers = files.flatten().filter_map(|file| {
        let number = Path::new(&file.file_name())
            .file_stem()?
            .to_str()?
            .parse()
            .ok()?;
        (name(number).file_name()? == file.file_name()).then_some(number)
    });
    let mut numbers: Vec<usize> = numbers.collect();
    numbers.sort_unstable();
    numbers
}

/// The bytes of a shard's file.
pub(crate) fn bytes(folder: &Path, shard: usize) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_beneath(folder, &name(shard))?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The start of the names of the temporary files of a shard's results.
pub(crate) fn mark(shard: usize) -> String {
    format!("{MARK}{shard:05}-")
}

/// The start of the names of the temporary files of all shards' results.
pub(crate) const MARK: &str = "shard";

/// A shard's file as text.
pub(crate) fn text<'a>(
    header: &ShardHeader,
    entries: impl IntoIterator<Item = &'a ManifestEntry>,
) -> String {
    let lines: Vec<String> = entries.into_iter().map(entry::line).collect();
    let header = ShardHeader {
        results: lines.len(),
        results_sha256: digest::of_bytes(lines.iter().map(String::as_bytes)),
        ..header.clone()
    };
    let first = serde_json::to_string(&header).expect("strings and numbers") + "\n";
    first + &lines.concat()
}

/// The header of a shard's file, and its length; `None` if the file is not a shard's.
pub(crate) fn header(bytes: &[u8]) -> Option<(ShardHeader, usize)> {
    let end = bytes.iter().position(|&byte| byte == b'\n')? + 1;
    let header = serde_json::from_slice(&bytes[..end]).ok()?;
    Some((header, end))
}

/// As [`header`], of a file whose lines are complete and unchanged.
pub(crate) fn whole(bytes: &[u8]) -> Option<(ShardHeader, usize)> {
    let (header, start) = header(bytes)?;
    let lines = &bytes[start..];
    let count = lines.split_inclusive(|&byte| byte == b'\n').count();
    let is_whole = count == header.results
        && digest::of_bytes([lines]) == header.results_sha256
        && lines
            .split_inclusive(|&byte| byte == b'\n')
            .all(|line| line.ends_with(b"\n") && owner(line).is_some());
    is_whole.then_some((header, start))
}

/// The lines of all shards of a directory: the results that they have made, and the inputs that failed.
pub(crate) fn lines(folder: &Path) -> ManifestLines {
    let mut all = ManifestLines::parse(&[]);
    for shard in numbers(folder) {
        all.extend(lines_of(&bytes(folder, shard).unwrap_or_default()));
    }
    all
}

/// The lines in the bytes of a shard's file.
pub(crate) fn lines_of(bytes: &[u8]) -> ManifestLines {
    let Some((header, start)) = header(bytes) else {
        return ManifestLines::parse(&[]);
    };
    let mut lines = ManifestLines::parse(&bytes[start..]);
    let failed = header.failed.iter().map(RefusedInput::entry);
    lines.inputs = failed.map(|entry| (entry.key(), entry)).collect();
    lines
}

/// The part of a line that names its result.
#[derive(Deserialize)]
struct NamedResult {
    output: String,
    #[serde(default)]
    one_of: Option<(String, usize)>,
}

/// The result that a line names, and that of all clips; `None` if the line is not an entry, or names
/// a result outside its directory.
pub(crate) fn owner(line: &[u8]) -> Option<(String, Option<String>)> {
    let NamedResult { output, one_of } = serde_json::from_slice(line).ok()?;
    let all = one_of.map(|(all, _)| all);
    let is_good = is_beneath(&output) && all.as_deref().is_none_or(is_beneath);
    is_good.then_some((output, all))
}

/// The results, and the results of all clips of an input together, that a directory's manifests name.
pub(crate) fn names(folder: &Path) -> HashSet<String> {
    let mut known = HashSet::new();
    for_each_line(folder, |line| {
        if let Some((output, all)) = owner(line) {
            known.insert(output);
            known.extend(all);
        }
    });
    known
}

/// The inputs of some results, as a directory's manifests name them.
pub(crate) fn inputs_of(folder: &Path, results: &HashSet<&str>) -> HashMap<String, String> {
    let mut inputs = HashMap::new();
    for_each_line(folder, |line| {
        let entry = ManifestEntry::of_line(line);
        if let Some(entry) = entry.filter(|entry| results.contains(entry.whole().0)) {
            inputs.insert(entry.whole().0.to_owned(), entry.input);
        }
    });
    inputs
}

/// The results in `found` that, according to a directory's manifests, were made from inputs with other paths; in order.
pub(crate) fn other_owners(
    folder: &Path,
    found: &HashMap<&str, &FoundInput>,
) -> BTreeMap<String, Owner> {
    let mut owners = BTreeMap::new();
    for_each_line(folder, |line| {
        let Some(entry) = ManifestEntry::of_line(line) else {
            return;
        };
        let result = entry.whole().0;
        match found.get(result) {
            Some(found) if found.path.display().to_string() != entry.input => {
                owners.insert(result.to_owned(), Owner::from(&entry));
            }
            _ => {
                owners.remove(result);
            }
        }
    });
    owners
}

/// The first result in `found` that, according to a directory's manifests, another command has made than the command of
/// shards; and that command.
pub(crate) fn of_other_command(
    folder: &Path,
    found: &HashMap<&str, &FoundInput>,
) -> Option<(String, String)> {
    let mut first = None;
    for_each_line(folder, |line| {
        let entry = ManifestEntry::of_line(line).filter(|_| first.is_none());
        let other = entry.filter(|entry| {
            found.contains_key(entry.whole().0) && entry.command() != DEFAULT_COMMAND
        });
        first = first
            .take()
            .or_else(|| other.map(|entry| (entry.output.clone(), entry.command().to_owned())));
    });
    first
}

/// Passes on the lines of a directory's manifests, those of its shards last: they are newer. They may be a million: one
/// line is in memory at a time. A line that is not an entry, such as a shard's header, is among them.
fn for_each_line(folder: &Path, mut each: impl FnMut(&[u8])) {
    let shards = numbers(folder).into_iter();
    let shards = shards.filter_map(|shard| open_beneath(folder, &name(shard)).ok());
    let manifest = entry::open(folder).ok().flatten();
    for file in manifest.into_iter().chain(shards) {
        for line in BufReader::new(file).split(b'\n').map_while(Result::ok) {
            each(&line);
        }
    }
}

/// The inputs without results in a directory's manifest, by the names of their results; `None` if there is no
/// manifest.
pub(crate) fn merged_failures(folder: &Path) -> Option<HashMap<String, InputEntry>> {
    let file = entry::open(folder).ok().flatten()?;
    let lines = BufReader::new(file).split(b'\n').map_while(Result::ok);
    let failed = lines.filter_map(|line| {
        let entry = match owner(&line) {
            Some(_) => None,
            None => InputEntry::of_line(&line),
        };
        entry.filter(|entry| entry.state == InputState::Failed)
    });
    Some(failed.map(|entry| (entry.key(), entry)).collect())
}

/// The entries for the results of one shard: those of the directory's manifest, replaced by those of the
/// shard's file.
pub(crate) fn previous(folder: &Path, shard: usize, names: &[&str]) -> PreviousEntries {
    let shard_names: HashSet<&str> = names.iter().copied().collect();
    let mut found = ManifestLines::parse(&[]);
    if let Ok(Some(file)) = entry::open(folder) {
        // The directory's manifest may have a million lines, so only one line is in memory at a time.
        for line in BufReader::new(file).split(b'\n').map_while(Result::ok) {
            let is_of_shard = |name: &str| shard_names.contains(name);
            let is_kept = match owner(&line) {
                Some((output, all)) => is_of_shard(all.as_deref().unwrap_or(&output)),
                None => InputEntry::of_line(&line).is_some_and(|entry| is_of_shard(&entry.key())),
            };
            if is_kept {
                found.extend(ManifestLines::parse(&line));
            }
        }
    }
    found.extend(lines_of(&bytes(folder, shard).unwrap_or_default()));
    let unfinished = found.unfinished();
    PreviousEntries::new(folder, found.entries, unfinished)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_lost_a_line_is_not_whole() {
        let entry = |name: &str| ManifestEntry {
            output: name.to_owned(),
            output_sha256: String::new(),
            output_bytes: 1,
            input: name.to_owned(),
            input_sha256: None,
            options: String::new(),
            option_files: Vec::new(),
            kernels_sha256: String::new(),
            tumble: String::new(),
            device: String::new(),
            one_of: None,
            frames: entry::FrameNotes::default(),
            warnings: Vec::new(),
        };
        let entries = [entry("a"), entry("b"), entry("c")];
        let all = text(&ShardHeader::default(), &entries);
        assert!(whole(all.as_bytes()).is_some());
        for removed in 1..4 {
            let left: String = (all.lines().enumerate())
                .filter(|(at, _)| *at != removed)
                .map(|(_, line)| format!("{line}\n"))
                .collect();
            assert!(whole(left.as_bytes()).is_none(), "without line {removed}");
        }
        assert!(whole(all.trim_end().as_bytes()).is_none());
        assert!(whole(all.replace("\"b\"", "\"d\"").as_bytes()).is_none());
    }
}
