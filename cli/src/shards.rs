//! Evaluates a library of files in shards, for front ends that distribute them over machines. These are the steps of
//! `tumble eval --shard` and `tumble merge`.
//!
//! Options are the words of a command line of `tumble eval`. Inputs and output are passed separately, because workers
//! may access them by other paths. A [`LibraryPlan`] divides the library into shards, a [`Worker`] keeps a device
//! open and evaluates shards, and [`merge`] makes one manifest of their records.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Parser;
use serde::Serialize;
use tumble_formats::{Format, Limits};

use crate::arguments::input::{FoundInput, GatheredInputs};
use crate::batch::digest::InputFile;
use crate::batch::entry::{FrameNotes, InputEntry, ManifestEntry, ManifestLines, UnfinishedInputs};
use crate::batch::shards::merge as merging;
use crate::batch::shards::plan::ShardPlan;
use crate::batch::shards::record::{self, RefusedInput, ShardHeader};
use crate::batch::shards::run::Shard;
use crate::batch::{entry, output_plan, result_names, target};
use crate::commands::eval::Arguments;
use crate::commands::eval::shards::{EvaluationOptions, Evaluator, size};
use crate::host::Refused;
use crate::messages::exit::{ALL_INPUTS, Failure, USAGE};
use crate::messages::words;

/// A command line.
#[derive(Debug, Parser)]
#[command(name = "eval", disable_help_flag = true)]
struct EvalCommandLine {
    #[command(flatten)]
    eval: Arguments,
}

fn parse(line: &[OsString]) -> Result<Arguments, Refused> {
    let name = OsString::from("eval");
    let parsed = EvalCommandLine::try_parse_from(std::iter::once(&name).chain(line));
    let parsed = parsed.map_err(|error| Refused {
        message: error.to_string(),
        is_usage: true,
        code: USAGE,
    })?;
    Ok(parsed.eval)
}

/// The inputs that a command line names.
///
/// # Errors
/// When the command line is invalid.
pub fn inputs(line: &[OsString]) -> Result<Vec<PathBuf>, Refused> {
    Ok(parse(line)?.inputs.named_paths().to_vec())
}

/// The files that an input refers to (the buffers of a glTF), relative to its folder.
#[must_use]
pub fn referred_files(path: &Path) -> Vec<PathBuf> {
    tumble_formats::referred::referred_files(path, Limits::default())
}

/// The hash of an input with the files that it refers to, as manifests contain it; `None` if it cannot be read.
#[must_use]
pub fn input_sha256(path: &Path) -> Option<String> {
    InputFile::new(path).sha256().map(str::to_owned)
}

/// The unfinished inputs in the text of a manifest and of the records of shards that are not merged: a line for each
/// input that failed or does not have all its results yet.
#[must_use]
pub fn manifest_unfinished(text: &str, records: &[String]) -> Vec<String> {
    let mut lines = ManifestLines::parse(text.as_bytes());
    for record in records {
        lines.extend(record::lines_of(record.as_bytes()));
    }
    let UnfinishedInputs { failed, pending } = lines.unfinished_inputs();
    let message = |entry: &&InputEntry| match &entry.message {
        Some(message) => message.clone(),
        None => format!("{}: failed", entry.input),
    };
    let failed = failed.iter().map(message);
    let pending = pending
        .iter()
        .map(|input| format!("{input}: does not have all its results yet"));
    failed.chain(pending).collect()
}

/// The SHA-256 hash of all kernels. Machines with the same hash and the same version write the same bytes.
#[must_use]
pub fn kernels_sha256() -> &'static str {
    entry::kernels_sha256()
}

/// A library divided into shards.
pub struct LibraryPlan {
    shard_plan: ShardPlan,
    arguments: Arguments,
}

impl LibraryPlan {
    /// Divides a library into shards. `library` is a directory, a pattern of file names, or one file. With `listed`,
    /// the inputs are these names below `library` with their sizes in bytes; names without the extension of a known
    /// format are left out. `folder` is the directory of results. `shard_bytes` is the largest size of a shard's
    /// inputs, such as `256MiB`; a single input may be larger. `into` is the kind of output, such as `files`.
    ///
    /// # Errors
    /// When the command line is invalid, when there are no inputs, or when two inputs would have the same result.
    pub fn new(
        line: &[OsString],
        library: &Path,
        listed: Option<Vec<(String, u64)>>,
        folder: &Path,
        shard_bytes: &str,
        into: &str,
    ) -> Result<Self, Refused> {
        let arguments = parse(line)?;
        let shard_bytes = words::parse_bytes(shard_bytes).map_err(Failure::usage)?;
        let mut request = EvaluationOptions::new(&arguments)?;
        if into != "files" {
            request.options.text += &format!(" into={into}");
        }
        let (inputs, sizes): (GatheredInputs, Vec<u64>) = match listed {
            Some(listed) => {
                arguments.results.refuse_base(library)?;
                let of_formats = listed
                    .into_iter()
                    .filter(|(name, _)| Format::of_input(Path::new(name)).is_some())
                    .filter(|(name, _)| !arguments.inputs.excludes(Path::new(name)));
                let found = of_formats.map(|(name, size)| {
                    let path = PathBuf::from(format!("{}/{name}", library.display()));
                    let below = PathBuf::from(name);
                    (FoundInput::named(path, below), size)
                });
                let (files, sizes) = found.unzip();
                (GatheredInputs::of(files), sizes)
            }
            None => {
                let found = arguments.inputs.gather_library(library)?;
                let mut found = arguments.results.based(found)?;
                found.files = output_plan::without_results(found.files, folder)?;
                let sizes = found.files.iter().map(size).collect();
                (found, sizes)
            }
        };
        if inputs.files.is_empty() {
            let library = library.display();
            let message = format!("{library}: has no file of a format that can be read");
            return Err(Failure::usage(message).into());
        }
        let shard_plan = request.plan(&arguments, inputs, &sizes, folder, shard_bytes)?;
        let naming = arguments.results.naming();
        result_names::refuse_shared_names(&shard_plan.inputs, shard_plan.format, naming)?;
        Ok(Self {
            shard_plan,
            arguments,
        })
    }

    /// Records the plan in the directory of results, and checks that no other files would be replaced.
    ///
    /// # Errors
    /// When the directory contains shards of another plan, or files with the names of results.
    pub fn claim(&self, folder: &Path) -> Result<(), Refused> {
        let results = &self.arguments.results;
        self.shard_plan
            .claim(folder, results.is_resumed(), results.overwrites())?;
        Ok(())
    }

    /// The identifier of the plan, which is equal for equal inputs, sizes, options and versions.
    #[must_use]
    pub fn id(&self) -> &str {
        &self.shard_plan.recorded.plan
    }

    /// The options that determine the results, as manifests contain them.
    #[must_use]
    pub fn options(&self) -> &str {
        &self.shard_plan.recorded.options
    }

    /// Number of shards.
    #[must_use]
    pub fn shards(&self) -> usize {
        self.shard_plan.cuts.len()
    }

    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.shard_plan.inputs.len()
    }

    /// The inputs of a shard, from 1: for each, its path and its path below the library. `None` if there is no such
    /// shard.
    #[must_use]
    pub fn inputs_of(&self, shard: usize) -> Option<Vec<(PathBuf, PathBuf)>> {
        let range = self.shard_plan.cuts.get(shard.checked_sub(1)?)?;
        let found = self.shard_plan.inputs[range.clone()].iter();
        Some(
            found
                .map(|found| (found.path.clone(), found.below.clone()))
                .collect(),
        )
    }

    /// The names of the results of a shard, from 1, below the directory of results. They do not include inputs whose
    /// result cannot have a name there; these fail. `None` if there is no such shard.
    #[must_use]
    pub fn names_of(&self, shard: usize) -> Option<Vec<String>> {
        let range = self.shard_plan.cuts.get(shard.checked_sub(1)?)?;
        Some(
            self.shard_plan.names[range.clone()]
                .iter()
                .flatten()
                .cloned()
                .collect(),
        )
    }
}

/// A request to evaluate one shard, or some of its inputs.
#[derive(Debug, Clone)]
pub struct ShardTask {
    /// Index of the shard, from 1.
    pub shard: usize,
    /// Number of shards.
    pub of: usize,
    /// The identifier of the plan: [`LibraryPlan::id`].
    pub plan: String,
    /// For each input, its path and its path below the library.
    pub inputs: Vec<(PathBuf, PathBuf)>,
    /// Whether the shard's record is written to the directory of results, rather than returned.
    pub record: bool,
}

/// The outcome of a [`ShardTask`].
#[derive(Debug, Clone, Serialize)]
pub struct ShardOutcome {
    made: usize,
    skipped: usize,
    /// Number of rotations that were evaluated.
    rotations: u64,
    device: String,
    failed: Vec<RefusedInput>,
    /// The text of the shard's record, if the caller writes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    record: Option<String>,
}

impl ShardOutcome {
    /// The outcome as JSON.
    #[must_use]
    pub fn to_json(&self) -> String {
        json(self)
    }
}

/// Evaluates shards on a device that stays open.
pub struct Worker {
    arguments: Arguments,
    evaluator: Evaluator,
}

impl Worker {
    /// Opens the device that a command line names. `threads` is the number of threads on the CPU.
    ///
    /// # Errors
    /// When the command line is invalid, or when the device cannot be opened.
    pub fn new(line: &[OsString], threads: Option<usize>) -> Result<Self, Refused> {
        let mut arguments = parse(line)?;
        arguments.device.set_threads(threads);
        let evaluator = Evaluator::new(&arguments)?;
        Ok(Self {
            arguments,
            evaluator,
        })
    }

    /// The name of its device.
    #[must_use]
    pub fn device(&self) -> &str {
        &self.evaluator.device.label
    }

    /// The options that determine the results, as manifests contain them.
    #[must_use]
    pub fn options(&self) -> &str {
        &self.evaluator.request.options.text
    }

    /// The name by which the results of an input are known, from its path below the library: that of its result,
    /// without the extension of the result's format.
    #[must_use]
    pub fn key_of(&self, below: &Path) -> String {
        self.arguments.results.naming().key(below)
    }

    /// Evaluates the inputs of a task, and writes the results to `folder`. The plan of this directory must have been
    /// recorded by [`LibraryPlan::claim`], unless only the caller uses the directory.
    ///
    /// # Errors
    /// When the device fails, or when results cannot be written. Inputs that are refused are not errors; the outcome
    /// contains them.
    pub fn run(&mut self, task: &ShardTask, folder: &Path) -> Result<ShardOutcome, Refused> {
        let found: Vec<FoundInput> = (task.inputs.iter())
            .map(|(path, below)| FoundInput::named(path.clone(), below.clone()))
            .collect();
        let format = result_names::format(folder, self.arguments.results.format())?;
        let naming = self.arguments.results.naming();
        let names = result_names::name_results(&found, folder, format, naming);
        let header = ShardHeader {
            shard: task.shard,
            of: task.of,
            plan: task.plan.clone(),
            inputs: found.len(),
            ..ShardHeader::default()
        };
        let valid_names: Vec<&str> = names.iter().flatten().map(|name| &**name).collect();
        let resume = self.arguments.results.is_resumed();
        let folder = target::opened(folder)?;
        let mut shard = Shard::new(&folder, header, &valid_names, resume);
        shard.quiet = true;
        let paths = found.into_iter().map(|found| found.path);
        let jobs = shard.jobs(paths, &names, format);
        let arguments = &self.arguments;
        let rotations = (self.evaluator).evaluate(arguments, jobs, &mut shard, &mut Vec::new())?;
        let record = match task.record {
            true => shard.finish().map(|()| None),
            false => shard.finish_elsewhere().map(Some),
        }?;
        Ok(ShardOutcome {
            made: shard.made,
            skipped: shard.skipped,
            rotations,
            device: self.evaluator.device.label.clone(),
            failed: shard.header.failed,
            record,
        })
    }
}

/// The record of a shard, for front ends that store results in locations to which the program cannot write: a header,
/// and the shard's lines of the manifest.
#[derive(Debug, Clone)]
pub struct ShardRecord {
    header: ShardHeader,
    entries: Vec<ManifestEntry>,
    is_whole: bool,
}

/// A file of rows with all results of a shard.
#[derive(Debug, Clone)]
pub struct RowsFile {
    /// Name of the file below the directory of results.
    pub name: String,
    /// SHA-256 hash of the file.
    pub sha256: String,
    /// Length of the file in bytes.
    pub bytes: u64,
    /// The library of the shard's inputs.
    pub library: String,
    /// SHA-256 hash of the hashes of these inputs.
    pub inputs_sha256: String,
    /// The kind of output, as `into` in [`LibraryPlan::new`].
    pub into: String,
}

impl ShardRecord {
    /// The name of a shard's record below the directory of results.
    #[must_use]
    pub fn name_of(shard: usize) -> String {
        format!("{}/{shard:05}.jsonl", record::FOLDER)
    }

    /// Parses the text of a shard's record; `None` if it is not one.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        let (header, start) = record::header(bytes)?;
        Some(Self {
            header,
            entries: entries_of(&text[start..]),
            is_whole: record::whole(bytes).is_some(),
        })
    }

    /// The record of a shard with these lines of a manifest as results; invalid lines are left out.
    #[must_use]
    pub fn new(shard: usize, of: usize, plan: String, inputs: usize, lines: &[String]) -> Self {
        let header = ShardHeader {
            shard,
            of,
            plan,
            inputs,
            ..ShardHeader::default()
        };
        Self {
            header,
            entries: entries_of(&lines.concat()),
            is_whole: true,
        }
    }

    /// Whether the parsed text was complete and unchanged.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// The identifier of the shard's plan: [`LibraryPlan::id`].
    #[must_use]
    pub fn plan(&self) -> &str {
        &self.header.plan
    }

    /// Changes the plan of the shard to another one with the same results.
    pub fn set_plan(&mut self, plan: String) {
        self.header.plan = plan;
    }

    /// The results of the shard: for each, its name below the directory, its SHA-256 hash and its length in bytes.
    #[must_use]
    pub fn results(&self) -> Vec<(String, String, u64)> {
        results_of(&self.entries)
    }

    /// Adds an input without a result, with the error message.
    pub fn refuse(&mut self, input: String, message: String) {
        let code = ALL_INPUTS;
        self.header.inputs += 1;
        self.header.failed.push(RefusedInput {
            input,
            code,
            message,
            result: None,
            diagnostic: None,
            causes: Vec::new(),
            warnings: Vec::new(),
        });
    }

    /// Whether the record contains all results of `inputs` and no others. `inputs` maps the name of each input's
    /// result, without extension, to the hash of the input. The results must have been made with these options, and
    /// with the kernels and the version of this program.
    #[must_use]
    pub fn is_made_from(&self, inputs: &BTreeMap<String, String>, options: &str) -> bool {
        let mut parts: BTreeMap<String, usize> = BTreeMap::new();
        let mut made = 0;
        for entry in &self.entries {
            let (result, count) = entry.whole();
            let key = result_names::key_of_result(result);
            let hash = inputs.get(&key);
            if !hash.is_some_and(|hash| entry.is_made_from(hash, options)) {
                return false;
            }
            let parts = parts.entry(key).or_default();
            *parts += 1;
            made += usize::from(*parts == count);
        }
        self.header.failed.is_empty() && made == inputs.len()
    }

    /// Replaces the results by one file of rows that contains them. Without results nothing changes.
    pub fn join(&mut self, rows: RowsFile) {
        let Some(first) = self.entries.first() else {
            return;
        };
        self.entries = vec![ManifestEntry {
            output: rows.name,
            output_sha256: rows.sha256,
            output_bytes: rows.bytes,
            input: rows.library,
            input_sha256: Some(rows.inputs_sha256),
            options: format!("{} into={}", first.options, rows.into),
            one_of: None,
            frames: FrameNotes::default(),
            ..first.clone()
        }];
    }

    /// The text of the record.
    #[must_use]
    pub fn text(&self) -> String {
        record::text(&self.header, &self.entries)
    }
}

fn entries_of(lines: &str) -> Vec<ManifestEntry> {
    let lines = lines.split_inclusive('\n');
    lines
        .filter_map(|line| ManifestEntry::of_line(line.as_bytes()))
        .collect()
}

fn results_of<'a>(
    entries: impl IntoIterator<Item = &'a ManifestEntry>,
) -> Vec<(String, String, u64)> {
    let result = |entry: &ManifestEntry| {
        let (output, sha256) = (entry.output.clone(), entry.output_sha256.clone());
        (output, sha256, entry.output_bytes)
    };
    entries.into_iter().map(result).collect()
}

/// The results in the text of a manifest: for each, its name, its SHA-256 hash and its length in bytes. If a result
/// occurs several times, the last line counts.
#[must_use]
pub fn manifest_results(text: &str) -> Vec<(String, String, u64)> {
    results_of(ManifestLines::parse(text.as_bytes()).entries.values())
}

/// The lines of a manifest, by the name of the input's result without its extension.
#[must_use]
pub fn manifest_by_input(text: &str) -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    // If a part of an input failed, the results of this input are incomplete.
    let unfinished = ManifestLines::parse(text.as_bytes()).inputs;
    for entry in entries_of(text) {
        if unfinished.contains_key(entry.whole().0) {
            continue;
        }
        let key = result_names::key_of_result(entry.whole().0);
        let lines = found.entry(key).or_default();
        lines.push(entry::line(&entry));
    }
    found
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("strings and numbers")
}

/// The outcome of [`merge`].
#[derive(Debug, Clone, Serialize)]
pub struct MergeReport {
    results: usize,
    shards: usize,
    inputs: usize,
    failed: Vec<RefusedInput>,
}

impl MergeReport {
    /// The report as JSON.
    #[must_use]
    pub fn to_json(&self) -> String {
        json(self)
    }
}

/// Makes one manifest of the shards in a directory. It does not look at the results, which may be in an object store.
///
/// # Errors
/// When shards are missing, or when the manifest cannot be written.
pub fn merge(folder: &Path) -> Result<MergeReport, Refused> {
    let merged = merging::merge(folder, merging::ResultLocation::Store)?;
    Ok(MergeReport {
        results: merged.results,
        shards: merged.shards,
        inputs: merged.inputs,
        failed: merged.failed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(output: &str, one_of: Option<(&str, usize)>) -> String {
        entry::line(&ManifestEntry {
            output: output.to_owned(),
            output_sha256: format!("hash of {output}"),
            output_bytes: 3,
            input: "a.glb".to_owned(),
            input_sha256: Some("1".to_owned()),
            options: "o".to_owned(),
            option_files: Vec::new(),
            kernels_sha256: kernels_sha256().to_owned(),
            tumble: env!("CARGO_PKG_VERSION").to_owned(),
            device: "CPU".to_owned(),
            one_of: one_of.map(|(all, count)| (all.to_owned(), count)),
            frames: FrameNotes::default(),
            warnings: Vec::new(),
        })
    }

    fn hashes(keys: &[&str]) -> BTreeMap<String, String> {
        keys.iter()
            .map(|key| ((*key).to_owned(), "1".to_owned()))
            .collect()
    }

    #[test]
    fn a_record_is_read_as_it_was_written() {
        let lines = [line("é\u{2028}.npy", None), line("a.npy", None)];
        let mut record = ShardRecord::new(3, 9, "plan".to_owned(), 2, &lines);
        record.refuse("bad.dat".to_owned(), "no keys".to_owned());
        let text = record.text();
        assert!(text.ends_with(&lines.concat()), "{text}");
        let read = ShardRecord::parse(&text).unwrap();
        assert!(read.is_whole());
        assert_eq!((read.text(), read.plan()), (text.clone(), "plan"));
        assert_eq!((read.header.inputs, read.header.failed.len()), (3, 1));
        let less = ShardRecord::parse(&text.replace(&lines[1], "")).unwrap();
        assert!(!less.is_whole());
        assert_eq!(less.results().len(), 1);
        assert!(ShardRecord::parse("").is_none());
        assert!(
            !ShardRecord::parse(&text[..text.len() - 1])
                .unwrap()
                .is_whole()
        );
    }

    /// All clips of all inputs, from the same bytes with the same options.
    #[test]
    fn a_shard_is_done_when_all_its_results_are_those_of_the_request() {
        let clips = [
            line("b.npy", None),
            line("a.run.npy", Some(("a.npy", 2))),
            line("a.walk.npy", Some(("a.npy", 2))),
        ];
        let of = |lines: &[String]| ShardRecord::new(1, 1, String::new(), 2, lines);
        let both = hashes(&["a", "b"]);
        assert!(of(&clips).is_made_from(&both, "o"));
        assert!(!of(&clips).is_made_from(&both, "p"), "other options");
        assert!(
            !of(&clips[..2]).is_made_from(&both, "o"),
            "a clip is missing"
        );
        assert!(
            !of(&clips).is_made_from(&hashes(&["b"]), "o"),
            "another input"
        );
        assert!(
            !of(&clips).is_made_from(&hashes(&["a", "b", "c"]), "o"),
            "no result of c"
        );
        let mut changed = both.clone();
        changed.insert("b".to_owned(), "2".to_owned());
        assert!(
            !of(&clips).is_made_from(&changed, "o"),
            "another input's bytes"
        );
        let mut failed = of(&clips);
        failed.refuse("c.dat".to_owned(), String::new());
        assert!(!failed.is_made_from(&both, "o"));
    }

    #[test]
    fn rows_take_the_place_of_a_shards_results() {
        let lines = [line("a.npy", None), line("b.npy", None)];
        let mut record = ShardRecord::new(1, 1, String::new(), 2, &lines);
        record.join(RowsFile {
            name: "part-00001.parquet".to_owned(),
            sha256: "rows".to_owned(),
            bytes: 8,
            library: "clips".to_owned(),
            inputs_sha256: "1".to_owned(),
            into: "parquet".to_owned(),
        });
        let results = record.results();
        assert_eq!(
            results,
            [("part-00001.parquet".to_owned(), "rows".to_owned(), 8)]
        );
        assert!(record.is_made_from(&hashes(&["part-00001.parquet"]), "o into=parquet"));
        let mut none = ShardRecord::new(1, 1, String::new(), 0, &[]);
        none.join(RowsFile {
            name: "part-00001.parquet".to_owned(),
            sha256: String::new(),
            bytes: 0,
            library: String::new(),
            inputs_sha256: String::new(),
            into: String::new(),
        });
        assert_eq!(none.results(), []);
    }

    /// Records of shards that are not merged count, and inputs of which a clip is missing.
    #[test]
    fn unfinished_inputs_are_in_manifests_and_in_records() {
        let cut = line("a.run.npy", Some(("a.npy", 2)));
        let mut record = ShardRecord::new(1, 1, String::new(), 0, &[line("b.npy", None)]);
        record.refuse("c.dat".to_owned(), "c.dat: no keys".to_owned());
        let pending = r#"{"state":"pending","input":"b.dat","result":"b.npy"}"#;
        let text = format!("{cut}{pending}\n");
        let of = |records: &[String]| manifest_unfinished(&text, records);
        let is_missing = |input: &str| format!("{input}: does not have all its results yet");
        assert_eq!(of(&[]), [is_missing("a.glb"), is_missing("b.dat")]);
        let with_record = of(&[record.text()]);
        assert_eq!(
            with_record,
            ["c.dat: no keys".to_owned(), is_missing("a.glb")]
        );
    }

    /// The results of objects are named by the names of the objects, so that `--base` cannot apply.
    #[test]
    fn a_base_of_listed_objects_is_refused() {
        let plan = |line: &[&str]| {
            let line: Vec<OsString> = line.iter().map(OsString::from).collect();
            let listed = Some(vec![("walks/a.dat".to_owned(), 3)]);
            let (library, out) = (Path::new("s3://bucket/lib"), Path::new("out"));
            LibraryPlan::new(&line, library, listed, out, "1MiB", "files")
        };
        assert_eq!(plan(&["lib"]).map(|plan| plan.inputs()).ok(), Some(1));
        let refused = plan(&["lib", "--base", "lib"]).err().unwrap();
        assert!(refused.is_usage, "{}", refused.message);
        assert!(
            refused.message.contains("--base lib: "),
            "{}",
            refused.message
        );
    }

    #[test]
    fn manifests_are_listed_by_result_and_by_input() {
        let lines = [
            line("walks/a.run.npy", Some(("walks/a.npy", 2))),
            line("walks/a.walk.npy", Some(("walks/a.npy", 2))),
            line("b.npy", None),
            "{\"output\":3}\n".to_owned(),
        ];
        let by_input = manifest_by_input(&lines.concat());
        assert_eq!(by_input.keys().collect::<Vec<_>>(), ["b", "walks/a"]);
        assert_eq!(by_input["walks/a"], lines[..2]);
        let names: Vec<String> = manifest_results(&lines.concat())
            .into_iter()
            .map(|it| it.0)
            .collect();
        assert_eq!(names, ["b.npy", "walks/a.run.npy", "walks/a.walk.npy"]);
    }
}
