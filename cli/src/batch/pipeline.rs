//! The steps of a command's inputs: they are read ahead, evaluated one by one by the command, and their results are
//! kept.
//!
//! ```text
//! while let Some(work) = pipeline.next_work() {
//!     let made = …;                    what the command does to one input
//!     pipeline.keep(&work, made);
//! }
//! pipeline.finish()
//! ```
//!
//! A thread reads, and hashes, the next input of a batch while the command works on one: at most one waits,
//! so that at most two are in memory. A failure of an input is reported when the next one begins, and the
//! others go on, unless they would fail alike. Warnings of a batch are summed up at its end ([`BatchSummary`]);
//! those of a single input are printed as they come. Both are in the JSON, and in the manifest of the batch.

use std::collections::{BTreeMap, HashSet, VecDeque};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Instant;

use serde::Serialize;
use serde_json::{Value, json};
use tumble_formats::motion::Motion;
use tumble_formats::{Diagnostic, Feature, Limits, Loaded};

use crate::arguments::input::{InputReader, check_complete, several_clips_failure};
use crate::arguments::options::ResultOptions;
use crate::batch::digest::InputFile;
use crate::batch::entry::{
    BatchStart, FrameNotes, InputEntry, ManifestEntry, PreviousEntries, ResultRecorder,
    kernels_sha256,
};
use crate::batch::output_plan::UnplannedInput;
use crate::batch::owner::{Owner, ReplacedOwners};
use crate::batch::summary::BatchSummary;
use crate::batch::target::{ResultTarget, WrittenFile};
use crate::messages::exit::{DEVICE, Failure, Outcomes, SOME_INPUTS};
use crate::messages::progress::{Progress, busy};
use crate::messages::signals::BatchGuard;
use crate::messages::warnings::{self, RecordedWarning, Warning, WarningMark};
use crate::messages::{listing, names, signals, words};

/// An input and the target of its result.
pub(crate) type PipelineJob = (PathBuf, ResultTarget);

/// The inputs and results of a command.
#[derive(Default)]
pub(crate) struct PipelineInputs {
    pub(crate) jobs: Vec<PipelineJob>,
    /// Inputs that have no job.
    pub(crate) refused: Vec<UnplannedInput>,
    /// Skipped entries of the directories of inputs.
    pub(crate) skipped: Vec<InputEntry>,
    /// Whether JSON about all results and failures is printed at the end.
    pub(crate) prints_json: bool,
}

/// The options of a batch.
pub(crate) struct BatchOptions {
    /// Everything that determines a result besides its input.
    pub(crate) options: ResultOptions,
    /// Whether results that are complete are kept.
    pub(crate) resume: bool,
    /// Whether existing results are replaced, also those of other inputs.
    pub(crate) overwrite: bool,
    /// Whether every result and every warning is printed.
    pub(crate) verbose: bool,
}

/// A result that still has its temporary name, the device that computed it, and the message about it.
pub(crate) struct EvaluatedResult {
    pub(crate) written: WrittenFile,
    pub(crate) device: String,
    pub(crate) message: String,
    pub(crate) frames: FrameNotes,
}

/// An input that was read.
pub(crate) struct OpenInput {
    pub(crate) file: InputFile,
    pub(crate) loaded: Loaded,
    /// The time when the command began with this input.
    pub(crate) started: Instant,
}

/// A file to write: all clips of an input, or one of them.
pub(crate) struct ClipWork {
    pub(crate) input: Rc<OpenInput>,
    /// The name of the clips in messages.
    pub(crate) name: String,
    pub(crate) target: ResultTarget,
    clips: std::ops::Range<usize>,
    /// When the work began.
    mark: WarningMark,
}

impl ClipWork {
    /// ` (1.2 MB → 860.0 kB)`: the bytes of the input with its files, and of the result; nothing if the input's are
    /// not known.
    pub(crate) fn sizes(&self, written: &WrittenFile) -> String {
        let size = |bytes: u64| words::bytes(bytes as f64);
        let before = self.input.file.bytes();
        before.map_or(String::new(), |before| {
            format!(" ({} → {})", size(before), size(written.bytes))
        })
    }

    /// The clips.
    pub(crate) fn clips(&self) -> Vec<&Motion> {
        self.input.loaded.clips[self.clips.clone()].iter().collect()
    }

    /// The name of the only animation of the file, where the input has several.
    fn animation(&self) -> Option<String> {
        match self.clips()[..] {
            [clip] if self.input.loaded.clips.len() > 1 => Some(names::clip(clip)),
            _ => None,
        }
    }

    /// The name of the clips in results. It contains only the name of the input's file, not its directory, so that a
    /// file has the same results in every directory.
    pub(crate) fn origin(&self) -> String {
        let input = names::input(self.path());
        let animation = self.name.strip_prefix(&*input).unwrap_or_default();
        format!("{}{animation}", names::file(self.path()))
    }

    /// The path of the input.
    pub(crate) fn path(&self) -> &Path {
        self.input.file.path()
    }

    /// The result of this work. `done` is the participle in its message. `device` is the device that computed it;
    /// `None` if nothing was computed.
    pub(crate) fn result(
        &self,
        written: WrittenFile,
        done: &str,
        device: Option<&str>,
    ) -> EvaluatedResult {
        let (name, target) = (&self.name, &self.target);
        let on_device = device.map_or(String::new(), |device| format!(", on {device}"));
        let spent = words::duration(self.input.started.elapsed());
        // Sizes are compared only for files of clips: arrays and tables of rotations have other content than the
        // input.
        let sizes = match target.format().write {
            None => self.sizes(&written),
            Some(_) => String::new(),
        };
        EvaluatedResult {
            written,
            device: device.unwrap_or("none").to_owned(),
            message: format!("{name}: {done}{on_device} in {spent} → {target}{sizes}"),
            frames: FrameNotes::default(),
        }
    }
}

/// See the module.
pub(crate) struct Pipeline<'a> {
    inputs: InputSource,
    /// The input that is being worked on.
    current: Option<CurrentInput>,
    /// Nothing for a single result.
    batch: Option<BatchRecords<'a>>,
    outcomes: Outcomes,
    /// The records of results and failures, if they are printed as JSON.
    json: Option<Vec<Value>>,
}

/// Where inputs come from.
enum InputSource {
    /// One, or none.
    One(Box<dyn InputReader>, std::vec::IntoIter<PipelineJob>),
    /// Inputs that a thread reads in advance.
    Ahead {
        read_jobs: Receiver<ReadJob>,
        left: usize,
        thread: JoinHandle<()>,
    },
    /// The thread could not start.
    None,
}

/// A job whose input was read.
struct ReadJob {
    job: PipelineJob,
    /// `None` if its result exists and is complete.
    input: Option<(InputFile, Result<Loaded, Failure>)>,
}

/// The input that is being worked on.
struct CurrentInput {
    input: Rc<OpenInput>,
    target: ResultTarget,
    /// The files that are left.
    files: VecDeque<Result<ClipFile, Failure>>,
    file_count: usize,
    failed: Vec<Failure>,
    /// The warnings so far: those of the input, and those about its clips.
    warnings: Vec<Warning>,
    /// The warnings about clips that failed.
    of_failed: Vec<RecordedWarning>,
}

/// The results of a batch.
struct BatchRecords<'a> {
    records: Box<dyn ResultRecorder + 'a>,
    summary: BatchSummary,
    progress: Progress,
    /// A signal ends the batch at its next input; the batch then prints how much is done.
    _until_end: BatchGuard,
    options: ResultOptions,
    previous: PreviousEntries,
    overwrite: bool,
    inputs: usize,
    /// The inputs that the batch has not processed yet, with the names of their results.
    left: BTreeMap<PathBuf, String>,
    made: HashSet<String>,
    /// The number of inputs with all their results, and of inputs with some of them.
    done: usize,
    done_in_part: usize,
    /// The number of inputs whose results were complete before the batch, and the number of these results.
    skipped: usize,
    skipped_results: usize,
    failed: usize,
}

impl<'a> Pipeline<'a> {
    /// The pipeline of a single result, without a manifest.
    pub(crate) fn of_one(reader: impl InputReader, inputs: PipelineInputs) -> Self {
        let PipelineInputs {
            jobs,
            refused,
            prints_json,
            ..
        } = inputs;
        let mut pipeline = Self {
            outcomes: Outcomes::of(refused.len() + jobs.len()),
            inputs: InputSource::One(Box::new(reader), jobs.into_iter()),
            current: None,
            batch: None,
            json: prints_json.then(Vec::new),
        };
        pipeline.refuse_all(refused);
        pipeline
    }

    /// The pipeline of results that `records` records.
    pub(crate) fn of_batch(
        reader: impl InputReader,
        inputs: PipelineInputs,
        options: BatchOptions,
        mut records: Box<dyn ResultRecorder + 'a>,
    ) -> Self {
        let PipelineInputs {
            jobs,
            refused,
            skipped,
            prints_json,
        } = inputs;
        let BatchOptions {
            options,
            resume,
            overwrite,
            verbose,
        } = options;
        let job_count = jobs.len();
        let inputs = refused.len() + job_count;
        let mut outcomes = Outcomes::of(inputs);
        let json = prints_json.then(|| skipped.iter().map(to_json).collect());
        let left = jobs.iter();
        let left = left.map(|(path, target)| (path.clone(), target.name().to_owned()));
        let left = left.collect();
        let previous = records.previous();
        let reading = ReadingAhead {
            reader,
            previous: previous.clone(),
            options: options.text.clone(),
            resume,
        };
        let begun = records.begin(BatchStart {
            inputs: jobs
                .iter()
                .map(|(path, target)| (&**path, target.name()))
                .collect(),
            skipped,
            options: &options.text,
            resume,
        });
        let batch = BatchRecords {
            records,
            summary: BatchSummary::new(inputs, verbose),
            progress: Progress::new("inputs", inputs as u64),
            _until_end: BatchGuard::begin(),
            options,
            previous,
            overwrite,
            inputs,
            left,
            made: HashSet::new(),
            done: 0,
            done_in_part: 0,
            skipped: 0,
            skipped_results: 0,
            failed: 0,
        };
        let (hand_over, read_jobs) = sync_channel(0);
        let start = || thread::Builder::new().spawn(move || reading.read_all(jobs, &hand_over));
        let started = begun.and_then(|()| {
            start().map_err(|error| {
                let message = format!(
                    "the system refuses to start a thread: {error}; allow more threads (ulimit -u)"
                );
                Failure::new(DEVICE, message)
            })
        });
        let inputs = match started {
            Ok(thread) => InputSource::Ahead {
                read_jobs,
                left: job_count,
                thread,
            },
            Err(failure) => {
                outcomes.end(failure);
                InputSource::None
            }
        };
        let mut pipeline = Self {
            inputs,
            current: None,
            batch: Some(batch),
            outcomes,
            json,
        };
        pipeline.refuse_all(refused);
        pipeline
    }

    /// Adds the failures of inputs that have no job.
    fn refuse_all(&mut self, refused: Vec<UnplannedInput>) {
        for UnplannedInput { path, failure } in refused {
            if !self.outcomes.is_ended() {
                self.add(&path, None, Err(failure), Vec::new());
            }
        }
    }

    /// The next file to write; `None` at the end.
    pub(crate) fn next_work(&mut self) -> Option<ClipWork> {
        loop {
            while let Some(current) = &mut self.current {
                match current.files.pop_front() {
                    Some(Ok(file)) => {
                        warnings::sum(self.batch.is_some());
                        return Some(ClipWork {
                            input: Rc::clone(&current.input),
                            name: file.name,
                            target: file.target,
                            clips: file.clips,
                            mark: warnings::mark(),
                        });
                    }
                    Some(Err(failure)) => self.fail(failure),
                    None => self.end_input(),
                }
            }
            if self.outcomes.is_ended() {
                return None;
            }
            if let Some(stop) = signals::stopped() {
                self.outcomes.end(stop);
                return None;
            }
            let ReadJob { job, input } = self.inputs.next()?;
            self.begin(job, input);
        }
    }

    /// Keeps the result of a file's clips, or its failure; returns whether it is kept. `report` is its part of the
    /// JSON: the fields of one record, or a list of those of several.
    pub(crate) fn keep<T: Serialize>(
        &mut self,
        work: &ClipWork,
        made: Result<(EvaluatedResult, T), Failure>,
    ) -> bool {
        let kept = made.and_then(|(mut result, report)| {
            let of_file = std::mem::take(&mut result.written.warnings);
            let (target, loaded) = (&work.target, &work.input.loaded);
            let space = loaded.space_warning(target.format(), &target.to_string());
            of_file.into_iter().chain(space).for_each(words::warn_of);
            let warnings = warnings::since(work.mark);
            let of_input = loaded.warnings.iter().map(RecordedWarning::from);
            let recorded = of_input.chain(warnings.iter().map(RecordedWarning::from));
            let recorded: Vec<RecordedWarning> = recorded.collect();
            if let Some(current) = &mut self.current {
                current.warnings.extend(warnings);
            }
            let sizes = [work.input.file.bytes(), Some(result.written.bytes)];
            match &mut self.batch {
                Some(batch) => {
                    let whole = self.current.as_ref().map_or("", |it| it.target.name());
                    batch.keep(work, whole, result, recorded.clone())?;
                }
                None => {
                    result.written.commit()?;
                    words::note(&result.message);
                }
            }
            if let Some(json) = &mut self.json {
                json.extend(records_of(work, &recorded, sizes, &report));
            }
            Ok(())
        });
        let of_failed = warnings::since(work.mark);
        if let Some(current) = &mut self.current {
            let recorded = of_failed.iter().map(RecordedWarning::from);
            current.of_failed.extend(recorded);
            current.warnings.extend(of_failed);
        }
        warnings::sum(false);
        kept.map_err(|failure| self.fail(failure)).is_ok()
    }

    /// Ends the work: the exit code of the command.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let (outcome, json) = self.finish_with_json();
        if let Some(json) = json {
            listing::records(&json, &[])?;
        }
        outcome
    }

    /// As [`Pipeline::finish`]; gives the records instead of printing them as JSON.
    pub(crate) fn finish_with_json(mut self) -> (Result<(), Failure>, Option<Vec<Value>>) {
        let mut json = self.json.take();
        if let (Some(json), Some(batch)) = (&mut json, &self.batch) {
            let left = batch.left.iter();
            json.extend(left.map(|(path, result)| to_json(&InputEntry::pending(path, result))));
        }
        let outcome = self.end();
        (outcome, json)
    }

    fn end(self) -> Result<(), Failure> {
        self.inputs.close();
        if let Some(batch) = self.batch {
            batch.summarize();
            batch.records.close()?;
        }
        self.outcomes.finish()
    }

    /// Begins with an input that was read.
    fn begin(
        &mut self,
        (path, target): PipelineJob,
        input: Option<(InputFile, Result<Loaded, Failure>)>,
    ) {
        if let Some(batch) = &mut self.batch {
            batch.left.remove(&path);
        }
        let Some((file, loaded)) = input else {
            self.skip(&path, &target);
            return;
        };
        let mut of_failed = Vec::new();
        let files = loaded.and_then(|loaded| {
            match &mut self.batch {
                None => words::print_kept(loaded.warnings.iter().chain(&loaded.refused)),
                Some(batch) => {
                    let parts = loaded.refused.iter();
                    parts.for_each(|fault| batch.summary.fail(&Failure::input(fault, "")));
                }
            }
            let warnings: Vec<Warning> =
                (loaded.warnings.iter().cloned().map(Warning::OfInput)).collect();
            match clip_files(&path, &loaded, &target) {
                Ok(files) => Ok((loaded, files, warnings)),
                Err(failure) => {
                    if let Some(batch) = &mut self.batch {
                        batch.summary.warn(&warnings);
                    }
                    of_failed.extend(warnings.iter().map(RecordedWarning::from));
                    Err(failure)
                }
            }
        });
        match files {
            Ok((loaded, files, warnings)) => {
                let input = OpenInput {
                    file,
                    loaded,
                    started: Instant::now(),
                };
                self.current = Some(CurrentInput {
                    input: Rc::new(input),
                    target,
                    file_count: files.len(),
                    files,
                    failed: Vec::new(),
                    warnings,
                    of_failed,
                });
            }
            Err(failure) => self.add(&path, Some(target.name()), Err(failure), of_failed),
        }
    }

    /// The results of an input are complete.
    fn skip(&mut self, path: &Path, target: &ResultTarget) {
        let Some(batch) = &mut self.batch else {
            return;
        };
        let folder = batch.previous.folder();
        let kept = batch.previous.results_of(target.name());
        let records = kept.map(|entry| KeptResult {
            state: "kept",
            input: names::recorded(path),
            output: folder.join(&entry.output).display().to_string(),
            frames: &entry.frames,
        });
        let records: Vec<Value> = records.map(|record| to_json(&record)).collect();
        batch.skipped += 1;
        batch.skipped_results += records.len();
        batch.progress.advance(1);
        batch.records.skip(target.name());
        if let Some(json) = &mut self.json {
            json.extend(records);
        }
    }

    /// Records that a file of the input failed. The work on the others continues, unless they would fail in the same
    /// way.
    fn fail(&mut self, failure: Failure) {
        let Some(current) = &mut self.current else {
            return;
        };
        if failure.is_final() {
            let path = current.input.file.path().to_owned();
            let mut warnings = std::mem::take(&mut current.of_failed);
            let of_input = current.input.loaded.warnings.iter();
            warnings.splice(..0, of_input.map(RecordedWarning::from));
            self.current = None;
            self.add(&path, None, Err(failure), warnings);
        } else {
            current.failed.push(failure);
        }
    }

    /// All files of the input are made, or failed.
    fn end_input(&mut self) {
        let Some(mut current) = self.current.take() else {
            return;
        };
        let path = current.input.file.path();
        let name = names::input(path);
        let failed = current.failed.len();
        let batch = &mut self.batch;
        let mut report = |failure: &Failure| match batch {
            Some(batch) => batch.summary.fail(failure),
            None => {
                failure.report();
            }
        };
        let outcome = match current.failed.pop() {
            None => check_complete(&name, &current.input.loaded),
            Some(last) => {
                current.failed.iter().for_each(&mut report);
                if failed == current.file_count {
                    Err(last)
                } else {
                    report(&last);
                    let all = current.file_count;
                    let message = format!("{name}: {failed} of {all} animations failed");
                    let causes = current.failed.iter().chain([&last]);
                    let causes = causes.map(|cause| cause.message().to_owned());
                    let refused = current
                        .input
                        .loaded
                        .refused
                        .iter()
                        .map(Diagnostic::to_string);
                    let causes = causes.chain(refused).collect();
                    Err(Failure::new(SOME_INPUTS, message).with_causes(causes))
                }
            }
        };
        if let Some(batch) = &mut self.batch {
            batch.summary.warn(&current.warnings);
            if outcome.is_ok() {
                batch.done += 1;
                batch.records.end_input(current.target.name());
            }
        }
        let mut warnings = current.of_failed;
        if failed == current.file_count {
            let of_input = current.input.loaded.warnings.iter();
            warnings.splice(..0, of_input.map(RecordedWarning::from));
        }
        self.add(path, Some(current.target.name()), outcome, warnings);
    }

    /// Adds the outcome of an input; `result` is the name of its result, `warnings` are those that no result has.
    fn add(
        &mut self,
        path: &Path,
        result: Option<&str>,
        outcome: Result<(), Failure>,
        warnings: Vec<RecordedWarning>,
    ) {
        let entry = outcome.as_ref().err().map(|failure| {
            let result = result.filter(|result| !result.is_empty());
            let entry = match failure.message().is_empty() {
                // A signal stopped the work: the input has not failed.
                true => InputEntry::pending(path, result.unwrap_or_default()),
                false => InputEntry::failed(path, result, failure),
            };
            let options = self.batch.as_ref().map_or("", |batch| &batch.options.text);
            InputEntry {
                warnings,
                command: InputEntry::command_in(options),
                ..entry
            }
        });
        if let (Some(entry), Some(json)) = (&entry, &mut self.json) {
            json.push(to_json(entry));
        }
        let Some(batch) = &mut self.batch else {
            self.outcomes.add(outcome);
            return;
        };
        let mut recorded = Ok(());
        if let (Err(failure), Some(entry)) = (&outcome, entry)
            && !failure.is_final()
        {
            match failure.code {
                SOME_INPUTS => batch.done_in_part += 1,
                _ => {
                    batch.failed += 1;
                    let folder = batch.previous.folder();
                    let earlier = result
                        .into_iter()
                        .flat_map(|it| batch.previous.results_of(it));
                    let mut earlier = earlier.map(|entry| folder.join(&entry.output));
                    if let Some(stale) = earlier.find(|path| path.exists()) {
                        batch.summary.stay(&stale);
                    }
                }
            }
            recorded = batch.records.refuse(entry);
        }
        match outcome {
            Ok(()) => batch.progress.advance(1),
            Err(_) => batch.progress.fail(1),
        }
        let summary = &mut batch.summary;
        self.outcomes
            .add_reporting(outcome, |failure| summary.fail(failure));
        if let Err(failure) = recorded {
            self.outcomes.end(failure);
        }
    }
}

/// A result that was complete before the batch, in JSON.
#[derive(Serialize)]
struct KeptResult<'a> {
    state: &'static str,
    input: String,
    output: String,
    #[serde(flatten)]
    frames: &'a FrameNotes,
}

/// A record in JSON: an input without a result, or a result that is kept.
fn to_json(record: &impl Serialize) -> Value {
    serde_json::to_value(record).expect("strings and numbers")
}

/// The records of a result in JSON.
fn records_of(
    work: &ClipWork,
    warnings: &[RecordedWarning],
    [bytes_before, bytes_after]: [Option<u64>; 2],
    report: &impl Serialize,
) -> Vec<Value> {
    let base = json!({
        "state": "made",
        "input": names::recorded(work.path()),
        "animation": work.animation(),
        "output": work.target.path().display().to_string(),
        "bytes_before": bytes_before,
        "bytes_after": bytes_after,
        "warnings": warnings,
        "seconds": work.input.started.elapsed().as_secs_f64(),
    });
    let fields = serde_json::to_value(report).expect("strings and numbers");
    let of_each = match fields {
        Value::Array(each) => each,
        one => vec![one],
    };
    let record = |fields: Value| {
        let mut record = base.clone();
        if let (Value::Object(record), Value::Object(fields)) = (&mut record, fields) {
            record.extend(fields);
        }
        record
    };
    of_each.into_iter().map(record).collect()
}

impl InputSource {
    fn next(&mut self) -> Option<ReadJob> {
        match self {
            Self::One(reader, jobs) => {
                let job = jobs.next()?;
                let path = &job.0;
                let file = InputFile::within(path, reader.limits());
                let label = format!("reading {}", names::input(path));
                let loaded = busy(&label, || reader.read(path));
                let input = Some((file, loaded));
                Some(ReadJob { job, input })
            }
            Self::Ahead { left: 0, .. } | Self::None => None,
            Self::Ahead {
                read_jobs, left, ..
            } => {
                *left -= 1;
                Some(read_jobs.recv().expect("the reader hands over every input"))
            }
        }
    }

    /// Waits for the thread, which stops at the next input.
    fn close(self) {
        if let Self::Ahead {
            read_jobs, thread, ..
        } = self
        {
            drop(read_jobs);
            if let Err(panic) = thread.join() {
                std::panic::resume_unwind(panic);
            }
        }
    }
}

impl BatchRecords<'_> {
    /// Records the result of some clips of an input; `whole` is the name of the result of all.
    fn keep(
        &mut self,
        work: &ClipWork,
        whole: &str,
        mut result: EvaluatedResult,
        warnings: Vec<RecordedWarning>,
    ) -> Result<(), Failure> {
        let name = work.target.name();
        // A clip may have the name of a result that an earlier batch made from another input.
        if let Some(entry) = self.previous.entries.get(name)
            && !self.overwrite
        {
            let owner = Owner::from(entry);
            ReplacedOwners::default().check(work.path(), work.target.path(), &owner)?;
        }
        // The name of a clip may be that of another input: the clip `Run` of walk.glb, and walk.Run.bvh.
        if !self.made.insert(name.to_owned()) {
            let input = names::input(work.path());
            return Err(Failure::usage(format!(
                "{input}: another input's result is {name} already; give --names full, or write the results \
                 to different directories"
            )));
        }
        let bytes = result.written.bytes;
        let digest = result.written.digest.take().unwrap_or_default();
        let clips = work.input.loaded.clips.len();
        let assumed_fps = result.frames.assumed_fps.clone();
        let entry = ManifestEntry {
            output: name.to_owned(),
            output_bytes: result.written.bytes,
            output_sha256: digest.finish(),
            input: names::recorded(work.path()),
            input_sha256: work.input.file.sha256().map(str::to_owned),
            options: self.options.text.clone(),
            option_files: self.options.files.clone(),
            kernels_sha256: kernels_sha256().to_owned(),
            tumble: env!("CARGO_PKG_VERSION").to_owned(),
            device: result.device,
            one_of: (name != whole).then(|| (whole.to_owned(), clips)),
            frames: result.frames,
            warnings,
        };
        let kept = self.records.keep(entry, result.written);
        kept.inspect_err(|_| {
            self.made.remove(name);
        })?;
        self.progress.add_bytes(bytes);
        let assumed = assumed_fps.as_deref();
        if let Some(line) = self.summary.result(&result.message, assumed) {
            self.records.tell(line);
        }
        Ok(())
    }

    /// The summary of a batch: its warnings, and of several inputs, how many of them are done.
    fn summarize(&self) {
        for line in self.summary.lines() {
            self.records.tell(&line);
        }
        if self.inputs <= 1 && self.skipped == 0 {
            return;
        }
        let list = self.records.list();
        let (results, made_of) = (self.made.len(), self.done + self.done_in_part);
        let mut made = format!("{} made", words::count(results, "result"));
        if results != made_of {
            made += &format!(" of {}", words::count(made_of, "input"));
        }
        if self.done_in_part > 0 {
            made += &format!(" ({} in part)", self.done_in_part);
        }
        let mut parts = vec![made];
        if self.skipped > 0 {
            let mut skipped = words::count(self.skipped_results, "result");
            if self.skipped_results != self.skipped {
                skipped += &format!(" of {}", words::count(self.skipped, "input"));
            }
            parts.push(format!("{skipped} kept (already complete)"));
        }
        if self.failed > 0 {
            parts.push(format!("{} failed", words::count(self.failed, "input")));
        }
        let left = self.inputs - (made_of + self.skipped + self.failed).min(self.inputs);
        if left > 0 {
            let inputs = words::count(left, "input");
            parts.push(format!("{inputs} not reached (--resume makes them)"));
        }
        let mut summary = parts.join(", ");
        if list.exists() || results > 0 {
            summary += &format!("; listed in {}", list.display());
        }
        if self.summary.is_shortened() {
            summary += " (--verbose prints a line for each)";
        }
        self.records.tell(&summary);
    }
}

/// The state of the thread that reads inputs ahead of the evaluation.
struct ReadingAhead<R> {
    reader: R,
    previous: PreviousEntries,
    options: String,
    resume: bool,
}

impl<R: InputReader> ReadingAhead<R> {
    /// Reads the inputs one by one; stops when the receiver was dropped.
    fn read_all(&self, jobs: Vec<PipelineJob>, hand_over: &SyncSender<ReadJob>) {
        for job in jobs {
            let input = self.read(&job);
            if hand_over.send(ReadJob { job, input }).is_err() {
                return;
            }
        }
    }

    /// Reads an input, if it has to be evaluated.
    fn read(&self, (path, target): &PipelineJob) -> Option<(InputFile, Result<Loaded, Failure>)> {
        let limits = self.reader.limits();
        let file = InputFile::within(path, limits);
        let is_done = |hash: &str| self.previous.is_done(target.name(), hash, &self.options);
        let sha256 = hash_before_reading(&file, limits);
        if self.resume && sha256.is_some_and(is_done) {
            return None;
        }
        let loaded = self.reader.read(path);
        let loaded = loaded.and_then(|loaded| file.check_unchanged().map(|()| loaded));
        Some((file, loaded))
    }
}

/// The hash of an input's bytes, which are read next; longer inputs are refused.
pub(crate) fn hash_before_reading(file: &InputFile, limits: Limits) -> Option<&str> {
    let is_read = std::fs::metadata(file.path()).is_ok_and(|found| found.len() <= limits.file);
    is_read.then(|| file.sha256()).flatten()
}

/// The remedy in the message about an input with several clips whose result is a file that can store only one.
pub(super) const SEVERAL_CLIPS_REMEDY: &str = ", or give a directory for all of them: -o RESULTS/";

/// A file to write: which of the input's clips go into it.
pub(super) struct ClipFile {
    /// The name of these clips in messages.
    pub(super) name: String,
    pub(super) clips: Range<usize>,
    pub(super) target: ResultTarget,
}

/// The files of an input whose result is `target`. If a clip can have no file, only this clip fails.
pub(super) fn clip_files(
    path: &Path,
    loaded: &Loaded,
    target: &ResultTarget,
) -> Result<VecDeque<Result<ClipFile, Failure>>, Failure> {
    let (name, clips) = (names::input(path), &loaded.clips);
    if target.format().supports(Feature::SeveralClips) || clips.len() == 1 {
        return Ok(VecDeque::from([Ok(ClipFile {
            name,
            clips: 0..clips.len(),
            target: target.clone(),
        })]));
    }
    if target.name().is_empty() {
        return Err(several_clips_failure(path, loaded).hinted(SEVERAL_CLIPS_REMEDY));
    }
    let file_names = clip_file_names(clips).into_iter();
    let files = clips.iter().zip(file_names).enumerate();
    Ok(files
        .map(|(index, (clip, file))| {
            Ok(ClipFile {
                name: format!("{name} {}", names::clip(clip)),
                clips: index..index + 1,
                target: target.of_clip(&file)?,
            })
        })
        .collect())
}

/// The names of the clips' files: the clips' names, with characters that file systems refuse replaced;
/// names that are then equal get the clip's index appended.
pub(crate) fn clip_file_names(clips: &[Motion]) -> Vec<String> {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ');
    let plain = |clip: &Motion| -> String {
        let name = clip.name.clone().unwrap_or_else(|| clip.index.to_string());
        let each = name.chars().map(|c| if is_plain(c) { c } else { '_' });
        each.collect()
    };
    let mut used = HashSet::new();
    let names = clips.iter().map(|clip| {
        let whole = plain(clip);
        let mut name = short(&whole, "");
        let mut end = String::new();
        if name != whole {
            end = format!(".{}", clip.index);
            name = short(&whole, &end);
        }
        while !used.insert(name.to_lowercase()) {
            end = format!("{end}.{}", clip.index);
            name = short(&whole, &end);
        }
        name
    });
    names.collect()
}

/// The most bytes of a clip's name in a file name: the input's name and two extensions must fit too.
const MAX_CLIP_NAME: usize = 120;

/// The name, cut so that it fits with `end` into [`MAX_CLIP_NAME`] bytes, and `end`.
fn short(name: &str, end: &str) -> String {
    let max_length = MAX_CLIP_NAME.saturating_sub(end.len()).min(name.len());
    let cut = (0..=max_length).rfind(|&at| name.is_char_boundary(at));
    format!("{}{end}", &name[..cut.unwrap_or(0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_never_share_a_file() {
        let names = [
            Some("Run"),
            Some("run"),
            Some("a/b"),
            Some("a:b"),
            None,
            Some("4"),
        ];
        let clips: Vec<Motion> = names
            .iter()
            .enumerate()
            .map(|(index, name)| Motion {
                name: name.map(str::to_owned),
                index,
                ..Motion::default()
            })
            .collect();
        assert_eq!(
            clip_file_names(&clips),
            ["Run", "run.1", "a_b", "a_b.3", "4", "4.5"]
        );
    }

    #[test]
    fn long_names_are_cut_between_letters_and_stay_apart() {
        let long = "ä".repeat(200);
        let clip = |index| Motion {
            name: Some(long.clone()),
            index,
            ..Motion::default()
        };
        let names = clip_file_names(&[clip(0), clip(1)]);
        assert_eq!(names[0], format!("{}.0", "ä".repeat(59)));
        assert_eq!(names[1], format!("{}.1", "ä".repeat(59)));
    }
}
