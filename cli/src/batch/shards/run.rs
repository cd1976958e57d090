//! One shard on its way: its results wait for each other, get their names together, and then the
//! shard's file says that they are there.

use std::io::Write;
use std::path::{Path, PathBuf};

use tumble_formats::output::{Output, remove_marked};

use crate::batch::folder::{Name, Places};
use crate::batch::manifest::{Entry, Previous};
use crate::batch::output::Target;
use crate::batch::place::Written;
use crate::batch::run::Records;
use crate::batch::shards::record::{self, Header, Refusal};
use crate::messages::exit::Failure;
use crate::messages::words;
use tumble_formats::format::Format;

/// So many files wait for each other at most: a process may have a thousand open.
const TOGETHER: usize = 128;

/// So many files are synced at once. One by one they cost up to 7 ms each; a file system writes its
/// journal once for all that wait.
const AT_ONCE: usize = 16;

/// A shard that is being evaluated.
pub(crate) struct Shard<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) header: Header,
    /// Nothing is said of results as they are made.
    pub(crate) quiet: bool,
    pub(crate) made: usize,
    pub(crate) skipped: usize,
    previous: Previous,
    entries: Vec<Entry>,
    waiting: Vec<Written>,
}

impl<'a> Shard<'a> {
    /// A shard with results of those names.
    pub(crate) fn new(folder: &'a Path, header: Header, names: &[&str], resume: bool) -> Self {
        let previous = match resume {
            true => record::previous(folder, header.shard, names),
            false => Default::default(),
        };
        Self {
            folder,
            header,
            quiet: false,
            made: 0,
            skipped: 0,
            previous: Previous::new(folder, previous),
            entries: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// Whether its file says that it is done, by the same plan.
    pub(crate) fn is_done(&self) -> bool {
        let bytes = record::bytes(self.folder, self.header.shard);
        let header = bytes.ok().and_then(|bytes| record::whole(&bytes));
        header.is_some_and(|(header, _)| header.plan == self.header.plan)
    }

    /// What is to be done: each input, and where its result goes. Inputs whose results have no name or
    /// no place have failed. What an earlier attempt left half-way is removed.
    pub(crate) fn jobs(
        &mut self,
        paths: impl Iterator<Item = PathBuf>,
        names: &[Name],
        format: &'static Format,
    ) -> Vec<(PathBuf, Target)> {
        let mark = record::mark(self.header.shard);
        let mut places = Places::new(self.folder);
        let mut jobs = Vec::new();
        for (path, name) in paths.zip(names) {
            let target = name.clone().and_then(|name| {
                // The plan has claimed its results.
                let place = places.place(&name, true)?;
                Ok(Target::new(place.hashed().marked(&mark), format, name))
            });
            match target {
                Ok(target) => jobs.push((path, target)),
                Err(failure) => {
                    if !self.quiet {
                        failure.report();
                    }
                    self.refuse(&path, &failure);
                }
            }
        }
        for folder in &places.made {
            remove_marked(folder, &mark);
        }
        jobs
    }

    /// Gives the results their names, and says so in the shard's file.
    pub(crate) fn finish(&mut self) -> Result<(), Failure> {
        self.commit()?;
        let path = record::path(self.folder, self.header.shard);
        let text = self.text();
        match record::bytes(self.folder, self.header.shard) {
            Ok(before) if before == text.as_bytes() => return Ok(()),
            Ok(before) if record::header(&before).is_none() => {
                let path = path.display();
                let message = "is not the file of a shard: its first line is none; move it";
                return Err(Failure::usage(format!("{path}: {message}")));
            }
            Ok(_) | Err(_) => {}
        }
        let output = Output::create(&path, true, &[]);
        let mut output = output.map_err(|error| Failure::output(&error))?;
        let written = output.write_all(text.as_bytes());
        written.map_err(|error| Failure::writing(&path.display().to_string(), &error))?;
        output.commit().map_err(|error| Failure::output(&error))
    }

    /// As [`Shard::finish`], without the file: what it would hold.
    pub(crate) fn finish_elsewhere(&mut self) -> Result<String, Failure> {
        self.commit()?;
        Ok(self.text())
    }

    fn text(&self) -> String {
        record::text(&self.header, &self.entries)
    }

    /// Gives those that wait their names.
    fn commit(&mut self) -> Result<(), Failure> {
        let mut waiting: Vec<Option<Written>> = self.waiting.drain(..).map(Some).collect();
        let each = waiting.len().div_ceil(AT_ONCE).max(1);
        std::thread::scope(|scope| {
            let threads = waiting.chunks_mut(each).map(|files| {
                scope.spawn(|| {
                    let mut files = files.iter_mut().filter_map(Option::take);
                    files.try_for_each(Written::commit)
                })
            });
            // All are begun before the first is waited for.
            let threads: Vec<_> = threads.collect();
            let ended = threads.into_iter().map(|thread| {
                let ended = thread.join();
                ended.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            ended.collect::<Vec<_>>().into_iter().collect()
        })
    }
}

impl Records for Shard<'_> {
    fn previous(&self) -> Previous {
        self.previous.clone()
    }

    fn keep(&mut self, entry: Entry, written: Written) -> Result<(), Failure> {
        self.made += 1;
        self.entries.push(entry);
        self.waiting.push(written.settle()?);
        match self.waiting.len() {
            TOGETHER.. => self.commit(),
            _ => Ok(()),
        }
    }

    fn skip(&mut self, output: &str) {
        self.skipped += 1;
        let there = self.previous.results_of(output);
        self.entries.extend(there.cloned());
    }

    fn refuse(&mut self, path: &Path, failure: &Failure) {
        self.header.failed.push(Refusal {
            input: path.display().to_string(),
            code: failure.code,
            message: failure.message().to_owned(),
        });
    }

    fn list(&self) -> PathBuf {
        record::path(self.folder, self.header.shard)
    }

    fn tell(&self, text: &str) {
        if !self.quiet {
            words::note(text);
        }
    }
}
