//! `tumble devices`: what Vulkan offers here, and whether it is exact.

use std::fmt::Write;

use clap::Args;
use serde::Serialize;
use tumble::{Device, DeviceInfo, Engine, EngineOptions, SelfTestReport, VulkanError};

use tumble_formats::printable::printable;

use crate::commands::probe;
use crate::messages::exit::Failure;
use crate::messages::words;

/// List the Vulkan devices and whether they give the CPU's bits
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What is listed; also the form of the JSON.
#[derive(Serialize)]
struct Listing {
    /// Why there is no Vulkan device.
    no_vulkan: Option<String>,
    devices: Vec<Entry>,
}

#[derive(Serialize)]
struct Entry {
    /// What `--device` takes.
    index: usize,
    #[serde(flatten)]
    info: DeviceInfo,
    /// It opens, and no self-test differs.
    exact: bool,
    self_tests: Vec<SelfTestReport>,
    /// Why it could not be opened.
    error: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let listing = Listing::new(probe::devices());
    if arguments.json {
        words::json(&listing)
    } else {
        words::listing(&listing.text())
    }
}

impl Listing {
    fn new(devices: Result<Vec<Device>, VulkanError>) -> Self {
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
                    .filter_map(|(i, device)| Entry::new(i, device))
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

impl Entry {
    /// Opens the device, exact or not.
    fn new(index: usize, device: Device) -> Option<Self> {
        let Device::Vulkan(vulkan) = &device else {
            return None;
        };
        let info = vulkan.info().clone();
        let mut options = EngineOptions::default();
        options.allow_inexact = true;
        let (self_tests, error) = match Engine::with_options(device, &options) {
            Ok(engine) => (engine.self_tests().to_vec(), None),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        let exact = error.is_none() && self_tests.iter().all(|check| check.differing == 0);
        Some(Self {
            index,
            info,
            exact,
            self_tests,
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
            "   buffers     {} visible of one, {} in one allocation",
            words::bytes(info.max_storage_buffer_range as f64),
            words::bytes(info.max_memory_allocation_size as f64),
        );
        let _ = writeln!(
            text,
            "   workgroups  {} invocations in one, {x} × {y} × {z} in a dispatch",
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
        let failed: Vec<String> = self
            .self_tests
            .iter()
            .filter(|check| check.differing > 0)
            .map(|c| format!("{} ({} of {})", c.name, c.differing, c.total))
            .collect();
        if failed.is_empty() {
            let results: usize = self.self_tests.iter().map(|check| check.total).sum();
            return format!(
                "yes: all {} self-tests pass ({results} results)",
                self.self_tests.len()
            );
        }
        format!("NO: these self-tests differ: {}", failed.join(", "))
    }
}
