//! `tumble compare`: how far two motions, or two results, are apart.

mod folders;
mod table;
mod text;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;

use clap::Args;
use clap::builder::TypedValueParser;
use serde::Serialize;
use tumble::{Device, Engine, FrameRate};
use tumble_formats::compare::{
    ArrayDifference, ClipDifference, ClipPair, CompareError, PathDifference, PathMeasure,
    ScalarDifference,
};
use tumble_formats::format::FormatOption;
use tumble_formats::motion::{Motion, ScalarKind};
use tumble_formats::npz::open_numbers;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::times::clock_text;
use tumble_formats::trajectory::{Align, Associate, Step};
use tumble_formats::{Code, Diagnostic, Format};

use crate::arguments::input::{self, Inputs};
use crate::arguments::output::{component_order, one_of};
use crate::arguments::time::{check_range, clock_difference, finite_seconds};
use crate::arguments::tolerance::{degrees, not_negative};
use crate::batch::room;
use crate::commands::compare::table::{TableArguments, csv_table};
use crate::messages::exit::{ALL_INPUTS, DIFFERENCE, Failure};
use crate::messages::{listing, names, words};

/// Compare two motions or two results: the largest and the mean difference, and where it is
#[derive(Debug, Args)]
#[command(after_help = "\
Motions are interpolated as their files state (`eval --method authored`), at every key of both and halfway \
between neighbouring keys, or at the frames of --fps. Tracks are matched by equal names, or by \
index if neither file has names. Joints with different parents can be compared only with --world. A table lists \
the joints that are furthest apart. Frames are those of the first input, from 0 at its first key; \
frame 7.5 is halfway between two. Two NPY files are compared number by number, and by angles if they contain \
rotations. The exit code is 8 if a difference exceeds --tolerance or --distance. With one of these \
options it is also 8 if a track is missing in one of the motions. \
With --ape, --rpe or --align, the second input is an estimate of the trajectory of the first. Both are \
compared as by the program evo, after the alignment by --align, at the times of the input with fewer \
poses. The other is interpolated there by lines and arcs; --associate nearest:0.01 takes its nearest \
pose within 0.01 s instead, as evo does. --tolerance and --distance are then limits of the absolute errors.
Of two directories, the files with the same relative names are compared: a line for each pair that differs (of \
trajectories a table of the errors of all), and a summary. With --tolerance or --distance the exit code is 8 if a pair exceeds it, if one of a pair is longer, or if a file is \
in only one.

Examples:
  tumble compare walk.bvh walk.glb
  tumble compare walk.bvh reduced.glb --world --tolerance 0.1deg --distance 0.5
  tumble compare walk.bvh retargeted.bvh --world --worst-by distance --top 5
  tumble compare walk.bvh walk.glb --csv > joints.csv
  tumble compare one.npy other.npy --tolerance 0
  tumble compare a.dat b.dat --fps 240 --json
  tumble compare before/ after/ --tolerance 0.01deg
  tumble compare truth.tum estimate.tum --align sim3 --ape --rpe 1m
  tumble compare truth.tum estimate.tum --align se3 --ape --associate nearest:0.01
  tumble compare truth.tum estimate.tum --ape --time-offset -0.25
  tumble compare truth.tum estimate.tum --ape --second-source-order wxyz")]
pub(crate) struct Arguments {
    /// Two keyframe files, two results of `tumble eval`, or two directories of them
    #[command(flatten)]
    inputs: Inputs,
    /// Frames per second: compare at these frames [default: at the keys, and halfway between them]
    #[arg(long, value_name = "FPS")]
    fps: Option<FrameRate>,
    /// Where to start, seconds [default: the first time that both have]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    start: Option<f64>,
    /// Where to end, seconds [default: the last time that both have]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    end: Option<f64>,
    /// Seconds to add to the times of the second input, if it has another clock
    #[arg(long, value_name = "SECONDS", value_parser = clock_difference, allow_hyphen_values = true)]
    time_offset: Option<f64>,
    /// --source-order of the second input, if it differs from that of the first
    #[arg(long, value_name = "ORDER", value_parser = component_order())]
    second_source_order: Option<ComponentOrder>,
    /// Compare joints in the world instead of relative to their parents
    #[arg(long)]
    world: bool,
    /// The largest allowed angle: 0.1deg or 0.002rad, degrees without a unit; for arrays
    /// other than rotations, the largest difference of two numbers
    #[arg(long, value_name = "ANGLE", value_parser = degrees, allow_hyphen_values = true)]
    tolerance: Option<f64>,
    /// The largest allowed distance: between corresponding translations
    #[arg(long, value_name = "LENGTH", value_parser = not_negative, allow_hyphen_values = true)]
    distance: Option<f64>,
    /// Which transformations align the second trajectory to the first, by least squares
    #[arg(long, value_name = "FREEDOM", value_parser = alignment(), help_heading = TRAJECTORIES)]
    align: Option<Align>,
    /// Absolute errors: pose by pose
    #[arg(long, help_heading = TRAJECTORIES)]
    ape: bool,
    /// Relative errors: over steps of this many seconds, or units of length along the second path
    #[arg(long, value_name = "1s|1m", value_parser = step, help_heading = TRAJECTORIES)]
    rpe: Option<Step>,
    /// How poses are associated: interpolated, or nearest:SECONDS, the nearest one within this time
    #[arg(long, value_name = "HOW", value_parser = association, help_heading = TRAJECTORIES)]
    associate: Option<Associate>,
    /// The longest gap, seconds: poses between two of the interpolated input that are further apart are left out
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, help_heading = TRAJECTORIES)]
    max_gap: Option<f64>,
    #[command(flatten)]
    table: TableArguments,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Print a table of the joints and the scalars as CSV
    #[arg(long, conflicts_with = "json")]
    csv: bool,
}

fn alignment() -> impl TypedValueParser<Value = Align> {
    let help = |align| match align {
        Align::None => "as they are",
        Align::Position => "move the second",
        Align::Yaw => "move it, and turn it about z",
        Align::Se3 => "move and turn it",
        Align::Sim3 => "move, turn and scale it",
    };
    one_of(Align::ALL.map(|align| (align.name(), help(align), align)))
}

fn association(text: &str) -> Result<Associate, String> {
    text.parse::<Associate>().map_err(|error| error.to_string())
}

fn step(text: &str) -> Result<Step, String> {
    text.parse::<Step>().map_err(|error| error.to_string())
}

/// The failure of a command whose inputs cannot be compared; it counts as an error of the inputs.
fn refused(error: CompareError) -> Failure {
    let message = error.to_string();
    match error {
        CompareError::Evaluating { input, error } => Failure::evaluating(&input, &error),
        CompareError::NoTimeInBoth { spans, .. } | CompareError::NoPoseInBoth { spans, .. } => {
            let apart = clock_text(0, spans[0][0] - spans[1][0]);
            let hint = format!(
                "; --time-offset adds seconds to the times of the second ({apart} lets both begin together)"
            );
            Failure::new(ALL_INPUTS, message).hinted(&hint)
        }
        _ => Failure::new(ALL_INPUTS, message),
    }
}

/// For each animation of a file, the index of its [partner] in another file that has as many.
fn partners(paths: [&Path; 2], clips: [&[Motion]; 2]) -> Result<Vec<usize>, Failure> {
    let all = clips.map(|clips| -> Vec<Option<&str>> {
        clips.iter().map(|clip| clip.name.as_deref()).collect()
    });
    let found_or_refused = |index: usize| {
        partner([&all[0], &all[1]], index).ok_or_else(|| {
            let message = format!(
                "{} {} has not exactly one partner of the same name in {}; choose one animation of each (--animation)",
                names::input(paths[0]),
                names::clip(&clips[0][index]),
                names::input(paths[1])
            );
            Failure::new(ALL_INPUTS, message)
        })
    };
    (0..all[0].len()).map(found_or_refused).collect()
}

/// The index of the animation of a second file that belongs to animation `index` of the first. `all` has the names of
/// the animations of both files. If each file has one animation, or both have the same names in the same order, the
/// index is the same. Otherwise it is that of the animation of the same name, if the name occurs only once in each
/// file.
pub(crate) fn partner(all: [&[Option<&str>]; 2], index: usize) -> Option<usize> {
    if all.iter().all(|names| names.len() == 1) || all[0] == all[1] {
        return Some(index);
    }
    let name = all[0].get(index).copied().flatten()?;
    let is_same = |other: &Option<&str>| *other == Some(name);
    let is_unique =
        |names: &[Option<&str>]| names.iter().copied().filter(|it| is_same(it)).count() == 1;
    let same = all[1].iter().position(is_same);
    same.filter(|_| all.iter().all(|names| is_unique(names)))
}

/// Why a comparison fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum FaultKind {
    /// A difference is over its bound.
    Over,
    /// A number is NaN or infinite in only one.
    NotFinite,
    /// A track or a scalar is in only one.
    Missing,
}

/// The heading of the options for trajectories in help.
const TRAJECTORIES: &str = "Trajectories";

/// The differences that were found, as JSON has them.
#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
enum ComparisonReport {
    Clips(Vec<ClipDifference>),
    Array(ArrayDifference),
    Trajectory(Box<PathDifference>),
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check_range(arguments.start, arguments.end)?;
    if (arguments.start, arguments.end) != (None, None) && arguments.fps.is_none() {
        return Err(Failure::usage("--start and --end are for --fps; add it"));
    }
    arguments.check_trajectories()?;
    if let Some(folders) = folders::named(&arguments.inputs) {
        return folders::run(arguments, folders);
    }
    if !arguments.inputs.has_list() {
        check_kinds(&arguments.inputs)?;
    }
    let inputs = arguments.inputs.with_repeats()?;
    let [first, second] = &inputs[..] else {
        return Err(not_two(&words::count(inputs.len(), "file")));
    };
    let paths = [first.as_path(), second.as_path()];
    arguments.check_table(paths)?;
    arguments.check_second_order(&[paths[1]])?;
    let (report, rest) = arguments.compared(paths)?;
    arguments.check_effects(&report)?;
    arguments.print(&report)?;
    arguments.judge(&report).and(rest)
}

/// Refuses to compare a directory with anything except a directory. Otherwise the files in it would be counted as
/// inputs.
fn check_kinds(inputs: &Inputs) -> Result<(), Failure> {
    let paths = inputs.named_paths();
    let (directories, others): (Vec<_>, Vec<_>) = paths.iter().partition(|path| path.is_dir());
    let Some(directory) = directories.first() else {
        return Ok(());
    };
    for path in others.iter().filter(|path| !names::is_standard(path)) {
        path.metadata().map_err(|error| {
            let message = format!("cannot be read: {error}");
            let fault = Diagnostic::new(names::input(path), Code::Open, message);
            Failure::input(&fault, "")
        })?;
    }
    if let ([_], [other]) = (&*directories, &*others) {
        return Err(Failure::usage(format!(
            "two files or two directories are compared, but {} is a directory and {} is none",
            names::input(directory),
            names::input(other)
        )));
    }
    let mut counts = match directories.len() {
        1 => "1 directory".to_owned(),
        count => format!("{count} directories"),
    };
    if !others.is_empty() {
        counts = format!("{counts} and {}", words::count(others.len(), "file"));
    }
    Err(not_two(&counts))
}

/// The refusal of inputs that are not two.
fn not_two(counts: &str) -> Failure {
    Failure::usage(format!(
        "two files or two directories are compared, not {counts}"
    ))
}

impl Arguments {
    /// The differences of two files; and the failure of their animations that were refused.
    fn compared(
        &self,
        paths: [&Path; 2],
    ) -> Result<(ComparisonReport, Result<(), Failure>), Failure> {
        Ok(match self.are_arrays(paths)? {
            _ if self.is_of_trajectories() => {
                let (found, rest) = self.trajectory(paths)?;
                (ComparisonReport::Trajectory(Box::new(found)), rest)
            }
            true => (ComparisonReport::Array(self.arrays(paths)?), Ok(())),
            false => {
                let (found, rest) = self.clips(paths)?;
                (ComparisonReport::Clips(found), rest)
            }
        })
    }

    /// Refuses options for the joints of motions if no joints are compared.
    fn check_table(&self, paths: [&Path; 2]) -> Result<(), Failure> {
        let compared = match self.is_of_trajectories() {
            true => "trajectories",
            false if self.are_arrays(paths)? => "arrays",
            false => return Ok(()),
        };
        let option = self.csv.then_some("--csv").or(self.table.set_option());
        match option {
            Some(option) => Err(Failure::usage(format!(
                "{option} is for the joints of motions, and two {compared} are compared; leave it out"
            ))),
            None => Ok(()),
        }
    }

    fn print(&self, report: &ComparisonReport) -> Result<(), Failure> {
        let table = self.table;
        match report {
            ComparisonReport::Clips(found) => {
                let ordered = found.iter().map(|found| {
                    let mut found = found.clone();
                    found.joints = table.listed(&found.joints);
                    found.each_scalar = table.listed_scalars(&found.each_scalar);
                    found
                });
                if self.csv {
                    let csv = csv_table(&ordered.collect::<Vec<_>>());
                    let csv = csv.map_err(|error| Failure::writing("standard output", &error))?;
                    return listing::text(&csv);
                }
                if self.json {
                    return listing::json(&ComparisonReport::Clips(ordered.collect()));
                }
                let lines: String = found.iter().map(|it| text::of_clips(it, table)).collect();
                listing::text(&lines)
            }
            report if self.json => listing::json(report),
            ComparisonReport::Array(found) => listing::text(&text::of_arrays(found)),
            ComparisonReport::Trajectory(found) => listing::text(&text::of_paths(found)),
        }
    }

    /// Whether the second is an estimate of the path of the first.
    fn is_of_trajectories(&self) -> bool {
        let has_option = self.align.is_some() || self.associate.is_some() || self.max_gap.is_some();
        has_option || self.ape || self.rpe.is_some()
    }

    /// Whether absolute errors of trajectories are computed.
    fn is_absolute(&self) -> bool {
        self.ape || self.rpe.is_none()
    }

    /// Refuses options that contradict those of trajectories.
    fn check_trajectories(&self) -> Result<(), Failure> {
        if !self.is_of_trajectories() {
            return Ok(());
        }
        if self.fps.is_some() || self.world {
            let message = "trajectories are compared in the world at their poses; leave out --fps and --world";
            return Err(Failure::usage(message));
        }
        if !self.is_absolute() && (self.tolerance.is_some() || self.distance.is_some()) {
            let message = "--tolerance and --distance are limits of absolute errors; add --ape, or leave them out";
            return Err(Failure::usage(message));
        }
        if matches!(self.associate, Some(Associate::Nearest(_))) && self.max_gap.is_some() {
            return Err(Failure::usage(
                "--max-gap is for interpolated poses, and --associate nearest takes poses as they are; leave out one",
            ));
        }
        Ok(())
    }

    /// The one track of both files, as paths.
    fn trajectory(
        &self,
        paths: [&Path; 2],
    ) -> Result<(PathDifference, Result<(), Failure>), Failure> {
        let [first, second] = [
            self.inputs.load_one(paths[0])?,
            self.second_inputs(paths[1])?.load_one(paths[1])?,
        ];
        let names = paths.map(names::input);
        let track = |clip: &Motion, name: &str| {
            let all = || (0..clip.set.track_count()).collect();
            let chosen = self.inputs.tracks.of(clip, name)?.unwrap_or_else(all);
            // Keep all other tracks of the clip, because the position of a track depends on its ancestors.
            let &[track] = &chosen[..] else {
                let message = format!(
                    "{name}: has {}; a trajectory has one, choose it with --tracks",
                    words::count(chosen.len(), "track")
                );
                return Err(Failure::new(ALL_INPUTS, message));
            };
            Ok(track)
        };
        let tracks = [
            track(&first.clip, &names[0])?,
            track(&second.clip, &names[1])?,
        ];
        let engine =
            Engine::new(Device::Cpu).map_err(|error| Failure::evaluating(&names[0], &error))?;
        let measure = PathMeasure {
            align: self.align.unwrap_or_default(),
            is_absolute: self.is_absolute(),
            step: self.rpe,
            associate: self.associate.unwrap_or_default(),
            max_gap: self.max_gap,
            offset: self.time_offset.unwrap_or_default(),
        };
        let clips = [
            (&*names[0], &first.clip, tracks[0]),
            (&*names[1], &second.clip, tracks[1]),
        ];
        let mut found = PathDifference::of(&engine, clips, &measure).map_err(refused)?;
        found.inputs = paths.map(names::recorded);
        found.warnings.iter().for_each(|it| words::warning(it));
        Ok((found, first.rest.and(second.rest)))
    }

    /// How the second input is read.
    fn second_inputs(&self, path: &Path) -> Result<Cow<'_, Inputs>, Failure> {
        let Some(order) = self.second_source_order else {
            return Ok(Cow::Borrowed(&self.inputs));
        };
        match self.inputs.format(path).takes(FormatOption::SourceOrder) {
            true => Ok(Cow::Owned(self.inputs.with_source_order(order)?)),
            false => Ok(Cow::Borrowed(&self.inputs)),
        }
    }

    /// Refuses an order of components for second inputs none of which has a choice of orders.
    fn check_second_order(&self, seconds: &[&Path]) -> Result<(), Failure> {
        let takes = |path: &&Path| self.inputs.format(path).takes(FormatOption::SourceOrder);
        if self.second_source_order.is_none() || seconds.iter().any(takes) {
            return Ok(());
        }
        let formats = seconds.iter().map(|path| self.inputs.format(path).name);
        let formats: BTreeSet<&str> = formats.collect();
        let formats: Vec<&str> = formats.into_iter().collect();
        Err(Failure::usage(format!(
            "--second-source-order has no effect on {}; it is for {}; leave it out",
            formats.join(", "),
            Format::names_taking(FormatOption::SourceOrder)
        )))
    }

    /// Refuses options for joints and bounds of other quantities if only scalars are compared.
    fn check_effects(&self, report: &ComparisonReport) -> Result<(), Failure> {
        let ComparisonReport::Clips(all) = report else {
            return Ok(());
        };
        if all.iter().any(|found| found.rotation.is_some()) {
            return Ok(());
        }
        let has = |kind: ScalarKind| {
            let mut scalars = all.iter().flat_map(|found| &found.scalars);
            scalars.any(|scalar| scalar.kind.parse() == Ok(kind))
        };
        let is_listed = self.json || self.csv;
        let tolerates = self.tolerance.is_none_or(|bound| bound == 0.0) || has(ScalarKind::Angle);
        let distances = self.distance.is_none() || has(ScalarKind::Length);
        for (is_idle, option, remedy) in [
            (self.world, "--world", "leave it out"),
            (self.table.ranks(), "--worst-by", "leave it out"),
            (
                self.table.limits() && !is_listed,
                "--top",
                "leave it out, or list the scalars by --json or --csv",
            ),
            (
                !tolerates,
                "--tolerance",
                "none is an angle; leave it out, or give 0 to require that all are equal",
            ),
            (!distances, "--distance", "none is a length; leave it out"),
        ] {
            if is_idle {
                return Err(Failure::usage(format!(
                    "{option} has no effect where only scalars are compared; {remedy}"
                )));
            }
        }
        Ok(())
    }

    /// The arrays of two NPY files.
    fn arrays(&self, paths: [&Path; 2]) -> Result<ArrayDifference, Failure> {
        let options = self.inputs.options()?;
        let read = |path| {
            open_numbers(path, &options).map_err(|error: Diagnostic| Failure::input(&error, ""))
        };
        let arrays = [read(paths[0])?, read(paths[1])?];
        let names = paths.map(names::input);
        let found = ArrayDifference::of([&names[0], &names[1]], arrays.each_ref());
        found.map_err(refused)
    }

    /// Whether both are arrays that are compared number by number.
    fn are_arrays(&self, paths: [&Path; 2]) -> Result<bool, Failure> {
        let is_array = |path: &Path| Format::detected(path).name == "npy";
        let has_options = self.inputs.tracks.is_set() || self.inputs.reading.is_set();
        let all = paths.iter().all(|path| is_array(path));
        if !all || has_options {
            return Ok(false);
        }
        if self.fps.is_some()
            || self.world
            || self.distance.is_some()
            || self.time_offset.is_some()
            || self.second_source_order.is_some()
        {
            return Err(Failure::usage(
                "two arrays are compared number by number, without --fps, --world, --distance, --time-offset and \
                 --second-source-order; say what they mean (--source-fps, --map) to compare them as motions",
            ));
        }
        Ok(true)
    }

    /// The differences of each clip of one file from its partner in the other file; and the failure of the clips that
    /// were refused.
    fn clips(
        &self,
        paths: [&Path; 2],
    ) -> Result<(Vec<ClipDifference>, Result<(), Failure>), Failure> {
        let loaded = [
            self.inputs.load(paths[0])?,
            self.second_inputs(paths[1])?.load(paths[1])?,
        ];
        let rest = (paths.iter().zip(&loaded))
            .try_for_each(|(path, loaded)| input::check_complete(&names::input(path), loaded));
        let counts = [0, 1].map(|side| loaded[side].clips.len());
        if counts[0] != counts[1] {
            return Err(Failure::new(
                ALL_INPUTS,
                format!(
                    "{} has {} and {} has {}; choose one of each (--animation)",
                    names::input(paths[0]),
                    words::count(counts[0], "animation"),
                    names::input(paths[1]),
                    words::count(counts[1], "animation"),
                ),
            ));
        }
        let partner = partners(paths, [&loaded[0].clips, &loaded[1].clips])?;
        let engine = Engine::new(Device::Cpu)
            .map_err(|error| Failure::evaluating(&names::input(paths[0]), &error))?;
        let offset = self.time_offset.unwrap_or_default();
        let mut found = Vec::new();
        for (index, first) in loaded[0].clips.iter().enumerate() {
            let second = &loaded[1].clips[partner[index]];
            let of_clips = |name: fn(&Path) -> String| {
                [(paths[0], first), (paths[1], second)].map(|(path, clip)| match counts[0] {
                    1 => name(path),
                    _ => format!("{} {}", name(path), names::clip(clip)),
                })
            };
            let names = of_clips(names::input);
            let inputs = [&*names[0], &names[1]];
            let selected = [
                self.select(first, inputs[0])?,
                self.select(second, inputs[1])?,
            ];
            let clips = [&*selected[0], &selected[1]];
            if !self.world {
                let whole = ClipPair {
                    inputs,
                    clips: [first, second],
                    offset,
                };
                whole.check_parents(clips).map_err(refused)?;
            }
            let pair = ClipPair {
                inputs,
                clips,
                offset,
            };
            let mut differences = self.differences(&engine, pair)?;
            differences.inputs = of_clips(names::recorded);
            found.push(differences);
        }
        Ok((found, rest))
    }

    /// The selected tracks of a clip, with names, so that tracks without names keep those that they are selected by.
    fn select<'a>(&self, clip: &'a Motion, name: &str) -> Result<Cow<'a, Motion>, Failure> {
        let tracks = &self.inputs.tracks;
        let mut selected = match self.world {
            true => tracks.select_with_ancestors(clip, name)?,
            false => tracks.select(clip, name)?,
        };
        if let Some(indices) = tracks.of(clip, name)? {
            let indices = match self.world {
                true => clip.with_ancestors(&indices),
                false => indices,
            };
            for (track, index) in indices.into_iter().enumerate() {
                let named = selected
                    .to_mut()
                    .set
                    .set_name(track, clip.set.track_name(index));
                named.map_err(|error| Failure::evaluating(name, &error.into()))?;
            }
        }
        Ok(selected)
    }

    /// The differences of two clips at the requested frames.
    fn differences(&self, engine: &Engine, pair: ClipPair<'_>) -> Result<ClipDifference, Failure> {
        let common = pair.common_times().map_err(refused)?;
        for warning in common.warning.iter().chain(&pair.assumptions()) {
            words::warning(warning);
        }
        let frames = match self.fps {
            Some(rate) => {
                let frames = pair.frames(&common, rate, self.start, self.end);
                frames.map_err(refused)?
            }
            None => pair.keys(&common),
        };
        for (name, clip) in pair.inputs.into_iter().zip(pair.clips) {
            room::in_memory(name, &clip.set, &frames, 7)?;
        }
        let found = pair.differences(engine, &frames, self.world);
        found.map_err(refused)
    }

    /// Returns an error if a difference is over its bound.
    fn judge(&self, report: &ComparisonReport) -> Result<(), Failure> {
        let faults = self.faults(report);
        let texts: Vec<String> = faults.into_iter().map(|(_, text)| text).collect();
        match texts.is_empty() {
            true => Ok(()),
            false => Err(Failure::new(
                DIFFERENCE,
                format!("they differ: {}", texts.join(", ")),
            )),
        }
    }

    /// The faults of a comparison, each with its kind.
    fn faults(&self, report: &ComparisonReport) -> Vec<(FaultKind, String)> {
        let over = |quantity: &str, largest: f64, bound: Option<f64>, unit: &str| {
            let bound = bound.filter(|&bound| largest > bound)?;
            let largest = words::decimals(largest);
            let text = format!("{quantity} of {largest}{unit} over {bound}{unit}");
            Some((FaultKind::Over, text))
        };
        let mut faults = Vec::new();
        match report {
            ComparisonReport::Array(found) => {
                faults.extend(match &found.rotation {
                    Some(rotation) => over("angle", rotation.largest, self.tolerance, "°"),
                    None => over("difference", found.difference.largest, self.tolerance, ""),
                });
                if found.not_finite > 0 && self.tolerance.is_some() {
                    faults.push((FaultKind::NotFinite, text::not_finite(found.not_finite)));
                }
            }
            ComparisonReport::Trajectory(found) => {
                if let Some(absolute) = &found.ape {
                    faults.extend(over("angle", absolute.rotation.max, self.tolerance, "°"));
                    faults.extend(over(
                        "distance",
                        absolute.translation.max,
                        self.distance,
                        "",
                    ));
                }
            }
            ComparisonReport::Clips(all) => {
                for found in all {
                    if let Some(rotation) = &found.rotation {
                        let angle = rotation.spread.largest;
                        faults.extend(over("angle", angle, self.tolerance, "°"));
                    }
                    if let Some(moved) = &found.translation {
                        let distance = moved.spread.largest;
                        faults.extend(over("distance", distance, self.distance, ""));
                    }
                    for ScalarDifference {
                        kind, difference, ..
                    } in &found.scalars
                    {
                        let (bound, unit) = match kind.parse() {
                            Ok(ScalarKind::Angle) => (self.tolerance, "°"),
                            Ok(ScalarKind::Length) => (self.distance, ""),
                            // Numbers without a unit have no tolerance, except 0, which requires that all numbers are
                            // equal.
                            _ => (self.tolerance.filter(|&bound| bound == 0.0), ""),
                        };
                        let quantity = format!("{kind} {}", difference.track);
                        faults.extend(over(&quantity, difference.spread.largest, bound, unit));
                    }
                    let has_bound = self.tolerance.is_some() || self.distance.is_some();
                    let missing: usize = found.missing.iter().map(Vec::len).sum();
                    if missing > 0 && has_bound {
                        let tracks = words::count(missing, "track");
                        let text = format!("{tracks} in only one of the files (--tracks)");
                        faults.push((FaultKind::Missing, text));
                    }
                    let missing: usize = found.missing_scalars.iter().map(Vec::len).sum();
                    if missing > 0 && has_bound {
                        let scalars = words::count(missing, "scalar");
                        let text = format!("{scalars} in only one of the files");
                        faults.push((FaultKind::Missing, text));
                    }
                }
            }
        }
        faults
    }
}
