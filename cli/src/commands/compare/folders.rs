//! Two directories, such as the results of a batch before and after a change: the files of one relative name are
//! compared.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tumble_formats::compare::{
    ArrayDifference, ChannelDifference, ClipDifference, PathDifference, ScalarDifference,
};
use tumble_formats::motion::ScalarKind;
use tumble_formats::printable::printable;

use crate::arguments::input::{Inputs, directory_failure};
use crate::commands::compare::table::aligned;
use crate::commands::compare::text::not_finite;
use crate::commands::compare::{Arguments, ComparisonReport, FaultKind};
use crate::messages::exit::{ALL_INPUTS, DIFFERENCE, Failure, Outcomes};
use crate::messages::{listing, names, words};

/// The two directories that a command line names; `None` if it names anything else.
pub(super) fn named(inputs: &Inputs) -> Option<[&Path; 2]> {
    match inputs.named_paths() {
        [first, second] if first.is_dir() && second.is_dir() && !inputs.has_list() => {
            Some([first, second])
        }
        _ => None,
    }
}

/// The largest differences of two files, each over all animations, tracks and samples.
#[derive(Debug, Clone, Copy, Default, Serialize)]
struct LargestDifferences {
    /// In degrees.
    angle: f64,
    /// Of positions and lengths, in the files' unit.
    distance: f64,
    /// Of scales, of other numbers and of arrays.
    number: f64,
    /// Tracks and scalars that only one of the files has.
    missing: usize,
    /// Numbers of arrays that are NaN or infinite in only one of the files; not in `number`.
    not_finite: usize,
    /// Seconds that only one of the two has, and which are not compared.
    unshared_seconds: f64,
}

/// The comparison of the files of one name.
#[derive(Debug, Serialize)]
struct FilePair {
    /// Path below both directories.
    file: String,
    #[serde(flatten)]
    differences: Option<LargestDifferences>,
    /// The errors of the second as an estimate of the first, where trajectories are compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    trajectory: Option<Box<PathDifference>>,
    /// Why they cannot be compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

/// The comparison of two directories, as JSON has it.
#[derive(Debug, Serialize)]
struct FolderDifference {
    inputs: [String; 2],
    pairs: Vec<FilePair>,
    /// Files that only the first directory has, and those that only the second has.
    missing: [Vec<String>; 2],
}

/// Compares all files of two directories that have one relative name.
pub(super) fn run(arguments: &Arguments, folders: [&Path; 2]) -> Result<(), Failure> {
    if let Some(option) = arguments
        .csv
        .then_some("--csv")
        .or(arguments.table.set_option())
    {
        return Err(Failure::usage(format!(
            "{option} is for the joints of two files, and two directories are compared; leave it out (--json lists all \
             pairs of files)"
        )));
    }
    let mut by_name: BTreeMap<PathBuf, [Option<PathBuf>; 2]> = BTreeMap::new();
    for (side, folder) in folders.into_iter().enumerate() {
        for found in arguments.inputs.gather_library(folder)?.files {
            if found.path == folder {
                return Err(directory_failure(folder));
            }
            by_name.entry(found.below).or_default()[side] = Some(found.path);
        }
    }
    let paths: Vec<&PathBuf> = by_name.values().flatten().flatten().collect();
    arguments.inputs.check_formats(&paths)?;
    let mut report = FolderDifference {
        inputs: folders.map(names::recorded),
        pairs: Vec::new(),
        missing: Default::default(),
    };
    let mut pairs = Vec::new();
    for (name, found) in &by_name {
        let name = names::recorded(name);
        match found {
            [Some(first), Some(second)] => pairs.push((name, [&**first, &**second])),
            [Some(_), None] => report.missing[0].push(name),
            _ => report.missing[1].push(name),
        }
    }
    if pairs.is_empty() {
        let [first, second] = folders.map(names::input);
        let message = format!(
            "no file of {first} has the relative name of a file of {second}; to compare two files of other names, \
             name both"
        );
        return Err(Failure::new(ALL_INPUTS, message));
    }
    let seconds: Vec<&Path> = pairs.iter().map(|(_, paths)| paths[1]).collect();
    arguments.check_second_order(&seconds)?;
    let mut outcomes = Outcomes::of(pairs.len());
    let mut partial = 0;
    let mut of_kinds: BTreeMap<FaultKind, usize> = BTreeMap::new();
    for (file, paths) in pairs {
        let mut pair = FilePair {
            file,
            differences: None,
            trajectory: None,
            error: None,
        };
        match arguments.compared(paths) {
            Ok((found, rest)) => {
                let faults = arguments.faults(&found).into_iter();
                let kinds: BTreeSet<FaultKind> = faults.map(|(kind, _)| kind).collect();
                for kind in kinds {
                    *of_kinds.entry(kind).or_default() += 1;
                }
                match found {
                    ComparisonReport::Trajectory(found) => pair.trajectory = Some(found),
                    ComparisonReport::Clips(clips) => {
                        let mut largest = LargestDifferences::default();
                        clips.iter().for_each(|clip| largest.add(clip));
                        partial += usize::from(largest.unshared_seconds > 0.0);
                        pair.differences = Some(largest);
                    }
                    ComparisonReport::Array(found) => {
                        pair.differences = Some(LargestDifferences::of_arrays(&found));
                    }
                }
                outcomes.add(rest);
            }
            Err(failure) => {
                pair.error = Some(failure.message().to_owned());
                outcomes.add(Err(failure));
            }
        }
        report.pairs.push(pair);
        if outcomes.is_ended() {
            break;
        }
    }
    match arguments.json {
        true => listing::json(&report)?,
        false => listing::text(&report.text())?,
    }
    outcomes.finish()?;
    let has_bound = arguments.tolerance.is_some() || arguments.distance.is_some();
    let missing: usize = report.missing.iter().map(Vec::len).sum();
    let mut faults = Vec::new();
    faults.extend(of_kinds.into_iter().map(|(kind, count)| {
        let pairs = words::count(count, "pair");
        match kind {
            FaultKind::Over => format!("{pairs} over the limit"),
            FaultKind::NotFinite => {
                format!("{pairs} with numbers that only one has as NaN or infinite")
            }
            FaultKind::Missing => {
                format!("{pairs} with tracks or scalars in only one of the files")
            }
        }
    }));
    if partial > 0 && has_bound {
        faults.push(format!(
            "{} of which one is longer than the other",
            words::count(partial, "pair")
        ));
    }
    if missing > 0 && has_bound {
        faults.push(words::count(missing, "file") + " in only one of the directories");
    }
    match faults.is_empty() {
        true => Ok(()),
        false => Err(Failure::new(
            DIFFERENCE,
            format!("they differ: {}", faults.join(", ")),
        )),
    }
}

impl LargestDifferences {
    fn of_arrays(found: &ArrayDifference) -> Self {
        match &found.rotation {
            Some(rotation) => Self {
                angle: rotation.largest,
                ..Self::default()
            },
            None => Self {
                number: found.difference.largest,
                not_finite: found.not_finite,
                ..Self::default()
            },
        }
    }

    fn add(&mut self, clip: &ClipDifference) {
        let largest = |channel: &Option<ChannelDifference>| {
            channel.as_ref().map_or(0.0, |it| it.spread.largest)
        };
        self.angle = self.angle.max(largest(&clip.rotation));
        self.distance = self.distance.max(largest(&clip.translation));
        self.number = self.number.max(largest(&clip.scale));
        for ScalarDifference {
            kind, difference, ..
        } in &clip.scalars
        {
            let of_kind = match kind.parse() {
                Ok(ScalarKind::Angle) => &mut self.angle,
                Ok(ScalarKind::Length) => &mut self.distance,
                _ => &mut self.number,
            };
            *of_kind = of_kind.max(difference.spread.largest);
        }
        self.unshared_seconds += clip.unshared_seconds;
        let missing = clip.missing.iter().chain(&clip.missing_scalars);
        self.missing += missing.map(Vec::len).sum::<usize>();
    }

    fn is_none(self) -> bool {
        let numbers = [
            self.angle,
            self.distance,
            self.number,
            self.unshared_seconds,
        ];
        self.missing + self.not_finite == 0 && numbers == [0.0; 4]
    }
}

impl FolderDifference {
    /// A line for each pair that differs, or a table of the errors of all trajectories, and a summary.
    fn text(&self) -> String {
        let mut text = self.trajectories_text();
        let is_of_trajectories = !text.is_empty();
        let (mut same, mut failed) = (0, 0);
        for pair in &self.pairs {
            let name = printable(&pair.file);
            match (pair.differences, &pair.error) {
                (Some(found), _) if found.is_none() => same += 1,
                (Some(found), _) => {
                    let mut parts = Vec::new();
                    for (quantity, number, unit) in [
                        ("angle", found.angle, "°"),
                        ("distance", found.distance, ""),
                        ("number", found.number, ""),
                    ] {
                        if number > 0.0 {
                            parts.push(format!("{quantity} {}{unit}", words::decimals(number)));
                        }
                    }
                    if found.not_finite > 0 {
                        parts.push(not_finite(found.not_finite));
                    }
                    if found.missing > 0 {
                        parts.push(match found.missing {
                            1 => "1 track or scalar in only one".to_owned(),
                            count => format!("{count} tracks or scalars in only one"),
                        });
                    }
                    if found.unshared_seconds > 0.0 {
                        let seconds = words::decimals(found.unshared_seconds);
                        parts.push(format!("{seconds} s in only one"));
                    }
                    let _ = writeln!(text, "{name}: {}", parts.join(", "));
                }
                (None, None) => {}
                (None, Some(_)) => {
                    failed += 1;
                    let _ = writeln!(text, "{name}: not compared");
                }
            }
        }
        let pairs = words::count(self.pairs.len(), "pair");
        let _ = match is_of_trajectories {
            true => write!(text, "{pairs} of trajectories"),
            false => {
                let differing = self.pairs.len() - same - failed;
                write!(
                    text,
                    "{pairs} of files: {same} without a difference, {differing} with one"
                )
            }
        };
        if failed > 0 {
            let _ = write!(text, ", {failed} not compared");
        }
        for (folder, files) in self.inputs.iter().zip(&self.missing) {
            if let Some(first) = files.first() {
                let count = words::count(files.len(), "file");
                let first = printable(first);
                let _ = write!(text, "\n{count} only in {}: {first}", printable(folder));
                if files.len() > 1 {
                    text.push_str(" … (--json lists all)");
                }
            }
        }
        text.push('\n');
        text
    }

    /// A row for each kind of errors of each pair of trajectories; empty where there are none.
    fn trajectories_text(&self) -> String {
        let mut rows = Vec::new();
        for pair in &self.pairs {
            let Some(found) = &pair.trajectory else {
                continue;
            };
            for (kind, errors) in [("absolute", &found.ape), ("relative", &found.rpe)] {
                let Some(errors) = errors else { continue };
                let mut row = vec![printable(&pair.file).into_owned(), kind.to_owned()];
                row.push(errors.count.to_string());
                for (numbers, unit) in [(&errors.translation, ""), (&errors.rotation, "°")] {
                    let numbers = [numbers.rmse, numbers.max];
                    row.extend(numbers.map(|it| format!("{}{unit}", words::decimals(it))));
                }
                rows.push(row);
            }
        }
        if rows.is_empty() {
            return String::new();
        }
        let names = "file,errors,count,translation rmse,max,rotation rmse,max";
        rows.insert(0, names.split(',').map(str::to_owned).collect());
        aligned(&rows, 2)
    }
}
