//! `--device`: which device evaluates, found among those that `tumble devices` lists, and the error when it is
//! not there.

use std::convert::Infallible;
use std::str::FromStr;

use ash::vk;
use clap::Args;
use glam::Quat;
use tumble::vulkan::VulkanError;
use tumble::{
    CacheFiles, Device, Engine, EngineOptions, Error, Interpolation, Layout, PerTrack, SampleTimes,
    TrackSet,
};

use crate::batch::target::{ChunkSink, ResultError};
use crate::drivers;
use crate::messages::exit::{DEVICE, Failure};
use crate::messages::words;

/// The number of rotations that are evaluated at once: 16 MB.
const CHUNK: usize = 1 << 20;

/// The number of values of a chunk of a result: at least a row.
pub(crate) fn stream_chunk(layout: Layout, tracks: usize) -> usize {
    match layout {
        Layout::TrackMajor => CHUNK,
        Layout::FrameMajor => CHUNK.max(tracks),
    }
}

#[derive(Debug, Clone, Args)]
pub(crate) struct DeviceArguments {
    /// The device: auto (the CPU for fewer than 2^20 rotations, else the CPU or a graphics card, whichever is
    /// faster in a short measurement), first (the first Vulkan device that gives the CPU's bits, else the CPU),
    /// cpu, vulkan or gpu (the first Vulkan device that gives the CPU's bits, which may be a software driver), or a
    /// device by its index, part of its name or uuid:UUID (`tumble devices`). All give the same bits
    #[arg(long, value_name = "DEVICE", default_value = "auto")]
    device: DeviceChoice,
    /// Use the device that --device names although its self-tests fail: its bits may differ from
    /// the CPU's
    #[arg(long)]
    allow_inexact: bool,
    /// The memory of a Vulkan device that may be used in addition to the results, such as 256MiB
    #[arg(long, value_name = "SIZE", value_parser = words::parse_bytes)]
    memory: Option<u64>,
    /// Threads of the CPU, for front ends that leave the choice.
    #[arg(skip)]
    threads: Option<usize>,
    /// Where kernels are kept, for front ends that leave the choice.
    #[arg(skip)]
    cache_files: CacheFiles,
}

#[derive(Debug, Clone, PartialEq)]
enum DeviceChoice {
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

impl FromStr for DeviceChoice {
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
pub(crate) struct OpenedDevice {
    pub(crate) engine: Engine,
    pub(crate) label: String,
    /// Whether the device was chosen automatically: the CPU, which gives the same bits, may then replace it.
    automatic: bool,
    /// Each job goes to the device that is fastest for it.
    by_cost: Option<ByCost>,
}

/// The CPU evaluates fewer rotations than this before another device has opened. The rule is that of [`Engine::auto`];
/// it is repeated here so that small jobs load no driver.
const MIN_GPU_ROTATIONS: usize = 1 << 20;

/// Chooses the device of each job by its size.
struct ByCost {
    cpu: Engine,
    /// The engine for large jobs, which is opened when the first large job comes.
    large: Option<Engine>,
    options: EngineOptions,
}

impl ByCost {
    fn engine(&mut self, rotations: usize) -> Result<Engine, Error> {
        if rotations < MIN_GPU_ROTATIONS {
            return Ok(self.cpu.clone());
        }
        if self.large.is_none() {
            self.large = Some(self.fastest()?);
        }
        Ok(self.large.as_ref().unwrap_or(&self.cpu).clone())
    }

    /// The fastest device for large jobs, with the options.
    fn fastest(&self) -> Result<Engine, Error> {
        if drivers::drivers().is_err() {
            return Ok(self.cpu.clone());
        }
        let found = Engine::auto()?;
        let Some(info) = found.device_info() else {
            return Ok(self.cpu.clone());
        };
        if self.options.memory.is_none() {
            return Ok(found);
        }
        let mut all = drivers::devices()?.into_iter();
        let same = all.find(|device| device.name() == info.name);
        same.map_or(Ok(found.clone()), |device| {
            Engine::with_options(device, &self.options)
        })
    }
}

impl DeviceArguments {
    /// The device of that name, as in `--device`.
    pub(crate) fn of(name: &str, options: &EngineOptions) -> Self {
        let Ok(device) = name.parse();
        Self {
            device,
            allow_inexact: options.allow_inexact,
            memory: options.memory,
            threads: options.thread_count,
            cache_files: options.cache_files.clone(),
        }
    }

    /// Sets the number of threads of the CPU.
    pub(crate) fn set_threads(&mut self, threads: Option<usize>) {
        self.threads = threads;
    }

    /// Opens the device of a command line; refuses options for a device that is not used.
    pub(crate) fn open(&self) -> Result<OpenedDevice, Failure> {
        if self.device == DeviceChoice::Cpu && self.memory.is_some() {
            let message =
                "--memory limits the memory of a Vulkan device; leave it out with --device cpu";
            return Err(Failure::usage(message));
        }
        if self.allow_inexact && matches!(self.device, DeviceChoice::Cpu | DeviceChoice::Auto) {
            return Err(Failure::usage(
                "--allow-inexact needs a Vulkan device: add --device vulkan, or a name (`tumble devices`)",
            ));
        }
        self.open_any()
    }

    /// Whether `--device cpu` is set.
    pub(crate) fn is_cpu(&self) -> bool {
        self.device == DeviceChoice::Cpu
    }

    /// Opens the device without checking the other options.
    pub(crate) fn open_any(&self) -> Result<OpenedDevice, Failure> {
        match &self.device {
            DeviceChoice::Cpu => self.cpu("CPU".to_owned()),
            DeviceChoice::Auto => {
                let opened = self.cpu("CPU".to_owned())?;
                let by_cost = ByCost {
                    cpu: opened.engine.clone(),
                    large: None,
                    options: self.options(),
                };
                Ok(OpenedDevice {
                    by_cost: Some(by_cost),
                    ..opened
                })
            }
            DeviceChoice::First => match self.first_exact() {
                Ok(engine) => Ok(OpenedDevice {
                    automatic: true,
                    ..OpenedDevice::new(engine)
                }),
                Err(error) => self.cpu(format!("CPU ({})", short_reason(&error))),
            },
            DeviceChoice::Vulkan => self
                .first_exact()
                .map(OpenedDevice::new)
                .map_err(|e| refused(&e)),
            DeviceChoice::Named(name) => {
                let devices = drivers::devices().map_err(|error| refused(&error.into()))?;
                let device = named(name, &devices)?;
                self.engine(device)
                    .map(OpenedDevice::new)
                    .map_err(|error| refused(&error))
            }
        }
    }

    fn options(&self) -> EngineOptions {
        let mut options = EngineOptions::default();
        options.memory = self.memory;
        options.allow_inexact = self.allow_inexact;
        options.thread_count = self.threads;
        options.cache_files = self.cache_files.clone();
        options
    }

    fn engine(&self, device: Device) -> Result<Engine, Error> {
        Engine::with_options(device, &self.options())
    }

    fn cpu(&self, label: String) -> Result<OpenedDevice, Failure> {
        let engine = self.engine(Device::Cpu).map_err(|error| refused(&error))?;
        Ok(OpenedDevice {
            engine,
            label,
            automatic: false,
            by_cost: None,
        })
    }

    /// The first device that opens and is exact; otherwise the reason why the first one is not
    /// used.
    fn first_exact(&self) -> Result<Engine, Error> {
        let mut reason = Error::Vulkan(VulkanError::NoDevice);
        for (index, device) in drivers::devices()?.into_iter().enumerate() {
            match self.engine(device) {
                Ok(engine) => return Ok(engine),
                Err(error) if index == 0 => reason = error,
                Err(_) => {}
            }
        }
        Err(reason)
    }
}

impl OpenedDevice {
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

    /// Chooses the device for a job of `rotations`, if the device depends on the size of the job.
    pub(crate) fn choose(&mut self, rotations: usize) -> Result<(), Error> {
        if let Some(by_cost) = &mut self.by_cost {
            self.engine = by_cost.engine(rotations)?;
            self.label = self.engine.device_name().to_owned();
            self.automatic = self.is_vulkan();
        }
        Ok(())
    }

    /// Evaluates into `sink`, chunk by chunk. If a device that was chosen automatically fails, the CPU,
    /// which gives the same bits, continues where it stopped.
    pub(crate) fn stream(
        &mut self,
        set: &TrackSet,
        interpolations: &PerTrack<Interpolation>,
        frames: &SampleTimes,
        layout: Layout,
        sink: &mut ChunkSink<'_>,
    ) -> Result<(), ResultError> {
        let timeline = frames.resolve(set.track_count(), set.time_span());
        let samples = timeline.map_err(Error::from)?.len();
        self.choose(set.track_count() * samples)?;
        let chunk = stream_chunk(layout, set.track_count());
        let mut done = 0;
        let result = self
            .engine
            .request(set, interpolations.clone(), frames)
            .layout(layout)
            .stream(chunk, |chunk| {
                done = chunk.start + chunk.rows.len();
                sink(chunk)
            });
        match result {
            Err(ResultError::Evaluating(Error::Vulkan(error))) if self.automatic => {
                self.fall_back(&error)?;
                self.engine
                    .request(set, interpolations.clone(), frames)
                    .layout(layout)
                    .stream(chunk, |chunk| {
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

    /// Does some work on the device. If a device that was chosen automatically fails, the CPU does it.
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

    /// Uses the CPU from now on.
    fn fall_back(&mut self, error: &VulkanError) -> Result<(), Error> {
        words::warning(&format!("{}: {error}; going on with the CPU", self.label));
        self.engine = Engine::new(Device::Cpu)?;
        self.label = format!("CPU ({} failed)", self.label);
        self.automatic = false;
        self.by_cost = None;
        Ok(())
    }

    /// As [`OpenedDevice::stream`], into one vector.
    pub(crate) fn collect(
        &mut self,
        set: &TrackSet,
        interpolation: Interpolation,
        frames: &SampleTimes,
        layout: Layout,
    ) -> Result<Vec<Quat>, Error> {
        let mut rotations = Vec::new();
        let collected = self.stream(set, &interpolation.into(), frames, layout, &mut |chunk| {
            rotations.extend_from_slice(chunk.rotations().unwrap_or_default());
            Ok(())
        });
        match collected {
            Ok(()) | Err(ResultError::Writing(_)) => Ok(rotations), // nothing was written
            Err(ResultError::Evaluating(error)) => Err(error),
        }
    }
}

/// The Vulkan device of that name, as in `--device`, not opened; the first one without a name.
/// `None` for the CPU.
pub(crate) fn vulkan_device(name: Option<&str>) -> Result<Option<Device>, Failure> {
    let choice = name.map_or(DeviceChoice::First, |name| {
        let Ok(choice) = name.parse();
        choice
    });
    let devices = || drivers::devices().map_err(|error| refused(&error.into()));
    match choice {
        DeviceChoice::Cpu => Ok(None),
        DeviceChoice::First | DeviceChoice::Auto | DeviceChoice::Vulkan => {
            let first = devices()?.into_iter().next();
            first
                .map(Some)
                .ok_or_else(|| Failure::no_vulkan(&VulkanError::NoDevice))
        }
        DeviceChoice::Named(name) => named(&name, &devices()?).map(Some),
    }
}

/// The failure of a device that the command line names and that cannot be opened.
pub(crate) fn refused(error: &Error) -> Failure {
    match error {
        Error::Vulkan(error) if is_absence(error) => Failure::no_vulkan(error),
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
        // The Vulkan loader returns this if no driver works.
        VulkanError::Call { result, .. } => *result == vk::Result::ERROR_INITIALIZATION_FAILED,
        _ => false,
    }
}

/// Why the CPU is used, in a few words.
fn short_reason(error: &Error) -> String {
    match error {
        Error::Vulkan(VulkanError::NoLoader { .. }) => "no Vulkan: no loader library".to_owned(),
        Error::Vulkan(VulkanError::NoDevice) => "no Vulkan: no driver".to_owned(),
        Error::Vulkan(error) if is_absence(error) => format!("no Vulkan: {error}"),
        _ => error.to_string(),
    }
}

/// The device with this index, or this name, or a name that contains the text (a card's name may be a
/// number). After `uuid:` is the UUID that Vulkan reports, by which other programs know the card.
fn named(requested: &str, devices: &[Device]) -> Result<Device, Failure> {
    if devices.is_empty() {
        return Err(Failure::no_vulkan(&VulkanError::NoDevice));
    }
    let part = requested.to_lowercase();
    if let Some(uuid) = part.strip_prefix("uuid:") {
        return by_uuid(requested, uuid, devices);
    }
    if let Some(device) = requested
        .parse()
        .ok()
        .and_then(|index: usize| devices.get(index))
    {
        return Ok(device.clone());
    }
    let matching = |matches: &dyn Fn(&str) -> bool| -> Vec<&Device> {
        devices
            .iter()
            .filter(|device| matches(&device.name().to_lowercase()))
            .collect()
    };
    let whole = matching(&|name| name == part);
    let found = if whole.is_empty() {
        matching(&|name| name.contains(&part))
    } else {
        whole
    };
    let list = listing(devices);
    match *found {
        [one] => Ok(one.clone()),
        [] => {
            let known = devices
                .iter()
                .map(Device::name)
                .chain(["auto", "first", "cpu", "vulkan"]);
            let hint = words::nearest(requested, known)
                .map(|near| format!("; did you mean `{near}`?"))
                .unwrap_or_default();
            let message = format!("there is no device `{requested}`{hint}");
            Err(Failure::usage(message).with_lines(list))
        }
        _ => Err(Failure::usage(format!(
            "`{requested}` could be several devices; give more of the name, or the index"
        ))
        .with_lines(list)),
    }
}

/// The device of a UUID, with or without its dashes and NVIDIA's `GPU-` before it.
fn by_uuid(requested: &str, uuid: &str, devices: &[Device]) -> Result<Device, Failure> {
    let digits = |text: &str| text.replace('-', "");
    let requested_digits = digits(uuid.strip_prefix("gpu-").unwrap_or(uuid));
    let has_uuid = |device: &&Device| {
        device
            .uuid()
            .is_some_and(|known| digits(&known) == requested_digits)
    };
    match devices.iter().find(has_uuid) {
        Some(device) => Ok(device.clone()),
        None => {
            let lines = devices.iter().map(|device| {
                let uuid = device.uuid().unwrap_or_default();
                format!("  uuid:{uuid}  {}", device.name())
            });
            let message = format!("there is no device `{requested}`; there are");
            Err(Failure::usage(message).with_lines(lines))
        }
    }
}

fn listing(devices: &[Device]) -> Vec<String> {
    let lines = devices.iter().enumerate();
    let lines = lines.map(|(index, device)| format!("  {index}  {}", device.name()));
    std::iter::once(
        "  names: auto, first, cpu, vulkan (or gpu); devices by index or name:".to_owned(),
    )
    .chain(lines)
    .collect()
}
