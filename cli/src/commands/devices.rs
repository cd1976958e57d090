//! `tumble devices`: the Vulkan devices of this machine, and whether they are exact.

use std::fmt::Write;

use clap::Args;
use serde::Serialize;
use tumble::vulkan::{DeviceInfo, KernelCheck, SelfTestReport, VulkanError};
use tumble::{Device, Engine, EngineOptions};

use tumble_formats::printable::printable;

use crate::drivers;
use crate::messages::exit::Failure;
use crate::messages::listing;
use crate::messages::words;

/// List the Vulkan devices and whether they give the CPU's bits
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Check every kernel on every device now; else each is checked when it is first needed
    #[arg(long)]
    check: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The list of devices, as printed and as JSON.
#[derive(Serialize)]
struct Listing {
    /// Why there is no Vulkan device.
    no_vulkan: Option<String>,
    devices: Vec<DeviceEntry>,
}

#[derive(Serialize)]
struct DeviceEntry {
    /// Its index for `--device`.
    index: usize,
    #[serde(flatten)]
    info: DeviceInfo,
    /// Whether the device opens, and every self-test and every checked kernel that it uses gives the CPU's bits.
    exact: bool,
    self_tests: Vec<SelfTestReport>,
    kernels: KernelSummary,
    /// Why it could not be opened.
    error: Option<String>,
}

/// The kernels of a device: how many there are, and the results of their checks.
#[derive(Default, Serialize)]
struct KernelSummary {
    /// The number of kernels that may run on the device.
    all: usize,
    /// The number of kernels that gave the CPU's bits on the device, now or in an earlier check.
    exact: usize,
    /// The kernels whose bits differ.
    differing: Vec<KernelCheck>,
}

impl KernelSummary {
    fn of(engine: &Engine, check: bool) -> Result<Self, tumble::Error> {
        let checks = match check {
            true => engine.check_kernels()?,
            false => engine.known_kernels(),
        };
        let is_exact =
            |check: &&KernelCheck| check.differing == 0 && (check.remembered || check.total > 0);
        Ok(Self {
            all: checks.len(),
            exact: checks.iter().filter(is_exact).count(),
            differing: checks
                .into_iter()
                .filter(|check| check.differing > 0)
                .collect(),
        })
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let listing = Listing::new(drivers::devices(), arguments.check);
    if arguments.json {
        listing::json(&listing)
    } else {
        listing::text(&listing.text())
    }
}

impl Listing {
    fn new(devices: Result<Vec<Device>, VulkanError>, check: bool) -> Self {
        let devices = match devices {
            Ok(devices) if devices.is_empty() => Err(VulkanError::NoDevice),
            result => result,
        };
        match devices {
            Err(error) => Self {
                no_vulkan: Some(error.to_string()),
                devices: Vec::new(),
            },
            Ok(devices) => {
                let entries = devices.into_iter().enumerate();
                let devices = entries
                    .filter_map(|(i, device)| DeviceEntry::new(i, device, check))
                    .collect();
                Self {
                    no_vulkan: None,
                    devices,
                }
            }
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for entry in &self.devices {
            entry.tell(&mut text);
        }
        if let Some(reason) = &self.no_vulkan {
            let _ = writeln!(
                text,
                "no Vulkan device: {reason}\n  the CPU gives the same bits (--device cpu); for \
                 Vulkan install the graphics card's driver,\n  or Mesa's software device (Debian \
                 and Ubuntu: libvulkan1 mesa-vulkan-drivers)"
            );
        }
        text
    }
}

impl DeviceEntry {
    /// Opens the device, exact or not.
    fn new(index: usize, device: Device, check: bool) -> Option<Self> {
        let Device::Vulkan(vulkan) = &device else {
            return None;
        };
        let info = vulkan.info().clone();
        let mut options = EngineOptions::default();
        options.allow_inexact = true;
        let opened = Engine::with_options(device, &options).and_then(|engine| {
            let kernels = KernelSummary::of(&engine, check)?;
            Ok((engine.self_tests().to_vec(), kernels))
        });
        let (self_tests, kernels, error) = match opened {
            Ok((self_tests, kernels)) => (self_tests, kernels, None),
            Err(error) => (
                Vec::new(),
                KernelSummary::default(),
                Some(error.to_string()),
            ),
        };
        let exact = error.is_none()
            && self_tests.iter().all(|check| check.differing == 0)
            && kernels.differing.iter().all(|check| check.replaced);
        Some(Self {
            index,
            info,
            exact,
            self_tests,
            kernels,
            error,
        })
    }

    fn tell(&self, text: &mut String) {
        let info = &self.info;
        let kind = serde_json::to_value(info.kind).unwrap_or_default();
        let [x, y, z] = info.max_compute_work_group_count;
        let _ = writeln!(text, "{}  {}", self.index, printable(&info.name));
        let _ = writeln!(text, "   kind        {}", kind.as_str().unwrap_or_default());
        let _ = writeln!(text, "   driver      {}", printable(&info.driver));
        let _ = writeln!(text, "   Vulkan      {}", info.api_version);
        let _ = writeln!(text, "   uuid        {}", info.uuid);
        let _ = writeln!(
            text,
            "   buffers     at most {} in a binding, at most {} in an allocation",
            words::bytes(info.max_storage_buffer_range as f64),
            words::bytes(info.max_memory_allocation_size as f64),
        );
        let _ = writeln!(
            text,
            "   workgroups  at most {} invocations, at most {x} × {y} × {z} in a dispatch",
            info.max_compute_work_group_invocations,
        );
        let _ = writeln!(
            text,
            "   memory      {}",
            words::bytes(info.device_local_memory as f64)
        );
        let _ = writeln!(text, "   same bits   {}", self.verdict());
    }

    fn verdict(&self) -> String {
        if let Some(error) = &self.error {
            return format!("unknown: it could not be opened: {}", printable(error));
        }
        let self_tests =
            (self.self_tests.iter()).map(|check| (check.name, check.differing, check.total));
        let (replaced, used): (Vec<_>, Vec<_>) =
            (self.kernels.differing.iter()).partition(|check| check.replaced);
        let kernels = (used.iter()).map(|check| (check.name, check.differing, check.total));
        let failed: Vec<String> = self_tests
            .chain(kernels)
            .filter(|(_, differing, _)| *differing > 0)
            .map(|(name, differing, total)| format!("{name} ({differing} of {total})"))
            .collect();
        if failed.is_empty() {
            let results: usize = self.self_tests.iter().map(|check| check.total).sum();
            let KernelSummary { all, exact, .. } = self.kernels;
            let kernels = match (exact == all, &replaced[..]) {
                (true, _) => format!("all {all} kernels are exact"),
                (false, [check, ..]) => format!(
                    "{exact} of {all} kernels are exact; {} differs ({} of {}), and others are used \
                     in its place",
                    check.name, check.differing, check.total
                ),
                (false, []) => format!(
                    "{exact} of {all} kernels are known to be exact, the others are checked when \
                     they are first needed, or by --check"
                ),
            };
            return format!(
                "yes: all {} self-tests pass ({results} results); {kernels}",
                self.self_tests.len()
            );
        }
        format!("NO: these differ: {}", failed.join(", "))
    }
}
