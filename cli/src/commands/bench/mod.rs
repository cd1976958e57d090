//! `tumble bench`: how fast this machine is, against itself and against what a user
//! would write. Everything is measured in one run, in turns, because machines are
//! shared and their clocks drift; what counts are the ratios.

pub(crate) mod device;
pub(crate) mod files;
pub(crate) mod follow;
pub(crate) mod naive;
pub(crate) mod report;
pub(crate) mod smooth;
pub(crate) mod stream;
pub(crate) mod workload;

use std::error::Error as _;
use std::time::{Duration, Instant};

use clap::Args;
use glam::Quat;
use rayon::prelude::*;
use tumble::{
    Clip, Device, Encoding, Engine, EngineOptions, Layout, Method, OutputBuffer, VectorWidth,
    method,
};

use crate::commands::bench::device::BenchDevice;
use crate::commands::bench::report::{Report, Row, Section};
use crate::commands::bench::workload::{Kind, Workload};
use crate::commands::probe;
use crate::messages::exit::{DEVICE, Failure};
use crate::messages::words;

/// Measure speed on this machine, as ratios taken in one run
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// What to measure
    #[arg(value_enum, default_values = ["sparse", "small"])]
    workloads: Vec<Kind>,
    /// Times that each is measured, after one that does not count; the median is told
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Make every workload smaller by this factor, to try it out
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
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
        probe::devices().unwrap_or_default()
    };
    // What others would write uses rayon's own threads.
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
            let turns = Turns {
                rounds: arguments.rounds,
                calls: 1,
            };
            let shrink = arguments.shrink as usize;
            sections.extend(match kind {
                Kind::Smooth => smooth::measure(shrink, turns)?,
                _ => files::measure(shrink, turns)?,
            });
            continue;
        };
        for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
            // Paths are curves of one method.
            if kind == Kind::Follow && method == method::SLERP {
                continue;
            }
            words::note(&format!("measuring {kind:?}, {method} …").to_lowercase());
            // A short call is repeated, so that the clock can see it.
            let calls = match kind {
                Kind::Small => (10_000 / arguments.rounds / arguments.shrink).max(1),
                _ => 1,
            };
            let turns = Turns {
                rounds: arguments.rounds,
                calls,
            };
            let section = if kind == Kind::Stream {
                stream::measure(&workload, method, turns)?
            } else if kind == Kind::Follow {
                follow::measure(&workload, method, &devices, turns)
                    .map_err(|error| crate::arguments::device::refused(&error))?
            } else {
                measure(kind, &workload, method, &devices, turns)
                    .map_err(|error| crate::arguments::device::refused(&error))?
            };
            sections.push(section);
        }
    }
    let devices = devices.into_iter().map(|device| device.report).collect();
    let report = Report::new(arguments.rounds, devices, sections);
    if arguments.json {
        words::json(&report)
    } else {
        words::styled_listing(&report.text())
    }
}

/// One way to do the work; what it returns are times besides that of the whole.
type Action<'a, E> = Box<dyn FnMut(&mut [Quat]) -> Result<Vec<Part>, E> + 'a>;

/// How often each is measured, and how many calls one measurement takes.
#[derive(Clone, Copy)]
pub(crate) struct Turns {
    rounds: u32,
    calls: u32,
}

/// A share of an action's time.
struct Part {
    name: &'static str,
    time: Duration,
}

struct Contestant<'a, E> {
    name: String,
    action: Action<'a, E>,
    /// Whether the first part is the time that counts, and not the host's from call to return: where a result
    /// stays on a device. Then the bytes that the device writes, and the bytes a second that it can write.
    on_device: Option<(u64, f64)>,
}

impl<'a, E> Contestant<'a, E> {
    fn new(
        name: impl Into<String>,
        action: impl FnMut(&mut [Quat]) -> Result<Vec<Part>, E> + 'a,
    ) -> Self {
        Self {
            name: name.into(),
            action: Box::new(action),
            on_device: None,
        }
    }
}

fn measure(
    kind: Kind,
    workload: &Workload,
    method: Method,
    devices: &[BenchDevice],
    turns: Turns,
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
    // Segments of dense keys take gigabytes: there is room for them once.
    let clips = match kind {
        Kind::Dense => Vec::new(),
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
    if kind != Kind::Dense {
        let one = cpu_clip(&|options| options.threads = Some(1))?;
        contestants.push(evaluate("CPU, one thread".into(), one));
        for width in VectorWidth::available() {
            let narrow = cpu_clip(&|options| options.vector_width = Some(width))?;
            contestants.push(evaluate(format!("CPU, {width:?}"), narrow));
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
    let mut rows = race(contestants, &mut output, turns)?;
    // The limit is the faster of plain and streaming stores: on Intel's processors streaming
    // stores write long results twice as fast, on others they bring little.
    let [plain, streaming] = [0, 1].map(|i| rows[i].milliseconds);
    rows.remove(usize::from(plain <= streaming));
    Ok(Section::new(kind, method, count, rows))
}

/// Keys and results stay on the device, whose clock counts; `None` where it has none.
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
        Ok(parts.map(|(name, time)| Part { name, time }).into())
    });
    contestant.on_device = on_device;
    Ok(Some(contestant))
}

/// Into memory of the caller's that is used again: that of a device that copies its results.
fn into_host_memory<'a>(
    clip: &'a Clip,
    workload: &'a Workload,
) -> impl FnMut(&mut [Quat]) -> Result<Vec<Part>, tumble::Error> + 'a {
    move |output| {
        clip.evaluate_into(&workload.frames, Layout::TrackMajor, output)?;
        Ok(taken(clip))
    }
}

/// Into memory of the device's choice, as a caller gets it fastest where that is the host's too.
fn on_device<'a>(
    clip: &'a Clip,
    workload: &'a Workload,
) -> impl FnMut(&mut [Quat]) -> Result<Vec<Part>, tumble::Error> + 'a {
    move |_| {
        std::hint::black_box(clip.evaluate(&workload.frames)?);
        Ok(taken(clip))
    }
}

/// Where a device's time went.
fn taken(clip: &Clip) -> Vec<Part> {
    let timings = clip.engine().take_timings();
    let parts = [
        ("work lists", timings.work_lists),
        ("submit to fence", timings.submit_to_fence),
        ("device clock", timings.on_device),
        ("read back", timings.read_back),
    ];
    parts.map(|(name, time)| Part { name, time }).into()
}

/// Every contestant in turn, round after round; the first round does not count.
fn race<E>(
    mut contestants: Vec<Contestant<'_, E>>,
    output: &mut [Quat],
    Turns { rounds, calls }: Turns,
) -> Result<Vec<Row>, E> {
    let mut times = vec![Vec::new(); contestants.len()];
    let mut parts: Vec<Vec<(&str, Vec<Duration>)>> = vec![Vec::new(); contestants.len()];
    for round in 0..=rounds {
        for (i, contestant) in contestants.iter_mut().enumerate() {
            let mut own = Vec::new();
            let started = Instant::now();
            for _ in 0..calls {
                own = (contestant.action)(output)?;
            }
            let mut time = started.elapsed() / calls;
            if let (Some(_), Some(device)) = (contestant.on_device, own.first()) {
                time = device.time;
            }
            std::hint::black_box(&mut *output);
            if round == 0 {
                parts[i] = own.iter().map(|part| (part.name, Vec::new())).collect();
                continue;
            }
            times[i].push(time);
            for (of_part, part) in parts[i].iter_mut().zip(own) {
                of_part.1.push(part.time);
            }
        }
    }
    let rows = contestants.into_iter().zip(times).zip(parts);
    Ok(rows
        .map(|((contestant, times), parts)| {
            let parts = parts.into_iter().map(|(name, times)| (name, median(times)));
            let mut row = Row::new(contestant.name, median(times), parts.collect());
            row.share_of_device(contestant.on_device);
            row
        })
        .collect())
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}
