//! A library evaluated in shards, for front ends that spread them over machines: what `tumble eval
//! --shard` and `tumble merge` do, part by part.
//!
//! The options are those of a command line of `tumble eval`; inputs and output are passed separately,
//! since workers may see them under other names. A [`LibraryPlan`] cuts the library, a [`Worker`] keeps
//! a device open and evaluates shards, and [`merge`] makes one manifest of their records.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Parser;
use serde::Serialize;
use tumble_formats::Format;

use crate::arguments::gather::{FoundInput, GatheredInputs};
use crate::batch::entry;
use crate::batch::output_plan;
use crate::batch::result_names;
use crate::batch::shards::plan::ShardPlan;
use crate::batch::shards::record::ShardHeader;
use crate::batch::shards::run::Shard;
use crate::batch::shards::{merge as merging, record::RefusedInput};
use crate::commands::eval::Arguments;
use crate::commands::eval::job::EvaluationReport;
use crate::commands::eval::shards::{EvaluationRequest, Evaluator, size};
use crate::host::Refused;
use crate::messages::exit::{Failure, USAGE};
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
/// When the command line is wrong.
pub fn inputs(line: &[OsString]) -> Result<Vec<PathBuf>, Refused> {
    Ok(parse(line)?.inputs.named_paths().to_vec())
}

/// Of every kernel: machines that agree in it and in the version write the same bytes.
#[must_use]
pub fn kernels_sha256() -> &'static str {
    entry::kernels_sha256()
}

/// A library, cut into shards.
pub struct LibraryPlan {
    shard_plan: ShardPlan,
    arguments: Arguments,
}

impl LibraryPlan {
    /// Cuts the files below a directory, those that match a pattern, or one file; or `listed`, names
    /// below `library` with their sizes, if their formats can be read. `into`: the kind of output, where
    /// that is not `files`.
    ///
    /// # Errors
    /// When the command line is wrong, or results of two inputs would be one.
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
        let mut request = EvaluationRequest::new(&arguments)?;
        if into != "files" {
            request.options += &format!(" into={into}");
        }
        let (inputs, sizes): (Vec<FoundInput>, Vec<u64>) = match listed {
            Some(listed) => {
                let of_formats = listed
                    .into_iter()
                    .filter(|(name, _)| Format::of(Path::new(name)).is_some());
                let found = of_formats.map(|(name, size)| {
                    let path = PathBuf::from(format!("{}/{name}", library.display()));
                    let below = PathBuf::from(name);
                    (FoundInput::named(path, below), size)
                });
                found.unzip()
            }
            None => {
                let found = GatheredInputs::new(&[library.to_owned()], None)?.files;
                let found = output_plan::without_results(found, folder)?;
                let sizes = found.iter().map(size).collect();
                (found, sizes)
            }
        };
        if inputs.is_empty() {
            let library = library.display();
            let message = format!("{library}: has no file of a format that can be read");
            return Err(Failure::usage(message).into());
        }
        let shard_plan = request.plan(&arguments, inputs, &sizes, folder, shard_bytes)?;
        result_names::refuse_shared_names(&shard_plan.inputs, shard_plan.format)?;
        Ok(Self {
            shard_plan,
            arguments,
        })
    }

    /// Records the plan in the directory of results, and refuses to replace other files.
    ///
    /// # Errors
    /// When the directory has other shards, or files under the names of results.
    pub fn claim(&self, folder: &Path) -> Result<(), Refused> {
        let results = &self.arguments.results;
        self.shard_plan
            .claim(folder, results.is_resumed(), results.overwrites())?;
        Ok(())
    }

    /// Which plan it is: the same for the same list, sizes, options and version.
    #[must_use]
    pub fn id(&self) -> &str {
        &self.shard_plan.recorded.plan
    }

    /// Everything that determines results besides their inputs, as in manifests.
    #[must_use]
    pub fn options(&self) -> &str {
        &self.shard_plan.recorded.options
    }

    /// How many shards there are.
    #[must_use]
    pub fn shards(&self) -> usize {
        self.shard_plan.cuts.len()
    }

    /// How many inputs there are.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.shard_plan.inputs.len()
    }

    /// The inputs of a shard, from 1: their paths, and their paths below the library; `None` where there
    /// is no such shard.
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

    /// The names of the results of a shard below the directory of results; an input whose result cannot
    /// have a name there fails.
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

/// One shard, or some of its inputs.
#[derive(Debug, Clone)]
pub struct ShardTask {
    /// From 1.
    pub shard: usize,
    /// How many shards there are.
    pub of: usize,
    /// [`LibraryPlan::id`].
    pub plan: String,
    /// The paths of the inputs, and their paths below the library.
    pub inputs: Vec<(PathBuf, PathBuf)>,
    /// Whether the shard's file is written, rather than returned.
    pub record: bool,
}

/// The outcome of a task.
#[derive(Debug, Clone, Serialize)]
pub struct ShardOutcome {
    made: usize,
    skipped: usize,
    /// Rotations that were evaluated.
    rotations: u64,
    device: String,
    failed: Vec<RefusedInput>,
    /// The text of the shard's file, if the caller writes it.
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
    /// Opens the device that a command line names; `threads` of the CPU.
    ///
    /// # Errors
    /// When the command line is wrong, or the device cannot be opened.
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

    /// Everything that determines results besides their inputs, as in manifests.
    #[must_use]
    pub fn options(&self) -> &str {
        &self.evaluator.request.options
    }

    /// Evaluates a task's inputs into a directory whose plan is claimed, or that only the caller uses.
    ///
    /// # Errors
    /// When the device fails or results cannot be written. Inputs that are refused are no error.
    pub fn run(&mut self, task: &ShardTask, folder: &Path) -> Result<ShardOutcome, Refused> {
        let found: Vec<FoundInput> = (task.inputs.iter())
            .map(|(path, below)| FoundInput::named(path.clone(), below.clone()))
            .collect();
        let format = result_names::format(folder, self.arguments.results.format())?;
        let names = result_names::name_results(&found, folder, format);
        let header = ShardHeader {
            shard: task.shard,
            of: task.of,
            plan: task.plan.clone(),
            inputs: found.len(),
            ..ShardHeader::default()
        };
        let valid_names: Vec<&str> = names.iter().flatten().map(|name| &**name).collect();
        let resume = self.arguments.results.is_resumed();
        let mut shard = Shard::new(folder, header, &valid_names, resume);
        shard.quiet = true;
        let paths = found.into_iter().map(|found| found.path);
        let jobs = shard.jobs(paths, &names, format);
        let reports = self.evaluator.evaluate(&self.arguments, jobs, &mut shard)?;
        let record = match task.record {
            true => shard.finish().map(|()| None),
            false => shard.finish_elsewhere().map(Some),
        }?;
        Ok(ShardOutcome {
            made: shard.made,
            skipped: shard.skipped,
            rotations: reports.iter().map(EvaluationReport::rotations).sum(),
            device: self.evaluator.device.label.clone(),
            failed: shard.header.failed,
            record,
        })
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("strings and numbers")
}

/// What merging came to.
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

/// Makes one manifest of a directory's shards.
///
/// # Errors
/// When shards are missing, or the manifest cannot be written.
pub fn merge(folder: &Path) -> Result<MergeReport, Refused> {
    let merged = merging::merge(folder)?;
    Ok(MergeReport {
        results: merged.results,
        shards: merged.shards,
        inputs: merged.inputs,
        failed: merged.failed,
    })
}
