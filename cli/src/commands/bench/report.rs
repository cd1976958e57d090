//! The measurements, as a table and as JSON.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Duration;

use serde::Serialize;
use tumble::{Method, VectorWidth};

use crate::commands::bench::device::DeviceReport;
use crate::commands::bench::workload::WorkloadKind;
use crate::messages::words;

/// A whole run; also the form of the JSON.
#[derive(Serialize)]
pub(crate) struct BenchReport {
    version: &'static str,
    threads: usize,
    /// Vector instructions of the CPU, the widest of which is used.
    vector_widths: Vec<String>,
    rounds: u32,
    devices: Vec<DeviceReport>,
    sections: Vec<Section>,
}

/// One workload and method.
#[derive(Serialize)]
pub(crate) struct Section {
    workload: WorkloadKind,
    method: String,
    rotations: usize,
    /// The size of the files, if files are read.
    #[serde(skip_serializing_if = "Option::is_none")]
    file_bytes: Option<u64>,
    /// The most memory that the process has had so far, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_memory_bytes: Option<u64>,
    #[serde(skip)]
    ratios: &'static [Ratio],
    rows: Vec<BenchRow>,
}

/// A ratio's name in JSON, and its heading in the table.
type Ratio = (&'static str, &'static str);

/// Ratios to the first row of a section and to its second.
const WRITING: [Ratio; 2] = [
    ("share_of_write_rate", "writing"),
    ("ratio_to_naive", "naive"),
];
const LOOPS: [Ratio; 1] = [("ratio_to_naive", "naive")];
const COPYING: [Ratio; 1] = [("share_of_copying_rate", "copying")];
const READING: [Ratio; 2] = [
    ("share_of_bytes_rate", "bytes"),
    ("share_of_reading_rate", "reading"),
];

/// One contestant. Times are medians.
#[derive(Serialize)]
pub(crate) struct BenchRow {
    name: String,
    pub(crate) milliseconds: f64,
    million_rotations_per_second: f64,
    nanoseconds_per_rotation: f64,
    /// Its speed relative to those that the section names.
    #[serde(flatten)]
    ratios: BTreeMap<&'static str, f64>,
    /// For a result that stays on a device: the speed of writing it, relative to the largest speed of the device.
    #[serde(skip_serializing_if = "Option::is_none")]
    share_of_device_write_rate: Option<f64>,
    /// Where the time went, milliseconds.
    parts: Vec<(&'static str, f64)>,
}

impl BenchReport {
    pub(crate) fn new(rounds: u32, devices: Vec<DeviceReport>, sections: Vec<Section>) -> Self {
        let widths = VectorWidth::available();
        Self {
            version: env!("CARGO_PKG_VERSION"),
            threads: rayon::current_num_threads(),
            vector_widths: widths.iter().map(|width| width.name().to_owned()).collect(),
            rounds,
            devices,
            sections,
        }
    }

    pub(crate) fn text(&self) -> String {
        let mut text = format!(
            "tumble {}, {} threads, {}; medians of {}, measured alternately\n",
            self.version,
            self.threads,
            self.vector_widths.join(", "),
            self.rounds
        );
        for device in &self.devices {
            device.tell(&mut text);
        }
        for section in &self.sections {
            section.tell(&mut text);
        }
        text
    }
}

impl Section {
    /// `rows`: the write rate first, then the naive peer if there is one.
    pub(crate) fn new(
        workload: WorkloadKind,
        method: Method,
        rotations: usize,
        rows: Vec<BenchRow>,
    ) -> Self {
        let ratios = match workload {
            WorkloadKind::Stream => &WRITING[..1],
            _ => &WRITING,
        };
        Self {
            peak_memory_bytes: (workload == WorkloadKind::Stream)
                .then(peak_memory)
                .flatten(),
            ..Self::with(workload, method.name, rotations, rows, ratios)
        }
    }

    /// `rows`: reading the bytes first, then reading the clips.
    pub(crate) fn of_files(
        format: &'static str,
        rotations: usize,
        file_bytes: u64,
        rows: Vec<BenchRow>,
    ) -> Self {
        Self {
            file_bytes: Some(file_bytes),
            peak_memory_bytes: peak_memory(),
            ..Self::with(WorkloadKind::Files, format, rotations, rows, &READING)
        }
    }

    /// `rows`: the naive peer first.
    pub(crate) fn of_poses(
        method: Method,
        tracks: usize,
        rotations: usize,
        rows: Vec<BenchRow>,
    ) -> Self {
        let label = format!("{method}, {tracks} tracks a call");
        Self::with(WorkloadKind::Poses, label, rotations, rows, &LOOPS)
    }

    /// `rows`: the naive peer first.
    pub(crate) fn of_characters(output: &str, rotations: usize, rows: Vec<BenchRow>) -> Self {
        let label = format!("slerp, {output}");
        Self::with(WorkloadKind::Characters, label, rotations, rows, &LOOPS)
    }

    /// `rows`: copying first.
    pub(crate) fn of_smoothing(kernel: String, samples: usize, rows: Vec<BenchRow>) -> Self {
        Self::with(WorkloadKind::Smooth, kernel, samples, rows, &COPYING)
    }

    fn with(
        workload: WorkloadKind,
        method: impl Into<String>,
        rotations: usize,
        mut rows: Vec<BenchRow>,
        ratios: &'static [Ratio],
    ) -> Self {
        let firsts: Vec<f64> = rows.iter().take(2).map(|row| row.milliseconds).collect();
        for row in &mut rows {
            row.million_rotations_per_second = rotations as f64 / row.milliseconds / 1e3;
            row.nanoseconds_per_rotation = row.milliseconds * 1e6 / rotations as f64;
            let ratio = |(&(name, _), first): (&Ratio, &f64)| (name, first / row.milliseconds);
            row.ratios = ratios.iter().zip(&firsts).map(ratio).collect();
        }
        Self {
            workload,
            method: method.into(),
            rotations,
            file_bytes: None,
            peak_memory_bytes: None,
            ratios,
            rows,
        }
    }

    fn tell(&self, text: &mut String) {
        let workload = format!("{:?}", self.workload).to_lowercase();
        let (method, rotations) = (&self.method, self.rotations);
        let width = self.rows.iter().map(|row| row.name.chars().count()).max();
        let width = width.unwrap_or(0);
        let _ = write!(
            text,
            "\n\x1b[1m{workload}, {method}\x1b[0m: {rotations} rotations\n\
             {:width$}  {:>10}  {:>8}  {:>8}",
            "", "ms", "M/s", "ns each"
        );
        for (_, heading) in self.ratios {
            let _ = write!(text, "  {heading:>7}");
        }
        let _ = writeln!(text);
        for row in &self.rows {
            let _ = write!(
                text,
                "{:width$}  {:>10.3}  {:>8.1}  {:>8.2}",
                row.name,
                row.milliseconds,
                row.million_rotations_per_second,
                row.nanoseconds_per_rotation,
            );
            for (name, _) in self.ratios {
                let _ = write!(text, "  {:>6.2}x", row.ratios[name]);
            }
            let _ = writeln!(text);
            if let Some(share) = row.share_of_device_write_rate {
                let label = "  share of the device's write rate";
                let _ = writeln!(text, "{label:width$}  {share:>10.3}");
            }
            for (name, milliseconds) in &row.parts {
                let _ = writeln!(text, "{:width$}  {milliseconds:>10.3}", format!("  {name}"));
            }
        }
        if let Some(bytes) = self.file_bytes {
            let bytes = words::bytes(bytes as f64);
            let _ = writeln!(text, "the files have {bytes}");
        }
        if let Some(bytes) = self.peak_memory_bytes {
            let bytes = words::bytes(bytes as f64);
            let _ = writeln!(text, "the process has had {bytes} of memory at most");
        }
    }
}

/// The most memory that this process has had, bytes; `None` on other systems than Linux.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mut lines = status.lines();
    let kibibytes = lines.find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = kibibytes.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

impl BenchRow {
    /// Sets the share of the device's bandwidth. `on_device`: the bytes written, and the bytes per second it can write.
    pub(crate) fn share_of_device(&mut self, on_device: Option<(u64, f64)>) {
        let known = on_device.filter(|&(_, limit)| limit > 0.0 && self.milliseconds > 0.0);
        self.share_of_device_write_rate =
            known.map(|(bytes, limit)| bytes as f64 / (self.milliseconds / 1e3) / limit);
    }

    pub(crate) fn new(name: String, time: Duration, parts: Vec<(&'static str, Duration)>) -> Self {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        Self {
            name,
            milliseconds: milliseconds(time),
            million_rotations_per_second: 0.0,
            nanoseconds_per_rotation: 0.0,
            ratios: BTreeMap::new(),
            share_of_device_write_rate: None,
            parts: parts
                .into_iter()
                .map(|(name, time)| (name, milliseconds(time)))
                .collect(),
        }
    }
}
