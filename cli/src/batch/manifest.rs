//! The manifest of a directory of results: what each was made from and how, and its
//! hash. One JSON object a line.
//!
//! While a batch runs, a line is added for each result before the result is renamed: a file that does
//! not match its line is to be made again. At the end the lines are sorted and the file is replaced, so
//! that a batch that was stopped and resumed ends with the bytes of one that was not.
//!
//! A file is a manifest if its first line is an entry; any other file of its name is refused unless
//! files may be replaced. Lines are added only to a file that this batch has created: hard links to an
//! older one keep its bytes.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use serde::{Deserialize, Serialize};
use tumble_formats::beneath::{is_beneath, open_beneath, parent_beneath};
use tumble_formats::output::Output;

use crate::batch::destination::WrittenFile;
use crate::batch::digest;
use crate::batch::run::ResultRecorder;
use crate::batch::shards::{plan::RecordedPlan, record};
use crate::messages::exit::{Failure, OUTPUT};
use crate::messages::words;

/// Its name in the directory.
pub(crate) const NAME: &str = "manifest.jsonl";

/// One result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ManifestEntry {
    /// Below the manifest's directory.
    pub(crate) output: String,
    pub(crate) output_sha256: String,
    pub(crate) output_bytes: u64,
    /// As on the command line.
    pub(crate) input: String,
    /// `None` for standard input.
    pub(crate) input_sha256: Option<String>,
    /// Everything that determines the result besides the input.
    pub(crate) options: String,
    pub(crate) kernels_sha256: String,
    /// The program's version.
    pub(crate) tumble: String,
    /// Which device computed it; on every other the bits would be the same.
    pub(crate) device: String,
    /// For a clip of a file with several: the result that all clips together would have been, and
    /// how many clips there are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) one_of: Option<(String, usize)>,
}

impl ManifestEntry {
    /// The entry in a line; `None` where there is none, or where it names a result outside its directory.
    pub(crate) fn of_line(line: &[u8]) -> Option<Self> {
        let entry: Self = serde_json::from_slice(line).ok()?;
        let all = entry.one_of.as_ref().map(|(all, _)| &**all);
        (is_beneath(&entry.output) && all.is_none_or(is_beneath)).then_some(entry)
    }

    /// Whether it is the result of the same request.
    fn is_made_from(&self, input_sha256: &str, options: &str) -> bool {
        self.input_sha256.as_deref() == Some(input_sha256)
            && self.options == options
            && self.kernels_sha256 == kernels_sha256()
            && self.tumble == env!("CARGO_PKG_VERSION")
    }
}

/// Of every kernel's SPIR-V, one behind the other.
pub(crate) fn kernels_sha256() -> &'static str {
    static HASH: LazyLock<String> =
        LazyLock::new(|| digest::of_bytes(tumble::kernels().map(|(_, code)| code)));
    &HASH
}

/// A manifest's lines: the last one for each output, and how many are no entries.
pub(crate) struct ManifestLines {
    pub(crate) entries: BTreeMap<String, ManifestEntry>,
    pub(crate) damaged: usize,
}

impl ManifestLines {
    /// A last line without its end was being written when the program was killed.
    pub(crate) fn parse(bytes: &[u8]) -> Self {
        let mut lines = Self {
            entries: BTreeMap::new(),
            damaged: 0,
        };
        for line in bytes.split_inclusive(|&byte| byte == b'\n') {
            match ManifestEntry::of_line(line) {
                Some(entry) => {
                    lines.entries.insert(entry.output.clone(), entry);
                }
                None if line.ends_with(b"\n") && line.len() > 1 => lines.damaged += 1,
                None => {}
            }
        }
        lines
    }
}

/// Opens the manifest of a directory; `None` where there is none.
///
/// # Errors
/// When it is a link, not a regular file, or not a manifest.
pub(crate) fn open(folder: &Path) -> Result<Option<File>, Failure> {
    let path = folder.join(NAME);
    let shown = path.display();
    let refuse = |why: &str| Err(Failure::usage(format!("{shown}: {why}")));
    match std::fs::symlink_metadata(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Ok(found) if found.is_symlink() => {
            return refuse(
                "is a symbolic link, and a manifest must be a regular file; remove the link",
            );
        }
        Ok(found) if !found.is_file() => {
            return refuse("is not a regular file, as a manifest must be; give another directory");
        }
        Ok(_) | Err(_) => {}
    }
    let failed = |error| Failure::new(OUTPUT, format!("{shown}: cannot be read: {error}"));
    let file = open_beneath(folder, Path::new(NAME)).map_err(failed)?;
    let mut first = Vec::new();
    let mut reader = BufReader::new(file.try_clone().map_err(failed)?).take(MAX_LINE);
    reader.read_until(b'\n', &mut first).map_err(failed)?;
    if ManifestEntry::of_line(&first).is_none() {
        return refuse(
            "is not a manifest of tumble: its first line is not an entry; move it, give another directory, \
             or --overwrite to replace it",
        );
    }
    io::Seek::rewind(&mut &file).map_err(failed)?;
    Ok(Some(file))
}

/// Warns of lines of a directory's manifest that are not entries: they are left out of the next one.
pub(crate) fn warn_of_damaged_lines(folder: &Path, lines: usize) {
    if lines > 0 {
        let path = folder.join(NAME);
        let lines = words::count(lines, "line");
        words::warning(&format!(
            "{}: {lines} without a result of this directory, left out",
            path.display()
        ));
    }
}

/// The longest line, in bytes.
const MAX_LINE: u64 = 1 << 20;

/// A directory's manifest, open for one batch.
pub(crate) struct Manifest {
    folder: PathBuf,
    previous: Arc<BTreeMap<String, ManifestEntry>>,
    added: BTreeMap<String, ManifestEntry>,
    /// Whether there is a file of its name: a manifest, or a file to replace.
    exists: bool,
    /// The file that lines are appended to; `None` before the first.
    journal: Option<File>,
    /// Whether there are shards, whose lines become part of it.
    has_shards: bool,
    /// Locks the directory: two batches would lose each other's lines.
    _lock: Option<File>,
}

/// Locks a directory of results; `None` where the system or the file system has no such locks.
pub(crate) fn lock(folder: &Path) -> Result<Option<File>, Failure> {
    let Ok(file) = File::open(folder) else {
        return Ok(None);
    };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let folder = folder.display();
            let message = format!("{folder}: another tumble is writing into it; wait for it");
            Err(Failure::new(OUTPUT, message))
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(file)),
    }
}

impl Manifest {
    /// Opens a directory's manifest; its file is written with the first line. `has_shards`: the lines of
    /// shards become lines of the manifest. `overwrite`: a file that is not a manifest is replaced.
    pub(crate) fn open(folder: &Path, has_shards: bool, overwrite: bool) -> Result<Self, Failure> {
        let lock = lock(folder)?;
        let mut bytes = Vec::new();
        let exists = match open(folder) {
            Ok(None) => false,
            Ok(Some(mut file)) => {
                let read = file.read_to_end(&mut bytes);
                read.map_err(|error| {
                    let path = folder.join(NAME);
                    Failure::new(
                        OUTPUT,
                        format!("{}: cannot be read: {error}", path.display()),
                    )
                })?;
                true
            }
            Err(_) if overwrite && folder.join(NAME).is_file() => true,
            Err(failure) => return Err(failure),
        };
        let ManifestLines {
            entries: mut previous,
            damaged,
        } = ManifestLines::parse(&bytes);
        warn_of_damaged_lines(folder, damaged);
        if has_shards {
            previous.extend(record::entries(folder));
        }
        Ok(Self {
            folder: folder.to_owned(),
            previous: Arc::new(previous),
            added: BTreeMap::new(),
            exists,
            journal: None,
            has_shards,
            _lock: lock,
        })
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

    /// Adds a line, in one piece.
    pub(crate) fn add(&mut self, entry: ManifestEntry) -> Result<(), Failure> {
        match &mut self.journal {
            Some(journal) => {
                let written = journal.write_all(line(&entry).as_bytes());
                let synced = written.and_then(|()| journal.sync_data());
                synced.map_err(|error| self.failed(&error))?;
            }
            None => {
                let lines = self.previous.values().chain([&entry]);
                self.journal = self.replace(lines)?;
                self.exists = true;
            }
        }
        self.added.insert(entry.output.clone(), entry);
        Ok(())
    }

    fn is_empty(&self) -> bool {
        self.previous.is_empty() && self.added.is_empty()
    }

    /// Puts the lines in order.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        // Windows replaces no file that is open.
        self.journal = None;
        if !self.is_empty() {
            let mut entries: BTreeMap<&String, &ManifestEntry> = self.previous.iter().collect();
            entries.extend(&self.added);
            self.replace(entries.into_values())?;
        }
        self.forget_shards()
    }

    /// Replaces the file whole; gives it, open at its end.
    fn replace<'a>(
        &self,
        lines: impl Iterator<Item = &'a ManifestEntry>,
    ) -> Result<Option<File>, Failure> {
        let path = self.folder.join(NAME);
        let output = Output::create(&path, self.exists, &[]);
        let mut output = output.map_err(|error| Failure::output(&error))?;
        for entry in lines {
            let written = output.write_all(line(entry).as_bytes());
            written.map_err(|error| self.failed(&error))?;
        }
        output
            .commit_open()
            .map_err(|error| Failure::output(&error))
    }

    /// Removes the record of shards: the manifest has their lines.
    fn forget_shards(&self) -> Result<(), Failure> {
        match self.has_shards {
            true => RecordedPlan::remove(&self.folder),
            false => Ok(()),
        }
    }

    fn failed(&self, error: &io::Error) -> Failure {
        Failure::writing(&self.folder.join(NAME).display().to_string(), error)
    }
}

impl ResultRecorder for Manifest {
    fn previous(&self) -> PreviousEntries {
        PreviousEntries {
            folder: self.folder.clone(),
            entries: Arc::clone(&self.previous),
        }
    }

    fn keep(&mut self, entry: ManifestEntry, written: WrittenFile) -> Result<(), Failure> {
        let output = entry.output.clone();
        self.add(entry)?;
        written.commit().inspect_err(|_| {
            // The line stays in the file until the end of the batch: the result does not match it, so it
            // is made again.
            self.added.remove(&output);
        })
    }

    fn list(&self) -> PathBuf {
        self.folder.join(NAME)
    }
}

/// The entries of a manifest before the batch.
#[derive(Clone)]
pub(crate) struct PreviousEntries {
    folder: PathBuf,
    entries: Arc<BTreeMap<String, ManifestEntry>>,
}

impl PreviousEntries {
    pub(crate) fn new(folder: &Path, entries: BTreeMap<String, ManifestEntry>) -> Self {
        Self {
            folder: folder.to_owned(),
            entries: Arc::new(entries),
        }
    }

    /// The entry of an output, or the entries of its clips.
    pub(crate) fn results_of<'a>(
        &'a self,
        output: &'a str,
    ) -> impl Iterator<Item = &'a ManifestEntry> {
        let one = self.entries.get(output);
        let clips = of_clips(&self.entries, output).filter(move |_| one.is_none());
        one.into_iter().chain(clips.map(|(entry, _)| entry))
    }

    /// Whether the output, or the outputs of all its clips, exist, are complete, and were made by the
    /// same request.
    pub(crate) fn is_done(&self, output: &str, input_sha256: &str, options: &str) -> bool {
        let is_whole = |entry: &ManifestEntry| {
            let (bytes, sha256) = (entry.output_bytes, &entry.output_sha256);
            entry.is_made_from(input_sha256, options)
                && digest::is_whole(&self.folder, &entry.output, bytes, sha256)
                    .is_ok_and(|is_whole| is_whole)
        };
        if let Some(entry) = self.entries.get(output) {
            return is_whole(entry);
        }
        let clips = of_clips(&self.entries, output);
        let clips = clips.filter_map(|(entry, count)| is_whole(entry).then_some(count));
        let counts: Vec<usize> = clips.collect();
        counts.first().is_some_and(|&count| count == counts.len())
    }
}

/// The results of the single clips of an output, with the number of clips: `fox.Run.npy` and so on for
/// `fox.npy`.
fn of_clips<'a>(
    entries: &'a BTreeMap<String, ManifestEntry>,
    output: &'a str,
) -> impl Iterator<Item = (&'a ManifestEntry, usize)> {
    let stem = output.rsplit_once('.').map_or(output, |(stem, _)| stem);
    let beside = entries.range(format!("{stem}.")..);
    let candidates = beside.take_while(move |(name, _)| name.starts_with(stem));
    candidates.filter_map(move |(_, entry)| {
        let (all, count) = entry.one_of.as_ref()?;
        (all == output).then_some((entry, *count))
    })
}

/// An entry as a line.
pub(crate) fn line(entry: &ManifestEntry) -> String {
    serde_json::to_string(entry).expect("strings and numbers") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(output: &str, hash: &str) -> ManifestEntry {
        let text = String::from;
        ManifestEntry {
            output: text(output),
            output_sha256: text(hash),
            output_bytes: 3,
            input: text("a.dat"),
            input_sha256: Some(text("1")),
            options: text("o"),
            kernels_sha256: kernels_sha256().to_owned(),
            tumble: text(env!("CARGO_PKG_VERSION")),
            device: text("CPU"),
            one_of: None,
        }
    }

    #[test]
    fn a_line_cut_short_is_forgotten_and_the_next_is_whole() {
        let directory = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::open(directory.path(), false, false).unwrap();
        manifest.add(entry("b", "1")).unwrap();
        manifest.add(entry("a", "2")).unwrap();
        manifest.add(entry("b", "3")).unwrap();
        drop(manifest);
        let path = directory.path().join(NAME);
        let mut bytes = std::fs::read(&path).unwrap();
        bytes.truncate(bytes.len() - 5);
        std::fs::write(&path, &bytes).unwrap();
        let mut manifest = Manifest::open(directory.path(), false, false).unwrap();
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
        let first = Manifest::open(directory.path(), false, false).unwrap();
        assert!(Manifest::open(directory.path(), false, false).is_err());
        drop(first);
        assert!(Manifest::open(directory.path(), false, false).is_ok());
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }

    /// Whatever leads to an older manifest keeps its bytes.
    #[test]
    fn a_manifest_is_replaced_and_never_written_into() {
        let directory = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::open(directory.path(), false, false).unwrap();
        manifest.add(entry("a", "1")).unwrap();
        manifest.finish().unwrap();
        let (path, other) = (directory.path().join(NAME), directory.path().join("copy"));
        std::fs::hard_link(&path, &other).unwrap();
        let mut manifest = Manifest::open(directory.path(), false, false).unwrap();
        manifest.add(entry("b", "1")).unwrap();
        manifest.add(entry("c", "1")).unwrap();
        manifest.finish().unwrap();
        let text = |path| std::fs::read_to_string(path).unwrap();
        assert_eq!(text(&other), line(&entry("a", "1")));
        assert_eq!(text(&path).lines().count(), 3);
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
        let mut manifest = Manifest::open(directory.path(), false, false).unwrap();
        let hash = digest::of_bytes([&b"abc"[..]]);
        manifest.add(entry("a", &hash)).unwrap();
        manifest.finish().unwrap();
        let manifest = Manifest::open(directory.path(), false, false)
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
