//! `tumble lab`: compares and measures variants of the kernels on a card, and says which to use.

mod text;

use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;
use tumble::verify::lab::{LabOptions, LabReport, lab};
use tumble::vulkan::DeviceInfo;
use tumble::{Engine, EngineOptions};

use crate::arguments::device::{refused, vulkan_device};
use crate::commands::prove::ReportOutput;
use crate::commands::prove::device;
use crate::commands::prove::report::{Host, LAB_FORMAT, LAB_FORMAT_VERSION, Program};
use crate::messages::exit::{DEVICE, DIFFERENCE, Failure};

/// Compare every variant of the kernels for cards with the CPU, measure them, and choose the fastest by fixed rules
#[derive(Debug, Args)]
#[command(after_help = "\
Variants differ in the invocations that evaluate a run together, in the size of workgroups, in how results \
pass the caches, and in how numbers become halves. Each is compared with the same function on the CPU, and \
left out if a bit differs. Then the limits of the device are measured, such as that of stores, and the \
variants, in rows of 32 dispatches. `docs/proofs.md` has the rules by which the fastest are chosen, and explains the JSON.

Exit codes:
  0  no bit differs
  6  bits differ

Examples:
  tumble lab --bits                              compare only: nothing is measured
  tumble lab --time-limit 150 -o lab.json
  tumble prove --quick --lab lab.json            with the lanes that the lab chose")]
pub(crate) struct Arguments {
    /// The device: its index, part of its name or uuid:UUID (`tumble devices`) [default: the first Vulkan
    /// device]
    #[arg(long, value_name = "DEVICE")]
    device: Option<String>,
    /// The time limit, seconds; the most typical runs are measured first
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 150,
        value_parser = clap::value_parser!(u64).range(1..=86_400)
    )]
    time_limit: u64,
    /// Compare bits only, and measure nothing
    #[arg(long)]
    bits: bool,
    #[command(flatten)]
    output: ReportOutput,
}

/// The file of a lab.
#[derive(Serialize)]
struct LabFile {
    format: &'static str,
    format_version: u64,
    program: Program,
    /// When it began, in UTC.
    date: String,
    /// How long it took.
    seconds: f64,
    host: Host,
    device: DeviceInfo,
    lab: LabReport,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let started = Instant::now();
    let Some(vulkan) = vulkan_device(arguments.device.as_deref())? else {
        return Err(Failure::new(
            DIFFERENCE,
            "nothing is compared: the CPU has no such kernels; name a Vulkan device with --device, or leave \
             that out for the first one (`tumble devices` lists them)",
        ));
    };
    arguments.output.check()?;
    let date = device::now();
    let mut options = EngineOptions::default();
    options.allow_inexact = true;
    let engine = Engine::with_options(vulkan, &options).map_err(|error| refused(&error))?;
    let options = LabOptions {
        bits_only: arguments.bits,
        budget: Duration::from_secs(arguments.time_limit),
    };
    let lab = lab(&engine, &options);
    let (Some(lab), Some(info)) = (lab.map_err(|error| refused(&error))?, engine.device_info())
    else {
        return Err(Failure::new(DEVICE, "the device is no Vulkan device"));
    };
    let file = LabFile {
        format: LAB_FORMAT,
        format_version: LAB_FORMAT_VERSION,
        program: device::program(),
        date,
        seconds: started.elapsed().as_secs_f64(),
        host: device::host(),
        device: info.clone(),
        lab,
    };
    let page = text::page(&file.device.name, file.seconds, &file.lab);
    arguments.output.report(&file, &page)?;
    match file.lab.rejected.len() {
        0 => Ok(()),
        count => Err(Failure::new(
            DEVICE,
            format!("bits differ in {count} variants"),
        )),
    }
}
