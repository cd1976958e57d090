//! `tumble lab`: compares and measures variants of the kernels on a card, and says which to use.

mod text;

use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;
use tumble::vulkan::DeviceInfo;
use tumble::{Engine, EngineOptions};
use tumble_verify::lab::{LabOptions, LabReport, lab};

use crate::arguments::device::{refused, vulkan_device};
use crate::commands::prove::ReportOutput;
use crate::commands::prove::device;
use crate::commands::prove::report::{Host, LAB_FORMAT, LAB_FORMAT_VERSION, Program};
use crate::messages::exit::{DEVICE, DIFFERENCE, Failure};
use crate::messages::words;

/// Measure which variant of the kernels for graphics cards is the fastest, and compare every variant with the CPU
#[derive(Debug, Args)]
#[command(after_help = "\
Variants differ in the number of invocations that evaluate a run together, in the size of workgroups, in stores \
that bypass the caches or use them, and in the conversion to half precision. Each variant is compared with the \
same function on the CPU, and left out if a bit differs. Then the limits of the device are measured, and rows of \
32 dispatches of each variant. `docs/proofs.md` has the rules by which variants are chosen, and explains the JSON.

Exit codes:
  0  no bit differs
  5  there is no Vulkan device
  6  bits differ, or the device failed
  8  nothing was compared: --device cpu

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
        value_parser = words::whole_number::<u64>(1, 86_400)
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
            "nothing is compared: only Vulkan devices have kernels to measure; leave out --device for the first \
             one, or name one (`tumble devices`)",
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
