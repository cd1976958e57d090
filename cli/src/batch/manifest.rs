//! The manifest of a directory of results. It has a JSON object per line: for each result, its input, its options and
//! its hash; and for each input without a result, or without all of its results, its state.
//!
//! A batch begins with a line for each input that it will evaluate (`pending`). By these lines, a batch that did not
//! end is recognised. While the batch runs, a line is added for each input that failed, and for each result. The line
//! of a result is added before the file gets its name. So a file that does not match its line must be made again. At
//! the end the lines are sorted and the file is replaced. So the manifest has the same bytes whether or not the batch
//! was stopped and resumed.
//!
//! A file is a manifest if its first line is an entry; any other file of this name is refused unless files may be
//! replaced. Lines are added only to a file that this batch has created, because hard links to an older file must keep
//! their bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tumble_formats::beneath::parent_beneath;
use tumble_formats::folder::Folder;
use tumble_formats::output::{Output, OutputError};

use crate::batch::digest;
use crate::batch::entry::{
    BatchStart, InputEntries, InputEntry, InputState, ManifestEntry, ManifestLines, NAME,
    PreviousEntries, ResultRecorder, line, of_clips,
};
use crate::batch::owner::{CommandsOfResults, Owner};
use crate::batch::result_names::ResultName;
use crate::batch::shards::{plan::RecordedPlan, record};
use crate::batch::target::{self, WrittenFile};
use crate::messages::exit::{Failure, OUTPUT};
use crate::messages::{names, words};

/// A directory's manifest, open for one batch.
pub(crate) struct Manifest {
    folder: PathBuf,
    /// The directory, which stays open. If another directory gets its path meanwhile, nothing is written there.
    opened: Folder,
    previous: Arc<BTreeMap<String, ManifestEntry>>,
    /// The results of inputs that earlier batches have not finished.
    unfinished: Arc<BTreeSet<String>>,
    added: BTreeMap<String, ManifestEntry>,
    /// The inputs without results, or without all of them, as they are now.
    inputs: InputEntries,
    /// The results of this batch's inputs.
    planned: PlannedResults,
    /// Whether results without an input are removed.
    prune: bool,
    /// Whether a file with the manifest's name exists: a manifest, or a file to replace.
    exists: bool,
    /// The file to which lines are appended; `None` before the first line is written.
    journal: Option<File>,
    /// Whether there are shards, whose lines become part of the manifest.
    has_shards: bool,
    /// Locks the directory, because two batches would lose each other's lines.
    _lock: Option<File>,
}

/// The results that a batch plans, one for all clips of each input. They decide which earlier results have no input any
/// more.
#[derive(Default)]
pub(crate) struct PlannedResults {
    names: BTreeSet<String>,
    /// The names of results, by the paths of their inputs.
    of_inputs: BTreeMap<String, String>,
    /// The names whose files have all been written.
    ended: BTreeSet<String>,
    /// The names whose results were complete before.
    complete: BTreeSet<String>,
}

impl PlannedResults {
    /// Adds the result of an input.
    pub(super) fn plan(&mut self, input: &Path, result: &str) {
        let input = input.display().to_string();
        self.of_inputs.insert(input, result.to_owned());
        self.names.insert(result.to_owned());
    }

    /// The files of a result are all made.
    pub(super) fn end(&mut self, result: &str) {
        self.ended.insert(result.to_owned());
    }

    /// A result was complete already.
    pub(super) fn complete(&mut self, result: &str) {
        self.complete.insert(result.to_owned());
    }

    /// Whether this batch gives the result of an input another name, in the same format.
    fn is_renamed(&self, input: &str, result: &str) -> bool {
        let ending = |name: &str| Path::new(name).extension().map(ToOwned::to_owned);
        self.of_inputs
            .get(input)
            .is_some_and(|planned| planned != result && ending(planned) == ending(result))
    }

    /// Whether a result has no input any more: the input was removed, has other clips than before, or its result has
    /// another name now. `is_made`: whether this batch made the result. `previous` are the results before the batch.
    pub(super) fn is_orphan(
        &self,
        entry: &ManifestEntry,
        is_made: bool,
        previous: &BTreeMap<String, ManifestEntry>,
    ) -> bool {
        let whole = entry.whole().0;
        if self.complete.contains(whole) {
            // The file had several clips before and has one now, so the name of its result has changed.
            return entry.output != whole && previous.contains_key(whole);
        }
        match self.names.contains(whole) {
            true => self.ended.contains(whole) && !is_made,
            false => {
                self.is_renamed(&entry.input, whole)
                    || InputPresence::of_entry(entry) == InputPresence::Removed
            }
        }
    }

    /// Why a result has no input any more.
    pub(super) fn why_orphan(&self, entry: &ManifestEntry) -> &'static str {
        let whole = entry.whole().0;
        match self.is_renamed(&entry.input, whole) {
            true => "its input's result has another name now",
            false if self.names.contains(whole) => "its input has no such clip any more",
            false => "its input is gone",
        }
    }
}

/// How the manifest of a directory is opened.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ManifestOptions {
    /// Whether there are shards, whose lines become lines of the manifest.
    pub(crate) has_shards: bool,
    /// Whether a file that is not a manifest is replaced.
    pub(crate) overwrite: bool,
    /// Whether results without an input are removed.
    pub(crate) prune: bool,
}

/// Locks a directory of results; `None` if the system or the file system has no such locks.
pub(crate) fn lock(folder: &Folder) -> Result<Option<File>, Failure> {
    let Ok(file) = folder.to_lock() else {
        return Ok(None);
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let folder = folder.path().display();
            let message = format!(
                "{folder}: another process of tumble writes into it; wait until it has ended"
            );
            Err(Failure::new(OUTPUT, message))
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(file)),
    }
}

impl Manifest {
    /// Opens a directory's manifest; its file is written with the first line.
    pub(crate) fn open(folder: &Path, options: ManifestOptions) -> Result<Self, Failure> {
        let ManifestOptions {
            has_shards,
            overwrite,
            prune,
        } = options;
        let opened = target::opened(folder)?;
        let lock = lock(&opened)?;
        let (mut lines, exists) = ManifestLines::of_folder(folder, overwrite)?;
        if has_shards {
            lines.extend(record::lines(folder));
        }
        Ok(Self {
            folder: folder.to_owned(),
            opened,
            unfinished: Arc::new(lines.unfinished()),
            previous: Arc::new(lines.entries),
            added: BTreeMap::new(),
            inputs: lines.inputs,
            planned: PlannedResults::default(),
            prune,
            exists,
            journal: None,
            has_shards,
            _lock: lock,
        })
    }

    /// Its directory.
    pub(crate) fn folder(&self) -> &Folder {
        &self.opened
    }

    /// The directories of its results, if they are below its own.
    pub(crate) fn folders(&self) -> impl Iterator<Item = PathBuf> {
        let outputs = self.previous.keys();
        outputs.filter_map(|output| parent_beneath(&self.folder, Path::new(output)).ok())
    }

    /// Whether the manifest lists that output, or the results of its clips.
    pub(crate) fn knows(&self, output: &str) -> bool {
        self.previous.contains_key(output) || of_clips(&self.previous, output).next().is_some()
    }

    /// The input that the output was made from, or those of its clips.
    pub(crate) fn owner(&self, output: &str) -> Option<Owner> {
        let whole = self.previous.get(output);
        let clip = || {
            of_clips(&self.previous, output)
                .map(|(entry, _)| entry)
                .next()
        };
        whole.or_else(clip).map(Owner::from)
    }

    /// Refuses to resume results of other commands; see [`CommandsOfResults`].
    pub(crate) fn check_command(
        &self,
        results: &[ResultName],
        command: &str,
    ) -> Result<(), Failure> {
        let commands = CommandsOfResults::of(&self.previous, &self.inputs);
        commands.check(&self.folder, results.iter().flatten(), command)
    }

    /// Adds the line of a result, in one piece.
    pub(crate) fn add(&mut self, entry: ManifestEntry) -> Result<(), Failure> {
        entry.settle(&mut self.inputs);
        let text = line(&entry);
        self.added.insert(entry.output.clone(), entry);
        self.append(&text)
    }

    /// Appends a line. Its entry must be in the fields already, because the first line is written with the lines of all
    /// entries.
    fn append(&mut self, text: &str) -> Result<(), Failure> {
        match &mut self.journal {
            Some(journal) => {
                let written = journal.write_all(text.as_bytes());
                let synced = written.and_then(|()| journal.sync_data());
                synced.map_err(|error| self.failed(&error))
            }
            None => self.begin_journal(),
        }
    }

    /// Writes all lines into a new file, which lines are appended to.
    fn begin_journal(&mut self) -> Result<(), Failure> {
        self.journal = self.replace(&BTreeSet::new())?;
        self.exists = true;
        Ok(())
    }

    fn is_empty(&self) -> bool {
        self.previous.is_empty() && self.added.is_empty() && self.inputs.is_empty()
    }

    /// The entries of all results, in order.
    fn results(&self) -> BTreeMap<&str, &ManifestEntry> {
        let all = self.previous.values().chain(self.added.values());
        all.map(|entry| (&*entry.output, entry)).collect()
    }

    /// Puts the lines in order.
    fn finish(mut self) -> Result<(), Failure> {
        // Windows cannot replace a file that is open, so it is closed first.
        self.journal = None;
        self.check_in_place()?;
        let orphans = self.orphans();
        let pruned = match self.prune {
            true => self.remove(&orphans)?,
            false => BTreeSet::new(),
        };
        if !self.prune {
            let of_other_name = |output: &&String| {
                let entry = self.results()[&***output];
                self.planned.is_renamed(&entry.input, entry.whole().0)
            };
            let (renamed, orphaned): (Vec<&String>, Vec<&String>) =
                orphans.iter().partition(of_other_name);
            self.note_orphans(
                &orphaned,
                "no input any more (--prune removes what has none)",
            );
            self.note_orphans(&renamed, "another name now (--prune removes the old ones)");
        }
        if self.prune {
            self.note_unknown();
        }
        if !self.is_empty() {
            self.replace(&pruned)?;
        }
        self.forget_shards()
    }

    /// Prints a note about results that are not of this batch.
    fn note_orphans(&self, outputs: &[&String], possession: &str) {
        if let Some(first) = outputs.first() {
            let results = words::count(outputs.len(), "result");
            let have = if outputs.len() == 1 { "has" } else { "have" };
            let first = self.folder.join(first);
            words::note(&format!(
                "{results} {have} {possession}, the first is {}",
                first.display()
            ));
        }
    }

    /// The results that have no input any more.
    fn orphans(&self) -> BTreeSet<String> {
        let is_orphan = |entry: &&ManifestEntry| {
            let is_made = self.added.contains_key(&entry.output);
            self.planned.is_orphan(entry, is_made, &self.previous)
        };
        let orphans = self.results().into_values().filter(is_orphan);
        orphans.map(|entry| entry.output.clone()).collect()
    }

    /// Prints which results `--prune` keeps because it is not known whether their inputs were removed.
    fn note_unknown(&self) {
        let results = self.results().into_values();
        let unknown = results.filter(|entry| {
            !self.planned.names.contains(entry.whole().0)
                && InputPresence::of_entry(entry) == InputPresence::Unknown
        });
        let unknown: Vec<&ManifestEntry> = unknown.collect();
        if let Some(first) = unknown.first() {
            let results = words::count(unknown.len(), "result");
            let stay = if unknown.len() == 1 { "stays" } else { "stay" };
            words::note(&format!(
                "{results} {stay}: {} was not found from this directory, but it may be somewhere else",
                first.input
            ));
        }
    }

    /// Removes the files of results, and directories that are empty then. A file that is not the one that its line
    /// describes stays, with its line.
    fn remove(&self, outputs: &BTreeSet<String>) -> Result<BTreeSet<String>, Failure> {
        let results = self.results();
        let mut removed = BTreeSet::new();
        for output in outputs {
            let (entry, path) = (results[&**output], self.folder.join(output));
            let shown = path.display();
            let whole = digest::is_whole(
                &self.folder,
                output,
                entry.output_bytes,
                &entry.output_sha256,
            );
            match whole {
                Ok(true) => {
                    let removed = self.opened.remove_file(Path::new(output));
                    removed.map_err(|error| Failure::writing(&shown.to_string(), &error))?;
                    // Stop at the first directory that is not empty: it and its parents are kept.
                    let parents = Path::new(output).ancestors().skip(1);
                    let mut parents = parents.filter(|parent| parent.file_name().is_some());
                    while parents
                        .next()
                        .is_some_and(|parent| self.opened.remove_folder(parent).is_ok())
                    {
                    }
                    let why = self.planned.why_orphan(entry);
                    words::note(&format!("{shown}: removed; {why}"));
                }
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                _ => {
                    words::warning(&format!(
                        "{shown}: has no input any more, but differs from its line in the manifest; it stays"
                    ));
                    continue;
                }
            }
            removed.insert(output.clone());
        }
        Ok(removed)
    }

    /// Replaces the whole file by one without the lines of some results; returns the new file, open at its end.
    fn replace(&self, without: &BTreeSet<String>) -> Result<Option<File>, Failure> {
        let output = Output::create_in(&self.opened, Path::new(NAME), self.exists, "");
        let mut output = output.map_err(|error| Failure::output(&error))?;
        let results = self.results().into_values();
        let results = results.filter(|entry| !without.contains(&entry.output));
        let lines = results
            .map(line)
            .chain(self.inputs.values().map(InputEntry::line));
        for line in lines {
            let written = output.write_all(line.as_bytes());
            written.map_err(|error| self.failed(&error))?;
        }
        output
            .commit_open()
            .map_err(|error| Failure::output(&error))
    }

    /// Removes the record of shards: the manifest has their lines.
    fn forget_shards(&self) -> Result<(), Failure> {
        match self.has_shards {
            true => RecordedPlan::remove(&self.opened),
            false => Ok(()),
        }
    }

    /// Refuses to continue if the directory was moved or replaced, because its results would not be found.
    fn check_in_place(&self) -> Result<(), Failure> {
        match self.opened.is_in_place() {
            true => Ok(()),
            false => Err(Failure::output(&OutputError::Moved {
                path: self.folder.join(NAME),
                folder: self.folder.clone(),
            })),
        }
    }

    fn failed(&self, error: &io::Error) -> Failure {
        Failure::writing(&self.folder.join(NAME).display().to_string(), error)
    }
}

/// Whether an input exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InputPresence {
    Present,
    /// The directory in which it was found no longer contains it.
    Removed,
    /// It was not found. Its path may be one of another machine, of a disk that is not mounted, or relative to another
    /// directory.
    Unknown,
}

impl InputPresence {
    /// Whether the input of a result is present.
    pub(crate) fn of_entry(entry: &ManifestEntry) -> Self {
        Self::of(&entry.input, Some(entry.whole().0), entry.is_of_directory())
    }

    /// Whether an input without a result is present.
    fn of_input(entry: &InputEntry) -> Self {
        // Directories that could not be read have no result.
        Self::of(
            &entry.input,
            entry.result.as_deref(),
            entry.result.is_none(),
        )
    }

    /// Whether the input with this path, whose result has this name, is present. If it is not found, it counts as
    /// removed if the directory that the command line named still exists and has other files. This directory is the
    /// input's path without the part that the name of its result repeats. For a path below the current directory, such
    /// as `walks/a.bvh` in a list of inputs, it is the first folder of the path. For a name without a directory the
    /// answer is unknown, because any directory may have contained it. A directory in the place of a file is not the
    /// input, unless `may_be_folder` is set.
    fn of(input: &str, result: Option<&str>, may_be_folder: bool) -> Self {
        let path = Path::new(input);
        let is_missing = || match std::fs::symlink_metadata(path) {
            Ok(found) => found.is_dir() && !may_be_folder,
            Err(error) => matches!(
                error.kind(),
                io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
            ),
        };
        if names::is_standard(path) {
            return Self::Present;
        }
        // A name that is not UTF-8 is recorded with replacement characters.
        if input.contains("://") || input.contains('\u{fffd}') {
            return Self::Unknown;
        }
        if !is_missing() {
            return Self::Present;
        }
        let repeated = result.map_or(1, |result| Path::new(result).components().count());
        let is_named = |folder: &Path| folder.file_name().is_some();
        let root = path.ancestors().nth(repeated);
        let first = || {
            path.ancestors()
                .skip(1)
                .filter(|folder| is_named(folder))
                .last()
        };
        let root = root.filter(|root| is_named(root)).or_else(first);
        match root.is_some_and(has_files) {
            true => Self::Removed,
            false => Self::Unknown,
        }
    }
}

/// Whether a path is a directory that can be read and is not empty.
fn has_files(path: &Path) -> bool {
    std::fs::read_dir(path).is_ok_and(|mut files| files.next().is_some())
}

impl ResultRecorder for Manifest {
    fn previous(&self) -> PreviousEntries {
        PreviousEntries {
            folder: self.folder.clone(),
            entries: Arc::clone(&self.previous),
            unfinished: Arc::clone(&self.unfinished),
        }
    }

    fn begin(&mut self, start: BatchStart<'_>) -> Result<(), Failure> {
        // Forget the failure of an input that was deleted.
        let mut forgotten = Vec::new();
        let prune = self.prune;
        for (input, result) in &start.inputs {
            self.planned.plan(input, result);
        }
        let mut inputs = std::mem::take(&mut self.inputs);
        inputs.retain(|_, entry| match InputPresence::of_input(entry) {
            _ if entry.state == InputState::Skipped => false,
            // A directory that could not be read, or was empty, and now has files.
            _ if has_files(Path::new(&entry.input)) => false,
            // The result of this input now has another name.
            _ if (entry.result.as_deref())
                .is_some_and(|result| self.planned.is_renamed(&entry.input, result)) =>
            {
                false
            }
            InputPresence::Present => true,
            InputPresence::Removed => false,
            InputPresence::Unknown => {
                // An input whose result has no name is refused again if it is there.
                if prune && entry.result.is_some() {
                    forgotten.push(entry.input.clone());
                }
                !prune
            }
        });
        self.inputs = inputs;
        if let Some(first) = forgotten.first() {
            let inputs = words::count(forgotten.len(), "input");
            let are = if forgotten.len() == 1 { "is" } else { "are" };
            words::note(&format!(
                "{inputs} without a result {are} forgotten: {first} was not found from this directory"
            ));
        }
        let skipped = start.skipped.into_iter();
        self.inputs
            .extend(skipped.map(|entry| (entry.key(), entry)));
        let previous = self.previous();
        let is_same = |result: &str| {
            let mut made = previous.results_of(result).peekable();
            made.peek().is_some() && made.all(|entry| entry.is_made_with(start.options))
        };
        let mut has_pending = false;
        for (input, result) in start.inputs {
            if !(start.resume && is_same(result)) || self.unfinished.contains(result) {
                let entry = InputEntry {
                    command: InputEntry::command_in(start.options),
                    ..InputEntry::pending(input, result)
                };
                self.inputs.insert(entry.key(), entry);
                has_pending = true;
            }
        }
        match has_pending {
            true => self.begin_journal(),
            false => Ok(()),
        }
    }

    fn keep(&mut self, entry: ManifestEntry, written: WrittenFile) -> Result<(), Failure> {
        let output = entry.output.clone();
        self.add(entry)?;
        written.commit().inspect_err(|_| {
            // The line stays in the manifest until the end of the batch. The result does not match the line, so
            // `--resume` makes the result again.
            self.added.remove(&output);
        })
    }

    fn skip(&mut self, output: &str) {
        self.planned.complete(output);
        self.inputs.remove(output);
    }

    fn end_input(&mut self, output: &str) {
        self.planned.end(output);
    }

    fn refuse(&mut self, entry: InputEntry) -> Result<(), Failure> {
        let text = entry.line();
        self.inputs.insert(entry.key(), entry);
        self.append(&text)
    }

    fn list(&self) -> PathBuf {
        self.folder.join(NAME)
    }

    fn close(self: Box<Self>) -> Result<(), Failure> {
        (*self).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::entry::{FrameNotes, kernels_sha256};

    fn entry(output: &str, hash: &str) -> ManifestEntry {
        let text = String::from;
        ManifestEntry {
            output: text(output),
            output_sha256: text(hash),
            output_bytes: 3,
            input: text("a.dat"),
            input_sha256: Some(text("1")),
            options: text("o"),
            option_files: Vec::new(),
            kernels_sha256: kernels_sha256().to_owned(),
            tumble: text(env!("CARGO_PKG_VERSION")),
            device: text("CPU"),
            one_of: None,
            frames: FrameNotes::default(),
            warnings: Vec::new(),
        }
    }

    #[test]
    fn a_line_cut_short_is_forgotten_and_the_next_is_whole() {
        let directory = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::open(directory.path(), ManifestOptions::default()).unwrap();
        manifest.add(entry("b", "1")).unwrap();
        manifest.add(entry("a", "2")).unwrap();
        manifest.add(entry("b", "3")).unwrap();
        drop(manifest);
        let path = directory.path().join(NAME);
        let mut bytes = std::fs::read(&path).unwrap();
        bytes.truncate(bytes.len() - 5);
        std::fs::write(&path, &bytes).unwrap();
        let mut manifest = Manifest::open(directory.path(), ManifestOptions::default()).unwrap();
        assert_eq!(manifest.previous["b"].output_sha256, "1");
        manifest.add(entry("b", "4")).unwrap();
        manifest.finish().unwrap();
        let ordered = line(&entry("a", "2")) + &line(&entry("b", "4"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), ordered);
    }

    #[cfg(unix)]
    #[test]
    fn two_batches_do_not_write_into_one_directory() {
        let directory = tempfile::tempdir().unwrap();
        let first = Manifest::open(directory.path(), ManifestOptions::default()).unwrap();
        assert!(Manifest::open(directory.path(), ManifestOptions::default()).is_err());
        drop(first);
        assert!(Manifest::open(directory.path(), ManifestOptions::default()).is_ok());
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }

    /// Hard links to an older manifest keep its bytes.
    #[test]
    fn a_manifest_is_replaced_and_never_written_into() {
        let directory = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::open(directory.path(), ManifestOptions::default()).unwrap();
        manifest.add(entry("a", "1")).unwrap();
        manifest.finish().unwrap();
        let (path, other) = (directory.path().join(NAME), directory.path().join("copy"));
        std::fs::hard_link(&path, &other).unwrap();
        let mut manifest = Manifest::open(directory.path(), ManifestOptions::default()).unwrap();
        manifest.add(entry("b", "1")).unwrap();
        manifest.add(entry("c", "1")).unwrap();
        manifest.finish().unwrap();
        let text = |path| std::fs::read_to_string(path).unwrap();
        assert_eq!(text(&other), line(&entry("a", "1")));
        assert_eq!(text(&path).lines().count(), 3);
    }

    /// Every batch writes the manifest again. The numbers in it must not change, and older lines do not have such
    /// numbers.
    #[test]
    fn notes_about_frames_are_read_as_they_were_written() {
        let mut noted = entry("a", "1");
        noted.frames = FrameNotes::new(Some("25".to_owned()), Some(0.6 / 7.3));
        let text = line(&noted);
        assert!(
            text.contains(r#""assumed_fps":"25","left_out_seconds":0.082191781"#),
            "{text}"
        );
        let read = ManifestEntry::of_line(text.as_bytes()).unwrap();
        assert_eq!((&read, line(&read)), (&noted, text));
        let plain = line(&entry("a", "1"));
        assert!(!plain.contains("assumed_fps"), "{plain}");
    }

    #[test]
    fn names_outside_are_no_entries() {
        for name in ["../a", "/a", "a/../../b", ""] {
            let bytes = line(&entry(name, "1"));
            let lines = ManifestLines::parse(bytes.as_bytes());
            assert_eq!((lines.entries.len(), lines.damaged), (0, 1), "{name}");
        }
    }

    #[test]
    fn what_is_done_is_what_is_there_and_was_asked_for() {
        let directory = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::open(directory.path(), ManifestOptions::default()).unwrap();
        let hash = digest::of_bytes([&b"abc"[..]]);
        manifest.add(entry("a", &hash)).unwrap();
        manifest.finish().unwrap();
        let manifest = Manifest::open(directory.path(), ManifestOptions::default())
            .unwrap()
            .previous();
        assert!(!manifest.is_done("a", "1", "o"), "it is not there");
        std::fs::write(directory.path().join("a"), "abc").unwrap();
        assert!(manifest.is_done("a", "1", "o"));
        assert!(!manifest.is_done("a", "2", "o"), "another input");
        assert!(!manifest.is_done("a", "1", "p"), "other options");
        std::fs::write(directory.path().join("a"), "abd").unwrap();
        assert!(!manifest.is_done("a", "1", "o"), "a damaged output");
    }

    #[test]
    fn damaged_lines_are_counted() {
        let good = line(&entry("a", "1"));
        let lines =
            ManifestLines::parse(format!("{good}{{\"output\":3}}\n{}", &good[..20]).as_bytes());
        assert_eq!((lines.entries.len(), lines.damaged), (1, 1));
    }
}
