//! Speed of a device by its time stamps, on a renderer's device ([`mod@crate::renderer`]): memory, the bus, a
//! submission, and the engine's cases relative to these.

use std::time::{Duration, Instant};

use ash::vk;
use tumble::crowd::{CrowdLayer, CrowdLibrary, CrowdOutput, CrowdValues};
use tumble::vulkan::{DeviceKind, VulkanDevice};
use tumble::{Encoding, Engine, EngineOptions, Error, Layout, Method, SampleTimes, method};

use crate::application::{Application, ApplicationBuffer, ApplicationMemory, Elapsed};
use crate::golden::GoldenError;
use crate::renderer::{Renderer, record, record_clip, record_clip_in_row, record_in_row};
use crate::sets::{
    SeededRandom, crowd_layer, crowd_library, shared_set, typical_layer, typical_library,
};

/// The duration in seconds of the keys of the cases: 26 keys, 0.8 s apart.
const SECONDS: f64 = 20.0;

/// The rows of a crowd.
const CROWD_ROWS: usize = 3;

/// The joints of an instance of a crowd.
const JOINTS: usize = 60;

/// Measured speeds. Rates are bytes per second. Each figure is the median of several runs after a run that is
/// ignored.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Figures {
    /// The clock of the rates and of [`FigureCase::seconds`]: `device` if the device has time stamps, else `host`.
    pub clock: &'static str,
    /// The size in bytes of each buffer that was filled and copied.
    pub buffer_bytes: u64,
    /// The rate of filling device memory (`vkCmdFillBuffer`).
    pub fill_rate: f64,
    /// The rate of copying within device memory; only written bytes are counted.
    pub device_copy_rate: f64,
    /// The rate of copying from host memory to device memory.
    pub upload_rate: f64,
    /// The rate of copying from device memory to host memory.
    pub download_rate: f64,
    /// The time from submitting an empty command buffer until the host saw its fence, seconds of the host's clock.
    pub submit_and_fence: f64,
    /// The engine's cases.
    pub cases: Vec<FigureCase>,
}

/// One case of the engine.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct FigureCase {
    /// `resident`, `read-back`, `crowd` or `encoded`.
    pub case: &'static str,
    /// A description of the case.
    pub name: String,
    /// The number of the result's values: rotations, or joints.
    pub values: u64,
    /// The size of the result in bytes.
    pub bytes: u64,
    /// The time in seconds of the first call, from keys to the result, including compilation of kernels.
    pub first_call: f64,
    /// The time of later calls in seconds.
    pub seconds: f64,
    /// The time of later calls in seconds by the host's clock.
    pub host_seconds: f64,
    /// The time in seconds in which the host recorded a later call into commands; `None` if the case is not recorded.
    pub record_seconds: Option<f64>,
    /// The time in seconds of one of a row of calls that are recorded one after another, with a barrier between
    /// kernels; `None` if the case is not recorded, or the device has no time stamps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row_seconds: Option<f64>,
    /// The rate of the result in bytes per second.
    pub rate: f64,
    /// The figure that limits the rate: `fill` or `download`.
    pub limit: &'static str,
    /// The rate as a fraction of that figure.
    pub share: f64,
}

/// Measures the figures in about the time `budget`. Cases for which no time remains are omitted.
///
/// # Errors
/// When the device cannot be opened, or fails.
pub fn figures(device: &VulkanDevice, budget: Duration) -> Result<Figures, GoldenError> {
    figures_with(device, &EngineOptions::default(), budget)
}

/// As [`figures`], with other options of the engine.
///
/// # Errors
/// As [`figures`].
pub fn figures_with(
    device: &VulkanDevice,
    options: &EngineOptions,
    budget: Duration,
) -> Result<Figures, GoldenError> {
    let deadline = Instant::now() + budget;
    let is_software = matches!(device.info().kind, DeviceKind::Cpu | DeviceKind::Other);
    let renderer = Renderer::new(device, false, options)?;
    let mut bench = Bench {
        renderer,
        is_software,
        deadline,
        figures: Figures {
            clock: "device",
            buffer_bytes: if is_software { 16 << 20 } else { 256 << 20 },
            fill_rate: 0.0,
            device_copy_rate: 0.0,
            upload_rate: 0.0,
            download_rate: 0.0,
            submit_and_fence: 0.0,
            cases: Vec::new(),
        },
    };
    bench.memory()?;
    bench.resident()?;
    bench.crowds()?;
    bench.read_back()?;
    bench.encoded()?;
    Ok(bench.figures)
}

struct Bench {
    renderer: Renderer,
    is_software: bool,
    deadline: Instant,
    figures: Figures,
}

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times
        .get(times.len() / 2)
        .map_or(0.0, Duration::as_secs_f64)
}

/// The median of up to seven runs after the first one; of fewer if they take long.
fn measured<T>(mut run: impl FnMut() -> Result<T, Error>) -> Result<(T, Vec<T>), Error> {
    const RUNS: usize = 7;
    const LONG: Duration = Duration::from_millis(700);
    let first = run()?;
    let (mut runs, started) = (Vec::new(), Instant::now());
    while runs.is_empty() || runs.len() < RUNS && started.elapsed() < LONG {
        runs.push(run()?);
    }
    Ok((first, runs))
}

/// The time in seconds by the device's clock, if every run has it, and by the host's clock.
fn seconds(runs: &[Elapsed]) -> (Option<f64>, f64) {
    let on_device: Option<Vec<_>> = runs.iter().map(|run| run.on_device).collect();
    let on_host = runs.iter().map(|run| run.on_host).collect();
    (on_device.map(median), median(on_host))
}

impl Bench {
    fn is_over(&self) -> bool {
        Instant::now() > self.deadline
    }

    /// The time by the clock of the figures in seconds.
    fn clocked(&mut self, (on_device, on_host): (Option<f64>, f64)) -> f64 {
        if on_device.is_none() {
            self.figures.clock = "host";
        }
        on_device.unwrap_or(on_host)
    }

    fn device_buffer(&self, size: u64) -> Result<ApplicationBuffer, Error> {
        Ok((self.renderer.application).buffer(size, ApplicationMemory::Device)?)
    }

    /// The rate in bytes per second of commands that are recorded for each run.
    fn rate(
        &mut self,
        bytes: u64,
        commands: impl Fn(&Application, vk::CommandBuffer),
    ) -> Result<f64, Error> {
        let application = &mut self.renderer.application;
        let (_, runs) = measured(|| {
            let recorded = application.recorded(true, |buffer| {
                commands(application, buffer);
                Ok::<_, Error>(())
            })?;
            Ok(application.timed(recorded)?)
        })?;
        application.forget_commands();
        let seconds = seconds(&runs);
        Ok(bytes as f64 / self.clocked(seconds).max(1e-9))
    }

    fn memory(&mut self) -> Result<(), Error> {
        let bytes = self.figures.buffer_bytes;
        let [one, two] = [self.device_buffer(bytes)?, self.device_buffer(bytes)?];
        let host = (self.renderer.application).buffer(bytes, ApplicationMemory::Host)?;
        self.figures.fill_rate = self.rate(bytes, |application, commands| {
            application.fill(commands, &one, 0x3f80_0000);
        })?;
        self.figures.device_copy_rate = self.rate(bytes, |application, commands| {
            application.copy(commands, &one, &two, bytes);
        })?;
        self.figures.upload_rate = self.rate(bytes, |application, commands| {
            application.copy(commands, &host, &one, bytes);
        })?;
        self.figures.download_rate = self.rate(bytes, |application, commands| {
            application.copy(commands, &one, &host, bytes);
        })?;
        let application = &mut self.renderer.application;
        let nothing = application.recorded(false, |_| Ok::<_, Error>(()))?;
        let mut times = Vec::new();
        for _ in 0..33 {
            times.push(application.run(&[nothing])?.on_host);
        }
        application.forget_commands();
        self.figures.submit_and_fence = median(times);
        Ok(())
    }

    /// The number of tracks of the cases' sets.
    fn tracks(&self) -> usize {
        if self.is_software { 256 } else { 4096 }
    }

    /// Adds a case.
    fn add(
        &mut self,
        (case, name): (&'static str, String),
        (values, bytes): (u64, u64),
        first_call: Duration,
        runs: &[Elapsed],
        limit: &'static str,
    ) {
        let (on_device, on_host) = seconds(runs);
        let seconds = match limit {
            // The time on the bus ends when the host has the bytes.
            "download" => on_host,
            _ => self.clocked((on_device, on_host)),
        };
        let rate = bytes as f64 / seconds.max(1e-9);
        let of = match limit {
            "download" => self.figures.download_rate,
            _ => self.figures.fill_rate,
        };
        self.figures.cases.push(FigureCase {
            case,
            name,
            values,
            bytes,
            first_call: first_call.as_secs_f64(),
            seconds,
            host_seconds: on_host,
            record_seconds: None,
            row_seconds: None,
            rate,
            limit,
            share: if of > 0.0 { rate / of } else { 0.0 },
        });
    }

    /// Sets the median time of recording the last case; the first time is ignored.
    fn recorded_in(&mut self, mut times: Vec<Duration>) {
        times.remove(0);
        if let Some(case) = self.figures.cases.last_mut() {
            case.record_seconds = Some(median(times));
        }
    }

    /// The number of calls that are submitted back to back and timed together. Few on software devices, where a call takes
    /// equally long in a series and alone.
    fn row(&self) -> u32 {
        if self.is_software { 2 } else { 32 }
    }

    /// Sets the time of one call of a row, by rows of the last case.
    fn in_rows(&mut self, rows: &[Elapsed]) {
        let ((on_device, _), row) = (seconds(rows), self.row());
        if let Some(case) = self.figures.cases.last_mut() {
            case.row_seconds = on_device.map(|seconds| seconds / f64::from(row));
        }
    }

    /// A clip on the device whose result stays there.
    fn kept(
        &mut self,
        case: &'static str,
        method: Method,
        encoding: Encoding,
        layout: Layout,
    ) -> Result<(), Error> {
        if self.is_over() {
            return Ok(());
        }
        let tracks = self.tracks();
        let set = shared_set(51, tracks, 26, SECONDS / 25.0, 0.6, 0);
        // 1200 frames of 60 a second.
        let frames = SampleTimes::fps(60).between(0.0, SECONDS - 1.0 / 60.0);
        let samples = frames.resolve(tracks, set.time_span())?.len();
        let bytes = (tracks * samples * encoding.bytes()) as u64;
        let (buffer, row) = (self.device_buffer(bytes)?, self.row());
        let started = Instant::now();
        let clip = self.renderer.engine.upload(&set, method)?;
        let target = Renderer::clip_target(&clip, &frames, (layout, encoding), (&buffer, 0))?;
        let application = &mut self.renderer.application;
        let (mut first_call, mut recording) = (None, Vec::new());
        let (_, runs) = measured(|| {
            let commands = application.recorded(true, |commands| {
                let call = Instant::now();
                let recorded = record_clip(&target, commands, 0);
                recording.push(call.elapsed());
                recorded
            })?;
            let ran = application.timed(commands)?;
            first_call.get_or_insert_with(|| started.elapsed());
            Ok(ran)
        })?;
        application.forget_commands();
        let (_, rows) = measured(|| {
            let commands = application.recorded(true, |commands| {
                (0..row).try_for_each(|_| record_clip_in_row(&target, commands))
            })?;
            Ok(application.timed(commands)?)
        })?;
        application.forget_commands();
        drop(target);
        let name = format!("{tracks} tracks × {samples} frames, {method}, {encoding}, {layout:?}");
        let values = (tracks * samples) as u64;
        let first_call = first_call.unwrap_or_default();
        self.add((case, name), (values, bytes), first_call, &runs, "fill");
        self.recorded_in(recording);
        self.in_rows(&rows);
        Ok(())
    }

    /// Cases of results on the device. The first has constant keys: nothing is computed, so it measures the rate of
    /// the kernels' stores.
    fn resident(&mut self) -> Result<(), Error> {
        for method in [method::STEP, method::SLERP, method::BESSEL_OVERHAUSER] {
            self.kept("resident", method, Encoding::F32, Layout::TrackMajor)?;
        }
        Ok(())
    }

    fn encoded(&mut self) -> Result<(), Error> {
        for encoding in Encoding::ALL {
            if encoding.stores_rotations() {
                self.kept("encoded", method::SLERP, encoding, Layout::TrackMajor)?;
            }
        }
        self.kept("encoded", method::SLERP, Encoding::F32, Layout::FrameMajor)
    }

    /// The same clips, with results that are read back into memory of the engine's choice, which is reused.
    fn read_back(&mut self) -> Result<(), Error> {
        for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
            if self.is_over() {
                return Ok(());
            }
            let tracks = self.tracks();
            let set = shared_set(51, tracks, 26, SECONDS / 25.0, 0.6, 0);
            let frames = SampleTimes::fps(60).between(0.0, SECONDS - 1.0 / 60.0);
            let samples = frames.resolve(tracks, set.time_span())?.len();
            let started = Instant::now();
            let clip = self.renderer.engine.upload(&set, method)?;
            let engine = &self.renderer.engine;
            let mut first_call = None;
            let (_, runs) = measured(|| {
                let call = Instant::now();
                drop(clip.evaluate(&frames)?);
                let on_host = call.elapsed();
                first_call.get_or_insert_with(|| started.elapsed());
                Ok(elapsed(engine, on_host))
            })?;
            let values = (tracks * samples) as u64;
            let name = format!("{tracks} tracks × {samples} frames, {method}");
            let first_call = first_call.unwrap_or_default();
            self.add(
                ("read-back", name),
                (values, 16 * values),
                first_call,
                &runs,
                "download",
            );
        }
        Ok(())
    }

    /// 10 000 characters of 60 joints, recorded; 500 on software devices. They play clips of few keys at any speeds and
    /// wraps, which is hard; then clips as most are.
    fn crowds(&mut self) -> Result<(), GoldenError> {
        let random = &mut SeededRandom(61);
        let library = crowd_library(random, JOINTS, &[method::SLERP, method::SLERP])?;
        self.crowd("", &library, &mut || crowd_layer(random, &library))?;
        let library = typical_library(random, JOINTS)?;
        let name = "8 looped clips × 61 keys, ";
        self.crowd(name, &library, &mut || typical_layer(random, &library))
    }

    fn crowd(
        &mut self,
        library_name: &str,
        library: &CrowdLibrary,
        layer: &mut dyn FnMut() -> CrowdLayer,
    ) -> Result<(), GoldenError> {
        let instances = if self.is_software { 500 } else { 10_000 };
        for values in [
            CrowdValues::Rotations,
            CrowdValues::Local,
            CrowdValues::Model,
        ] {
            if self.is_over() {
                return Ok(());
            }
            let output = CrowdOutput::from(values);
            let size = (instances * JOINTS * output.bytes()) as u64;
            let buffer = self.device_buffer(size)?;
            let started = Instant::now();
            let mut crowd = self.renderer.engine.crowd(library, instances, 1)?;
            for instance in 0..instances {
                crowd.set(instance, 0, layer())?;
            }
            let target = Renderer::target(&crowd, output, &buffer)?;
            let (mut runs, mut recording) = (Vec::new(), Vec::new());
            let mut first_call = None;
            for _ in 0..8 {
                crowd.advance_ticks(11_760)?;
                let call = Instant::now();
                let application = &self.renderer.application;
                let commands = application.recorded(true, |commands| {
                    let call = Instant::now();
                    let recorded = record(&mut crowd, &target, commands);
                    recording.push(call.elapsed());
                    recorded
                })?;
                let ran = self.renderer.application.timed(commands);
                let ran = ran.map_err(Error::from)?;
                if first_call.is_none() {
                    first_call = Some(started.elapsed());
                    continue;
                }
                runs.push(Elapsed {
                    on_host: call.elapsed(),
                    ..ran
                });
            }
            let (row, mut rows) = (self.row(), Vec::new());
            for _ in 0..CROWD_ROWS {
                let commands = self.renderer.application.recorded(true, |commands| {
                    (0..row).try_for_each(|_| {
                        crowd.advance_ticks(11_760)?;
                        record_in_row(&mut crowd, &target, commands)
                    })
                })?;
                let ran = self.renderer.application.timed(commands);
                rows.push(ran.map_err(Error::from)?);
            }
            drop(target);
            self.renderer.application.forget_commands();
            let joints = (instances * JOINTS) as u64;
            let name = format!("{instances} instances × {JOINTS} joints, {library_name}{values:?}");
            let first_call = first_call.unwrap_or_default();
            self.add(("crowd", name), (joints, size), first_call, &runs, "fill");
            self.recorded_in(recording);
            self.in_rows(&rows);
        }
        Ok(())
    }
}

/// The times that the engine reports of its last call.
fn elapsed(engine: &Engine, on_host: Duration) -> Elapsed {
    let timings = engine.take_timings();
    Elapsed {
        on_device: (!timings.on_device.is_zero()).then_some(timings.on_device),
        on_host,
    }
}
