//! Merges the shards of a directory into the manifest that one process would have written.

use std::collections::{BTreeSet, HashMap};
use std::io::{BufRead, BufReader, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use tumble_formats::beneath::{open_beneath, parent_beneath};
use tumble_formats::folder::Folder;
use tumble_formats::output::{Output, remove_abandoned, remove_marked};

use crate::batch::entry::{
    self, InputEntries, InputEntry, InputState, ManifestEntry, ManifestLines, NAME,
};
use crate::batch::manifest;
use crate::batch::shards::plan::RecordedPlan;
use crate::batch::shards::record::{self, MARK, RefusedInput};
use crate::batch::target;
use crate::messages::exit::{ALL_INPUTS, DIFFERENCE, Failure};
use crate::messages::words;

/// How many files of shards are in memory at once; neighbouring results are mostly of one shard.
const MAX_CACHED_FILES: usize = 16;

/// The outcome of merging.
#[derive(Debug)]
pub(crate) struct MergeSummary {
    /// Lines of the manifest.
    pub(crate) results: usize,
    pub(crate) shards: usize,
    pub(crate) inputs: usize,
    pub(crate) failed: Vec<RefusedInput>,
}

/// Where the results of a manifest are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ResultLocation {
    /// In the directory of the manifest.
    Beside,
    /// In an object store; the directory has only the records of the shards.
    Store,
}

/// The results that are not in their directory as they were written.
#[derive(Default)]
struct FaultyResults {
    count: usize,
    first: Option<String>,
}

/// How many shards of a directory are done.
pub(crate) struct ShardProgress {
    done: usize,
    all: usize,
    first_missing: Option<usize>,
}

/// A line of the new manifest: its result, and the file and position of the line. File 0 is the previous manifest; file
/// n is the file of shard n.
struct LinePosition {
    output: String,
    file: usize,
    at: Range<usize>,
}

impl FaultyResults {
    /// Compares the length of a result with that in its entry.
    fn look_at(&mut self, folder: &Path, entry: &ManifestEntry) {
        let file = open_beneath(folder, Path::new(&entry.output));
        let length = file.and_then(|file| Ok(file.metadata()?.len()));
        let fault = match length {
            Ok(length) if length == entry.output_bytes => return,
            Ok(length) => format!(
                "has {length} bytes, and was written with {}",
                entry.output_bytes
            ),
            Err(error) => format!("cannot be read: {error}"),
        };
        self.count += 1;
        self.first
            .get_or_insert_with(|| format!("{} {fault}", entry.output));
    }

    fn outcome(&self, folder: &Path, all: usize) -> Result<(), Failure> {
        let Some(first) = &self.first else {
            return Ok(());
        };
        let message = format!(
            "{}: {} of {} missing or damaged (the first: {first}), so nothing is merged; the command that made \
             the shards makes them again with --resume",
            folder.display(),
            self.count,
            words::count(all, "result"),
        );
        Err(Failure::new(DIFFERENCE, message))
    }
}

impl ShardProgress {
    /// Reads the files that exist; their number, not that of the plan's shards, decides the time.
    pub(crate) fn of(folder: &Path, recorded: &RecordedPlan) -> Self {
        let all = recorded.shards;
        let numbers = record::numbers(folder).into_iter();
        let numbers = numbers.filter(|shard| (1..=all).contains(shard));
        let done: Vec<usize> = numbers
            .filter(|&shard| read(folder, recorded, shard).is_some())
            .collect();
        let gap = (1..).zip(&done).find(|(number, shard)| number != *shard);
        let first = gap.map_or(done.len() + 1, |(number, _)| number);
        Self {
            done: done.len(),
            all,
            first_missing: (first <= all).then_some(first),
        }
    }

    pub(crate) fn is_done(&self) -> bool {
        self.first_missing.is_none()
    }

    /// `3 of 79 shards are done; the first that is not is shard 4`.
    pub(crate) fn summary(&self) -> String {
        let all = words::count(self.all, "shard");
        let first = self.first_missing;
        let first = first.map(|first| format!("; the first that is not is shard {first}"));
        let are = if self.all == 1 { "is" } else { "are" };
        format!(
            "{} of {all} {are} done{}",
            self.done,
            first.unwrap_or_default()
        )
    }
}

/// A shard's file, if it is complete and of the plan, with its refusals and the start of its lines.
fn read(
    folder: &Path,
    recorded: &RecordedPlan,
    shard: usize,
) -> Option<(Vec<u8>, Vec<RefusedInput>, usize)> {
    let bytes = record::bytes(folder, shard).ok()?;
    let (header, start) = record::whole(&bytes)?;
    let matches_plan = header.plan == recorded.plan && header.shard == shard;
    matches_plan.then_some((bytes, header.failed, start))
}

/// Writes the manifest of a directory whose shards are all done, and removes `manifest.d` and the
/// temporary files of lost workers. If results are missing, or have another length than when they were written, nothing
/// is changed.
pub(crate) fn merge(folder: &Path, location: ResultLocation) -> Result<MergeSummary, Failure> {
    let shown = folder.display();
    std::fs::read_dir(folder)
        .map_err(|error| Failure::new(ALL_INPUTS, format!("{shown}: cannot be read: {error}")))?;
    let Some(recorded) = RecordedPlan::read(folder)? else {
        return Err(match RecordedPlan::lost(folder) {
            Some(message) => Failure::new(DIFFERENCE, message),
            None => Failure::new(
                ALL_INPUTS,
                format!("{shown}: has no shards to merge; `tumble eval … --shard` makes them"),
            ),
        });
    };
    // Two merging processes would remove each other's files, so the folder is locked.
    let opened = target::opened(folder)?;
    let _lock = manifest::lock(&opened)?;
    let progress = ShardProgress::of(folder, &recorded);
    if !progress.is_done() {
        let message = format!("{shown}: {}; make them with --resume", progress.summary());
        return Err(Failure::new(DIFFERENCE, message));
    }
    let mut lines = Vec::new();
    let path = folder.join(NAME);
    let mut inputs = list_before(folder, &path, &mut lines)?;
    inputs.retain(|_, entry| entry.state != InputState::Skipped);
    let mut failed: Vec<RefusedInput> = Vec::new();
    for shard in 1..=recorded.shards {
        let (bytes, refused, start) = read(folder, &recorded, shard).ok_or_else(|| {
            let message = format!("{shown}: shard {shard} was removed while it was merged");
            Failure::new(DIFFERENCE, message)
        })?;
        failed.extend(refused);
        list(&bytes, start, shard, &mut lines);
        if !inputs.is_empty() {
            let found = ManifestLines::parse(&bytes[start..]);
            found
                .entries
                .values()
                .for_each(|entry| entry.settle(&mut inputs));
        }
    }
    let refused = failed.iter().map(RefusedInput::entry);
    let without_results = refused.chain(recorded.skipped.iter().cloned());
    inputs.extend(without_results.map(|entry| (entry.key(), entry)));
    let lines = one_each(lines)?;
    if !lines.is_empty() || !inputs.is_empty() {
        write(&opened, &path, (&lines, location), &inputs)?;
    }
    let parents: BTreeSet<PathBuf> = (lines.iter())
        .filter_map(|line| parent_beneath(folder, Path::new(&line.output)).ok())
        .collect();
    for parent in parents.iter().map(|parent| &**parent).chain([folder]) {
        remove_marked(parent, MARK);
        remove_abandoned(parent);
    }
    RecordedPlan::remove(&opened)?;
    Ok(MergeSummary {
        results: lines.len(),
        shards: recorded.shards,
        inputs: recorded.inputs,
        failed,
    })
}

/// Lists the lines of the previous manifest, which may have a million results: one is in memory at a time. Gives the
/// entries of its inputs without results.
fn list_before(
    folder: &Path,
    path: &Path,
    lines: &mut Vec<LinePosition>,
) -> Result<InputEntries, Failure> {
    let mut inputs = InputEntries::new();
    let Some(file) = entry::open(folder)? else {
        return Ok(inputs); // mostly there is none
    };
    let mut reader = BufReader::new(file);
    let (mut line, mut start) = (Vec::new(), 0);
    let mut damaged = 0;
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line).map_err(|error| {
            let message = format!("{}: cannot be read: {error}", path.display());
            Failure::new(ALL_INPUTS, message)
        })?;
        if length == 0 {
            entry::warn_of_damaged_lines(folder, damaged);
            return Ok(inputs);
        }
        let mut found = Vec::new();
        list(&line, 0, 0, &mut found);
        if let Some(LinePosition { output, .. }) = found.pop() {
            lines.push(LinePosition {
                output,
                file: 0,
                at: start..start + length,
            });
        } else if let Some(entry) = InputEntry::of_line(&line) {
            inputs.insert(entry.key(), entry);
        } else {
            damaged += 1;
        }
        start += length;
    }
}

/// Lists the lines of a file that are entries of results.
fn list(bytes: &[u8], start: usize, file: usize, lines: &mut Vec<LinePosition>) {
    let mut at = start;
    for line in bytes[start..].split_inclusive(|&byte| byte == b'\n') {
        let end = at + line.len();
        if line.ends_with(b"\n")
            && let Some((output, _)) = record::owner(line)
        {
            let at = at..end;
            lines.push(LinePosition { output, file, at });
        }
        at = end;
    }
}

/// One line for each output, in order; a shard's replaces the previous manifest's.
fn one_each(mut lines: Vec<LinePosition>) -> Result<Vec<LinePosition>, Failure> {
    lines.sort_by(|one, other| {
        one.output
            .cmp(&other.output)
            .then(one.file.cmp(&other.file))
    });
    let mut kept: Vec<LinePosition> = Vec::with_capacity(lines.len());
    for line in lines {
        match kept.last_mut() {
            Some(last) if last.output == line.output && last.file == 0 => *last = line,
            Some(last) if last.output == line.output => {
                let output = &line.output;
                return Err(Failure::usage(format!(
                    "shards {} and {} both made {output}; evaluate their inputs into different \
                     directories",
                    last.file, line.file
                )));
            }
            _ => kept.push(line),
        }
    }
    Ok(kept)
}

/// Writes the lines. Few files are in memory at once: the index of a million results takes 130 MB, their
/// lines 500 MB.
fn write(
    opened: &Folder,
    path: &Path,
    (lines, location): (&[LinePosition], ResultLocation),
    inputs: &InputEntries,
) -> Result<(), Failure> {
    let failed = |error| Failure::writing(&path.display().to_string(), &error);
    let folder = opened.path();
    let output = Output::create_in(opened, Path::new(NAME), true, "");
    let mut output = output.map_err(|error| Failure::output(&error))?;
    let mut kept: HashMap<usize, Vec<u8>> = HashMap::new();
    let mut before = match lines.iter().any(|line| line.file == 0) {
        true => entry::open(folder)?.map(BufReader::new),
        false => None,
    };
    let (mut at, mut one) = (0, Vec::new());
    let mut faulty = FaultyResults::default();
    for line in lines {
        let text = match (line.file, &mut before) {
            (0, Some(before)) => {
                // Usually it is the next line, which the reader has already buffered: a relative seek keeps the buffer.
                let step = line.at.start as i64 - at;
                before.seek_relative(step).map_err(failed)?;
                one.resize(line.at.len(), 0);
                before.read_exact(&mut one).map_err(failed)?;
                at = line.at.end as i64;
                &*one
            }
            (shard, _) => {
                if !kept.contains_key(&shard) {
                    if kept.len() == MAX_CACHED_FILES {
                        kept.clear();
                    }
                    let bytes = record::bytes(folder, shard).map_err(failed)?;
                    kept.insert(shard, bytes);
                }
                kept[&shard].get(line.at.clone()).unwrap_or_default()
            }
        };
        // The file may have been replaced meanwhile by one with the same entries at other offsets.
        let entry = ManifestEntry::of_line(text).filter(|entry| entry.output == line.output);
        let Some(entry) = entry else {
            let message = format!(
                "{}: changed while it was merged; try again",
                folder.display()
            );
            return Err(Failure::new(DIFFERENCE, message));
        };
        if location == ResultLocation::Beside && line.file > 0 {
            faulty.look_at(folder, &entry);
        }
        output.write_all(text).map_err(failed)?;
    }
    faulty.outcome(folder, lines.len())?;
    for entry in inputs.values() {
        output.write_all(entry.line().as_bytes()).map_err(failed)?;
    }
    output.commit().map_err(|error| Failure::output(&error))
}
