//! The steps of a proof, their order, and how long each may take. Steps that a proof needs run first; the
//! remaining time is shared among the configurations of the device and random rounds.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use tumble::vulkan::VulkanDevice;
use tumble::vulkan::tuning::{Mapping, PrepareArcs, ReadBack, Reads, RunLanes, Transfer, Uploads};
use tumble::{Device, Engine, EngineOptions};
use tumble_verify::figures::figures_with;
use tumble_verify::golden::Golden;
use tumble_verify::random::{round, scalars_round};
use tumble_verify::renderer::renderer;

use crate::commands::prove::report::{
    CompileTimes, DeviceSection, DifferingValues, FORMAT, FORMAT_VERSION, GoldenSection,
    GoldenSetting, KernelSection, MAX_DESCRIBED, NegativeControl, Proof, RandomSection,
    ScalarSection, ValidationSection, Verdict,
};
use crate::commands::prove::{compile, device};
use crate::messages::words;

/// The options of a run.
pub(crate) struct ProofOptions {
    pub(crate) device: Device,
    pub(crate) seconds: u64,
    /// Run only what a proof needs.
    pub(crate) quick: bool,
    pub(crate) seed: u64,
    pub(crate) validate: bool,
    /// The lanes of runs, instead of the engine's choice.
    pub(crate) run_lanes: Option<RunLanes>,
}

/// A random round that takes at least this many seconds is reported.
const LONG_ROUND_SECONDS: u64 = 5;

/// For each step, the share of the time limit after which the step starts no more work.
const COMPILED_BY: f64 = 0.2;
const MEASURED_BY: f64 = 0.45;
const VALIDATED_BY: f64 = 0.65;
const RECORDED_BY: f64 = 0.85;
const ENDED_BY: f64 = 0.99;

/// Why a step ended early, in words.
struct StepError(String);

impl<E: std::error::Error> From<E> for StepError {
    fn from(error: E) -> Self {
        Self(error.to_string())
    }
}

/// One configuration of the device.
#[derive(Clone)]
struct DeviceSetting {
    name: String,
    options: EngineOptions,
}

/// How kernels read, and the samples of an invocation; how results and uploads are moved; a memory budget.
type SettingParts = (
    (Reads, Mapping, &'static str),
    (Transfer, Uploads, ReadBack, PrepareArcs, &'static str),
    Option<u64>,
);

impl DeviceSetting {
    fn new((reading, moving, memory): SettingParts) -> Self {
        let mut options = EngineOptions::default();
        options.allow_inexact = true;
        (options.reads, options.mapping) = (reading.0, reading.1);
        (options.transfer, options.uploads, options.read_back) = (moving.0, moving.1, moving.2);
        options.memory = memory;
        options.prepare_arcs = moving.3;
        let budget = match memory {
            Some(bytes) => format!("{} KiB of memory", bytes >> 10),
            None => "all memory".to_owned(),
        };
        Self {
            name: format!("{}, {}, {budget}", reading.2, moving.4),
            options,
        }
    }

    /// All combinations of how kernels read, how results are moved, and the two memory budgets. Each of these is in at
    /// least one of the first four settings.
    fn all(run_lanes: Option<RunLanes>) -> Vec<Self> {
        let reading = [
            (Reads::StorageBuffers, Mapping::Samples, "samples"),
            (Reads::StorageBuffers, Mapping::Runs, "runs"),
            (Reads::TexelBuffers, Mapping::Runs, "runs of texels"),
        ];
        let (uploads, read_back) = (Uploads::Automatic, ReadBack::Automatic);
        let moving = [
            (
                Transfer::Automatic,
                uploads,
                read_back,
                PrepareArcs::Automatic,
                "moved as chosen",
            ),
            (
                Transfer::Staged,
                Uploads::Staged,
                ReadBack::Overlapped,
                PrepareArcs::OnDevice,
                "staged, copied beside, arcs prepared on the device",
            ),
            (
                Transfer::InPlace,
                Uploads::Direct,
                read_back,
                PrepareArcs::OnDevice,
                "in place, arcs prepared on the device",
            ),
            (
                Transfer::Staged,
                Uploads::Direct,
                ReadBack::SameQueue,
                PrepareArcs::OnHost,
                "staged, uploaded directly, arcs prepared on the host",
            ),
        ];
        let budgets = [None, Some(256 << 10)];
        let diagonal = (0..4).map(|index| (index % 3, index, index % 2));
        let whole = (0..24).map(|index| (index % 3, index / 3 % 4, index / 12));
        let mut known = BTreeSet::new();
        let ordered = diagonal
            .chain(whole)
            .filter(|combination| known.insert(*combination));
        ordered
            .map(|(r, m, b)| Self::new((reading[r], moving[m], budgets[b])))
            .map(|mut setting| {
                setting.options.run_lanes = run_lanes;
                setting
            })
            .collect()
    }
}

/// The number of settings of [`DeviceSetting::all`] among which the recorded results are distributed in the first
/// round.
const FIRST_SETTINGS: usize = 4;

/// A run in progress.
struct ProofRun<'a> {
    options: &'a ProofOptions,
    vulkan: &'a VulkanDevice,
    started: Instant,
    cpu: Engine,
    golden: Golden,
    settings: Vec<DeviceSetting>,
    /// The first engines, kept for random rounds.
    engines: Vec<Engine>,
    proof: Proof,
}

/// Runs everything on a Vulkan device.
pub(crate) fn prove(options: &ProofOptions) -> Proof {
    let started = Instant::now();
    let Device::Vulkan(vulkan) = &options.device else {
        unreachable!("the CPU is refused before")
    };
    let mut proof = empty(options, vulkan);
    match Engine::new(Device::Cpu) {
        Ok(cpu) => {
            let mut run = ProofRun {
                options,
                vulkan,
                started,
                cpu,
                golden: Golden::new(),
                settings: DeviceSetting::all(options.run_lanes),
                engines: Vec::new(),
                proof,
            };
            run.all();
            proof = run.proof;
        }
        Err(error) => proof.failures.push(format!("the CPU: {error}")),
    }
    proof.seconds = started.elapsed().as_secs_f64();
    proof.judge();
    proof
}

/// A proof of nothing.
fn empty(options: &ProofOptions, vulkan: &VulkanDevice) -> Proof {
    let info = vulkan.info().clone();
    Proof {
        warnings: Vec::new(),
        format: FORMAT,
        format_version: FORMAT_VERSION,
        verdict: Verdict::NotProved,
        reasons: Vec::new(),
        program: device::program(),
        date: device::now(),
        seconds: 0.0,
        seconds_allowed: options.seconds,
        host: device::host(),
        negative_control: NegativeControl::default(),
        device: DeviceSection {
            info,
            details: None,
            choices: None,
            bus: None,
            opened_in: [0.0; 2],
        },
        self_tests: Vec::new(),
        kernels: KernelSection::default(),
        golden: GoldenSection::default(),
        random: RandomSection {
            seed: options.seed,
            ..RandomSection::default()
        },
        scalars: ScalarSection::default(),
        renderer: None,
        validation: options.validate.then(ValidationSection::default),
        compile_times: CompileTimes::default(),
        figures: None,
        failures: Vec::new(),
    }
}

impl ProofRun<'_> {
    fn all(&mut self) {
        self.step("opening the device", Self::open);
        if self.engines.len() < FIRST_SETTINGS {
            return; // it does not open: nothing else can run
        }
        self.step("kernels", Self::kernels);
        self.step("negative control", Self::negative_control);
        self.step("recorded results", Self::recorded_once);
        self.step("a renderer's device", Self::renderer);
        self.step("random sets and crowds", Self::random_once);
        self.step("random scalars", Self::scalars);
        self.step_if_time("compiling", COMPILED_BY, Self::compile);
        self.step_if_time("speed", MEASURED_BY, Self::measure);
        if self.options.validate {
            self.step("the validation layer", Self::validate);
        }
        if self.options.quick {
            return;
        }
        let everywhere = "recorded results in every setting";
        self.step_if_time(everywhere, RECORDED_BY, Self::recorded_everywhere);
        let more = "more random sets and crowds";
        self.step_if_time(more, ENDED_BY, Self::random_to_the_end);
    }

    /// Runs a step that a proof needs. Its error is recorded, and the other steps still run.
    fn step(&mut self, name: &str, work: fn(&mut Self) -> Result<(), StepError>) {
        let elapsed = self.started.elapsed().as_secs();
        if self.is_past(1.0) {
            let allowed = self.options.seconds;
            let reason = format!("{name}: the {allowed} s were over (--time-limit)");
            self.proof.failures.push(reason);
            return;
        }
        words::note(&format!("{elapsed:>4} s  {name} …"));
        if let Err(StepError(reason)) = work(self) {
            self.proof.failures.push(format!("{name}: {reason}"));
        }
    }

    /// Runs a step if less than this share of the time limit has passed.
    fn step_if_time(
        &mut self,
        name: &str,
        share: f64,
        work: fn(&mut Self) -> Result<(), StepError>,
    ) {
        if !self.is_past(share) {
            self.step(name, work);
        }
    }

    /// Whether that share of the time is over.
    fn is_past(&self, share: f64) -> bool {
        self.left_until(share).is_zero()
    }

    fn left_until(&self, share: f64) -> Duration {
        let end = Duration::from_secs(self.options.seconds).mul_f64(share);
        end.saturating_sub(self.started.elapsed())
    }

    fn open(&mut self) -> Result<(), StepError> {
        let mut options = EngineOptions::default();
        options.allow_inexact = true;
        let mut opened_in = [0.0; 2];
        for milliseconds in &mut opened_in {
            let started = Instant::now();
            let engine = Engine::with_options(self.options.device.clone(), &options)?;
            *milliseconds = started.elapsed().as_secs_f64() * 1e3;
            let device = &mut self.proof.device;
            device.details = engine.device_details();
            device.choices = engine.choices();
            self.proof.self_tests = engine.self_tests().to_vec();
        }
        let device = &mut self.proof.device;
        device.opened_in = opened_in;
        let address = device
            .details
            .as_ref()
            .and_then(|details| details.pci_address.clone());
        device.bus = address.and_then(|address| device::bus(&address));
        for setting in &self.settings[..FIRST_SETTINGS] {
            let engine = Engine::with_options(self.options.device.clone(), &setting.options)?;
            self.engines.push(engine);
        }
        Ok(())
    }

    /// Compares every kernel with its twin, in an engine that reads storage buffers and, if the device can, in one that
    /// reads texel buffers, for which most kernels have a separate variant.
    fn kernels(&mut self) -> Result<(), StepError> {
        let allowed = Duration::from_secs(self.options.seconds);
        let mut ran = BTreeSet::new();
        let mut expected: BTreeSet<&str> = BTreeSet::new();
        // The engines are kept: kernels compiled here are used again for the recorded results.
        for (setting, engine) in self.settings.iter().zip(&self.engines) {
            let reads = setting.options.reads;
            let texels = engine.choices().map(|choices| choices.reads) == Some("texel-buffers");
            // The kernels that this device can run, in the variants that the engine uses.
            let all = engine.known_kernels().into_iter().map(|check| check.name);
            let known = expected.len();
            expected.extend(all.filter(|name| name.ends_with("_texels") == texels));
            let is_known = expected.len() == known;
            if is_known || texels != (reads == Reads::TexelBuffers) {
                continue;
            }
            let (kernels, started) = (&mut self.proof.kernels, self.started);
            engine.check_kernels_while(&mut |check| {
                if ran.insert(check.name) {
                    kernels.values += check.total as u64;
                    if check.differing > 0 {
                        let differing = match check.replaced {
                            true => &mut kernels.replaced,
                            false => &mut kernels.differing,
                        };
                        differing.push(DifferingValues {
                            name: check.name.to_owned(),
                            values: check.total as u64,
                            differing: check.differing as u64,
                        });
                    }
                }
                started.elapsed() < allowed
            })?;
        }
        let kernels = &mut self.proof.kernels;
        kernels.count = expected.len();
        kernels.ran = expected.intersection(&ran).count();
        kernels.missing = expected
            .difference(&ran)
            .map(|&name| name.to_owned())
            .collect();
        match kernels.missing.is_empty() || !self.is_past(1.0) {
            true => Ok(()),
            false => Err(StepError(format!(
                "the {} s were over after {} of {} (--time-limit)",
                self.options.seconds, self.proof.kernels.ran, self.proof.kernels.count
            ))),
        }
    }

    fn negative_control(&mut self) -> Result<(), StepError> {
        let engine = &self.engines[0];
        let Some(found) = engine.negative_control()? else {
            return Ok(());
        };
        let control = &mut self.proof.negative_control;
        control.has_run = true;
        control.must_differ = found.must_differ;
        for expression in &found.expressions {
            control.values += expression.total as u64;
            control.differing += expression.differing as u64;
            if expression.differing > 0 {
                control.expressions.push(DifferingValues {
                    name: expression.name.to_owned(),
                    values: expression.total as u64,
                    differing: expression.differing as u64,
                });
            }
        }
        Ok(())
    }

    /// Compares a recorded result, in a setting.
    fn compare_recorded(
        &mut self,
        case: usize,
        setting: usize,
        engine: &Engine,
        compared: &mut BTreeSet<usize>,
    ) -> Result<(), StepError> {
        let name = self.golden.name(case);
        let setting = &self.settings[setting].name;
        let found = self.golden.evaluate(case, engine);
        let found = found.map_err(|error| StepError(format!("{name} ({setting}): {error}")))?;
        let is_same = Golden::recorded(name) == Some(&found.hash);
        let section = &mut self.proof.golden;
        section.bytes += found.bytes;
        compared.insert(case);
        let known = section
            .by_setting
            .iter()
            .position(|other| other.setting == *setting);
        let known = known.unwrap_or_else(|| {
            section.by_setting.push(GoldenSetting {
                setting: setting.clone(),
                cases: 0,
                differing: 0,
            });
            section.by_setting.len() - 1
        });
        let by_setting = &mut section.by_setting[known];
        by_setting.cases += 1;
        if !is_same {
            by_setting.differing += 1;
            let description = format!("{name} ({setting})");
            section.differing.push(description);
        }
        Ok(())
    }

    /// Compares each recorded result once; the results are distributed among the first settings.
    fn recorded_once(&mut self) -> Result<(), StepError> {
        let cases = self.golden.case_count();
        self.proof.golden.cases = Golden::recorded_count().max(cases);
        self.proof.golden.settings = self.settings.len();
        let mut compared = BTreeSet::new();
        let engines = self.engines.clone();
        let mut outcome = Ok(());
        for case in 0..cases {
            if self.is_past(1.0) {
                break;
            }
            // Each method has six cases. The shift by `case / 6` makes sure that the same case of the next method
            // uses another setting.
            let setting = (case + case / 6) % engines.len();
            outcome = self.compare_recorded(case, setting, &engines[setting], &mut compared);
            if outcome.is_err() {
                break;
            }
        }
        self.proof.golden.cases_compared = compared.len();
        outcome
    }

    /// All recorded results in one setting after the other, beginning with those that have had a part.
    fn recorded_everywhere(&mut self) -> Result<(), StepError> {
        let mut compared = BTreeSet::new();
        for index in 0..self.settings.len() {
            if self.is_past(RECORDED_BY) {
                return Ok(());
            }
            let options = self.settings[index].options.clone();
            let engine = match self.engines.get(index) {
                Some(engine) => engine.clone(),
                None => Engine::with_options(self.options.device.clone(), &options)?,
            };
            for case in 0..self.golden.case_count() {
                let is_done = index < FIRST_SETTINGS && (case + case / 6) % FIRST_SETTINGS == index;
                if is_done {
                    continue;
                }
                if self.is_past(RECORDED_BY) {
                    return Ok(());
                }
                self.compare_recorded(case, index, &engine, &mut compared)?;
            }
        }
        Ok(())
    }

    fn renderer(&mut self) -> Result<(), StepError> {
        self.proof.renderer = Some(renderer(self.vulkan, false, self.options.seed)?);
        Ok(())
    }

    /// One round after the other, with the next of the engines each.
    fn random_rounds(&mut self, mut goes_on: impl FnMut(&Self) -> bool) -> Result<(), StepError> {
        while goes_on(self) {
            let number = self.proof.random.rounds;
            let engine = &self.engines[number as usize % self.engines.len()];
            let started = Instant::now();
            let found = round(engine, &self.cpu, self.options.seed, number)?;
            let seconds = started.elapsed().as_secs();
            if seconds >= LONG_ROUND_SECONDS {
                let description = &found.description;
                words::note(&format!(
                    "        round {number} took {seconds} s: {description}"
                ));
            }
            self.proof.random.add(&found);
        }
        Ok(())
    }

    fn scalars(&mut self) -> Result<(), StepError> {
        let engine = &self.engines[0];
        self.proof.scalars = scalars_round(engine, &self.cpu, self.options.seed)?.into();
        Ok(())
    }

    fn random_once(&mut self) -> Result<(), StepError> {
        self.random_rounds(|run| run.proof.random.rounds < 8 && !run.is_past(1.0))
    }

    fn random_to_the_end(&mut self) -> Result<(), StepError> {
        self.random_rounds(|run| !run.is_past(ENDED_BY))
    }

    fn compile(&mut self) -> Result<(), StepError> {
        let limit = self.left_until(COMPILED_BY);
        // A measurement that does not affect the verdict.
        match compile::measure(&self.vulkan.info().uuid, limit) {
            Ok(times) => self.proof.compile_times = times,
            Err(reason) => {
                words::warning(&reason);
                self.proof.warnings.push(reason);
            }
        }
        Ok(())
    }

    fn measure(&mut self) -> Result<(), StepError> {
        let budget = self.left_until(MEASURED_BY);
        let mut options = EngineOptions::default();
        options.run_lanes = self.options.run_lanes;
        self.proof.figures = Some(figures_with(self.vulkan, &options, budget)?);
        Ok(())
    }

    /// Expressions, recorded results, random rounds and a renderer's device under the validation layer.
    fn validate(&mut self) -> Result<(), StepError> {
        let uuid = self.vulkan.info().uuid.clone();
        let devices = Device::list_validated()?;
        let same = |device: &Device| device.uuid().as_ref() == Some(&uuid);
        let device = devices.into_iter().find(same);
        let device = device.ok_or(tumble::vulkan::VulkanError::NoDevice)?;
        let mut options = EngineOptions::default();
        options.allow_inexact = true;
        let engine = Engine::with_options(device, &options)?;
        let mut found = ValidationSection::default();
        // Cases in large steps, so that all kinds of cases occur even if the time is short.
        let (count, step) = (self.golden.case_count(), 101);
        for index in 0..count {
            if index >= 24 && self.is_past(VALIDATED_BY) {
                break;
            }
            let case = index * step % count;
            let made = self.golden.evaluate(case, &engine)?;
            found.golden_cases += 1;
            let is_same = Golden::recorded(self.golden.name(case)) == Some(&made.hash);
            found.differing += u64::from(!is_same);
        }
        for number in 0..8 {
            let made = round(&engine, &self.cpu, self.options.seed, number)?;
            found.random_rounds += 1;
            found.differing += made.differing;
        }
        let renderer = renderer(self.vulkan, true, self.options.seed)?;
        found.renderer_values = renderer.checks.iter().map(|check| check.values).sum();
        found.differing += (renderer.checks.iter())
            .map(|check| check.differing)
            .sum::<u64>();
        let mut messages = engine.validation_messages();
        messages.extend(renderer.validation_messages);
        found.message_count = messages.len();
        messages.truncate(MAX_DESCRIBED);
        found.messages = messages;
        found.has_run = true;
        self.proof.validation = Some(found);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each way to read, to move results and each budget is in the first settings, and no two are alike.
    #[test]
    fn settings_are_all_there_are_and_the_first_have_each_way_once() {
        let all = DeviceSetting::all(None);
        assert_eq!(all.len(), 24);
        let names: BTreeSet<&str> = all.iter().map(|setting| setting.name.as_str()).collect();
        assert_eq!(names.len(), 24);
        let first = &all[..FIRST_SETTINGS];
        let count =
            |of: fn(&DeviceSetting) -> String| first.iter().map(of).collect::<BTreeSet<_>>().len();
        assert_eq!(
            count(|setting| format!("{:?} {:?}", setting.options.reads, setting.options.mapping)),
            3
        );
        assert_eq!(
            count(|setting| format!(
                "{:?} {:?}",
                setting.options.transfer, setting.options.uploads
            )),
            4
        );
        assert_eq!(count(|setting| format!("{:?}", setting.options.memory)), 2);
        assert!(all.iter().all(|setting| setting.options.allow_inexact));
    }
}
