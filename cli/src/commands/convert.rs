//! `tumble convert`: the keys of a file in another format, as they are.

use std::borrow::Cow;

use clap::Args;
use tumble::{Device, Engine, EulerSequence, SampleTimes};
use tumble_formats::dialect::write::WrittenDialect;
use tumble_formats::format::{FormatOption, JointClip, MotionOptions};
use tumble_formats::learning::{Mirror, MirrorError, mirrored, without_partner};
use tumble_formats::motion::{Motion, ScalarKind};
use tumble_formats::printable::printable;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::trim::{TrimError, trim};
use tumble_formats::{Code, Diagnostic, Feature};

use crate::arguments::input::Inputs;
use crate::arguments::options::CommandLine;
use crate::arguments::output::{component_order, sequence};
use crate::arguments::results::{
    ResultArguments, check_sequence, check_stores_keys, document_to_rewrite, makes_new, write_keys,
};
use crate::arguments::robot::{DialectArguments, RobotFrames};
use crate::arguments::time::{check_range, finite_seconds};
use crate::batch::pipeline::{ClipWork, EvaluatedResult};
use crate::batch::preview::PlannedWork;
use crate::batch::target::ResultTarget;
use crate::commands::features::{lost_partners, mirror_axis};
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::{names, words};

/// Convert motion files to another format, without resampling
#[derive(Debug, Args)]
#[command(after_help = "\
Nothing is resampled: keys keep their values and their times. If channels have keys at different times \
and the output format cannot store that, use `tumble eval --fps`. --start and --end cut the motion and \
add a key at the cut, on the curve of the channel. Steps, lines and arcs do not change by this. A smooth \
curve changes near the cut, because it also depends on keys outside. If the output has the format of the \
input, everything else in the file is kept; --tracks and --animation make a new file of the selection.

Examples:
  tumble convert walk.bvh -o walk.glb
  tumble convert data/pendulum.dat --start 2.5 --end 8 -o part.dat
  tumble convert walk.bvh --tracks 'Left*' -o left.bvh
  tumble convert amass -o glb --to glb         a directory's tree
  tumble convert walk.npz --up-axis y --scale 100 -o walk.bvh
  tumble convert walk.bvh --mirror x -o mirrored.bvh")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: ResultArguments,
    #[command(flatten)]
    dialect: DialectArguments,
    /// Where to start, seconds [default: the first key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    start: Option<f64>,
    /// Where to end, seconds [default: the last key]
    #[arg(long, value_name = "SECONDS", value_parser = finite_seconds, allow_hyphen_values = true)]
    end: Option<f64>,
    /// Mirror the motion: exchange left and right by the names of joints, and reverse the direction of this axis,
    /// from left to right
    #[arg(long, value_name = "AXIS", value_parser = mirror_axis())]
    mirror: Option<usize>,
    /// The order of a quaternion's components [default: xyzw; CSV: wxyz]
    #[arg(long, value_parser = component_order())]
    order: Option<ComponentOrder>,
    /// The sequence of axes: of the angles of BVH, three different ones [default: those of the input, else ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
}

/// The largest distance of a joint from the mirror image of its partner at rest, as a part of the size of the skeleton.
const SYMMETRIC: f64 = 0.01;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check_range(arguments.start, arguments.end)?;
    let files = arguments.inputs.gather(false)?;
    let asked = arguments.dialect.format(&arguments.results)?;
    let options = arguments.command_line.options().of_command("convert");
    let mut reader = arguments.inputs.clone();
    reader.reading.with_partners = arguments.mirror.is_some();
    let work = PlannedWork {
        reader: &reader,
        options: &options,
    };
    let plan = arguments.results.plan_in(files, asked, &work)?;
    match arguments.dialect.chosen() {
        None => {
            check_stores_keys(&plan)?;
            let on = "keys, which stay as they are";
            let remedy = "evaluate them with `tumble eval`";
            arguments
                .command_line
                .refuse(&[("limits", "--limits")], on, remedy)?;
        }
        Some(dialect) => {
            let options = [
                ("order", "--order"),
                ("sequence", "--sequence"),
                ("tracks", "--tracks"),
            ];
            let on = format!("--dialect {}", dialect.name);
            arguments
                .command_line
                .refuse(&options, &on, "leave it out")?;
        }
    }
    let format = plan.targets.first().map(ResultTarget::format);
    if let Some(format) = format.filter(|format| !format.takes(FormatOption::Order))
        && arguments.order.is_some()
    {
        return Err(Failure::usage(format!(
            "{} has a fixed order of quaternion components; leave out --order",
            format.name
        )));
    }
    check_sequence(arguments.sequence, format)?;
    let mut pipeline = arguments.results.start(reader, plan, options);
    while let Some(work) = pipeline.next_work() {
        let converted = arguments.convert(&work);
        pipeline.keep(&work, converted.map(|result| (result, ())));
    }
    pipeline.finish()
}

impl Arguments {
    /// The requested part of a clip.
    fn part<'a>(&self, name: &str, clip: &'a Motion) -> Result<Cow<'a, Motion>, Failure> {
        let clip = self.inputs.tracks.select_with_ancestors(clip, name)?;
        let Some(whole) = clip.set.time_span() else {
            return Ok(clip);
        };
        if (self.start, self.end) == (None, None) {
            return Ok(clip);
        }
        let failed = |error: TrimError| match error {
            TrimError::Evaluating(error) => Failure::evaluating(name, &error),
            error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
        };
        let engine = Engine::new(Device::Cpu).map_err(|error| Failure::evaluating(name, &error))?;
        let (start, end) = clip.range_in_set(self.start, self.end, whole);
        trim(&clip, start, end, &engine)
            .map(Cow::Owned)
            .map_err(failed)
    }

    /// The requested part of a clip, mirrored if that is asked for, and how many of its joints change their sides.
    fn mirrored_part<'a>(
        &self,
        work: &ClipWork,
        clip: &'a Motion,
    ) -> Result<(Cow<'a, Motion>, Option<String>), Failure> {
        let name = &*work.name;
        let part = self.part(name, clip)?;
        let Some(axis) = self.mirror else {
            return Ok((part, None));
        };
        let robot = self.inputs.reading.robot()?;
        let tree = robot.as_ref().map(|robot| &robot.tree);
        let of_clip = |warning: Diagnostic| match work.clips().len() {
            0 | 1 => warning,
            _ => warning.inside(names::clip(clip)),
        };
        let (mirrored, report) = mirrored(&part, Mirror { axis, tree }).map_err(|error| {
            let hint = match &error {
                MirrorError::NoAxis { .. } => " (--robot)",
                MirrorError::Axes { .. } => " (--mirror)",
                _ => "",
            };
            Failure::input(
                &Diagnostic::new(name, Code::Mirror, error.to_string()),
                hint,
            )
        })?;
        if let Some((joint, apart)) = report.asymmetry.filter(|(_, apart)| *apart > SYMMETRIC) {
            let message = format!(
                "`{}` is {:.0} % of the skeleton's size away from the mirror image of its partner at rest",
                printable(&joint),
                100.0 * apart
            );
            let warning = Diagnostic::new(name, Code::NotSymmetric, message);
            words::warn_of(of_clip(warning));
        }
        // Weights of morph targets are no joints.
        let is_weight = |name: &String| {
            let scalar = clip.set.scalar_named(name);
            scalar.is_some_and(|index| clip.scalar(index).kind == ScalarKind::Plain)
        };
        let alone: Vec<String> = report
            .alone
            .into_iter()
            .filter(|it| !is_weight(it))
            .collect();
        let in_place: Vec<usize> = (0..alone.len()).collect();
        if let Some(warning) = lost_partners(name, &alone, &in_place) {
            words::warn_of(of_clip(warning));
        }
        let mut scalars = (0..clip.set.scalar_count()).map(|index| clip.scalar(index).kind);
        if clip.set.track_count() == 0 && scalars.all(|kind| kind == ScalarKind::Plain) {
            return Ok((Cow::Owned(mirrored), None));
        }
        let pairs = words::count(report.pairs.len(), "pair");
        let alone = match alone.len() {
            0 => "no joint is".to_owned(),
            1 => format!("`{}` is", printable(&alone[0])),
            count => format!("{count} joints are"),
        };
        let changed = format!("{pairs} of joints change their sides and {alone} mirrored in place");
        Ok((Cow::Owned(mirrored), Some(changed)))
    }

    fn convert(&self, work: &ClipWork) -> Result<EvaluatedResult, Failure> {
        let (name, clips, target) = (&*work.name, work.clips(), &work.target);
        if let Some(dialect) = self.dialect.chosen() {
            return self.convert_robot(dialect, work);
        }
        let loaded = &work.input.loaded;
        let document = document_to_rewrite(work, self.makes_new(target))?;
        let parts = clips.iter().map(|&clip| self.mirrored_part(work, clip));
        let parts: Vec<_> = parts.collect::<Result<_, Failure>>()?;
        let (parts, changed): (Vec<Cow<'_, Motion>>, Vec<Option<String>>) =
            parts.into_iter().unzip();
        let is_whole = (self.start, self.end) == (None, None) && self.mirror.is_none();
        let is_copy = document.is_some() && is_whole && !self.inputs.reading.changes_keys();
        let options = MotionOptions {
            order: self.order,
            sequence: self.sequence,
            box_length: loaded.box_length,
            ..target.motion_options()
        };
        // A joint may have a channel that its partner on the other side does not have. Therefore all channels of joints
        // in a glTF file are replaced.
        let replaces = self.mirror.is_some() && target.format().supports(Feature::SeveralClips);
        let written = match document {
            Some(document) if is_copy => {
                target.write_motion(|out| document.write(&[], &options, target.path(), out))?
            }
            Some(document) if replaces => {
                note_weights(name, &clips);
                let whole = clips.iter().map(|clip| self.part(name, clip));
                let whole: Vec<Cow<'_, Motion>> = whole.collect::<Result<_, Failure>>()?;
                let both = parts.iter().zip(&whole);
                let both = both.map(|(joints, weights)| JointClip { joints, weights });
                let all: Vec<JointClip<'_>> = both.collect();
                target
                    .write_motion(|out| document.write_joints(&all, &options, target.path(), out))?
            }
            document => write_keys(work, &parts, document, &options)?,
        };
        let clips = words::count(parts.len(), "clip");
        let done = format!(
            "{clips}, {}{}",
            keys(&parts),
            mirrored_text(&parts, &changed)
        );
        Ok(work.result(written, &done, None))
    }

    /// The keys of a robot's motion in the layout of another program: a frame for each.
    fn convert_robot(
        &self,
        dialect: &WrittenDialect,
        work: &ClipWork,
    ) -> Result<EvaluatedResult, Failure> {
        let (name, clips) = (&*work.name, work.clips());
        let ([clip], Some(robot)) = (&*clips, self.inputs.reading.robot()?) else {
            let message = format!(
                "{name}: {} has one clip; choose it with --animation",
                dialect.name
            );
            return Err(Failure::usage(message));
        };
        let robot = self.dialect.robot_of(dialect, &robot)?;
        let (part, changed) = self.mirrored_part(work, clip)?;
        let changed = mirrored_text(std::slice::from_ref(&part), &[changed]);
        let times = part.key_times();
        let rate = part.rate.or_else(|| part.rate_of_keys());
        let spaced = rate.filter(|rate| {
            let step = rate.time_of(1);
            times
                .windows(2)
                .all(|pair| (pair[1] - pair[0] - step).abs() < 1e-3 * step)
        });
        let frames = SampleTimes::at(times);
        let frames = RobotFrames {
            frames: &frames,
            rate: spaced,
            methods: ChannelMethods::AUTHORED,
        };
        let engine = Engine::new(Device::Cpu).map_err(|error| Failure::evaluating(name, &error))?;
        let found = self
            .dialect
            .evaluate(dialect, &robot, (name, &part), &frames, |run| run(&engine))?;
        let notes = vec![("input", work.origin())];
        let (written, report) =
            self.dialect
                .write(dialect, &robot, (work, &part), (&found, frames.rate), notes)?;
        let done = format!(
            "{}, {}{changed}",
            words::count(found.times.len(), "frame"),
            report.text()
        );
        Ok(work.result(written, &done, None))
    }

    /// The reason why a new file is made; `None` if the input's file is written again.
    fn makes_new(&self, target: &ResultTarget) -> Option<&'static str> {
        let several = target.format().supports(Feature::SeveralClips);
        let chooses = self.inputs.reading.chooses_animation() && several;
        makes_new(&self.inputs).or(chooses.then_some("one animation makes"))
    }
}

/// Prints that the weights of morph targets are not mirrored, if some belong to one side.
fn note_weights(name: &str, clips: &[&Motion]) {
    for clip in clips {
        let weights = (0..clip.set.scalar_count()).filter_map(|index| clip.set.scalar(index));
        let weights: Vec<&str> = weights.map(|keys| keys.name).collect();
        let in_place: Vec<usize> = (0..weights.len()).collect();
        let of_sides = without_partner(&weights, &in_place);
        if let Some(&first) = of_sides.first() {
            let message = format!(
                "the weights of morph targets are not mirrored: {} with the name of a side (the first: {})",
                words::count(of_sides.len(), "target"),
                printable(weights[first])
            );
            let warning = Diagnostic::new(name, Code::LostPartner, message);
            words::warn_of(match clips.len() {
                1 => warning,
                _ => warning.inside(names::clip(clip)),
            });
        }
    }
}

/// `; 6 pairs of joints change their sides and no joint is mirrored in place`. If this differs between animations,
/// there is a text for each, with its name.
fn mirrored_text(parts: &[Cow<'_, Motion>], changed: &[Option<String>]) -> String {
    let differ = changed.windows(2).any(|pair| pair[0] != pair[1]);
    let texts = changed.iter().flatten().zip(parts);
    let texts = texts.map(|(text, part)| match differ {
        true => format!("; {}: {text}", names::clip(part)),
        false => format!("; {text}"),
    });
    texts.take(if differ { parts.len() } else { 1 }).collect()
}

/// `30 keys (25 of rotations)`: of all channels of some clips, and those that `tumble info` counts.
fn keys(clips: &[Cow<'_, Motion>]) -> String {
    let all = clips.iter().map(|clip| clip.key_count()).sum();
    let rotations: usize = clips.iter().map(|clip| clip.set.key_count()).sum();
    let keys = words::count(all, "key");
    match all == rotations {
        true => keys,
        false => format!("{keys} ({rotations} of rotations)"),
    }
}
