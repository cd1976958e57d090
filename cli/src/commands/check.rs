//! `tumble check`: is a batch complete, and have its results or its inputs changed?

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;
use serde::Serialize;

use crate::arguments::options::{self, OptionFile};
use crate::batch::digest::{self, InputFile};
use crate::batch::entry::{
    self, InputEntry, InputState, ManifestEntry, ManifestLines, NAME, UnfinishedInputs,
};
use crate::batch::manifest::InputPresence;
use crate::batch::shards::merge::ShardProgress;
use crate::batch::shards::plan::RecordedPlan;
use crate::batch::shards::record;
use crate::messages::exit::{ALL_INPUTS, DIFFERENCE, FailedInputs, Failure};
use crate::messages::listing;
use crate::messages::progress::busy;
use crate::messages::words;
use crate::threads::on_threads;

/// Check results against the manifest of their directory, bit for bit
#[derive(Debug, Args)]
#[command(after_help = "\
`tumble eval` writes a manifest into every directory of results: for each result a line of \
JSON with the SHA-256 of the result, of its input (with the files that it refers to) and of \
the files that options name, the options, the kernels, the program's version and the device; \
and a line for each input that failed or has no result yet. The exit code is 0 only if the \
batch is complete: all inputs have their results, and no result, no input and no file that an option \
names has changed. Inputs are looked for by their paths in the manifest, so run it in the directory in which \
the batch ran; the exit code is 8 if one is not found. Where the inputs are on another machine, \
--results-only checks the results without them. If shards \
are missing in the directory, it checks the results of the complete shards, and prints how \
many there are.

Examples:
  tumble check results/manifest.jsonl
  tumble check results
  tumble check results --results-only")]
pub(crate) struct Arguments {
    /// The manifest, or its directory
    manifest: PathBuf,
    /// Check the results alone: inputs and files of options are not looked for
    #[arg(long)]
    results_only: bool,
    /// Print JSON: about the batch, and about results that differ and inputs without a result
    #[arg(long)]
    json: bool,
}

/// The JSON that `--json` prints.
#[derive(Debug, Serialize)]
struct CheckReport<'a> {
    manifest: String,
    /// Whether all inputs have their results, and nothing has changed.
    complete: bool,
    results: usize,
    differ: Vec<FaultyResult<'a>>,
    /// Lines of the manifest that cannot be read.
    damaged_lines: usize,
    failed: Vec<&'a InputEntry>,
    /// Inputs that the batch has not processed.
    pending: BTreeSet<&'a str>,
    /// Inputs and files of options that are not found, so that it is not known whether they have changed.
    not_found: BTreeSet<&'a str>,
    /// If the shards of a directory are not merged: the number of shards that are done.
    #[serde(skip_serializing_if = "Option::is_none")]
    shards: Option<String>,
}

/// A result that is not as it was written, or that was made from other files.
#[derive(Debug, Serialize)]
struct FaultyResult<'a> {
    output: &'a str,
    input: &'a str,
    fault: String,
}

/// Why a result does not agree with its manifest.
enum Fault {
    Damaged,
    Unreadable(io::Error),
    /// The result was written as a file, but is now a link to something else.
    Link,
    /// This file has other bytes than those that it was made from.
    Stale(String),
    /// The result is of a clip that this input does not have any more; the results of all clips that it has exist.
    RemovedClip(String),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damaged => f.write_str("its bits have changed since it was written"),
            Self::Unreadable(error) => write!(f, "cannot be read: {error}"),
            Self::Link => f.write_str("its file was replaced by a link"),
            Self::Stale(file) => write!(f, "its {file} has changed since it was written"),
            Self::RemovedClip(input) => write!(f, "its input {input} has no such clip any more"),
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let manifest = &arguments.manifest;
    let path = if manifest.is_dir() {
        manifest.join(NAME)
    } else {
        manifest.clone()
    };
    let shown = path.display();
    let folder = path.parent().unwrap_or(Path::new(""));
    let shards = RecordedPlan::read(folder)?;
    if shards.is_none()
        && let Some(message) = RecordedPlan::lost(folder)
    {
        return Err(Failure::new(DIFFERENCE, message));
    }
    // A pipe or a device may have no end.
    let read = match std::fs::metadata(&path) {
        Ok(found) if !found.is_file() => {
            let message = format!("{shown}: is not a manifest; `tumble eval` writes one, {NAME}");
            return Err(Failure::new(ALL_INPUTS, message));
        }
        _ => std::fs::read(&path),
    };
    let bytes = match read {
        Err(error) if error.kind() == io::ErrorKind::NotFound && shards.is_some() => Vec::new(),
        read => read.map_err(|error| {
            Failure::new(
                ALL_INPUTS,
                format!(
                    "{shown}: the manifest cannot be read: {error}; `check` needs a directory of results that `tumble` wrote"
                ),
            )
        })?,
    };
    let mut lines = ManifestLines::parse(&bytes);
    // An incomplete last line: a batch was killed while writing the line, or the file was truncated.
    lines.damaged += usize::from(bytes.last().is_some_and(|&last| last != b'\n'));
    if shards.is_some() {
        lines.extend(record::lines(folder));
    } else if lines.entries.is_empty() && lines.inputs.is_empty() {
        let message = format!("{shown}: is not a manifest; `tumble eval` writes one, {NAME}");
        return Err(Failure::new(ALL_INPUTS, message));
    }
    let entries: Vec<&ManifestEntry> = lines.entries.values().collect();
    let inputs = match arguments.results_only {
        true => InputHashes::default(),
        false => busy("checking inputs", || InputHashes::of(&entries)),
    };
    let faults: Vec<(&ManifestEntry, Fault)> = busy("checking", || {
        let faulty = |entry| fault(folder, entry, &inputs).map(|fault| (entry, fault));
        on_threads(
            || entries.par_iter().copied().filter_map(faulty).collect(),
            || entries.iter().copied().filter_map(faulty).collect(),
        )
    });
    for (entry, fault) in &faults {
        let output = folder.join(&entry.output);
        let output = output.display();
        words::error(&format!("{output}: {fault}"));
    }
    let absent = inputs.absent(&entries);
    if lines.damaged > 0 {
        words::error(&format!(
            "{shown}: {} damaged",
            words::count(lines.damaged, "line")
        ));
    }
    let progress = shards
        .as_ref()
        .map(|recorded| ShardProgress::of(folder, recorded));
    if arguments.json {
        let UnfinishedInputs { failed, pending } = lines.unfinished_inputs();
        let differ = faults.iter().map(|(entry, fault)| FaultyResult {
            output: &entry.output,
            input: &entry.input,
            fault: fault.to_string(),
        });
        listing::json(&CheckReport {
            manifest: shown.to_string(),
            complete: faults.is_empty()
                && lines.damaged == 0
                && failed.is_empty()
                && pending.is_empty()
                && absent.is_empty()
                && progress.is_none(),
            results: entries.len(),
            differ: differ.collect(),
            damaged_lines: lines.damaged,
            failed,
            pending,
            not_found: absent.paths(),
            shards: progress.as_ref().map(ShardProgress::summary),
        })?;
    }
    let total = words::count(entries.len(), "result");
    let count_of = |is_kind: fn(&Fault) -> bool| {
        let faults = faults.iter().filter(|(_, fault)| is_kind(fault));
        faults.count()
    };
    let unreadable = count_of(|fault| matches!(fault, Fault::Unreadable(_)));
    let of_removed_clips = count_of(|fault| matches!(fault, Fault::RemovedClip(_)));
    let of_total =
        |count: usize, verb: &str| (count > 0).then(|| format!("{count} of {total} {verb}"));
    // A manifest is recognised by its first line.
    let is_known = shards.is_some() || entry::open(folder).is_ok();
    let remedies = Remedies::new(&lines, &faults, is_known);
    let (failed, pending) = unfinished(&lines);
    let changed = faults.len() - unreadable - of_removed_clips;
    let made_again = [
        of_total(changed, "changed"),
        of_total(unreadable, "missing or unreadable"),
        pending,
    ];
    let clips = of_total(of_removed_clips, "of clips that are gone");
    let damaged = (lines.damaged > 0).then(|| {
        let damaged = words::count(lines.damaged, "line");
        format!("{damaged} of the manifest damaged")
    });
    let parts = [
        (joined(made_again), remedies.resume("", ["makes", "make"], "again")),
        (failed, remedies.resume("", ["tries", "try"], "again")),
        (
            joined([clips, absent.orphans_text()]),
            remedies.resume(" --prune", ["removes", "remove"], ""),
        ),
        (damaged, remedies.overwrite()),
        (
            absent.elsewhere_text(),
            Some(
                "run it in the directory in which the batch ran, or add --results-only to check the results alone"
                    .to_owned(),
            ),
        ),
    ];
    let parts = parts.into_iter().filter_map(|(fact, remedy)| {
        let fact = fact?;
        Some(remedy.map_or_else(|| fact.clone(), |remedy| format!("{fact}; {remedy}")))
    });
    let mut missing: Vec<String> = parts.collect();
    if !missing.is_empty() {
        missing.extend(progress.iter().map(|progress| unmerged(folder, progress)));
        let first = missing.remove(0);
        return Err(Failure::new(DIFFERENCE, first).with_lines(missing));
    }
    let were = if entries.len() == 1 {
        "it was"
    } else {
        "they were"
    };
    let unchanged = format!("{total}, unchanged since {were} written");
    match arguments.json {
        true => words::note(&unchanged),
        false => listing::text(&format!("{unchanged}\n"))?,
    }
    match progress {
        None => Ok(()),
        Some(progress) => Err(Failure::new(DIFFERENCE, unmerged(folder, &progress))),
    }
}

/// Facts in a line; `None` if there are none.
fn joined(facts: impl IntoIterator<Item = Option<String>>) -> Option<String> {
    let facts: Vec<String> = facts.into_iter().flatten().collect();
    (!facts.is_empty()).then(|| facts.join(", "))
}

/// The commands that mend a directory of results.
struct Remedies {
    /// The commands of the results and inputs that are to be made again, or those of all.
    commands: BTreeSet<String>,
    has_damaged_lines: bool,
    /// Whether the program would recognise the manifest.
    is_known: bool,
}

impl Remedies {
    fn new(lines: &ManifestLines, faults: &[(&ManifestEntry, Fault)], is_known: bool) -> Self {
        let faulty = faults.iter().map(|(entry, _)| entry.command());
        let processed = lines.inputs.values();
        let processed = processed.filter(|entry| entry.state != InputState::Skipped);
        let mut commands: BTreeSet<&str> =
            faulty.chain(processed.map(InputEntry::command)).collect();
        if commands.is_empty() {
            commands.extend(lines.entries.values().map(ManifestEntry::command));
        }
        if commands.is_empty() {
            commands.insert(options::DEFAULT_COMMAND);
        }
        Self {
            commands: commands.into_iter().map(str::to_owned).collect(),
            has_damaged_lines: lines.damaged > 0,
            is_known,
        }
    }

    /// `tumble features … --resume makes them again`; `None` if that would not help. `verbs` are the verb for one
    /// command, and the verb for several.
    fn resume(&self, more: &str, verbs: [&str; 2], again: &str) -> Option<String> {
        let helps = self.is_known && !self.has_damaged_lines;
        let lines = self.lines(&format!("--resume{more}"));
        let verb = verbs[usize::from(self.commands.len() > 1)];
        helps.then(|| format!("{lines} {verb} them {again}").trim_end().to_owned())
    }

    fn overwrite(&self) -> Option<String> {
        let why = match self.is_known {
            true => "`--resume` does not recognise a result whose line is damaged",
            false => "the first line of the manifest is damaged",
        };
        let lines = self.lines("--overwrite");
        let make = if self.commands.len() == 1 {
            "makes"
        } else {
            "make"
        };
        Some(format!("{why}: {lines} {make} all results again"))
    }

    fn lines(&self, options: &str) -> String {
        let lines = self.commands.iter();
        let lines = lines.map(|command| format!("`tumble {command} … {options}`"));
        lines.collect::<Vec<_>>().join(" and ")
    }
}

/// The inputs that failed and those that no batch has processed yet: how many, and the first.
fn unfinished(lines: &ManifestLines) -> (Option<String>, Option<String>) {
    let UnfinishedInputs { failed, pending } = lines.unfinished_inputs();
    let failed = failed.first().map(|first| {
        let count = FailedInputs::of_codes(failed.iter().map(|entry| entry.code));
        let message = first.message.as_deref().unwrap_or_default();
        let count = count.text().unwrap_or_default();
        format!("{count} (the first: {message})")
    });
    let pending = pending.first().map(|first| {
        let inputs = words::count(pending.len(), "input");
        let have = if pending.len() == 1 { "has" } else { "have" };
        format!("{inputs} {have} no result yet (the first: {first})")
    });
    (failed, pending)
}

/// How many shards of a directory are done, and the command that finishes or combines them.
fn unmerged(folder: &Path, progress: &ShardProgress) -> String {
    let (folder, summary) = (folder.display(), progress.summary());
    match progress.is_done() {
        true => format!("{folder}: {summary}; `tumble merge {folder}` combines them"),
        false => format!("{folder}: {summary}; --resume makes the others"),
    }
}

fn fault(folder: &Path, entry: &ManifestEntry, inputs: &InputHashes<'_>) -> Option<Fault> {
    let (bytes, sha256) = (entry.output_bytes, &entry.output_sha256);
    match digest::is_whole(folder, &entry.output, bytes, sha256) {
        Ok(true) => inputs.fault(entry),
        _ if digest::is_link(folder, &entry.output) => Some(Fault::Link),
        Ok(false) => Some(Fault::Damaged),
        Err(error) => Some(Fault::Unreadable(error)),
    }
}

/// The current hashes of inputs, by their paths in the manifest. Inputs that are not found have no hash.
#[derive(Default)]
struct InputHashes<'a> {
    inputs: BTreeMap<&'a str, Option<String>>,
    /// The results, of all clips of an input together, that were made from the input as it is now.
    made: BTreeSet<&'a str>,
    /// Those of the files that options name.
    of_options: BTreeMap<&'a str, Option<String>>,
}

/// Files that the results were made from and that are not found.
#[derive(Default)]
struct AbsentFiles<'a> {
    /// Results whose inputs were removed from the directory that the batch was about.
    orphans: Vec<&'a ManifestEntry>,
    /// Other inputs, and files of options.
    elsewhere: BTreeSet<&'a str>,
}

impl<'a> AbsentFiles<'a> {
    fn is_empty(&self) -> bool {
        self.orphans.is_empty() && self.elsewhere.is_empty()
    }

    fn paths(&self) -> BTreeSet<&'a str> {
        let removed = self.orphans.iter().map(|entry| &*entry.input);
        removed.chain(self.elsewhere.iter().copied()).collect()
    }

    fn orphans_text(&self) -> Option<String> {
        let first = &self.orphans.first()?.output;
        let results = words::count(self.orphans.len(), "result");
        let have = if self.orphans.len() == 1 {
            "has"
        } else {
            "have"
        };
        Some(format!(
            "{results} {have} no input any more (the first: {first})"
        ))
    }

    fn elsewhere_text(&self) -> Option<String> {
        let first = self.elsewhere.first()?;
        let files = words::count(self.elsewhere.len(), "input file");
        Some(format!(
            "{files} not found (the first: {first}), so changes in them are not known"
        ))
    }
}

impl<'a> InputHashes<'a> {
    fn of(entries: &[&'a ManifestEntry]) -> Self {
        let hashed = entries.iter().filter(|entry| entry.input_sha256.is_some());
        let inputs: BTreeSet<&str> = hashed.map(|entry| &*entry.input).collect();
        let hash = |input: &'a str| {
            let file = InputFile::new(Path::new(input));
            (input, file.sha256().map(str::to_owned))
        };
        let inputs: Vec<&str> = inputs.into_iter().collect();
        let hashes: Vec<(&str, Option<String>)> = on_threads(
            || inputs.par_iter().map(|input| hash(input)).collect(),
            || inputs.iter().map(|input| hash(input)).collect(),
        );
        let inputs: BTreeMap<&str, Option<String>> = hashes.into_iter().collect();
        let mut counts: BTreeMap<(&str, usize), usize> = BTreeMap::new();
        for entry in entries {
            let now = inputs.get(&*entry.input).and_then(Option::as_ref);
            if now.is_some() && now == entry.input_sha256.as_ref() {
                *counts.entry(entry.whole()).or_default() += 1;
            }
        }
        let made = counts.into_iter().filter(|((_, all), found)| found >= all);
        let files = entries.iter().flat_map(|entry| &entry.option_files);
        // Files without a hash are left out: they could be read only once, as standard input.
        let files = files.filter(|file| !file.sha256.is_empty());
        let paths: BTreeSet<&str> = files.map(|file| &*file.path).collect();
        let hash = |path| Some(options::content(path)).filter(|_| Path::new(path).exists());
        Self {
            made: made.map(|((result, _), _)| result).collect(),
            inputs,
            of_options: paths.into_iter().map(|path| (path, hash(path))).collect(),
        }
    }

    /// The fault of a whole result whose input, or the file of an option, is there with other bytes than those that the
    /// result was made from.
    fn fault(&self, entry: &ManifestEntry) -> Option<Fault> {
        let now = self.inputs.get(&*entry.input).and_then(Option::as_ref);
        if now.is_some_and(|now| entry.input_sha256.as_ref() != Some(now)) {
            let input = &entry.input;
            return Some(match self.made.contains(entry.whole().0) {
                true => Fault::RemovedClip(input.clone()),
                false => Fault::Stale(format!("input {input} (or a file that belongs to it)")),
            });
        }
        let differs = |file: &&OptionFile| {
            let now = self.of_options.get(&*file.path).and_then(Option::as_ref);
            now.is_some_and(|now| *now != file.sha256)
        };
        let file = entry.option_files.iter().find(differs)?;
        Some(Fault::Stale(format!(
            "file {} of --{}",
            file.path, file.option
        )))
    }

    /// The inputs of results, and the files of options, that are not found or cannot be read.
    fn absent(&self, entries: &[&'a ManifestEntry]) -> AbsentFiles<'a> {
        let mut absent = AbsentFiles::default();
        for &entry in entries {
            let is_read = !self.inputs.get(&*entry.input).is_some_and(Option::is_none);
            if is_read || entry.is_of_directory() && Path::new(&entry.input).is_dir() {
                continue;
            }
            match InputPresence::of_entry(entry) {
                InputPresence::Removed => absent.orphans.push(entry),
                InputPresence::Present | InputPresence::Unknown => {
                    absent.elsewhere.insert(&*entry.input);
                }
            }
        }
        let files = self.of_options.iter();
        let files = files.filter_map(|(path, hash)| hash.is_none().then_some(*path));
        absent.elsewhere.extend(files);
        absent
    }
}
