//! The options of a command line: which are explicit, and the values of all. For the commands that write results, each
//! option has a row in [`OPTIONS`]: whether it determines the bytes of results, and which inputs or results it applies
//! to. An option that has no effect is refused, with a remedy, and never ignored. Manifests record the options that
//! determine bytes, by their names.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use serde::{Deserialize, Serialize};
use tumble::{Encoding, Layout};
use tumble_formats::end_frame::{SampledKind, SampledResult};
use tumble_formats::format::{Format, FormatOption};

use crate::arguments::global::GLOBAL;
use crate::arguments::interpolation::InterpolationArguments;
use crate::arguments::output::OutputArguments;
use crate::arguments::time::EndFrameArguments;
use crate::batch::digest::{self, InputFile};
use crate::messages::exit::Failure;
use crate::messages::names;

/// A rule about an option of this name, with `_`.
pub(crate) struct OptionRule {
    pub(crate) name: &'static str,
    pub(crate) bytes: Bytes,
    pub(crate) applies_to: AppliesTo,
}

/// The part of an option on which the bytes of a result depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bytes {
    /// No part: the option names the places of inputs and results, permits something, selects the device, or controls
    /// reports. Times may come from standard input, so the commands that read them add their hash.
    Unchanged,
    /// Its value.
    ByValue,
    /// The content of the file that it names.
    ByContent,
}

/// The inputs or results to which an option applies.
pub(crate) enum AppliesTo {
    /// All inputs and results of its command. Combinations that depend on values are refused by the code that uses the
    /// values.
    All,
    /// Inputs of formats that take it.
    Inputs(FormatOption),
    /// Results for which this gives no reason against it.
    Results(fn(&ResultDescription<'_>) -> Option<String>),
}

/// The kind of a result of `tumble eval`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ResultKind {
    /// The numbers of rotations as they come.
    Rotations,
    /// Whole poses.
    Poses,
    /// A clip with all its channels.
    Motion,
    /// The input's file with other keys.
    Baked,
    /// The motion of a robot in the layout of another program.
    Robot,
}

impl ResultKind {
    pub(crate) fn is_clip(self) -> bool {
        matches!(self, Self::Motion | Self::Baked)
    }
}

/// A result of `tumble eval`, as far as options apply to it or do not.
pub(crate) struct ResultDescription<'a> {
    pub(crate) kind: ResultKind,
    pub(crate) format: &'static Format,
    pub(crate) output: &'a OutputArguments,
    pub(crate) layout: Layout,
    pub(crate) encoding: Encoding,
    pub(crate) end_frame: &'a EndFrameArguments,
    /// Whether the times are written to a separate file.
    pub(crate) times_apart: bool,
}

impl ResultDescription<'_> {
    /// The result, as far as the rule for its end depends on it.
    pub(crate) fn sampled(&self) -> SampledResult<'static> {
        SampledResult {
            format: self.format,
            times_apart: self.times_apart,
            kind: match self.kind {
                ResultKind::Motion | ResultKind::Baked => SampledKind::Clips,
                ResultKind::Rotations if self.output.is_rotations() => SampledKind::Rotations,
                ResultKind::Rotations | ResultKind::Poses | ResultKind::Robot => {
                    SampledKind::Numbers
                }
            },
        }
    }
}

const fn silent(name: &'static str) -> OptionRule {
    OptionRule {
        name,
        bytes: Bytes::Unchanged,
        applies_to: AppliesTo::All,
    }
}

const fn deciding(name: &'static str) -> OptionRule {
    OptionRule {
        name,
        bytes: Bytes::ByValue,
        applies_to: AppliesTo::All,
    }
}

const fn reading(name: &'static str, option: FormatOption) -> OptionRule {
    OptionRule {
        name,
        bytes: Bytes::ByValue,
        applies_to: AppliesTo::Inputs(option),
    }
}

const fn of_results(
    name: &'static str,
    refusal: fn(&ResultDescription<'_>) -> Option<String>,
) -> OptionRule {
    OptionRule {
        name,
        bytes: Bytes::ByValue,
        applies_to: AppliesTo::Results(refusal),
    }
}

/// All options of the commands that write results (they have `--resume`). Where several have no effect, the
/// message is about the first.
pub(crate) const OPTIONS: &[OptionRule] = &[
    // Inputs.
    silent("paths"),
    silent("files_from"),
    silent("null"),
    silent("base"),
    silent("exclude"),
    silent("pipes"),
    silent("max_size"),
    silent("max_memory"),
    deciding("from"),
    deciding("animation"),
    deciding("tracks"),
    deciding("up_axis"),
    reading("raw_times", FormatOption::RawTimes),
    reading("duplicates", FormatOption::Duplicates),
    reading("source_fps", FormatOption::SourceRate),
    reading("override_fps", FormatOption::OverrideRate),
    OptionRule {
        bytes: Bytes::ByContent,
        ..reading("source_times", FormatOption::TimesApart)
    },
    reading("map", FormatOption::Map),
    reading("time_unit", FormatOption::TimeUnit),
    reading("source_order", FormatOption::SourceOrder),
    reading("bridge_gaps", FormatOption::BridgeGaps),
    reading("keyframes", FormatOption::Keyframes),
    OptionRule {
        bytes: Bytes::ByContent,
        ..deciding("robot")
    },
    deciding("source_body_order"),
    // Results.
    silent("out"),
    silent("overwrite"),
    silent("resume"),
    silent("dry_run"),
    silent("prune"),
    silent("names"),
    silent("verbose"),
    silent("format"),
    silent("times_out"),
    silent("shard"),
    silent("shard_bytes"),
    silent("json"),
    silent("explain_route"),
    deciding("plot"),
    // The device.
    silent("device"),
    silent("allow_inexact"),
    silent("memory"),
    // Samples.
    deciding("fps"),
    silent("times"),
    deciding("start"),
    deciding("end"),
    deciding("from_zero"),
    deciding("at"),
    of_results("end_frame", end_frame),
    deciding("max_gap"),
    deciding("in_gaps"),
    // Curves.
    deciding("method"),
    deciding("ends"),
    deciding("signs"),
    deciding("speed"),
    deciding("before"),
    deciding("after"),
    deciding("tension"),
    deciding("continuity"),
    deciding("bias"),
    // The quantity that is written of each rotation, and its encoding.
    deciding("quantity"),
    of_results("sequence", sequence),
    of_results("major", major),
    of_results("axes", axes),
    of_results("parents", parents),
    of_results("order", order),
    of_results("layout", layout),
    of_results("encoding", encoding),
    of_results("linear", linear),
    of_results("scale", |result| lengths(result, "scale")),
    OptionRule {
        bytes: Bytes::ByContent,
        ..of_results("offsets", |result| lengths(result, "offsets"))
    },
    OptionRule {
        bytes: Bytes::ByContent,
        ..of_results("body_model", |result| lengths(result, "body-model"))
    },
    // Motion of robots.
    deciding("dialect"),
    deciding("body_order"),
    deciding("joint_order"),
    deciding("siblings"),
    deciding("velocity_at"),
    deciding("fixed_bodies"),
    deciding("velocities"),
    deciding("limits"),
    deciding("describe"),
    deciding("mirror"),
    of_results("root_motion", root_motion),
    deciding("heading"),
    deciding("root_joint"),
    // Options of retargeting.
    OptionRule {
        bytes: Bytes::ByContent,
        ..deciding("onto")
    },
    OptionRule {
        bytes: Bytes::ByContent,
        ..deciding("bones")
    },
    deciding("rest"),
    deciding("rest_frame"),
    deciding("hips_scale"),
    silent("report"),
    // Features for learning.
    deciding("sets"),
    deciding("vertical"),
    deciding("contact_height"),
    deciding("contact_speed"),
    deciding("contact_window"),
    deciding("mirror_axis"),
    // Paths.
    deciding("seconds"),
    deciding("pace"),
    deciding("path_method"),
    deciding("path_ends"),
    deciding("path_frame"),
    deciding("path_up"),
    deciding("path_speed"),
    deciding("direction"),
    deciding("no_ups"),
    deciding("twist"),
    deciding("body_forward"),
    deciding("body_up"),
    // Smoothing and reduction.
    deciding("kernel"),
    deciding("low_pass"),
    deciding("passes"),
    deciding("edges"),
    deciding("tolerance"),
    deciding("distance"),
    deciding("shell"),
    deciding("quantize"),
    deciding("meshopt"),
];

/// Options that have been renamed: the command (as its text in a manifest begins), the old name and the new name.
const RENAMED: &[(&str, &str, &str)] = &[
    ("", "output", "quantity"),
    ("", "path", "signs"),
    ("", "up", "up_axis"),
    ("follow", "rate", "pace"),
    ("follow", "path_frames", "path_frame"),
    ("follow", "forward", "body_forward"),
    ("follow", "upward", "body_up"),
    ("smooth", "ends", "edges"),
    ("reduce", "curve", "method"),
];

/// The text of options in a manifest, with the names that they have now. The options of the command line are in the
/// order of their names; a text may have others after them.
pub(crate) fn with_present_names(text: &str) -> Cow<'_, str> {
    let is_option =
        |name: &str| rule(name).is_some() || RENAMED.iter().any(|(_, before, _)| *before == name);
    let (mut command, mut options) = (String::new(), Vec::<(String, String)>::new());
    for word in text.split(' ') {
        match (word.split_once('='), options.last_mut()) {
            (Some((name, value)), _) if is_option(name) => {
                options.push((name.to_owned(), value.to_owned()));
            }
            // The value contained a blank, so it was divided.
            (_, Some((_, value))) => *value += &format!(" {word}"),
            (_, None) => command = word.to_owned(),
        }
    }
    let ordered = options.is_sorted_by(|(a, _), (b, _)| a < b);
    let in_order = match ordered {
        true => options.len(),
        false => {
            1 + options
                .windows(2)
                .position(|pair| pair[0].0 >= pair[1].0)
                .unwrap_or(0)
        }
    };
    let mut has_changed = false;
    for (name, _) in &mut options[..in_order] {
        let of_command = |of: &str| of.is_empty() || of == command;
        let renamed = (RENAMED.iter()).find(|(of, before, _)| before == name && of_command(of));
        if let Some((_, _, since)) = renamed {
            *name = (*since).to_owned();
            has_changed = true;
        }
    }
    if !has_changed {
        return Cow::Borrowed(text);
    }
    options[..in_order].sort_by(|(a, _), (b, _)| a.cmp(b));
    let options = options
        .iter()
        .map(|(name, value)| format!("{name}={value}"));
    let command = Some(command).filter(|command| !command.is_empty());
    Cow::Owned(
        command
            .into_iter()
            .chain(options)
            .collect::<Vec<_>>()
            .join(" "),
    )
}

/// The command whose options have no name of a command before them.
pub(crate) const DEFAULT_COMMAND: &str = "eval";

/// The command with these options, as a manifest has them.
pub(crate) fn command_of(text: &str) -> &str {
    let first = text.split(' ').next().unwrap_or_default();
    match first.is_empty() || first.contains('=') {
        true => DEFAULT_COMMAND,
        false => first,
    }
}

/// Which options differ between the texts of two requests, such as `option --fps`.
pub(crate) fn changed_options(recorded: &str, current: &str) -> String {
    let entries = |text: &str| -> BTreeSet<String> { text.split(' ').map(str::to_owned).collect() };
    let (recorded, current) = (entries(recorded), entries(current));
    let changed = recorded.symmetric_difference(&current);
    let names = changed.filter_map(|entry| entry.split_once('=').map(|(name, _)| name));
    let names: BTreeSet<String> = names
        .map(|name| format!("--{}", name.replace('_', "-")))
        .collect();
    let names: Vec<String> = names.into_iter().collect();
    match names.len() {
        0 => "an option".to_owned(),
        1 => format!("option {}", names[0]),
        _ => format!("options {}", names.join(", ")),
    }
}

/// The rule of an option.
pub(crate) fn rule(name: &str) -> Option<&'static OptionRule> {
    OPTIONS.iter().find(|rule| rule.name == name)
}

impl ResultDescription<'_> {
    /// The reason why an option has no effect, if `applies` is false.
    fn unless(&self, applies: bool, option: &str, wants: &str) -> Option<String> {
        (!applies).then(|| {
            format!(
                "--{option} has no effect on --quantity {}; leave it out, or use {wants}",
                self.output.name()
            )
        })
    }
}

fn root_motion(result: &ResultDescription<'_>) -> Option<String> {
    let has_poses = result.kind.is_clip() || result.kind == ResultKind::Robot;
    (!has_poses).then(|| {
        let (name, quantity) = (result.format.name, result.output.name());
        format!(
            "--root-motion changes translations as well as rotations, and the result ({name}, --quantity {quantity}) \
             has only one of them; write NPZ, GLB or BVH"
        )
    })
}

fn sequence(result: &ResultDescription<'_>) -> Option<String> {
    // BVH stores Euler angles, whatever `--quantity` is.
    let is_angles = result.kind.is_clip() && result.format.takes(FormatOption::Sequence);
    let applies = result.output.is_euler() || is_angles;
    result.unless(applies, "sequence", "--quantity euler, or BVH")
}

fn major(result: &ResultDescription<'_>) -> Option<String> {
    let applies = result.output.is_matrix();
    result.unless(applies, "major", "--quantity matrix or matrix-3x4")
}

fn axes(result: &ResultDescription<'_>) -> Option<String> {
    let applies = result.output.is_rate();
    result.unless(applies, "axes", "--quantity velocity or acceleration")
}

fn parents(result: &ResultDescription<'_>) -> Option<String> {
    let applies = result.output.poses().is_some();
    result.unless(applies, "parents", "--quantity world or transform")
}

fn order(result: &ResultDescription<'_>) -> Option<String> {
    let (output, format) = (result.output, result.format);
    match result.kind {
        ResultKind::Poses if output.scalars().is_some() => Some(format!(
            "--order is for quaternions, and --quantity {} has none; leave it out",
            output.name()
        )),
        ResultKind::Rotations if !output.is_rotations() => Some(format!(
            "--order is for quaternions, and --quantity {} has none; leave it out",
            output.name()
        )),
        ResultKind::Motion if format.takes(FormatOption::Order) => None,
        ResultKind::Motion | ResultKind::Baked => Some(format!(
            "{} has a fixed order of quaternion components; leave out --order",
            format.name
        )),
        ResultKind::Robot => Some(
            "the layout of a robot's motion has a fixed order of quaternion components; leave out --order".to_owned(),
        ),
        ResultKind::Rotations | ResultKind::Poses => None,
    }
}

fn layout(result: &ResultDescription<'_>) -> Option<String> {
    let name = result.format.name;
    let (only, rows) = match result.kind {
        ResultKind::Rotations => {
            let only = result.format.write.as_ref()?.layout;
            (only, format!("rows of {name}"))
        }
        ResultKind::Poses => (Some(Layout::FrameMajor), "poses".to_owned()),
        ResultKind::Motion | ResultKind::Baked | ResultKind::Robot => {
            return Some(format!(
                "{name} has a fixed layout for clips; leave out --layout"
            ));
        }
    };
    let is_refused = only == Some(Layout::FrameMajor) && result.layout == Layout::TrackMajor;
    is_refused.then(|| format!("{rows} come frame by frame; leave out --layout track"))
}

fn encoding(result: &ResultDescription<'_>) -> Option<String> {
    if result.encoding == Encoding::F32 {
        return None;
    }
    let format = result.format;
    match result.kind {
        ResultKind::Rotations if format.is_text => {
            Some("--encoding is for binary results (NPY); text holds every digit".to_owned())
        }
        ResultKind::Rotations if result.output.is_rotations() => None,
        ResultKind::Rotations | ResultKind::Poses => Some(format!(
            "--encoding is for quaternions, and --quantity {} is written as f32; leave it out",
            result.output.name()
        )),
        ResultKind::Motion | ResultKind::Baked | ResultKind::Robot => Some(format!(
            "--encoding is for quaternions in NPY; {} has a fixed encoding; leave it out",
            format.name
        )),
    }
}

fn linear(result: &ResultDescription<'_>) -> Option<String> {
    let takes = result.kind == ResultKind::Baked && result.format.takes(FormatOption::Linear);
    (!takes).then(|| "--linear is for NPZ that is written again as NPZ; leave it out".to_owned())
}

fn end_frame(result: &ResultDescription<'_>) -> Option<String> {
    if result.kind == ResultKind::Robot {
        return Some(
            "--end-frame: the motion of a robot ends with the last frame before its end; leave it out".to_owned(),
        );
    }
    result.end_frame.for_result(result.sampled()).err()
}

fn lengths(result: &ResultDescription<'_>, option: &str) -> Option<String> {
    (result.kind == ResultKind::Rotations).then(|| {
        format!(
            "--{option} has no effect on rotations alone; leave it out, or write --quantity world or \
             transform, or a clip (-o OUT.glb)"
        )
    })
}

/// The options of a command. It must be the first field of the command's arguments: clap removes the
/// values of the fields after it.
#[derive(Debug, Clone, Default)]
pub(crate) struct CommandLine {
    explicit: BTreeSet<String>,
    values: BTreeMap<String, Vec<String>>,
}

impl CommandLine {
    /// Whether the command line names the option, rather than its default.
    pub(crate) fn has(&self, option: &str) -> bool {
        self.explicit.contains(option)
    }

    /// Refuses the first of these options, `(id, name)`, that the command line names, because it would have no effect
    /// on `on`. `remedy` says what to do.
    pub(crate) fn refuse(
        &self,
        options: &[(&str, &str)],
        on: &str,
        remedy: &str,
    ) -> Result<(), Failure> {
        match options.iter().find(|(id, _)| self.has(id)) {
            Some((_, option)) => Err(Failure::usage(format!(
                "{option} has no effect on {on}; {remedy}"
            ))),
            None => Ok(()),
        }
    }

    /// As [`CommandLine::refuse`], of all options of a group.
    pub(crate) fn refuse_group<T: clap::Args>(
        &self,
        on: &str,
        remedy: &str,
    ) -> Result<(), Failure> {
        let command = T::augment_args(Command::new(""));
        let named = command.get_arguments().filter_map(|argument| {
            let long = argument.get_long()?;
            Some((argument.get_id().as_str(), format!("--{long}")))
        });
        let named: Vec<(&str, String)> = named.collect();
        let options: Vec<(&str, &str)> = named.iter().map(|(id, long)| (*id, &**long)).collect();
        self.refuse(&options, on, remedy)
    }

    /// Refuses the options of curves through rotations if there are none.
    pub(crate) fn refuse_rotation_options(&self, on: &str) -> Result<(), Failure> {
        let remedy = "it is for rotations; leave it out, or see --path-frame and --path-method";
        self.refuse(&[("methods", "--method")], on, remedy)?;
        self.refuse_group::<InterpolationArguments>(on, remedy)
    }

    /// Everything that determines a result besides its input. Options without a value or a default are left out.
    pub(crate) fn options(&self) -> ResultOptions {
        ResultOptions {
            text: self.text(),
            files: self.files(),
        }
    }

    /// The files that options name, and that determine results.
    fn files(&self) -> Vec<OptionFile> {
        let named = self.values.iter().flat_map(|(name, values)| {
            let is_file =
                name == "times" || rule(name).is_some_and(|rule| rule.bytes == Bytes::ByContent);
            values
                .iter()
                .filter(move |_| is_file)
                .map(move |value| (name, value))
        });
        let files = named.filter(|(_, value)| !names::is_standard(Path::new(value)));
        let files = files.map(|(name, value)| OptionFile {
            option: name.replace('_', "-"),
            path: value.clone(),
            sha256: content(value),
        });
        files.filter(|file| !file.sha256.is_empty()).collect()
    }

    fn text(&self) -> String {
        let shown = self.values.iter().filter_map(|(name, values)| {
            let bytes = rule(name).map_or(Bytes::ByValue, |rule| rule.bytes);
            let values: Vec<String> = match bytes {
                Bytes::Unchanged => return None,
                Bytes::ByValue => values.clone(),
                Bytes::ByContent => values.iter().map(|file| content(file)).collect(),
            };
            Some(format!("{name}={}", values.join(",")))
        });
        shown.collect::<Vec<_>>().join(" ")
    }
}

/// Everything that determines a result besides its input.
#[derive(Debug, Clone, Default)]
pub(crate) struct ResultOptions {
    /// The options with their values: `layout=track method=slerp`.
    pub(crate) text: String,
    /// The files that they name.
    pub(crate) files: Vec<OptionFile>,
}

impl ResultOptions {
    /// The options of that command, whose name begins their text.
    pub(crate) fn of_command(self, command: &str) -> Self {
        Self {
            text: format!("{command} {}", self.text),
            ..self
        }
    }
}

/// A file that an option names, such as that of `--offsets`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct OptionFile {
    /// The option, without `--`.
    pub(crate) option: String,
    /// As on the command line.
    pub(crate) path: String,
    /// The hash of the file, or of the models in a folder.
    pub(crate) sha256: String,
}

/// The hash of a file; empty if it cannot be read again, as standard input. For a folder of body models, the hash of
/// the models in it.
pub(crate) fn content(file: &str) -> String {
    if Path::new(file).is_dir() {
        return digest::of_folder(Path::new(file), "npz");
    }
    let file = InputFile::new(Path::new(file));
    file.sha256().unwrap_or_default().to_owned()
}

/// It adds no options.
impl clap::Args for CommandLine {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl clap::FromArgMatches for CommandLine {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut command_line = Self::default();
        for id in matches.ids().map(clap::Id::as_str) {
            // The ids of argument groups are the names of their structs, which begin with a capital letter.
            if id.starts_with(char::is_uppercase) || GLOBAL.contains(&id) {
                continue;
            }
            if matches.value_source(id) == Some(ValueSource::CommandLine) {
                command_line.explicit.insert(id.to_owned());
            }
            let raw = matches.get_raw(id).into_iter().flatten();
            let values = raw.map(|value| value.to_string_lossy().into_owned());
            command_line.values.insert(id.to_owned(), values.collect());
        }
        Ok(command_line)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory;

    use super::*;

    /// Every option has a rule, and every rule an option.
    #[test]
    fn options_of_results_say_what_they_apply_to() {
        let program = crate::Arguments::command();
        let writing = |command: &&Command| {
            let mut options = command.get_arguments();
            options.any(|option| option.get_id() == "resume")
        };
        let commands: Vec<&Command> = program.get_subcommands().filter(writing).collect();
        assert!(commands.len() >= 5);
        let options = commands.iter().flat_map(|command| command.get_arguments());
        let named: BTreeSet<&str> = options
            .map(|argument| argument.get_id().as_str())
            .filter(|name| *name != "help")
            .collect();
        let ruled: BTreeSet<&str> = OPTIONS.iter().map(|rule| rule.name).collect();
        assert_eq!(named, ruled);
        assert_eq!(ruled.len(), OPTIONS.len(), "a rule each");
        // The names in manifests are those of the command line.
        for argument in commands.iter().flat_map(|command| command.get_arguments()) {
            let name = argument.get_id().as_str();
            let decides = rule(name).is_some_and(|rule| rule.bytes != Bytes::Unchanged);
            let long = argument.get_long().unwrap_or_default();
            assert!(
                !decides || long.replace('-', "_") == name,
                "{name} is --{long}"
            );
        }
    }

    #[test]
    fn the_options_in_a_manifest_name_their_command() {
        for (text, command) in [
            ("features fps=20 sets=contacts", "features"),
            ("convert ", "convert"),
            ("layout=track method=slerp", "eval"),
            ("", "eval"),
        ] {
            assert_eq!(command_of(text), command, "{text}");
        }
    }

    #[test]
    fn options_in_manifests_of_before_have_their_present_names() {
        for (before, since) in [
            (
                "layout=track method=slerp output=euler path=shortest sequence=XYZ times=0f",
                "layout=track method=slerp quantity=euler sequence=XYZ signs=shortest times=0f",
            ),
            (
                "encoding=f32 order=wxyz up=z times=0f",
                "encoding=f32 order=wxyz up_axis=z times=0f",
            ),
            (
                "map=a = b,output=x method=slerp",
                "map=a = b,output=x method=slerp",
            ),
            (
                "reduce curve=linear tolerance=1",
                "reduce method=linear tolerance=1",
            ),
            ("smooth ends=loop passes=2", "smooth edges=loop passes=2"),
            (
                "follow path_frames=fixed rate=2 upward=x",
                "follow body_up=x pace=2 path_frame=fixed",
            ),
            ("ends=natural method=c2", "ends=natural method=c2"),
            ("", ""),
        ] {
            assert_eq!(with_present_names(before), since);
            assert_eq!(with_present_names(since), since);
        }
    }
}
