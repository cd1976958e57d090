//! `tumble verify`: the device against the CPU, both against the f64 reference.

use std::fmt::Write;
use std::path::Path;

use clap::Args;
use serde::Serialize;
use tumble::Method;
use tumble::verify::{SamplePosition, Verdict, Verification};
use tumble_formats::motion::Motion;
use tumble_formats::printable::printable;

use crate::arguments::device::{DeviceArguments, OpenedDevice};
use crate::arguments::input::{self, Inputs};
use crate::arguments::interpolation::{
    InterpolationArguments, MethodSelection, chosen, curve_warning, methods,
};
use crate::arguments::time::{SampleChoice, SamplingArguments};
use crate::batch::entry::InputEntry;
use crate::batch::room;
use crate::messages::exit::{ALL_INPUTS, DIFFERENCE, Failure, NO_VULKAN, for_each};
use crate::messages::progress::Progress;
use crate::messages::warnings::{self, RecordedWarning, WarningMark};
use crate::messages::{listing, names, words};

/// Compare a device with the CPU, bit for bit, and both with textbook formulas in f64
#[derive(Debug, Args)]
#[command(mut_arg("device", |arg| arg.default_value("first")))]
#[command(after_help = "\
Every rotation of every frame is computed three times: on the device, by the engine on the CPU, and by \
a textbook implementation in f64. The bits of the first two must be equal, and the error against the \
third must be within a bound. Velocities, accelerations and every encoding are compared in the same \
way. The exit code is 8 if a comparison fails. Without --device, the device is the first Vulkan device, \
however few rotations there are. If there is none, only the CPU is compared with f64, and the exit code \
is 5. With --device cpu this comparison is enough, and the exit code is 0.

Examples:
  tumble verify data/pendulum.dat
  tumble verify *.dat -m slerp,c2 --fps 240
  tumble verify data/pendulum.dat --device llvmpipe --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    /// How to interpolate: the methods to verify, one or several, or all
    #[arg(
        short,
        long = "method",
        value_name = "METHODS",
        value_delimiter = ',',
        default_value = "all",
        value_parser = methods()
    )]
    methods: Vec<MethodSelection>,
    #[command(flatten)]
    sampling: SamplingArguments,
    #[command(flatten)]
    interpolation: InterpolationArguments,
    #[command(flatten)]
    device: DeviceArguments,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// One line of the report; also the form of the JSON.
#[derive(Serialize)]
struct VerificationLine {
    input: String,
    #[serde(flatten)]
    found: Verification,
    /// The names of the tracks of the worst sample and of the first difference, if they have names.
    worst_track_name: Option<String>,
    first_difference_track_name: Option<String>,
    /// Whether a Vulkan device gives the CPU's bits and these are near the reference.
    pass: bool,
    verdict: Verdict,
    /// Warnings about the method. The line of the first method also has those about the input.
    warnings: Vec<RecordedWarning>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = arguments
        .inputs
        .distinct(arguments.sampling.reads_standard_input())?;
    let samples = arguments.sampling.samples()?.and_halves();
    let methods = chosen(&arguments.methods);
    arguments
        .interpolation
        .check(&methods)
        .map_err(Failure::usage)?;
    let device = arguments.device.open()?;
    let steps = (inputs.len() * methods.len()) as u64;
    let mut progress = Progress::new("verifying", steps);
    let (mut lines, mut failed) = (Vec::new(), Vec::new());
    let mark = warnings::mark();
    let mut verify = |path: &Path| {
        let name = names::input(path);
        let loaded = arguments.inputs.load(path)?;
        for clip in &loaded.clips {
            let name = match loaded.clips.len() {
                1 => name.clone(),
                _ => format!("{name} {}", names::clip(clip)),
            };
            let clip = arguments.inputs.tracks.select(clip, &name)?;
            let clip = (&*name, &*clip);
            let found =
                arguments.compare(&device, &samples, clip, &methods, (&mut progress, mark))?;
            let is_nothing = found.iter().any(|line| line.verdict == Verdict::Nothing);
            lines.extend(found);
            if is_nothing {
                let message = "has no frames in this range: nothing was compared";
                return Err(Failure::new(ALL_INPUTS, format!("{name}: {message}")));
            }
        }
        input::check_complete(&name, &loaded)
    };
    let outcome = for_each(&inputs, |path| {
        verify(path).inspect_err(|failure| failed.push(InputEntry::failed(path, None, failure)))
    });
    drop(progress);
    let is_failed = |line: &&VerificationLine| line.verdict == Verdict::Failed;
    let failing = lines.iter().filter(is_failed).count();
    if arguments.json {
        listing::records(&lines, &failed)?;
    } else if !lines.is_empty() {
        listing::text(&report(&lines, &device))?;
    }
    if failing > 0 {
        let message = format!(
            "{failing} of {} comparisons failed: bits differ, or an error is over its bound",
            lines.len()
        );
        return Err(Failure::new(DIFFERENCE, message));
    }
    if !device.is_vulkan() && !arguments.device.is_cpu() {
        let message = "no Vulkan device was compared, only the CPU with the f64 reference; --device cpu \
                       selects this comparison alone";
        return outcome.and(Err(Failure::new(NO_VULKAN, message)));
    }
    outcome
}

impl Arguments {
    /// One set, by every method asked for.
    fn compare(
        &self,
        device: &OpenedDevice,
        samples: &SampleChoice,
        (name, clip): (&str, &Motion),
        methods: &[Method],
        (progress, mark): (&mut Progress, WarningMark),
    ) -> Result<Vec<VerificationLine>, Failure> {
        let set = &clip.set;
        let outside = self.interpolation.outside();
        let frames = samples.of(clip, outside, name)?;
        // Memory for two results, which exist at the same time.
        room::in_memory(name, set, &frames, 2)?;
        let mut lines = Vec::new();
        for &method in methods {
            let interpolation = self.interpolation.with(method);
            if let Some(warning) = curve_warning(name, clip, &interpolation) {
                words::warn_of(warning);
            }
            let mut found = tumble::verify::verify(&device.engine, set, interpolation, &frames)
                .map_err(|error| Failure::evaluating(name, &error))?;
            // Times are printed as in the file: with the clip's time offset.
            let positions = [&mut found.worst, &mut found.first_difference];
            for position in positions.into_iter().flatten() {
                position.time += clip.time_offset as f64;
            }
            let track_name = |position: Option<SamplePosition>| {
                position.and_then(|position| set.track(position.track).name.map(str::to_owned))
            };
            lines.push(VerificationLine {
                input: name.to_owned(),
                worst_track_name: track_name(found.worst),
                first_difference_track_name: track_name(found.first_difference),
                pass: found.passes(),
                verdict: found.verdict(),
                found,
                warnings: warnings::recorded_since(mark),
            });
            progress.advance(1);
        }
        Ok(lines)
    }
}

/// A table with a line for each input and method, and the verdict.
fn report(lines: &[VerificationLine], device: &OpenedDevice) -> String {
    let width = lines
        .iter()
        .map(|line| line.input.chars().count())
        .max()
        .unwrap_or(0)
        .max(5);
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{:width$}  {:22} {:>12} {:>9}  {:>9} {:>9} {:>9}  {:>9}  verdict",
        "input", "method", "rotations", "differing", "max rad", "bound", "rms rad", "| |q|-1 |"
    );
    for line in lines {
        line.tell(&mut text, width);
    }
    let rotations: u64 = lines.iter().map(|line| line.found.rotations).sum();
    let outputs = || lines.iter().flat_map(|line| &line.found.outputs);
    let values: u64 = outputs().map(|output| output.values).sum();
    let differing: u64 = lines.iter().map(|line| line.found.differing).sum::<u64>()
        + outputs().map(|output| output.differing).sum::<u64>();
    let _ = if device.is_vulkan() {
        writeln!(
            text,
            "total: {rotations} rotations, and {values} values derived from them (velocities, \
             accelerations, poses, encodings), compared between {} and the \
             CPU: {differing} differ",
            device.label
        )
    } else {
        writeln!(
            text,
            "total: {rotations} rotations on {}; NOTHING was compared with a Vulkan device, only \
             with the f64 reference",
            device.label
        )
    };
    text
}

impl VerificationLine {
    fn tell(&self, text: &mut String, width: usize) {
        let found = &self.found;
        let _ = writeln!(
            text,
            "{:width$}  {:22} {:>12} {:>9}  {:>9.2e} {:>9.0e} {:>9.2e}  {:>9.2e}  {}",
            self.input,
            found.method,
            found.rotations,
            if found.device.is_some() {
                found.differing.to_string()
            } else {
                "-".to_owned()
            },
            found.max_error,
            found.error_bound,
            found.rms_error,
            found.max_norm_error,
            match self.verdict {
                Verdict::Passed => "pass",
                Verdict::Failed => "FAIL",
                other => other.name(),
            },
        );
        for output in found.outputs.iter().filter(|output| !output.passes()) {
            let _ = writeln!(
                text,
                "{:width$}  FAIL: {}, {} of {} differ, error {:.2e} of {:.0e}",
                "",
                output.output,
                output.differing,
                output.values,
                output.max_error,
                output.error_bound
            );
        }
        for (label, sample, name) in [
            ("worst", found.worst, &self.worst_track_name),
            (
                "first difference",
                found.first_difference,
                &self.first_difference_track_name,
            ),
        ] {
            if let Some(position) = sample {
                let name = name.as_deref().map(printable);
                let name = name.map_or(String::new(), |name| format!(" ({name})"));
                let _ = writeln!(
                    text,
                    "{:width$}  {label}: track {}{name}, frame {}, at {:.4} s",
                    "", position.track, position.frame, position.time
                );
            }
        }
    }
}
