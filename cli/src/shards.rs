//! A library evaluated in shards, for front ends that spread them over machines: what `tumble eval
//! --shard` and `tumble merge` do, part by part.
//!
//! A command line, that of `tumble eval`, says what is asked for; its inputs and its output are said
//! apart, since workers may see them under other names. A [`Plan`] cuts the library, a [`Worker`]
//! keeps a device open and evaluates shards, and [`merge`] makes one manifest of what they leave.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Parser;
use serde::Serialize;
use tumble_formats::Format;

use crate::arguments::gather::{Found, Gathered};
use crate::batch::folder;
use crate::batch::manifest;
use crate::batch::shards::plan::Plan as OwnPlan;
use crate::batch::shards::record::Header;
use crate::batch::shards::run::Shard;
use crate::batch::shards::{merge as merging, record::Refusal};
use crate::commands::eval::shards::{Evaluator, Request, size};
use crate::commands::eval::{Arguments, Told};
use crate::host::Refused;
use crate::messages::exit::{Failure, USAGE};
use crate::messages::words;

/// A command line.
#[derive(Debug, Parser)]
#[command(name = "eval", disable_help_flag = true)]
struct Line {
    #[command(flatten)]
    eval: Arguments,
}

fn parse(line: &[OsString]) -> Result<Arguments, Refused> {
    let name = OsString::from("eval");
    let parsed = Line::try_parse_from(std::iter::once(&name).chain(line));
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
    Ok(parse(line)?.inputs.given().to_vec())
}

/// Of every kernel: machines that agree in it and in the version write the same bytes.
#[must_use]
pub fn kernels_sha256() -> &'static str {
    manifest::kernels_sha256()
}

/// A library, cut into shards.
pub struct Plan {
    own: OwnPlan,
    arguments: Arguments,
}

impl Plan {
    /// Cuts what lies below a directory, matches a pattern or is one file; or `listed`, the names
    /// below `library` and their sizes, of which those of readable formats are taken. `into`: what
    /// becomes of the results, where that is not `files`.
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
        let mut request = Request::new(&arguments)?;
        if into != "files" {
            request.options += &format!(" into={into}");
        }
        let (inputs, sizes): (Vec<Found>, Vec<u64>) = match listed {
            Some(listed) => {
                let of_formats = listed
                    .into_iter()
                    .filter(|(name, _)| Format::of(Path::new(name)).is_some());
                let found = of_formats.map(|(name, size)| {
                    let path = PathBuf::from(format!("{}/{name}", library.display()));
                    let below = PathBuf::from(name);
                    (Found::named(path, below), size)
                });
                found.unzip()
            }
            None => {
                let found = Gathered::new(&[library.to_owned()], None)?.files;
                let found = folder::without_results(found, folder)?;
                let sizes = found.iter().map(size).collect();
                (found, sizes)
            }
        };
        if inputs.is_empty() {
            let library = library.display();
            let message = format!("{library}: has no file of a format that can be read");
            return Err(Failure::usage(message).into());
        }
        let own = request.plan(&arguments, inputs, &sizes, folder, shard_bytes)?;
        folder::refuse_shared_names(&own.inputs, own.format)?;
        Ok(Self { own, arguments })
    }

    /// Says in the directory of results what its shards are of, and refuses what is a stranger's.
    ///
    /// # Errors
    /// When the directory has other shards, or files under the names of results.
    pub fn claim(&self, folder: &Path) -> Result<(), Refused> {
        let results = &self.arguments.results;
        self.own
            .claim(folder, results.is_resumed(), results.overwrites())?;
        Ok(())
    }

    /// Which plan it is: the same for the same list, sizes, options and version.
    #[must_use]
    pub fn id(&self) -> &str {
        &self.own.stated.plan
    }

    /// All that decides over results besides their inputs, as manifests have it.
    #[must_use]
    pub fn options(&self) -> &str {
        &self.own.stated.options
    }

    /// How many shards there are.
    #[must_use]
    pub fn shards(&self) -> usize {
        self.own.cuts.len()
    }

    /// How many inputs there are.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.own.inputs.len()
    }

    /// The inputs of a shard, from 1: where they are, and where they lie below the library; nothing
    /// where there is no such shard.
    #[must_use]
    pub fn inputs_of(&self, shard: usize) -> Option<Vec<(PathBuf, PathBuf)>> {
        let own = self.own.cuts.get(shard.checked_sub(1)?)?;
        let found = self.own.inputs[own.clone()].iter();
        Some(
            found
                .map(|found| (found.path.clone(), found.below.clone()))
                .collect(),
        )
    }

    /// What the results of a shard are called below the directory of results; an input whose result can
    /// have no name there fails.
    #[must_use]
    pub fn names_of(&self, shard: usize) -> Option<Vec<String>> {
        let own = self.own.cuts.get(shard.checked_sub(1)?)?;
        Some(
            self.own.names[own.clone()]
                .iter()
                .flatten()
                .cloned()
                .collect(),
        )
    }
}

/// One shard, or some of its inputs.
#[derive(Debug, Clone)]
pub struct Task {
    /// From 1.
    pub shard: usize,
    /// How many shards there are.
    pub of: usize,
    /// [`Plan::id`].
    pub plan: String,
    /// Where the inputs are, and where they lie below the library.
    pub inputs: Vec<(PathBuf, PathBuf)>,
    /// Whether it writes the shard's file, rather than give it to the caller.
    pub record: bool,
}

/// What became of a task.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    made: usize,
    skipped: usize,
    /// Rotations that were evaluated.
    rotations: u64,
    device: String,
    failed: Vec<Refusal>,
    /// The shard's file, where the caller is to write it.
    #[serde(skip_serializing_if = "Option::is_none")]
    record: Option<String>,
}

impl Outcome {
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

    /// How its device is called.
    #[must_use]
    pub fn device(&self) -> &str {
        &self.evaluator.device.label
    }

    /// All that decides over results besides their inputs, as manifests have it.
    #[must_use]
    pub fn options(&self) -> &str {
        &self.evaluator.request.options
    }

    /// Evaluates a task's inputs into a directory whose plan is claimed, or that is the caller's own.
    ///
    /// # Errors
    /// When the device fails or results cannot be written. Inputs that are refused are no error.
    pub fn run(&mut self, task: &Task, folder: &Path) -> Result<Outcome, Refused> {
        let found: Vec<Found> = (task.inputs.iter())
            .map(|(path, below)| Found::named(path.clone(), below.clone()))
            .collect();
        let format = folder::format(folder, self.arguments.results.format())?;
        let names = folder::names(&found, folder, format);
        let header = Header {
            shard: task.shard,
            of: task.of,
            plan: task.plan.clone(),
            inputs: found.len(),
            ..Header::default()
        };
        let own: Vec<&str> = names.iter().flatten().map(|name| &**name).collect();
        let resume = self.arguments.results.is_resumed();
        let mut shard = Shard::new(folder, header, &own, resume);
        shard.quiet = true;
        let paths = found.into_iter().map(|found| found.path);
        let jobs = shard.jobs(paths, &names, format);
        let mut told = Vec::new();
        self.evaluator
            .evaluate(&self.arguments, &jobs, &mut shard, &mut told)?;
        let record = match task.record {
            true => shard.finish().map(|()| None),
            false => shard.finish_elsewhere().map(Some),
        }?;
        Ok(Outcome {
            made: shard.made,
            skipped: shard.skipped,
            rotations: told.iter().map(Told::rotations).sum(),
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
pub struct Merged {
    results: usize,
    shards: usize,
    inputs: usize,
    failed: Vec<Refusal>,
}

impl Merged {
    /// It as JSON.
    #[must_use]
    pub fn to_json(&self) -> String {
        json(self)
    }
}

/// Makes one manifest of a directory's shards.
///
/// # Errors
/// When shards are missing, or the manifest cannot be written.
pub fn merge(folder: &Path) -> Result<Merged, Refused> {
    let merged = merging::merge(folder)?;
    Ok(Merged {
        results: merged.results,
        shards: merged.shards,
        inputs: merged.inputs,
        failed: merged.failed,
    })
}
