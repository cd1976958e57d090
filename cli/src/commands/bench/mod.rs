//! `tumble bench`: the speed on this machine, compared with its speed of writing memory and with code that a user would
//! write. All contestants are measured alternately in one run, because machines are shared and their clock rates
//! change. Only the ratios are meaningful.

pub(crate) mod characters;
pub(crate) mod device;
pub(crate) mod files;
pub(crate) mod follow;
pub(crate) mod naive;
pub(crate) mod poses;
pub(crate) mod race;
pub(crate) mod report;
pub(crate) mod smooth;
pub(crate) mod stream;
pub(crate) mod workload;

use std::error::Error as _;

use clap::Args;
use glam::Quat;
use rayon::prelude::*;
use tumble::{
    Clip, Device, Encoding, Engine, EngineOptions, Layout, Method, OutputBuffer, VectorWidth,
    method,
};

use crate::commands::bench::device::BenchDevice;
use crate::commands::bench::race::{Contestant, Repetitions, TimeShare, race};
use crate::commands::bench::report::{BenchReport, Section};
use crate::commands::bench::workload::{Workload, WorkloadKind};
use crate::drivers;
use crate::messages::exit::{DEVICE, Failure};
use crate::messages::listing;
use crate::messages::words;

/// Measure the speed of this machine, compared with a simple loop over glam
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// What to measure
    #[arg(value_enum, default_values = ["sparse", "small"])]
    workloads: Vec<WorkloadKind>,
    /// How often each workload is measured, after a warm-up; the median is reported
    #[arg(long, default_value_t = 7, value_parser = words::whole_number::<u32>(1, 1000))]
    rounds: u32,
    /// Make every workload smaller by this factor, to try it out
    #[arg(long, default_value_t = 1, value_parser = words::whole_number::<u32>(1, u64::from(u32::MAX)))]
    shrink: u32,
    /// Leave Vulkan devices out
    #[arg(long)]
    cpu_only: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let devices = if arguments.cpu_only {
        Vec::new()
    } else {
        drivers::devices().unwrap_or_default()
    };
    // The loop that a user would write uses rayon's own threads.
    if let Err(error) = rayon::ThreadPoolBuilder::new().build_global()
        && error.source().is_some()
    {
        return Err(Failure::new(DEVICE, format!("rayon's threads: {error}")));
    }
    let devices: Vec<BenchDevice> = (devices.iter().filter_map(BenchDevice::open))
        .collect::<Result<_, _>>()
        .map_err(|error| crate::arguments::device::refused(&error))?;
    let mut sections = Vec::new();
    for &kind in &arguments.workloads {
        let Some(workload) = kind.workload(arguments.shrink as usize) else {
            words::note(&format!("measuring {kind:?} …").to_lowercase());
            let repetitions = Repetitions {
                rounds: arguments.rounds,
                calls: 1,
            };
            let shrink = arguments.shrink as usize;
            sections.extend(match kind {
                WorkloadKind::Smooth => smooth::measure(shrink, repetitions)?,
                WorkloadKind::Characters => characters::measure(shrink, &devices, repetitions)
                    .map_err(|error| Failure::new(DEVICE, error.to_string()))?,
                WorkloadKind::Poses => poses::measure(shrink, repetitions)
                    .map_err(|error| crate::arguments::device::refused(&error))?,
                _ => files::measure(shrink, repetitions)?,
            });
            continue;
        };
        for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
            // A path is a curve of one method, so it is measured once.
            if kind == WorkloadKind::Follow && method == method::SLERP {
                continue;
            }
            words::note(&format!("measuring {kind:?}, {method} …").to_lowercase());
            // A short call is repeated in each measurement, because the clock is too coarse for a single call.
            let calls = match kind {
                WorkloadKind::Small => (10_000 / arguments.rounds / arguments.shrink).max(1),
                _ => 1,
            };
            let repetitions = Repetitions {
                rounds: arguments.rounds,
                calls,
            };
            let section = if kind == WorkloadKind::Stream {
                stream::measure(&workload, method, repetitions)?
            } else if kind == WorkloadKind::Follow {
                follow::measure(&workload, method, &devices, repetitions)
                    .map_err(|error| crate::arguments::device::refused(&error))?
            } else {
                measure(kind, &workload, method, &devices, repetitions)
                    .map_err(|error| crate::arguments::device::refused(&error))?
            };
            sections.push(section);
        }
    }
    let devices = devices.into_iter().map(|device| device.report).collect();
    let report = BenchReport::new(arguments.rounds, devices, sections);
    if arguments.json {
        listing::json(&report)
    } else {
        listing::styled(&report.text())
    }
}

/// The forms in which clips of motion are kept, and the option that selects each.
pub(crate) const KEPT_FORMS: [(&str, u64); 2] = [("segments", u64::MAX), ("keys", 0)];

fn measure(
    kind: WorkloadKind,
    workload: &Workload,
    method: Method,
    devices: &[BenchDevice],
    repetitions: Repetitions,
) -> Result<Section, tumble::Error> {
    let engine = Engine::new(Device::Cpu)?;
    let clip = engine.upload(&workload.set, method)?;
    let count = clip.track_count() * clip.timeline(&workload.frames)?.len();
    let mut output = OutputBuffer::new(count)?;
    output.fill(Quat::IDENTITY);

    let fill = |fill: fn(&mut [Quat], Quat)| {
        Contestant::new("host memory write rate", move |output: &mut [Quat]| {
            let value = std::hint::black_box(Quat::IDENTITY);
            let chunk = output.len().div_ceil(rayon::current_num_threads());
            (output.par_chunks_mut(chunk)).for_each(|part| fill(part, value));
            Ok(Vec::new())
        })
    };
    // Segments of dense keys take gigabytes. They would not fit into memory for each device, so no clip is kept.
    let clips = match kind {
        WorkloadKind::Dense => Vec::new(),
        _ => (devices.iter())
            .map(|device| device.engine.upload(&workload.set, method))
            .collect::<Result<_, _>>()?,
    };
    let mut contestants = vec![
        fill(<[Quat]>::fill),
        fill(|part, value| VectorWidth::widest().fill_past_caches(part, value)),
        Contestant::new("naive (glam, rayon)", |output: &mut [Quat]| {
            if method == method::BESSEL_OVERHAUSER {
                naive::cubic(workload, output);
            } else {
                naive::slerp(workload, output);
            }
            Ok(Vec::new())
        }),
    ];
    let cpu_clip = |change: &dyn Fn(&mut EngineOptions)| -> Result<Clip, tumble::Error> {
        let mut options = EngineOptions::default();
        change(&mut options);
        Engine::with_options(Device::Cpu, &options)?.upload(&workload.set, method)
    };
    let evaluate = |name: String, clip: Clip| {
        Contestant::new(name, move |output: &mut [Quat]| {
            clip.evaluate_into(&workload.frames, Layout::TrackMajor, output)?;
            Ok(Vec::new())
        })
    };
    contestants.push(evaluate("CPU, evaluation alone".into(), clip));
    if kind != WorkloadKind::Dense {
        let one = cpu_clip(&|options| options.thread_count = Some(1))?;
        contestants.push(evaluate("CPU, one thread".into(), one));
        for width in VectorWidth::available() {
            let narrow = cpu_clip(&|options| options.vector_width = Some(width))?;
            contestants.push(evaluate(format!("CPU, {width:?}"), narrow));
        }
    }
    if kind == WorkloadKind::Motion {
        for (form, kept_segments) in KEPT_FORMS {
            let clip = cpu_clip(&|options| options.kept_segments = Some(kept_segments))?;
            contestants.push(evaluate(format!("CPU, {form} kept"), clip));
        }
    }
    contestants.push(Contestant::new(
        "CPU, from keys",
        |output: &mut [Quat]| {
            let (set, frames) = (&workload.set, &workload.frames);
            engine.evaluate_into(set, method, frames, Layout::TrackMajor, output)?;
            Ok(Vec::new())
        },
    ));
    for (i, device) in devices.iter().enumerate() {
        let engine = device.engine.clone();
        let name = engine.device_name().to_owned();
        if let Some(clip) = clips.get(i) {
            contestants.push(match device.copies_results() {
                true => Contestant::new(&name, into_host_memory(clip, workload)),
                false => Contestant::new(&name, on_device(clip, workload)),
            });
            contestants.extend(resident(device, clip, workload)?);
        }
        contestants.push(Contestant::new(
            format!("{name}, from keys"),
            move |output: &mut [Quat]| {
                let (set, frames) = (&workload.set, &workload.frames);
                engine.evaluate_into(set, method, frames, Layout::TrackMajor, output)?;
                let _ = engine.take_timings();
                Ok(Vec::new())
            },
        ));
    }
    let mut rows = race(contestants, &mut output, repetitions)?;
    // The limit is the faster of plain and streaming stores: on Intel's processors streaming
    // stores write long results twice as fast, on others they bring little.
    let [plain, streaming] = [0, 1].map(|i| rows[i].milliseconds);
    rows.remove(usize::from(plain <= streaming));
    Ok(Section::new(kind, method, count, rows))
}

/// A contestant whose keys and results stay on the device. The device's clock measures the time; `None` if it has no
/// clock.
fn resident<'a>(
    device: &BenchDevice,
    clip: &'a Clip,
    workload: &'a Workload,
) -> Result<Option<Contestant<'a, tumble::Error>>, tumble::Error> {
    let Some(mut room) = clip.resident(&workload.frames, Layout::TrackMajor, Encoding::F32)? else {
        return Ok(None);
    };
    let on_device = Some((room.bytes(), device.write_limit()));
    let name = format!("{}, resident", device.engine.device_name());
    let mut contestant = Contestant::new(name, move |_: &mut [Quat]| {
        let took = room.evaluate()?;
        let parts = [("device clock", took.on_device), ("host", took.on_host)];
        Ok(parts.map(|(name, time)| TimeShare { name, time }).into())
    });
    contestant.on_device = on_device;
    Ok(Some(contestant))
}

/// A contestant that evaluates into memory of the caller, which is used again each time, for a device that copies its
/// results.
fn into_host_memory<'a>(
    clip: &'a Clip,
    workload: &'a Workload,
) -> impl FnMut(&mut [Quat]) -> Result<Vec<TimeShare>, tumble::Error> + 'a {
    move |output| {
        clip.evaluate_into(&workload.frames, Layout::TrackMajor, output)?;
        Ok(device_time_shares(clip))
    }
}

/// A contestant that evaluates into memory that the device chooses. This is the fastest for a caller if it is also the
/// host's memory.
fn on_device<'a>(
    clip: &'a Clip,
    workload: &'a Workload,
) -> impl FnMut(&mut [Quat]) -> Result<Vec<TimeShare>, tumble::Error> + 'a {
    move |_| {
        std::hint::black_box(clip.evaluate(&workload.frames)?);
        Ok(device_time_shares(clip))
    }
}

/// The parts of a device's time.
fn device_time_shares(clip: &Clip) -> Vec<TimeShare> {
    let timings = clip.engine().take_timings();
    let parts = [
        ("work lists", timings.work_lists),
        ("submit to fence", timings.submit_to_fence),
        ("device clock", timings.on_device),
        ("read back", timings.read_back),
    ];
    parts.map(|(name, time)| TimeShare { name, time }).into()
}
