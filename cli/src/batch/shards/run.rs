//! Evaluates one shard: its results are renamed together, then the shard's file lists them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::PathBuf;

use tumble_formats::folder::Folder;
use tumble_formats::format::Format;
use tumble_formats::output::{Output, remove_abandoned_marked};

use crate::batch::entry::{InputEntry, ManifestEntry, PreviousEntries, ResultRecorder};
use crate::batch::output_plan::ResultFolder;
use crate::batch::result_names::ResultName;
use crate::batch::shards::record::{self, RefusedInput, ShardHeader};
use crate::batch::target::{ResultTarget, WrittenFile};
use crate::messages::exit::Failure;
use crate::messages::words;

/// The most files that wait to be renamed: a process may have about a thousand open.
const MAX_WAITING: usize = 128;

/// The number of files that are synced at the same time. One after another they take up to 7 ms each; a file system
/// writes its journal once for all files that wait.
const SYNCED_AT_ONCE: usize = 16;

/// A shard that is being evaluated.
pub(crate) struct Shard<'a> {
    pub(crate) folder: &'a Folder,
    pub(crate) header: ShardHeader,
    /// Whether messages about results are left out.
    pub(crate) quiet: bool,
    pub(crate) made: usize,
    pub(crate) skipped: usize,
    previous: PreviousEntries,
    entries: Vec<ManifestEntry>,
    waiting: Vec<WrittenFile>,
}

impl<'a> Shard<'a> {
    /// A shard with results of these names.
    pub(crate) fn new(
        folder: &'a Folder,
        header: ShardHeader,
        names: &[&str],
        resume: bool,
    ) -> Self {
        let path = folder.path();
        let previous = match resume {
            true => record::previous(path, header.shard, names),
            false => PreviousEntries::new(path, BTreeMap::new(), BTreeSet::new()),
        };
        Self {
            folder,
            header,
            quiet: false,
            made: 0,
            skipped: 0,
            previous,
            entries: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// Whether its file is complete and of the same plan.
    pub(crate) fn is_done(&self) -> bool {
        let bytes = record::bytes(self.folder.path(), self.header.shard);
        let header = bytes.ok().and_then(|bytes| record::whole(&bytes));
        header.is_some_and(|(header, _)| header.plan == self.header.plan)
    }

    /// The work: each input with its target. Inputs whose results cannot have a file are recorded as
    /// failed. Temporary files of an attempt that was killed are removed; another worker may make the same shard.
    pub(crate) fn jobs(
        &mut self,
        paths: impl Iterator<Item = PathBuf>,
        names: &[ResultName],
        format: &'static Format,
    ) -> Vec<(PathBuf, ResultTarget)> {
        let mark = record::mark(self.header.shard);
        let mut result_folder = ResultFolder::new(self.folder);
        let mut jobs = Vec::new();
        for (path, name) in paths.zip(names) {
            let target = name.clone().and_then(|name| {
                // The plan has already reserved the names of its results.
                let destination = result_folder.destination(&name, true)?;
                Ok(ResultTarget::new(
                    destination.hashed().marked(&mark),
                    format,
                    name,
                ))
            });
            match target {
                Ok(target) => jobs.push((path, target)),
                Err(failure) => {
                    if !self.quiet {
                        failure.report();
                    }
                    self.add_refused(InputEntry::failed(&path, None, &failure));
                }
            }
        }
        for folder in &result_folder.made {
            remove_abandoned_marked(folder, &mark);
        }
        jobs
    }

    /// Records an input without a result.
    fn add_refused(&mut self, entry: InputEntry) {
        self.header.failed.push(RefusedInput {
            input: entry.input,
            code: entry.code.unwrap_or_default(),
            message: entry.message.unwrap_or_default(),
            result: entry.result,
            diagnostic: entry.diagnostic,
            causes: entry.causes,
            warnings: entry.warnings,
        });
    }

    /// Renames the results, and writes the shard's file.
    pub(crate) fn finish(&mut self) -> Result<(), Failure> {
        self.commit()?;
        let path = record::path(self.folder.path(), self.header.shard);
        let text = self.text();
        match record::bytes(self.folder.path(), self.header.shard) {
            Ok(before) if before == text.as_bytes() => return Ok(()),
            Ok(before) if record::header(&before).is_none() => {
                let path = path.display();
                let message =
                    "is not the file of a shard: its first line is not a shard's; move it";
                return Err(Failure::usage(format!("{path}: {message}")));
            }
            Ok(_) | Err(_) => {}
        }
        let name = record::name(self.header.shard);
        let output = Output::create_in(self.folder, &name, true, "");
        let mut output = output.map_err(|error| Failure::output(&error))?;
        let written = output.write_all(text.as_bytes());
        written.map_err(|error| Failure::writing(&path.display().to_string(), &error))?;
        output.commit().map_err(|error| Failure::output(&error))
    }

    /// As [`Shard::finish`], but returns the text of the file.
    pub(crate) fn finish_elsewhere(&mut self) -> Result<String, Failure> {
        self.commit()?;
        Ok(self.text())
    }

    fn text(&self) -> String {
        record::text(&self.header, &self.entries)
    }

    /// Renames the files that wait.
    fn commit(&mut self) -> Result<(), Failure> {
        let mut waiting: Vec<Option<WrittenFile>> = self.waiting.drain(..).map(Some).collect();
        let each = waiting.len().div_ceil(SYNCED_AT_ONCE).max(1);
        std::thread::scope(|scope| {
            let threads = waiting.chunks_mut(each).map(|files| {
                scope.spawn(|| {
                    let mut files = files.iter_mut().filter_map(Option::take);
                    files.try_for_each(WrittenFile::commit)
                })
            });
            // All threads are started before the first is joined.
            let threads: Vec<_> = threads.collect();
            let ended = threads.into_iter().map(|thread| {
                let ended = thread.join();
                ended.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            ended.collect::<Vec<_>>().into_iter().collect()
        })
    }
}

impl ResultRecorder for &mut Shard<'_> {
    fn previous(&self) -> PreviousEntries {
        self.previous.clone()
    }

    fn keep(&mut self, entry: ManifestEntry, written: WrittenFile) -> Result<(), Failure> {
        self.made += 1;
        self.entries.push(entry);
        self.waiting.push(written.free_buffer()?);
        match self.waiting.len() {
            MAX_WAITING.. => self.commit(),
            _ => Ok(()),
        }
    }

    fn skip(&mut self, output: &str) {
        let made = self.entries.len();
        let there = self.previous.results_of(output);
        self.entries.extend(there.cloned());
        self.skipped += self.entries.len() - made;
    }

    fn refuse(&mut self, entry: InputEntry) -> Result<(), Failure> {
        self.add_refused(entry);
        Ok(())
    }

    fn list(&self) -> PathBuf {
        record::path(self.folder.path(), self.header.shard)
    }

    fn tell(&self, text: &str) {
        if !self.quiet {
            words::note(text);
        }
    }
}
