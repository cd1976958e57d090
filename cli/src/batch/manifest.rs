//! The manifest of a directory of results: what each was made from and how, and its
//! hash. One JSON object a line.
//!
//! While a batch runs, a line is added for each result before the result gets its
//! name: whatever is there under its name, and is not what the line says, is to be
//! made again. At the end the lines are put in order and the file is replaced whole, so
//! that a batch that was stopped and resumed ends with the bytes of one that was not.

use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use serde::{Deserialize, Serialize};
use tumble_formats::output::Output;

use crate::batch::digest;
use crate::batch::place::Written;
use crate::batch::run::Records;
use crate::batch::shards::{plan::Stated, record};
use crate::messages::exit::{Failure, OUTPUT};

/// Its name in the directory.
pub(crate) const NAME: &str = "manifest.jsonl";

/// One result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Entry {
    /// Below the manifest's directory.
    pub(crate) output: String,
    pub(crate) output_sha256: String,
    pub(crate) output_bytes: u64,
    /// As it was given.
    pub(crate) input: String,
    /// Nothing where the input was standard input.
    pub(crate) input_sha256: Option<String>,
    /// All that decides over the result besides the input.
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

impl Entry {
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
pub(crate) struct Lines {
    pub(crate) entries: BTreeMap<String, Entry>,
    pub(crate) damaged: usize,
}

impl Lines {
    /// A last line without its end was being written when the program was killed.
    pub(crate) fn parse(bytes: &[u8]) -> Self {
        let mut lines = Self {
            entries: BTreeMap::new(),
            damaged: 0,
        };
        for line in bytes.split_inclusive(|&byte| byte == b'\n') {
            match serde_json::from_slice::<Entry>(line) {
                Ok(entry) => {
                    lines.entries.insert(entry.output.clone(), entry);
                }
                Err(_) if line.ends_with(b"\n") && line.len() > 1 => lines.damaged += 1,
                Err(_) => {}
            }
        }
        lines
    }
}

/// A directory's manifest, open for one batch.
pub(crate) struct Manifest {
    folder: PathBuf,
    previous: Arc<BTreeMap<String, Entry>>,
    added: BTreeMap<String, Entry>,
    /// The file, to whose end lines are added; locked.
    journal: File,
    /// There are shards, whose lines become part of it.
    has_shards: bool,
}

impl Manifest {
    /// Opens a directory's manifest, or begins one. `has_shards`: what shards have made is the
    /// batch's too, and their lines become lines of the manifest.
    pub(crate) fn open(folder: &Path, has_shards: bool) -> Result<Self, Failure> {
        let path = folder.join(NAME);
        let failed = |error: io::Error| Failure::writing(&path.display().to_string(), &error);
        let mut journal = File::options()
            .read(true)
            .append(true)
            .create(true)
            .open(&path)
            .map_err(failed)?;
        match journal.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let folder = folder.display();
                let message = format!("{folder}: another tumble is writing into it; wait for it");
                return Err(Failure::new(OUTPUT, message));
            }
            // Where a file system has no locks there is none to wait for.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        let mut bytes = Vec::new();
        journal.read_to_end(&mut bytes).map_err(failed)?;
        let whole = bytes.iter().rposition(|&byte| byte == b'\n');
        let whole = whole.map_or(0, |last| last + 1);
        if whole < bytes.len() {
            journal.set_len(whole as u64).map_err(failed)?;
            journal.seek(SeekFrom::End(0)).map_err(failed)?;
        }
        let mut previous = Lines::parse(&bytes[..whole]).entries;
        if has_shards {
            previous.extend(record::entries(folder));
        }
        Ok(Self {
            folder: folder.to_owned(),
            previous: Arc::new(previous),
            added: BTreeMap::new(),
            journal,
            has_shards,
        })
    }

    /// Whether the manifest names that output, or results of several clips in its place, which are
    /// then not a stranger's.
    pub(crate) fn knows(&self, output: &str) -> bool {
        self.previous.contains_key(output) || of_clips(&self.previous, output).next().is_some()
    }

    /// Adds a line, in one piece.
    pub(crate) fn add(&mut self, entry: Entry) -> Result<(), Failure> {
        let line = line(&entry);
        let written = self.journal.write_all(line.as_bytes());
        let synced = written.and_then(|()| self.journal.sync_data());
        synced.map_err(|error| self.failed(&error))?;
        self.added.insert(entry.output.clone(), entry);
        Ok(())
    }

    fn is_empty(&self) -> bool {
        self.previous.is_empty() && self.added.is_empty()
    }

    /// Puts the lines in order.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let path = self.folder.join(NAME);
        if self.is_empty() {
            return self.forget_shards();
        }
        let mut output =
            Output::create(&path, true, &[]).map_err(|error| Failure::output(&error))?;
        let mut entries: BTreeMap<&String, &Entry> = self.previous.iter().collect();
        entries.extend(&self.added);
        for entry in entries.into_values() {
            let written = output.write_all(line(entry).as_bytes());
            written.map_err(|error| self.failed(&error))?;
        }
        output.commit().map_err(|error| Failure::output(&error))?;
        self.forget_shards()
    }

    /// The manifest has their lines.
    fn forget_shards(&self) -> Result<(), Failure> {
        match self.has_shards {
            true => Stated::remove(&self.folder),
            false => Ok(()),
        }
    }

    fn failed(&self, error: &io::Error) -> Failure {
        Failure::writing(&self.folder.join(NAME).display().to_string(), error)
    }
}

impl Records for Manifest {
    fn previous(&self) -> Previous {
        Previous {
            folder: self.folder.clone(),
            entries: Arc::clone(&self.previous),
        }
    }

    fn keep(&mut self, entry: Entry, written: Written) -> Result<(), Failure> {
        self.add(entry)?;
        written.commit()
    }
}

/// A batch that was refused, or of which nothing came, leaves no manifest.
impl Drop for Manifest {
    fn drop(&mut self) {
        if self.is_empty() {
            let _ = std::fs::remove_file(self.folder.join(NAME)); // it says nothing
        }
    }
}

/// What a manifest said before the batch.
#[derive(Clone)]
pub(crate) struct Previous {
    folder: PathBuf,
    entries: Arc<BTreeMap<String, Entry>>,
}

impl Previous {
    pub(crate) fn new(folder: &Path, entries: BTreeMap<String, Entry>) -> Self {
        Self {
            folder: folder.to_owned(),
            entries: Arc::new(entries),
        }
    }

    /// What it names in the place of an output: that, or the results of the clips that it would hold.
    pub(crate) fn results_of<'a>(&'a self, output: &'a str) -> impl Iterator<Item = &'a Entry> {
        let one = self.entries.get(output);
        let clips = of_clips(&self.entries, output).filter(move |_| one.is_none());
        one.into_iter().chain(clips.map(|(entry, _)| entry))
    }

    /// Whether the output, or the outputs of all clips that it would hold, are there, whole, and
    /// the results of the same request.
    pub(crate) fn is_done(&self, output: &str, input_sha256: &str, options: &str) -> bool {
        let is_whole = |entry: &Entry| {
            entry.is_made_from(input_sha256, options)
                && digest::of_file(&self.folder.join(&entry.output))
                    .is_ok_and(|hash| hash == entry.output_sha256)
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

/// The results of single clips in the place of one of all, with how many there are: `fox.Run.npy` and
/// its like for `fox.npy`.
fn of_clips<'a>(
    entries: &'a BTreeMap<String, Entry>,
    output: &'a str,
) -> impl Iterator<Item = (&'a Entry, usize)> {
    let stem = output.rsplit_once('.').map_or(output, |(stem, _)| stem);
    let beside = entries.range(format!("{stem}.")..);
    let own = beside.take_while(move |(name, _)| name.starts_with(stem));
    own.filter_map(move |(_, entry)| {
        let (all, count) = entry.one_of.as_ref()?;
        (all == output).then_some((entry, *count))
    })
}

/// An entry as a line.
pub(crate) fn line(entry: &Entry) -> String {
    serde_json::to_string(entry).expect("strings and numbers") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(output: &str, hash: &str) -> Entry {
        let text = String::from;
        Entry {
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
        let place = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::open(place.path(), false).unwrap();
        assert!(
            Manifest::open(place.path(), false).is_err(),
            "two batches in one directory"
        );
        manifest.add(entry("b", "1")).unwrap();
        manifest.add(entry("a", "2")).unwrap();
        manifest.add(entry("b", "3")).unwrap();
        drop(manifest);
        let path = place.path().join(NAME);
        let mut bytes = std::fs::read(&path).unwrap();
        bytes.truncate(bytes.len() - 5);
        std::fs::write(&path, &bytes).unwrap();
        let mut manifest = Manifest::open(place.path(), false).unwrap();
        assert_eq!(manifest.previous["b"].output_sha256, "1");
        manifest.add(entry("b", "4")).unwrap();
        manifest.finish().unwrap();
        let ordered = line(&entry("a", "2")) + &line(&entry("b", "4"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), ordered);
    }

    #[test]
    fn what_is_done_is_what_is_there_and_was_asked_for() {
        let place = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::open(place.path(), false).unwrap();
        let hash = digest::of_bytes([&b"abc"[..]]);
        manifest.add(entry("a", &hash)).unwrap();
        manifest.finish().unwrap();
        let manifest = Manifest::open(place.path(), false).unwrap().previous();
        assert!(!manifest.is_done("a", "1", "o"), "it is not there");
        std::fs::write(place.path().join("a"), "abc").unwrap();
        assert!(manifest.is_done("a", "1", "o"));
        assert!(!manifest.is_done("a", "2", "o"), "another input");
        assert!(!manifest.is_done("a", "1", "p"), "other options");
        std::fs::write(place.path().join("a"), "abd").unwrap();
        assert!(!manifest.is_done("a", "1", "o"), "a damaged output");
    }

    #[test]
    fn damaged_lines_are_counted() {
        let good = line(&entry("a", "1"));
        let lines = Lines::parse(format!("{good}{{\"output\":3}}\n{}", &good[..20]).as_bytes());
        assert_eq!((lines.entries.len(), lines.damaged), (1, 1));
    }
}
