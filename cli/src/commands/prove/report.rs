//! The results of a run, and the verdict. Also the form of the JSON, which `docs/proof.schema.json` describes.

use std::io::Write as _;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use tumble::vulkan::tuning::RunLanes;
use tumble::vulkan::{DeviceInfo, SelfTestReport};
use tumble_verify::figures::Figures;
use tumble_verify::lab::{DeviceDetails, EngineChoices};
use tumble_verify::random::RandomRound;
use tumble_verify::renderer::{RendererCheck, RendererReport};

use crate::messages::exit::{ALL_INPUTS, Failure};

/// The value of `format` in the JSON.
pub(crate) const FORMAT: &str = "tumble-proof";

/// The form of the JSON; another number where names or meanings change.
pub(crate) const FORMAT_VERSION: u64 = 1;

/// Differences that are described; all are counted.
pub(crate) const MAX_DESCRIBED: usize = 20;

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    /// Everything ran, and no bit differs.
    Proved,
    /// Bits differ.
    BitsDiffer,
    /// No bit differs in the comparisons that were made, but some were not made.
    NotProved,
}

/// A whole run.
#[derive(Debug, Serialize)]
pub(crate) struct Proof {
    pub(crate) format: &'static str,
    pub(crate) format_version: u64,
    pub(crate) verdict: Verdict,
    /// Why it is not proved.
    pub(crate) reasons: Vec<String>,
    pub(crate) program: Program,
    /// When it began, in UTC.
    pub(crate) date: String,
    /// How long it took.
    pub(crate) seconds: f64,
    pub(crate) seconds_allowed: u64,
    pub(crate) host: Host,
    pub(crate) device: DeviceSection,
    /// The single expressions and kernels that are tested whenever the device is opened.
    pub(crate) self_tests: Vec<SelfTestReport>,
    pub(crate) kernels: KernelSection,
    pub(crate) negative_control: NegativeControl,
    pub(crate) golden: GoldenSection,
    pub(crate) random: RandomSection,
    pub(crate) scalars: ScalarSection,
    pub(crate) renderer: Option<RendererReport>,
    /// Only if it was requested.
    pub(crate) validation: Option<ValidationSection>,
    pub(crate) compile_times: CompileTimes,
    pub(crate) figures: Option<Figures>,
    /// Steps that ended with an error.
    pub(crate) failures: Vec<String>,
    /// Steps that could not measure. This does not affect the verdict.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) warnings: Vec<String>,
}

/// Which program ran.
#[derive(Debug, Serialize)]
pub(crate) struct Program {
    pub(crate) version: &'static str,
    /// `unknown` where the build did not set it.
    pub(crate) commit: &'static str,
    /// SHA-256 of the names and the SPIR-V of all kernels.
    pub(crate) kernels: String,
    /// SHA-256 of the recorded hashes.
    pub(crate) golden_table: String,
    pub(crate) target: String,
}

/// Where it ran.
#[derive(Debug, Serialize)]
pub(crate) struct Host {
    pub(crate) system: String,
    pub(crate) processor: String,
    pub(crate) threads: usize,
    pub(crate) vector_width: String,
}

/// The device.
#[derive(Debug, Serialize)]
pub(crate) struct DeviceSection {
    #[serde(flatten)]
    pub(crate) info: DeviceInfo,
    /// `None` if the device could not be opened.
    pub(crate) details: Option<DeviceDetails>,
    pub(crate) choices: Option<EngineChoices>,
    pub(crate) bus: Option<Bus>,
    /// The time to open the device with its self-test, in milliseconds: for the first time in this process, and for the
    /// second.
    pub(crate) opened_in: [f64; 2],
}

/// How the device is connected, as the system says.
#[derive(Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Bus {
    pub(crate) link_speed: Option<String>,
    pub(crate) link_width: Option<String>,
    pub(crate) largest_link_speed: Option<String>,
    pub(crate) largest_link_width: Option<String>,
}

/// Every kernel against its twin.
#[derive(Debug, Default, Serialize)]
pub(crate) struct KernelSection {
    /// How many there are.
    pub(crate) count: usize,
    /// How many ran and were compared.
    pub(crate) ran: usize,
    /// Values compared.
    pub(crate) values: u64,
    /// The values whose bits differ.
    pub(crate) differing: Vec<DifferingValues>,
    /// Values whose bits differ, and for which the engine uses other kernels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) replaced: Vec<DifferingValues>,
    /// The names of those that did not run.
    pub(crate) missing: Vec<String>,
}

/// Something whose bits differ.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct DifferingValues {
    pub(crate) name: String,
    pub(crate) values: u64,
    pub(crate) differing: u64,
}

/// The same expressions without the exactness pass, so that the driver may change their rounding. A difference here
/// shows that the comparison can fail; otherwise the comparison would prove nothing.
#[derive(Debug, Default, Serialize)]
pub(crate) struct NegativeControl {
    pub(crate) has_run: bool,
    /// Whether this device is known to show a difference.
    pub(crate) must_differ: bool,
    pub(crate) values: u64,
    pub(crate) differing: u64,
    /// The expressions that differ.
    pub(crate) expressions: Vec<DifferingValues>,
}

/// Recorded results.
#[derive(Debug, Default, Serialize)]
pub(crate) struct GoldenSection {
    /// How many are recorded.
    pub(crate) cases: usize,
    /// Cases that were evaluated in one setting at least.
    pub(crate) cases_compared: usize,
    /// How many configurations of the device there are.
    pub(crate) settings: usize,
    /// The configurations in which results were evaluated.
    pub(crate) by_setting: Vec<GoldenSetting>,
    pub(crate) bytes: u64,
    pub(crate) differing: Vec<String>,
}

/// Recorded results in one configuration of the device.
#[derive(Debug, Serialize)]
pub(crate) struct GoldenSetting {
    /// How kernels read and share samples, how results and uploads are moved, and the memory budget.
    pub(crate) setting: String,
    pub(crate) cases: usize,
    pub(crate) differing: usize,
}

/// Random sets and crowds.
#[derive(Debug, Default, Serialize)]
pub(crate) struct RandomSection {
    pub(crate) seed: u64,
    pub(crate) rounds: u64,
    /// Rounds in which both refused the request.
    pub(crate) rounds_refused: u64,
    pub(crate) crowds: u64,
    /// Rotations, velocities, accelerations and joints.
    pub(crate) values: u64,
    pub(crate) bytes: u64,
    pub(crate) values_differing: u64,
    /// The rounds that differ: the first ones.
    pub(crate) differing: Vec<String>,
    /// The hashes of the CPU's results of the first 1, 2, 4, 8 … rounds: the same on every machine.
    pub(crate) digests: Vec<RoundsDigest>,
    /// The hash of all rounds so far.
    #[serde(skip)]
    pub(crate) chained: [u8; 32],
}

impl RandomSection {
    /// Adds a round.
    pub(crate) fn add(&mut self, found: &RandomRound) {
        let number = self.rounds;
        self.rounds += 1;
        self.values += found.values;
        self.bytes += found.bytes;
        self.rounds_refused += u64::from(found.values == 0);
        self.crowds += u64::from(found.description.starts_with("crowd") && found.values > 0);
        self.values_differing += found.differing;
        if found.differing > 0 && self.differing.len() < MAX_DESCRIBED {
            let first = found.first_difference.unwrap_or_default();
            self.differing.push(format!(
                "round {number} of seed {}: {} of {} values, the first at {first}: {}",
                self.seed, found.differing, found.values, found.description
            ));
        }
        self.chain(&found.hash);
    }

    /// Extends the hash of all rounds, and stores it where their number is a power of two. The last of
    /// `digests` covers all rounds until then.
    fn chain(&mut self, hash: &[u8; 32]) {
        let before = self.chained;
        self.chained = Sha256::new()
            .chain_update(before)
            .chain_update(hash)
            .finalize()
            .into();
        if self.rounds.is_power_of_two() {
            self.digests.push(RoundsDigest {
                rounds: self.rounds,
                hash: hexadecimal(&self.chained[..8]),
            });
        }
    }
}

/// Random scalars by every method and quantity.
#[derive(Debug, Default, Serialize)]
pub(crate) struct ScalarSection {
    pub(crate) values: u64,
    pub(crate) values_differing: u64,
    /// The index of the first value that differs.
    pub(crate) first_difference: Option<usize>,
    /// The hash of the CPU's result: the same on every machine.
    pub(crate) digest: String,
}

impl From<RandomRound> for ScalarSection {
    fn from(found: RandomRound) -> Self {
        Self {
            values: found.values,
            values_differing: found.differing,
            first_difference: found.first_difference,
            digest: hexadecimal(&found.hash[..8]),
        }
    }
}

/// A hash of the first rounds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct RoundsDigest {
    pub(crate) rounds: u64,
    pub(crate) hash: String,
}

/// The part of the proof that ran under the validation layer.
#[derive(Debug, Default, Serialize)]
pub(crate) struct ValidationSection {
    pub(crate) has_run: bool,
    pub(crate) golden_cases: usize,
    pub(crate) random_rounds: u64,
    pub(crate) renderer_values: u64,
    /// Values and cases whose bits differ.
    pub(crate) differing: u64,
    pub(crate) message_count: usize,
    /// The first of them.
    pub(crate) messages: Vec<String>,
}

/// How long the driver takes for each kernel, without a cache.
#[derive(Debug, Default, Serialize)]
pub(crate) struct CompileTimes {
    /// Whether all of them were compiled in the time that there was.
    pub(crate) is_complete: bool,
    pub(crate) milliseconds_total: f64,
    pub(crate) kernels: Vec<CompileTime>,
}

#[derive(Debug, Clone, Serialize, serde::Deserialize)]
pub(crate) struct CompileTime {
    pub(crate) kernel: String,
    pub(crate) milliseconds: f64,
}

impl Proof {
    /// Sets the verdict and its reasons.
    pub(crate) fn judge(&mut self) {
        let differing = self.bits_that_differ();
        let missing = self.missing_parts();
        self.verdict = match (differing.is_empty(), missing.is_empty()) {
            (false, _) => Verdict::BitsDiffer,
            (true, false) => Verdict::NotProved,
            (true, true) => Verdict::Proved,
        };
        self.reasons = [differing, missing].concat();
    }

    fn bits_that_differ(&self) -> Vec<String> {
        let mut reasons = Vec::new();
        for test in self.self_tests.iter().filter(|test| test.differing > 0) {
            let (name, differing, total) = (test.name, test.differing, test.total);
            reasons.push(format!(
                "self-test `{name}`: {differing} of {total} values differ"
            ));
        }
        for kernel in &self.kernels.differing {
            let DifferingValues {
                name,
                values,
                differing,
            } = kernel;
            reasons.push(format!(
                "kernel `{name}`: {differing} of {values} values differ"
            ));
        }
        if let [first, ..] = &self.golden.differing[..] {
            let count = self.golden.differing.len();
            reasons.push(format!(
                "{count} recorded results differ, the first: {first}"
            ));
        }
        if self.random.values_differing > 0 {
            let first = self.random.differing.first().map_or("", String::as_str);
            let RandomSection {
                values,
                values_differing,
                ..
            } = self.random;
            reasons.push(format!(
                "{values_differing} of {values} random values differ, the first: {first}"
            ));
        }
        if self.scalars.values_differing > 0 {
            let ScalarSection {
                values,
                values_differing,
                first_difference,
                ..
            } = self.scalars;
            let first = first_difference.unwrap_or_default();
            reasons.push(format!(
                "{values_differing} of {values} scalars differ, the first at {first}"
            ));
        }
        let checks = self.renderer.iter().flat_map(|renderer| &renderer.checks);
        for check in checks.filter(|check| check.differing > 0) {
            let RendererCheck {
                name,
                values,
                differing,
            } = check;
            reasons.push(format!(
                "on a renderer's device, {name}: {differing} differ beside {values} values"
            ));
        }
        if let Some(validation) = self
            .validation
            .as_ref()
            .filter(|validation| validation.differing > 0)
        {
            let differing = validation.differing;
            reasons.push(format!(
                "{differing} values differ under the validation layer"
            ));
        }
        reasons
    }

    fn missing_parts(&self) -> Vec<String> {
        let mut reasons = self.failures.clone();
        let mut unless = |condition: bool, reason: String| {
            if !condition {
                reasons.push(reason);
            }
        };
        unless(
            self.self_tests.iter().any(|test| test.total > 0),
            "no expression was compared".to_owned(),
        );
        let KernelSection { count, ran, .. } = self.kernels;
        unless(
            count > 0 && ran == count,
            format!(
                "{ran} of {count} kernels ran; missing: {}",
                some_of(&self.kernels.missing)
            ),
        );
        unless(
            self.kernels.values > 0,
            "no value of a kernel was compared".to_owned(),
        );
        let control = &self.negative_control;
        unless(
            control.has_run,
            "the negative control did not run".to_owned(),
        );
        unless(
            !control.has_run || !control.must_differ || control.differing > 0,
            "the negative control found no difference on a device that is known to show one: the comparison \
             cannot find errors"
                .to_owned(),
        );
        let GoldenSection {
            cases,
            cases_compared,
            ..
        } = self.golden;
        unless(
            cases > 0 && cases_compared == cases && self.golden.bytes > 0,
            format!("{cases_compared} of {cases} recorded results were compared"),
        );
        unless(
            self.random.values > 0,
            "no random set was compared".to_owned(),
        );
        unless(
            self.random.crowds > 0,
            "no random crowd was compared".to_owned(),
        );
        unless(
            self.scalars.values >= 1 << 20,
            format!("{} scalars were compared, not 2^20", self.scalars.values),
        );
        let renderer_values = self.renderer.iter().flat_map(|renderer| &renderer.checks);
        unless(
            renderer_values.map(|check| check.values).sum::<u64>() > 0,
            "nothing was compared on a renderer's device".to_owned(),
        );
        if let Some(validation) = &self.validation {
            let compared = validation.golden_cases > 0 && validation.renderer_values > 0;
            unless(
                validation.has_run && compared,
                "not everything ran under the validation layer".to_owned(),
            );
            let first = validation.messages.first().map_or("", String::as_str);
            unless(
                validation.message_count == 0,
                format!(
                    "the validation layer has {} messages, the first: {first}",
                    validation.message_count
                ),
            );
        }
        reasons
    }
}

/// Writes a report as JSON, whole or not at all.
pub(crate) fn write(report: &impl Serialize, path: &Path) -> Result<(), Failure> {
    let name = path.display().to_string();
    let failed = |error: &std::io::Error| Failure::writing(&name, error);
    let mut text =
        serde_json::to_string_pretty(report).expect("names are strings and numbers are numbers");
    text.push('\n');
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(|error| failed(&error))?;
    file.write_all(text.as_bytes())
        .map_err(|error| failed(&error))?;
    let kept = file.persist(path).map_err(|error| failed(&error.error))?;
    // A temporary file is readable only by its owner; the report gets the usual permissions.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let _ = kept.set_permissions(std::fs::Permissions::from_mode(0o644));
    }
    drop(kept);
    Ok(())
}

/// Reads a report as it was written: of a format, which a command writes, and of a version of it.
pub(crate) fn read_report(
    path: &Path,
    [format, called, command]: [&str; 3],
    version: u64,
) -> Result<Value, Failure> {
    /// Files larger than any report are refused unread.
    const MAX_BYTES: u64 = 64 << 20;
    let name = path.display();
    let refuse = |why: String| Failure::new(ALL_INPUTS, format!("{name}: {why}"));
    let size = std::fs::metadata(path).map_err(|error| refuse(error.to_string()))?;
    if size.len() > MAX_BYTES {
        return Err(refuse(format!("it is too large to be {called}")));
    }
    let text = std::fs::read_to_string(path).map_err(|error| refuse(error.to_string()))?;
    let value: Value =
        serde_json::from_str(&text).map_err(|error| refuse(format!("it is not JSON: {error}")))?;
    if value["format"] != format {
        return Err(refuse(format!(
            "it is not {called}; `{command} -o FILE` writes one"
        )));
    }
    if value["format_version"] != version {
        let found = &value["format_version"];
        return Err(refuse(format!(
            "it is of version {found} of the format; this program reads {version}"
        )));
    }
    Ok(value)
}

/// The first few of some names.
fn some_of(names: &[String]) -> String {
    const SHOWN: usize = 5;
    let mut text = names[..names.len().min(SHOWN)].join(", ");
    if names.len() > SHOWN {
        text.push_str(", …");
    }
    text
}

/// Refuses a file that is there, before minutes are spent.
pub(crate) fn check_output(path: &Path, overwrite: bool) -> Result<(), Failure> {
    if path.exists() && !overwrite {
        let name = path.display();
        return Err(Failure::usage(format!(
            "{name} exists already; --overwrite replaces it"
        )));
    }
    let folder = path
        .parent()
        .filter(|parent| !parent.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        Some(folder) => Err(Failure::usage(format!(
            "{}: folder {} does not exist; create it first",
            path.display(),
            folder.display()
        ))),
        None => Ok(()),
    }
}

/// The lower-case digits of a hash.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The value of `format` in the report of a lab (`tumble lab`).
pub(crate) const LAB_FORMAT: &str = "tumble-lab";

/// The form of that report; another number where names or meanings change.
pub(crate) const LAB_FORMAT_VERSION: u64 = 1;

/// The lanes of runs that the report of a lab chose.
pub(crate) fn run_lanes(path: &Path) -> Result<RunLanes, Failure> {
    let called = [LAB_FORMAT, "the report of a lab", "tumble lab"];
    let file = read_report(path, called, LAB_FORMAT_VERSION)?;
    let lanes = serde_json::from_value(file["lab"]["run_lanes"].clone());
    lanes.map(RunLanes).map_err(|_| {
        let name = path.display();
        Failure::new(
            ALL_INPUTS,
            format!("{name}: it has no `run_lanes`; without --bits `tumble lab` chooses some"),
        )
    })
}

#[cfg(test)]
pub(crate) mod tests;
