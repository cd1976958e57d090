//! What was measured, as a table and as JSON.

use std::fmt::Write;
use std::time::Duration;

use serde::Serialize;
use tumble::{Method, VectorWidth};

use crate::commands::bench::workload::Kind;
use crate::messages::words;

/// A whole run; also the form of the JSON.
#[derive(Serialize)]
pub(crate) struct Report {
    version: &'static str,
    threads: usize,
    /// Vector instructions of the CPU, the widest of which is used.
    vector_widths: Vec<String>,
    rounds: u32,
    sections: Vec<Section>,
}

/// One workload and method.
#[derive(Serialize)]
pub(crate) struct Section {
    workload: Kind,
    method: &'static str,
    rotations: usize,
    /// The most memory that the process has had so far, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_memory_bytes: Option<u64>,
    rows: Vec<Row>,
}

/// One contestant. Times are medians.
#[derive(Serialize)]
pub(crate) struct Row {
    name: String,
    pub(crate) milliseconds: f64,
    million_rotations_per_second: f64,
    nanoseconds_per_rotation: f64,
    /// 1 is as fast as memory can be written.
    share_of_write_rate: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio_to_naive: Option<f64>,
    /// Where the time went, milliseconds.
    parts: Vec<(&'static str, f64)>,
}

impl Report {
    pub(crate) fn new(rounds: u32, sections: Vec<Section>) -> Self {
        let widths = VectorWidth::available();
        Self {
            version: env!("CARGO_PKG_VERSION"),
            threads: rayon::current_num_threads(),
            vector_widths: widths.iter().map(|width| format!("{width:?}")).collect(),
            rounds,
            sections,
        }
    }

    pub(crate) fn text(&self) -> String {
        let mut text = format!(
            "tumble {}, {} threads, {}; medians of {}, measured in turns\n",
            self.version,
            self.threads,
            self.vector_widths.join(", "),
            self.rounds
        );
        for section in &self.sections {
            section.tell(&mut text);
        }
        text
    }
}

impl Section {
    /// `rows`: the write rate first, then the naive peer where there is one.
    pub(crate) fn new(
        workload: Kind,
        method: Method,
        rotations: usize,
        mut rows: Vec<Row>,
    ) -> Self {
        let write = rows[0].milliseconds;
        let naive = (workload != Kind::Stream).then_some(rows[1].milliseconds);
        for row in &mut rows {
            row.million_rotations_per_second = rotations as f64 / row.milliseconds / 1e3;
            row.nanoseconds_per_rotation = row.milliseconds * 1e6 / rotations as f64;
            row.share_of_write_rate = write / row.milliseconds;
            row.ratio_to_naive = naive.map(|naive| naive / row.milliseconds);
        }
        Self {
            workload,
            method: method.name,
            rotations,
            peak_memory_bytes: (workload == Kind::Stream).then(peak_memory).flatten(),
            rows,
        }
    }

    fn tell(&self, text: &mut String) {
        let workload = format!("{:?}", self.workload).to_lowercase();
        let (method, rotations) = (self.method, self.rotations);
        let width = self.rows.iter().map(|row| row.name.chars().count()).max();
        let width = width.unwrap_or(0);
        let _ = writeln!(
            text,
            "\n\x1b[1m{workload}, {method}\x1b[0m: {rotations} rotations\n\
             {:width$}  {:>10}  {:>8}  {:>8}  {:>7}  {:>7}",
            "", "ms", "M/s", "ns each", "writing", "naive"
        );
        for row in &self.rows {
            let _ = writeln!(
                text,
                "{:width$}  {:>10.3}  {:>8.1}  {:>8.2}  {:>6.2}x  {:>7}",
                row.name,
                row.milliseconds,
                row.million_rotations_per_second,
                row.nanoseconds_per_rotation,
                row.share_of_write_rate,
                row.ratio_to_naive
                    .map_or(String::new(), |ratio| format!("{ratio:.2}x"))
            );
            for (name, milliseconds) in &row.parts {
                let _ = writeln!(text, "{:width$}  {milliseconds:>10.3}", format!("  {name}"));
            }
        }
        if let Some(bytes) = self.peak_memory_bytes {
            let bytes = words::bytes(bytes as f64);
            let _ = writeln!(text, "the process has had {bytes} of memory at most");
        }
    }
}

/// What Linux says of this process; unknown elsewhere.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mut lines = status.lines();
    let kibibytes = lines.find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = kibibytes.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

impl Row {
    pub(crate) fn new(name: String, time: Duration, parts: Vec<(&'static str, Duration)>) -> Self {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        Self {
            name,
            milliseconds: milliseconds(time),
            million_rotations_per_second: 0.0,
            nanoseconds_per_rotation: 0.0,
            share_of_write_rate: 0.0,
            ratio_to_naive: None,
            parts: parts
                .into_iter()
                .map(|(name, time)| (name, milliseconds(time)))
                .collect(),
        }
    }
}
