//! `tumble eval --shard`: one part of a library, into a directory that other processes fill too.

use std::path::Path;

use serde_json::Value;

use crate::arguments::device::OpenedDevice;
use crate::arguments::input::{FoundInput, GatheredInputs};
use crate::arguments::options::ResultOptions;
use crate::arguments::time::SampleChoice;
use crate::batch::output_plan;
use crate::batch::pipeline::{BatchOptions, Pipeline, PipelineInputs, PipelineJob};
use crate::batch::shards::plan::{ShardOptions, ShardPlan};
use crate::batch::shards::record::ShardHeader;
use crate::batch::shards::run::Shard;
use crate::batch::target;
use crate::commands::eval::arguments::{Arguments, ShardSelection};
use crate::commands::eval::job::evaluate_all;
use crate::messages::exit::{FailedInputs, Failure};
use crate::messages::listing;

/// Runs the shards of a part.
pub(crate) fn run(arguments: &Arguments, part: ShardSelection) -> Result<(), Failure> {
    let mut records = Vec::new();
    let outcome = run_shards(arguments, part, &mut records);
    // If there are no records, the caller prints only the failure.
    if arguments.results.prints_json() && (outcome.is_ok() || !records.is_empty()) {
        listing::json(&records)?;
    }
    outcome
}

/// As [`run`]; adds the records of results and failures, where they are asked for.
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
    plan.claim(folder, resume, arguments.results.overwrites())?;
    let folder = target::opened(folder)?;
    let (mut codes, mut inputs) = (Vec::new(), 0);
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
        let jobs = shard.jobs(paths, &plan.names[range], plan.format);
        evaluator.evaluate(arguments, jobs, &mut shard, json)?;
        shard.finish()?;
        let failed = shard.header.failed.iter();
        codes.extend(failed.map(|refused| Some(refused.code)));
    }
    FailedInputs::of_codes(codes.into_iter()).outcome_of(inputs)
}

/// The size of a file; 0 where it cannot be read, which is reported when it is opened.
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
            let message = "--times -: no other process can read it; give a file";
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
    /// and no failure. Adds the records of results and failures, where they are asked for.
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
