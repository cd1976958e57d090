//! `tumble eval --shard`: one part of a library, into a directory that other processes fill too.

use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::Path;

use serde_json::Value;

use crate::arguments::device::OpenedDevice;
use crate::arguments::input::{FoundInput, GatheredInputs};
use crate::arguments::options::ResultOptions;
use crate::arguments::time::SampleChoice;
use crate::batch::digest::InputFile;
use crate::batch::entry::InputEntry;
use crate::batch::output_plan;
use crate::batch::pipeline::{
    BatchOptions, Pipeline, PipelineInputs, PipelineJob, hash_before_reading,
};
use crate::batch::shards::plan::{RecordedPlan, ShardOptions, ShardPlan};
use crate::batch::shards::record::{self, ShardHeader};
use crate::batch::shards::run::Shard;
use crate::batch::target;
use crate::commands::eval::arguments::{Arguments, ShardSelection};
use crate::commands::eval::job::evaluate_all;
use crate::messages::exit::{FailedInputs, Failure};
use crate::messages::{listing, words};

/// Runs the shards of a part.
pub(crate) fn run(arguments: &Arguments, part: ShardSelection) -> Result<(), Failure> {
    let mut records = Vec::new();
    let outcome = run_shards(arguments, part, &mut records);
    // If there are no records, the caller prints only the failure.
    if arguments.results.prints_json() && (outcome.is_ok() || !records.is_empty()) {
        listing::records(&records, &[])?;
    }
    outcome
}

/// As [`run`]; adds the records of results and failures, if they are requested.
fn run_shards(
    arguments: &Arguments,
    part: ShardSelection,
    json: &mut Vec<Value>,
) -> Result<(), Failure> {
    let mut evaluator = Evaluator::new(arguments)?;
    let (folder, resume) = (arguments.results.folder()?, arguments.results.is_resumed());
    let mut gathered = arguments.results.based(arguments.inputs.gather(false)?)?;
    gathered.files = output_plan::without_results(gathered.files, folder)?;
    let sizes: Vec<u64> = gathered.files.iter().map(size).collect();
    let bytes = arguments.shard_bytes;
    let request = &evaluator.request;
    let plan = request.plan(arguments, gathered, &sizes, folder, bytes)?;
    let shards = part.shards(plan.cuts.len())?;
    if shards.is_empty() {
        let all = words::count(plan.cuts.len(), "shard");
        let are = if plan.cuts.len() == 1 { "is" } else { "are" };
        words::note(&format!(
            "--shard {part}: there {are} {all}, and none of them is of this part"
        ));
        return Ok(());
    }
    let merged = merged_part(&evaluator, arguments, &plan, shards.clone(), folder);
    if merged.is_none() {
        plan.claim(folder, resume, arguments.results.overwrites())?;
    }
    let folder = target::opened(folder)?;
    let (mut codes, mut inputs) = (Vec::new(), 0);
    let mut first_failed = None;
    for number in shards {
        let range = plan.cuts[number - 1].clone();
        inputs += range.len();
        let header = ShardHeader {
            shard: number,
            of: plan.cuts.len(),
            plan: plan.recorded.plan.clone(),
            inputs: range.len(),
            ..ShardHeader::default()
        };
        let names = plan.names[range.clone()].iter().flatten();
        let names: Vec<&str> = names.map(|name| &**name).collect();
        let mut shard = Shard::new(&folder, header, &names, resume);
        if shard.is_done() && !resume && !arguments.results.overwrites() {
            return Err(Failure::usage(format!(
                "shard {number} is done; --resume skips what is done, --overwrite makes it again"
            )));
        }
        let paths = plan.inputs[range.clone()]
            .iter()
            .map(|found| found.path.clone());
        let mut jobs = shard.jobs(paths, &plan.names[range], plan.format);
        if let Some(failed) = &merged {
            jobs.retain(|(_, target)| match failed.get(target.name()) {
                Some(entry) => {
                    codes.push(entry.code);
                    first_failed = first_failed.take().or_else(|| entry.message.clone());
                    if arguments.results.prints_json() {
                        json.push(serde_json::to_value(entry).expect("strings and numbers"));
                    }
                    false
                }
                None => true,
            });
        }
        evaluator.evaluate(arguments, jobs, &mut shard, json)?;
        if merged.is_none() {
            shard.finish()?;
        }
        let failed = shard.header.failed.iter();
        codes.extend(failed.map(|refused| Some(refused.code)));
    }
    if let Some(first) = first_failed {
        words::note(&format!(
            "inputs that failed before the shards were merged are not tried again (--resume without --shard tries them); \
             the first: {first}"
        ));
    }
    FailedInputs::of_codes(codes.into_iter()).outcome_of(inputs)
}

/// If the shards were merged and all inputs have their results except those that failed: the inputs that failed. A task
/// that a scheduler runs again then changes nothing.
fn merged_part(
    evaluator: &Evaluator,
    arguments: &Arguments,
    plan: &ShardPlan,
    shards: RangeInclusive<usize>,
    folder: &Path,
) -> Option<HashMap<String, InputEntry>> {
    let is_resumed = arguments.results.is_resumed() && !arguments.results.overwrites();
    if !is_resumed || RecordedPlan::read(folder).ok()?.is_some() {
        return None;
    }
    let failed = record::merged_failures(folder)?;
    let names = plan.names.iter().map(|name| name.as_deref().ok());
    let found = names.zip(&plan.inputs);
    let found = found.filter_map(|(name, found)| Some((name?, found)));
    if !record::other_owners(folder, &found.collect()).is_empty() {
        return None;
    }
    let options = &evaluator.request.options.text;
    let limits = arguments.inputs.limits();
    let is_settled = |shard: usize| {
        let range = plan.cuts[shard - 1].clone();
        let names = plan.names[range.clone()].iter().flatten();
        let names: Vec<&str> = names.map(|name| &**name).collect();
        let previous = record::previous(folder, shard, &names);
        let mut inputs = plan.inputs[range.clone()].iter().zip(&plan.names[range]);
        inputs.all(|(found, name)| {
            let Ok(name) = name else { return false };
            let file = InputFile::within(&found.path, limits);
            let is_done = |hash| previous.is_done(name, hash, options);
            failed.contains_key(name) || hash_before_reading(&file, limits).is_some_and(is_done)
        })
    };
    shards.into_iter().all(is_settled).then_some(failed)
}

/// The size of a file; 0 if it cannot be read, which is reported when it is opened.
pub(crate) fn size(found: &FoundInput) -> u64 {
    std::fs::metadata(&found.path).map_or(0, |file| file.len())
}

/// The checked options of an evaluation.
pub(crate) struct EvaluationOptions {
    samples: SampleChoice,
    /// Everything that determines results besides their inputs.
    pub(crate) options: ResultOptions,
}

impl EvaluationOptions {
    /// Refuses everything that can be refused before the inputs are known.
    pub(crate) fn new(arguments: &Arguments) -> Result<Self, Failure> {
        if arguments.sampling.reads_standard_input() {
            let message = "--times -: the other processes of the shards cannot read standard input; give a file";
            return Err(Failure::usage(message));
        }
        arguments.results.check_shards()?;
        let samples = arguments.checked_samples()?;
        Ok(Self {
            options: arguments.options(&samples),
            samples,
        })
    }

    /// Cuts inputs into shards.
    pub(crate) fn plan(
        &self,
        arguments: &Arguments,
        inputs: GatheredInputs,
        sizes: &[u64],
        folder: &Path,
        shard_bytes: u64,
    ) -> Result<ShardPlan, Failure> {
        let results = &arguments.results;
        let request = ShardOptions {
            format: arguments.dialect.format(results)?,
            naming: results.naming(),
            options: self.options.text.clone(),
            shard_bytes,
        };
        let plan = ShardPlan::new(inputs, sizes, folder, request)?;
        arguments.check_before(plan.format)?;
        Ok(plan)
    }
}

/// A request and an open device, kept for shard after shard.
pub(crate) struct Evaluator {
    pub(crate) request: EvaluationOptions,
    pub(crate) device: OpenedDevice,
}

impl Evaluator {
    /// Opens the device.
    pub(crate) fn new(arguments: &Arguments) -> Result<Self, Failure> {
        Ok(Self {
            request: EvaluationOptions::new(arguments)?,
            device: arguments.device.open()?,
        })
    }

    /// Evaluates the inputs of a shard; gives the number of rotations. Inputs that are refused are in the shard's header,
    /// and no failure. Adds the records of results and failures, if they are requested.
    pub(crate) fn evaluate(
        &mut self,
        arguments: &Arguments,
        jobs: Vec<PipelineJob>,
        shard: &mut Shard<'_>,
        records_as_json: &mut Vec<Value>,
    ) -> Result<u64, Failure> {
        arguments.choose_keys();
        let refused = shard.header.failed.len();
        let (inputs, quiet) = (jobs.len(), shard.quiet);
        let options = BatchOptions {
            overwrite: arguments.results.overwrites(),
            options: self.request.options.clone(),
            resume: arguments.results.is_resumed(),
            verbose: arguments.results.is_verbose(),
        };
        let reader = arguments.inputs.clone();
        let records = Box::new(&mut *shard);
        let work = PipelineInputs {
            jobs,
            prints_json: arguments.results.prints_json(),
            ..PipelineInputs::default()
        };
        let mut pipeline = Pipeline::of_batch(reader, work, options, records);
        let samples = &self.request.samples;
        let rotations = evaluate_all(arguments, samples, &mut self.device, &mut pipeline);
        let (outcome, json) = pipeline.finish_with_json();
        records_as_json.extend(json.into_iter().flatten());
        match outcome {
            Err(failure) if failure.is_final() => Err(failure),
            Err(failure) => {
                // The failure of a single input has not been reported yet.
                if inputs == 1 && shard.header.failed.len() > refused && !quiet {
                    failure.report();
                }
                Ok(rotations)
            }
            Ok(()) => Ok(rotations),
        }
    }
}
