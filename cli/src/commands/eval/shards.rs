//! `tumble eval --shard`: one part of a library, into a directory that other processes fill too.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

use crate::arguments::device::OpenedDevice;
use crate::arguments::gather::FoundInput;
use crate::arguments::time::SampleRequest;
use crate::batch::folder;
use crate::batch::output::ResultTarget;
use crate::batch::run::Batch;
use crate::batch::shards::plan::ShardPlan;
use crate::batch::shards::record::ShardHeader;
use crate::batch::shards::run::Shard;
use crate::commands::eval::{Arguments, EvaluationJob, EvaluationReport};
use crate::messages::exit::{ALL_INPUTS, Failure, SOME_INPUTS};
use crate::messages::words;

/// Which shards of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ShardSelection {
    /// That one.
    One(usize),
    /// The shards of one process of several, both from 1.
    Of(usize, usize),
}

impl FromStr for ShardSelection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let number = |text: &str| text.parse().ok().filter(|&number: &usize| number > 0);
        let part = match text.split_once('/') {
            None => number(text).map(Self::One),
            Some((index, all)) => (number(index).zip(number(all)))
                .filter(|(index, all)| index <= all)
                .map(|(index, all)| Self::Of(index, all)),
        };
        part.ok_or_else(|| "give I/N, from 1/N to N/N, or the number of a shard, from 1".to_owned())
    }
}

impl ShardSelection {
    /// The numbers of its shards, from 1. Parts differ by one shard at most.
    fn shards(self, all: usize) -> Result<std::ops::RangeInclusive<usize>, Failure> {
        let share = |part: usize, of: usize| (all as u128 * part as u128 / of as u128) as usize;
        match self {
            Self::One(one) if one > all => {
                let all = words::count(all, "shard");
                let message = format!("--shard {one}: there are {all}");
                Err(Failure::usage(message))
            }
            Self::One(one) => Ok(one..=one),
            Self::Of(index, of) => Ok(share(index - 1, of) + 1..=share(index, of)),
        }
    }
}

/// Runs the shards of a part.
pub(crate) fn run(arguments: &Arguments, part: ShardSelection) -> Result<(), Failure> {
    let mut evaluator = Evaluator::new(arguments)?;
    let (folder, resume) = (arguments.results.folder()?, arguments.results.is_resumed());
    let gathered = arguments.inputs.gather(false)?;
    let files = folder::without_results(gathered.files, folder)?;
    let sizes: Vec<u64> = files.iter().map(size).collect();
    let bytes = arguments.shard_bytes;
    let request = &evaluator.request;
    let plan = request.plan(arguments, files, &sizes, folder, bytes)?;
    let shards = part.shards(plan.cuts.len())?;
    plan.claim(folder, resume, arguments.results.overwrites())?;
    let (mut failed, mut inputs) = (0, 0);
    let mut reports = Vec::new();
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
        let mut shard = Shard::new(folder, header, &names, resume);
        if shard.is_done() && !resume && !arguments.results.overwrites() {
            return Err(Failure::usage(format!(
                "shard {number} is done; --resume skips what is done, --overwrite makes it again"
            )));
        }
        let paths = plan.inputs[range.clone()]
            .iter()
            .map(|found| found.path.clone());
        let jobs = shard.jobs(paths, &plan.names[range], plan.format);
        evaluator.evaluate(arguments, &jobs, &mut shard, &mut reports)?;
        shard.finish()?;
        failed += shard.header.failed.len();
    }
    if arguments.json {
        words::json(&reports)?;
    }
    match failed {
        0 => Ok(()),
        _ if failed == inputs => Err(Failure::new(
            ALL_INPUTS,
            format!("all {} failed", words::count(failed, "input")),
        )),
        _ => {
            let message = format!("{failed} of {inputs} inputs failed; the others are done");
            Err(Failure::new(SOME_INPUTS, message))
        }
    }
}

/// The size of a file; 0 where it cannot be read, which is reported when it is opened.
pub(crate) fn size(found: &FoundInput) -> u64 {
    std::fs::metadata(&found.path).map_or(0, |file| file.len())
}

/// The checked options of an evaluation.
pub(crate) struct EvaluationRequest {
    samples: SampleRequest,
    /// Everything that determines results besides their inputs.
    pub(crate) options: String,
}

impl EvaluationRequest {
    /// Refuses everything that can be refused before the inputs are known.
    pub(crate) fn new(arguments: &Arguments) -> Result<Self, Failure> {
        if arguments.sampling.reads_standard_input() {
            let message = "--times -: no other process can read it; give a file";
            return Err(Failure::usage(message));
        }
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
        inputs: Vec<FoundInput>,
        sizes: &[u64],
        folder: &Path,
        shard_bytes: u64,
    ) -> Result<ShardPlan, Failure> {
        let format = arguments.results.format();
        let options = self.options.clone();
        let plan = ShardPlan::new(inputs, sizes, folder, format, options, shard_bytes)?;
        arguments.check_before(plan.format)?;
        Ok(plan)
    }
}

/// A request and an open device, kept for shard after shard.
pub(crate) struct Evaluator {
    pub(crate) request: EvaluationRequest,
    pub(crate) device: OpenedDevice,
}

impl Evaluator {
    /// Opens the device.
    pub(crate) fn new(arguments: &Arguments) -> Result<Self, Failure> {
        Ok(Self {
            request: EvaluationRequest::new(arguments)?,
            device: arguments.device.open()?,
        })
    }

    /// Evaluates the inputs of a shard; `reports` gets a report of each result. Inputs that
    /// are refused are in the shard's header, and no failure.
    pub(crate) fn evaluate(
        &mut self,
        arguments: &Arguments,
        jobs: &[(PathBuf, ResultTarget)],
        shard: &mut Shard<'_>,
        reports: &mut Vec<EvaluationReport>,
    ) -> Result<(), Failure> {
        arguments.choose_keys();
        let batch = Batch {
            read: |path: &Path| arguments.inputs.read(path),
            max_bytes: arguments.inputs.max_size(),
            options: self.request.options.clone(),
            resume: arguments.results.is_resumed(),
        };
        let refused = shard.header.failed.len();
        let outcome = batch.run(jobs, Vec::new(), shard, |file, loaded, target, done| {
            let job = EvaluationJob {
                arguments,
                device: &mut self.device,
                samples: &self.request.samples,
                file,
                loaded,
                started: Instant::now(),
                in_gaps: 0,
            };
            job.run(target, done, reports)
        });
        match outcome {
            Err(failure) if failure.is_final() => Err(failure),
            Err(failure) => {
                // The failure of a single input has not been reported yet.
                if jobs.len() == 1 && shard.header.failed.len() > refused && !shard.quiet {
                    failure.report();
                }
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_every_shard_once() {
        for (all, of) in [(0, 3), (1, 64), (79, 64), (79, 2), (3, 3)] {
            let parts =
                (1..=of).flat_map(|index| ShardSelection::Of(index, of).shards(all).unwrap());
            assert!(parts.eq(1..=all), "{all} in {of}");
        }
        assert!(ShardSelection::One(4).shards(3).is_err());
    }

    #[test]
    fn parts_are_counted_from_one() {
        assert_eq!("3/64".parse(), Ok(ShardSelection::Of(3, 64)));
        assert_eq!("17".parse(), Ok(ShardSelection::One(17)));
        for text in ["0", "0/4", "5/4", "1/0", "-1/4", "1/", "/", "", "1.5"] {
            assert!(text.parse::<ShardSelection>().is_err(), "{text}");
        }
    }
}
