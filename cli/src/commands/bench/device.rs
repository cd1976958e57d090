//! The Vulkan devices of a run: their names, the engine's choices for them, and how fast they write into
//! their own memory, by their own clocks.

use std::fmt::Write;

use serde::Serialize;
use tumble::vulkan::DeviceKind;
use tumble::{Device, Engine};
use tumble_verify::lab::{EngineChoices, WriteRates};

/// An open device.
pub(crate) struct BenchDevice {
    pub(crate) engine: Engine,
    pub(crate) report: DeviceReport,
}

/// Its part of the report; also the form of the JSON.
#[derive(Clone, Serialize)]
pub(crate) struct DeviceReport {
    name: String,
    driver: String,
    /// As the driver counts its versions.
    driver_version: Option<u32>,
    uuid: String,
    choices: Option<EngineChoices>,
    /// Bytes a second into the device's own memory; `None` if it has no clock.
    write_rates: Option<WriteRates>,
}

impl BenchDevice {
    /// `None` for a device that cannot be opened: `tumble devices` says why.
    pub(crate) fn open(device: &Device) -> Option<Result<Self, tumble::Error>> {
        let engine = Engine::new(device.clone()).ok()?;
        Some(Self::measured(engine))
    }

    fn measured(engine: Engine) -> Result<Self, tumble::Error> {
        let write_rates = engine.write_rates()?;
        let info = engine.device_info();
        let report = DeviceReport {
            name: engine.device_name().to_owned(),
            driver: info.map_or_else(String::new, |info| info.driver.clone()),
            driver_version: engine
                .device_details()
                .map(|details| details.driver_version),
            uuid: info.map_or_else(String::new, |info| info.uuid.clone()),
            choices: engine.choices(),
            write_rates,
        };
        Ok(Self { engine, report })
    }

    /// Whether the device copies results to the host. If the caller does not pass memory that is used again, this is
    /// new memory each time.
    pub(crate) fn copies_results(&self) -> bool {
        let info = self.engine.device_info();
        info.is_some_and(|info| !matches!(info.kind, DeviceKind::Integrated | DeviceKind::Cpu))
    }

    /// The highest sustained speed in bytes per second; 0 if it is unknown.
    pub(crate) fn write_limit(&self) -> f64 {
        self.report.write_rates.map_or(0.0, |rates| rates.limit())
    }
}

impl DeviceReport {
    pub(crate) fn tell(&self, text: &mut String) {
        let Self { name, driver, .. } = self;
        let _ = write!(text, "{name}: {driver}");
        if let Some(version) = self.driver_version {
            let _ = write!(text, " (driver version {version:#x})");
        }
        let _ = writeln!(text);
        if let Some(choices) = &self.choices {
            let _ = writeln!(
                text,
                "  mapping {}, reads {}, transfer {}, read-back {}, uploads {}, {} windows in flight",
                choices.mapping,
                choices.reads,
                choices.transfer,
                choices.read_back,
                choices.uploads,
                choices.windows_in_flight
            );
        }
        let _ = match self.write_rates {
            Some(rates) => writeln!(
                text,
                "  writes into its own memory: {:.1} GB/s by a kernel, {:.1} GB/s by a fill (device clock)",
                rates.store / 1e9,
                rates.fill / 1e9
            ),
            None => writeln!(text, "  has no clock: what it takes alone is not measured"),
        };
    }
}
