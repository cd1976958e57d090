//! `--device`: which device evaluates, and what to say when it is not there.

use std::convert::Infallible;
use std::str::FromStr;

use ash::vk;
use clap::Args;
use glam::Quat;
use tumble::{
    Device, Engine, EngineOptions, Error, Frames, Interpolation, Layout, TrackSet, VulkanError,
};

use crate::arguments::given::Given;
use crate::arguments::named_device::named;
use crate::batch::output::{Ended, Sink};
use crate::commands::probe;
use crate::messages::exit::{DEVICE, Failure, NO_VULKAN};
use crate::messages::words;

/// Rotations evaluated at once: 16 MB.
const CHUNK: usize = 1 << 20;

#[derive(Debug, Clone, Args)]
pub(crate) struct DeviceArguments {
    /// auto (the CPU for fewer than 2^20 rotations and where there is no graphics card, else the
    /// fastest by a measured probe), first (Vulkan device that is exact, else the CPU), cpu, vulkan,
    /// or a device by its index, part of its name or uuid:UUID (`tumble devices`); the bits are the
    /// same
    #[arg(long, value_name = "DEVICE", default_value = "auto")]
    device: Choice,
    /// Use the device that --device names although its self-tests fail: its bits may differ from
    /// the CPU's
    #[arg(long)]
    allow_inexact: bool,
    /// Memory of a Vulkan device to use besides results, such as 256MiB
    #[arg(long, value_name = "SIZE", value_parser = words::parse_bytes)]
    memory: Option<u64>,
    /// Threads of the CPU, for front ends that leave the choice.
    #[arg(skip)]
    threads: Option<usize>,
}

#[derive(Debug, Clone, PartialEq)]
enum Choice {
    /// The first Vulkan device that is exact, else the CPU.
    First,
    /// The one that is fastest for each job.
    Auto,
    Cpu,
    /// The first Vulkan device that is exact.
    Vulkan,
    /// An index in the list of devices, part of a name, or a UUID.
    Named(String),
}

impl FromStr for Choice {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text.to_lowercase().as_str() {
            "first" => Self::First,
            "auto" => Self::Auto,
            "cpu" => Self::Cpu,
            "vulkan" | "gpu" => Self::Vulkan,
            _ => Self::Named(text.to_owned()),
        })
    }
}

/// An engine, and how to call its device.
pub(crate) struct Opened {
    pub(crate) engine: Engine,
    pub(crate) label: String,
    /// Another device may stand in: the bits are the same.
    automatic: bool,
    /// Each job goes to the device that is fastest for it.
    by_cost: Option<ByCost>,
}

/// Fewer rotations than this the CPU has done before another device is open: the rule of
/// [`Engine::auto`], here so that small jobs load no driver.
const FEW: usize = 1 << 20;

/// The devices of jobs whose size decides.
struct ByCost {
    cpu: Engine,
    /// For large jobs; found when there is one.
    large: Option<Engine>,
    options: EngineOptions,
}

impl ByCost {
    fn engine(&mut self, rotations: usize) -> Result<Engine, Error> {
        if rotations < FEW {
            return Ok(self.cpu.clone());
        }
        if self.large.is_none() {
            self.large = Some(self.fastest()?);
        }
        Ok(self.large.as_ref().unwrap_or(&self.cpu).clone())
    }

    /// The fastest device for large jobs, with the options.
    fn fastest(&self) -> Result<Engine, Error> {
        if probe::drivers().is_err() {
            return Ok(self.cpu.clone());
        }
        let found = Engine::auto()?;
        let Some(info) = found.device_info() else {
            return Ok(self.cpu.clone());
        };
        if self.options.memory.is_none() {
            return Ok(found);
        }
        let mut all = probe::devices()?.into_iter();
        let same = all.find(|device| device.name() == info.name);
        same.map_or(Ok(found.clone()), |device| {
            Engine::with_options(device, &self.options)
        })
    }
}

impl DeviceArguments {
    /// The device of that name, as `--device` takes it.
    pub(crate) fn of(name: &str, options: &EngineOptions) -> Self {
        let Ok(device) = name.parse();
        Self {
            device,
            allow_inexact: options.allow_inexact,
            memory: options.memory,
            threads: options.threads,
        }
    }

    /// So many threads of the CPU.
    pub(crate) fn set_threads(&mut self, threads: Option<usize>) {
        self.threads = threads;
    }

    /// The device of a command line, which says nothing of a device that is not used.
    pub(crate) fn open(&self) -> Result<Opened, Failure> {
        if self.device == Choice::Cpu && self.memory.is_some() {
            let message = "--memory is that of a Vulkan device; leave it out with --device cpu";
            return Err(Failure::usage(message));
        }
        if self.allow_inexact && matches!(self.device, Choice::Cpu | Choice::Auto) {
            return Err(Failure::usage(
                "--allow-inexact is for a Vulkan device that is asked for; give it too: --device \
                 vulkan, or a name (`tumble devices`)",
            ));
        }
        self.open_any()
    }

    /// Whether the CPU was asked for.
    pub(crate) fn is_cpu(&self) -> bool {
        self.device == Choice::Cpu
    }

    /// The same device for commands that compare it with the CPU: the first Vulkan device where the
    /// command line names none.
    pub(crate) fn compared(&self, given: &Given) -> Self {
        let device = match given.has("device") {
            true => self.device.clone(),
            false => Choice::First,
        };
        Self {
            device,
            ..self.clone()
        }
    }

    /// The device, whatever else is said.
    pub(crate) fn open_any(&self) -> Result<Opened, Failure> {
        match &self.device {
            Choice::Cpu => self.cpu("CPU".to_owned()),
            Choice::Auto => {
                let opened = self.cpu("CPU".to_owned())?;
                let by_cost = ByCost {
                    cpu: opened.engine.clone(),
                    large: None,
                    options: self.options(),
                };
                Ok(Opened {
                    by_cost: Some(by_cost),
                    ..opened
                })
            }
            Choice::First => match self.first_exact() {
                Ok(engine) => Ok(Opened {
                    automatic: true,
                    ..Opened::new(engine)
                }),
                Err(error) => self.cpu(format!("CPU ({})", short_reason(&error))),
            },
            Choice::Vulkan => self.first_exact().map(Opened::new).map_err(|e| refused(&e)),
            Choice::Named(name) => {
                let devices = probe::devices().map_err(|error| refused(&error.into()))?;
                let device = named(name, &devices)?;
                self.engine(device)
                    .map(Opened::new)
                    .map_err(|error| refused(&error))
            }
        }
    }

    fn options(&self) -> EngineOptions {
        let mut options = EngineOptions::default();
        options.memory = self.memory;
        options.allow_inexact = self.allow_inexact;
        options.threads = self.threads;
        options
    }

    fn engine(&self, device: Device) -> Result<Engine, Error> {
        Engine::with_options(device, &self.options())
    }

    fn cpu(&self, label: String) -> Result<Opened, Failure> {
        let engine = self.engine(Device::Cpu).map_err(|error| refused(&error))?;
        Ok(Opened {
            engine,
            label,
            automatic: false,
            by_cost: None,
        })
    }

    /// The first device that opens and is exact; else why the first one is not.
    fn first_exact(&self) -> Result<Engine, Error> {
        let mut reason = Error::Vulkan(VulkanError::NoDevice);
        for (index, device) in probe::devices()?.into_iter().enumerate() {
            match self.engine(device) {
                Ok(engine) => return Ok(engine),
                Err(error) if index == 0 => reason = error,
                Err(_) => {}
            }
        }
        Err(reason)
    }
}

impl Opened {
    fn new(engine: Engine) -> Self {
        let label = engine.device_name().to_owned();
        Self {
            engine,
            label,
            automatic: false,
            by_cost: None,
        }
    }

    /// Whether results come from Vulkan.
    pub(crate) fn is_vulkan(&self) -> bool {
        self.engine.device_info().is_some()
    }

    /// Chooses the device for so many rotations, where cost decides.
    pub(crate) fn choose(&mut self, rotations: usize) -> Result<(), Error> {
        if let Some(by_cost) = &mut self.by_cost {
            self.engine = by_cost.engine(rotations)?;
            self.label = self.engine.device_name().to_owned();
            self.automatic = self.is_vulkan();
        }
        Ok(())
    }

    /// Evaluates into `sink`, chunk by chunk. A device that nobody named may fail: the
    /// CPU gives the same bits, and goes on where it stopped.
    pub(crate) fn stream(
        &mut self,
        set: &TrackSet,
        interpolation: Interpolation,
        frames: &Frames,
        layout: Layout,
        sink: &mut Sink<'_>,
    ) -> Result<(), Ended> {
        let row = match layout {
            Layout::TrackMajor => 1,
            Layout::FrameMajor => set.track_count(),
        };
        let timeline = frames.resolve(set.track_count(), set.time_span());
        let samples = timeline.map_err(Error::from)?.len();
        self.choose(set.track_count() * samples)?;
        let chunk = CHUNK.max(row);
        let mut done = 0;
        let result = self
            .engine
            .stream(set, interpolation, frames, layout, chunk, |chunk| {
                done = chunk.start + chunk.rows.len();
                sink(chunk)
            });
        match result {
            Err(Ended::Evaluating(Error::Vulkan(error))) if self.automatic => {
                self.fall_back(&error)?;
                self.engine
                    .stream(set, interpolation, frames, layout, chunk, |chunk| {
                        if chunk.start < done {
                            Ok(())
                        } else {
                            sink(chunk)
                        }
                    })
            }
            result => result,
        }
    }

    /// Does some work on the device. One that nobody named may fail: then the CPU does it.
    pub(crate) fn work<T>(
        &mut self,
        mut work: impl FnMut(&Engine) -> Result<T, Error>,
    ) -> Result<T, Error> {
        match work(&self.engine) {
            Err(Error::Vulkan(error)) if self.automatic => {
                self.fall_back(&error)?;
                work(&self.engine)
            }
            done => done,
        }
    }

    /// From now on the CPU.
    fn fall_back(&mut self, error: &VulkanError) -> Result<(), Error> {
        words::warning(&format!("{}: {error}; going on with the CPU", self.label));
        self.engine = Engine::new(Device::Cpu)?;
        self.label = format!("CPU ({} failed)", self.label);
        self.automatic = false;
        self.by_cost = None;
        Ok(())
    }

    /// As [`Opened::stream`], all of it.
    pub(crate) fn collect(
        &mut self,
        set: &TrackSet,
        interpolation: Interpolation,
        frames: &Frames,
        layout: Layout,
    ) -> Result<Vec<Quat>, Error> {
        let mut rotations = Vec::new();
        let collected = self.stream(set, interpolation, frames, layout, &mut |chunk| {
            rotations.extend_from_slice(chunk.rotations().unwrap_or_default());
            Ok(())
        });
        match collected {
            Ok(()) | Err(Ended::Writing(_)) => Ok(rotations), // nothing was written
            Err(Ended::Evaluating(error)) => Err(error),
        }
    }
}

/// The Vulkan device of that name, as `--device` takes it, not opened; the first one where there is no name.
/// `None` for the CPU.
pub(crate) fn vulkan_device(name: Option<&str>) -> Result<Option<Device>, Failure> {
    let choice = name.map_or(Choice::First, |name| {
        let Ok(choice) = name.parse();
        choice
    });
    let devices = || probe::devices().map_err(|error| refused(&error.into()));
    match choice {
        Choice::Cpu => Ok(None),
        Choice::First | Choice::Auto | Choice::Vulkan => {
            let first = devices()?.into_iter().next();
            first
                .map(Some)
                .ok_or_else(|| no_vulkan(&VulkanError::NoDevice))
        }
        Choice::Named(name) => named(&name, &devices()?).map(Some),
    }
}

pub(super) fn no_vulkan(error: &VulkanError) -> Failure {
    Failure::new(NO_VULKAN, format!("no Vulkan device: {error}"))
}

/// A demanded device could not be opened.
pub(crate) fn refused(error: &Error) -> Failure {
    match error {
        Error::Vulkan(error) if is_absence(error) => no_vulkan(error),
        Error::Vulkan(
            error @ (VulkanError::Inexact { .. } | VulkanError::InexactKernel { .. }),
        ) => Failure::new(DEVICE, format!("{error} (--allow-inexact)")),
        _ => Failure::new(DEVICE, error.to_string()),
    }
}

/// Whether there is no Vulkan, rather than one that fails.
pub(crate) fn is_absence(error: &VulkanError) -> bool {
    match error {
        VulkanError::NoLoader { .. }
        | VulkanError::NoDevice
        | VulkanError::NoNvidiaDriver
        | VulkanError::SlowDriver { .. }
        | VulkanError::Driver { .. } => true,
        // So say loaders whose drivers do not work.
        VulkanError::Call { result, .. } => *result == vk::Result::ERROR_INITIALIZATION_FAILED,
        _ => false,
    }
}

/// Why the CPU was taken, in a few words.
fn short_reason(error: &Error) -> String {
    match error {
        Error::Vulkan(VulkanError::NoLoader { .. }) => "no Vulkan: no loader library".to_owned(),
        Error::Vulkan(VulkanError::NoDevice) => "no Vulkan: no driver".to_owned(),
        Error::Vulkan(error) if is_absence(error) => format!("no Vulkan: {error}"),
        _ => error.to_string(),
    }
}
