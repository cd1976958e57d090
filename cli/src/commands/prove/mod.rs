//! `tumble prove`: checks the engine's promises on any device, and reports what could not be checked.

pub(crate) mod compare;
pub(crate) mod compile;
pub(crate) mod device;
pub(crate) mod report;
pub(crate) mod steps;
pub(crate) mod text;

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::arguments::device::vulkan_device;
use crate::commands::prove::report::Verdict;
use crate::commands::prove::steps::ProofOptions;
use crate::messages::exit::{DEVICE, DIFFERENCE, Failure};
use crate::messages::listing;
use crate::messages::words;

/// Test that a device gives the same bits as the CPU, for every kernel and for recorded and random inputs, and measure its speed
#[derive(Debug, Args)]
#[command(after_help = "\
Every kernel is compared with the same function on the CPU. The recorded results of every method, output \
and crowd are computed again in every configuration in which the engine may use the device. Random tracks \
and crowds are compared with the CPU until the time limit. The same is done on a Vulkan device that is \
created in the way in which a renderer creates it. Every bit is compared. Times are measured by the device's clock. \
`docs/proofs.md` lists devices that were tested, and explains the JSON.

Exit codes:
  0  proved: everything ran, and no bit differs
  5  there is no Vulkan device
  6  bits differ, or the device failed
  8  not proved: something did not run or was not compared, or the validation layer complained

Examples:
  tumble prove                                   the first Vulkan device, at most 8 minutes
  tumble prove --device 1 --time-limit 60 -o proof.json
  tumble prove --validate                        again under the Khronos validation layer
  tumble prove --compare here.json there.json")]
pub(crate) struct Arguments {
    /// The device: its index, part of its name or uuid:UUID (`tumble devices`) [default: the first Vulkan
    /// device]
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,
    /// The time limit, seconds; what a proof needs runs first
    #[arg(
        long,
        alias = "seconds",
        value_name = "SECONDS",
        default_value_t = 480,
        value_parser = words::whole_number::<u64>(1, 86_400)
    )]
    time_limit: u64,
    /// Run only what a proof needs: no additional random rounds, and no repetition in every configuration
    #[arg(long)]
    quick: bool,
    /// The seed of random numbers: the same seed gives the same sets and crowds on every machine
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// Run everything again under the Khronos validation layer; any message is a failure
    #[arg(long)]
    validate: bool,
    /// Use the numbers of lanes in this report of `tumble lab`
    #[arg(long, value_name = "FILE")]
    lab: Option<PathBuf>,
    #[command(flatten)]
    output: ReportOutput,
    /// Compare two proofs instead: first their bits, then their measured times
    #[arg(
        long,
        num_args = 2,
        value_names = ["FILE", "FILE"],
        conflicts_with_all = ["device", "time_limit", "quick", "seed", "validate", "lab", "out", "overwrite"]
    )]
    compare: Vec<PathBuf>,
    /// Compile every kernel, and say how long each took
    #[arg(long, hide = true)]
    compile_kernels: bool,
}

/// Where a report is written.
#[derive(Debug, Args)]
pub(crate) struct ReportOutput {
    /// Where to write: the report, as JSON
    #[arg(short, long = "output", alias = "out", value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace existing files
    #[arg(long, requires = "out")]
    overwrite: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl ReportOutput {
    /// Refuses a file that cannot be written, before anything is done.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        match &self.out {
            Some(path) => report::check_output(path, self.overwrite),
            None => Ok(()),
        }
    }

    /// Writes a report, and prints it, or its page.
    pub(crate) fn report(&self, report: &impl Serialize, page: &str) -> Result<(), Failure> {
        if let Some(path) = &self.out {
            report::write(report, path)?;
        }
        match self.json {
            true => listing::document(report),
            false => listing::text(page),
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let [one, two] = &arguments.compare[..] {
        return compare::run([one, two], arguments.output.json);
    }
    let device = vulkan_device(arguments.device.as_deref())?;
    if arguments.compile_kernels {
        return device.map_or(Ok(()), compile::run);
    }
    let Some(device) = device else {
        return Err(Failure::new(
            DIFFERENCE,
            "nothing is proved: the CPU would be compared with itself; name a Vulkan device with \
             --device, or leave that out for the first one (`tumble devices` lists them)",
        ));
    };
    arguments.output.check()?;
    let lab = arguments.lab.as_deref();
    let run_lanes = lab.map(report::run_lanes).transpose()?;
    let proof = steps::prove(&ProofOptions {
        device,
        seconds: arguments.time_limit,
        quick: arguments.quick,
        seed: arguments.seed,
        validate: arguments.validate,
        run_lanes,
    });
    arguments.output.report(&proof, &text::page(&proof))?;
    let reasons = proof.reasons.join("; ");
    match proof.verdict {
        Verdict::Proved => Ok(()),
        Verdict::BitsDiffer => Err(Failure::new(DEVICE, format!("bits differ: {reasons}"))),
        Verdict::NotProved => Err(Failure::new(DIFFERENCE, format!("not proved: {reasons}"))),
    }
}
