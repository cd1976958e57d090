//! Measurements within the engine, with its private parts: the variants of kernels that `tumble lab` compares, results
//! that stay on a device, and reports of a device and of the engine's choices for it. The crate `tumble-verify` names
//! them for users.
//!
//! The lab ([`lab`]) measures other variants of the engine's kernels on a card. A card is available seldom and for
//! minutes, so the rules by which the lab decides were written before (`rules.rs`). Every variant of a kernel
//! ([`KernelVariant`]) is first compared with the kernel's twin; one that differs is rejected. Then the lab measures
//! the limits that no kernel can exceed, and rows of dispatches of the variants.

mod bench;
mod resident;
mod rules;
mod variant;

use std::time::Duration;

use crate::engine::Engine;
use crate::error::Error;
pub use crate::gpu::engine::figures::{EngineChoices, WriteRates};
use crate::gpu::instance::loader;
pub use crate::gpu::physical::details::{
    DeviceDetails, FloatControlsReport, Limits, MemoryHeap, MemoryType, QueueFamily,
};
pub use crate::lab::resident::{Resident, ResidentTime};
pub use crate::lab::rules::Timed;
pub use crate::lab::variant::{HalfConversion, KernelVariant, RunList, StoreCaching};
use crate::machine::error::VulkanError;
use crate::machine::options::RunLanes;

/// How much the lab does.
#[derive(Debug, Clone, Copy)]
pub struct LabOptions {
    /// Compare bits only: nothing is timed.
    pub bits_only: bool,
    /// The time for measurements; what is left then is not measured.
    pub budget: Duration,
}

/// The comparisons and measurements of a lab.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LabReport {
    /// The number of variants that were compared with the twins of their kernels.
    pub variants_compared: usize,
    /// The number of words that were compared.
    pub words_compared: u64,
    /// The variants whose words differ; they are not measured.
    pub rejected: Vec<RejectedVariant>,
    /// The samples of each measured dispatch.
    pub samples: u32,
    /// The dispatches of a row, which are timed together; 0 if nothing was timed.
    pub row: u32,
    /// Rates that no kernel exceeds. Empty if nothing was timed.
    pub ceilings: Vec<Ceiling>,
    /// Each kernel over runs of each length.
    pub rows: Vec<LabRow>,
    /// The decisions that follow from the times.
    pub decisions: Vec<Decision>,
    /// The lanes of runs of each class that follow; `None` if nothing was timed.
    pub run_lanes: Option<RunLanes>,
    /// Whether everything was measured in the time.
    pub is_complete: bool,
}

/// A variant whose words differ from those of the twin.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RejectedVariant {
    /// The kernel's name.
    pub kernel: &'static str,
    /// The variant.
    pub variant: KernelVariant,
    /// The number of compared words.
    pub words: u64,
    /// The number of words that differ.
    pub differing: u64,
}

/// A time that no kernel can go below.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Ceiling {
    /// The work that was timed: one of a row.
    pub name: &'static str,
    /// The time of one, measured twice.
    #[serde(flatten)]
    pub time: Timed,
    /// The bytes that one writes; `None` if it writes nothing.
    pub bytes: Option<u64>,
}

/// A kernel over runs of one length.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LabRow {
    /// The kernel's name.
    pub kernel: &'static str,
    /// The samples of a run.
    pub run: u32,
    /// Whether each run begins with a key.
    pub has_keys: bool,
    /// Whether the result is frame by frame, not track by track.
    pub by_frames: bool,
    /// The bytes that one dispatch writes.
    pub bytes: u64,
    /// The engine's variant.
    pub today: VariantTime,
    /// The best variant by the rules; the engine's unless another beats it.
    pub winner: VariantTime,
    /// The time of filling as many bytes, as a share of the winner's.
    pub share_of_filling: f64,
    /// The variants that were left at the end.
    pub finalists: Vec<VariantTime>,
}

/// The time of a variant.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct VariantTime {
    /// The variant.
    pub variant: KernelVariant,
    /// The time of one dispatch of a row, measured twice.
    #[serde(flatten)]
    pub time: Timed,
}

/// A rule, and what follows from it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Decision {
    /// The rule.
    pub rule: &'static str,
    /// The times that it looks at, in microseconds.
    pub microseconds: Vec<f64>,
    /// Whether it applies.
    pub applies: bool,
    /// The decision, in words.
    pub result: String,
}

/// The functions of the Vulkan loader, found as the engine finds it: also where Homebrew installs it.
///
/// # Errors
/// When there is no loader.
pub fn load_vulkan() -> Result<ash::Entry, VulkanError> {
    loader()
}

/// Compares all variants of the kernels over spread runs with their twins, and measures them. `None` on the CPU. Without
/// a clock on the device, nothing is timed.
///
/// # Errors
/// When the device fails, or has no memory for the test.
pub fn lab(engine: &Engine, options: &LabOptions) -> Result<Option<LabReport>, Error> {
    let Some(opened) = engine.opened() else {
        return Ok(None);
    };
    Ok(Some(bench::run(&opened.engine(), options)?))
}
