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
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tumble_formats::beneath::parent_beneath;
use tumble_formats::output::Output;

use crate::batch::entry::{
    self, ManifestEntry, ManifestLines, NAME, PreviousEntries, ResultRecorder, line, of_clips,
};
use crate::batch::shards::{plan::RecordedPlan, record};
use crate::batch::target::WrittenFile;
use crate::messages::exit::{Failure, OUTPUT};

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
        let exists = match entry::open(folder) {
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
        entry::warn_of_damaged_lines(folder, damaged);
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
    fn finish(mut self) -> Result<(), Failure> {
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

    fn close(self: Box<Self>) -> Result<(), Failure> {
        (*self).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::digest;
    use crate::batch::entry::kernels_sha256;

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
