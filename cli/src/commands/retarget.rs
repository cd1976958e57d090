//! `tumble retarget`: motions on another skeleton.

use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::TypedValueParser;
use serde::Serialize;
use tumble::EulerSequence;
use tumble_formats::format::{Document, MotionOptions};
use tumble_formats::motion::Motion;
use tumble_formats::printable::printable;
use tumble_formats::retarget::{
    HipsScale, RestAlignment, RetargetError, RetargetOptions, RetargetReport, open_target, retarget,
};
use tumble_formats::{Code, Diagnostic, Limits, Loaded, ReadOptions};

use crate::arguments::input::Inputs;
use crate::arguments::options::CommandLine;
use crate::arguments::output::{one_of, sequence};
use crate::arguments::results::{ResultArguments, check_sequence, check_stores_keys, write_keys};
use crate::batch::pipeline::{ClipWork, EvaluatedResult};
use crate::batch::preview::PlannedWork;
use crate::batch::target::{Destination, ResultTarget, WrittenFile};
use crate::commands::features::axis_name;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Carry motions over to the skeleton of another file
#[derive(Debug, Args)]
#[command(after_help = "\
Each joint rotates away from its rest pose, in world space, as its partner in the input does. The path of the \
hips is scaled to the size of the skeleton. Nothing is resampled: keys keep their times. Joints are paired by the \
parts of the body that their names mean (VRM, Mixamo, SMPL, LAFAN1, CMU, Xsens, Unreal, SOMA); --bones pairs the \
joints of other skeletons. If --onto and the output are glTF, the result is that file with its meshes and \
materials, and its animations are replaced. Limbs have other lengths, so hands and feet are not where they are in \
the input; --report contains the distances. There is no inverse kinematics.

Examples:
  tumble retarget take.bvh --onto character.glb -o walking.glb
  tumble retarget take.bvh --onto character.glb --rest-frame 0 -o walking.glb --report pairs.json
  tumble retarget takes --onto character.glb --bones bones.json -o out --to glb --resume")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: ResultArguments,
    /// The file with the skeleton: glTF, with or without animations, or the first clip of any other file
    #[arg(long, value_name = "FILE")]
    onto: PathBuf,
    /// The joints that belong together, as JSON: {"joint of --onto": "joint of the input", …} [default: by the parts of
    /// the body that their names stand for]
    #[arg(long, value_name = "FILE")]
    bones: Option<PathBuf>,
    /// How the rest poses are compared
    #[arg(long, value_name = "HOW", default_value_t, value_parser = rest())]
    rest: RestAlignment,
    /// Use the pose of this frame of the input, counted from 0, as its rest pose, such as a T-pose at the beginning
    /// [default: the rest pose of its skeleton]
    #[arg(long, value_name = "FRAME")]
    rest_frame: Option<usize>,
    /// The factor for the translations of the hips: hips, the ratio of their heights; legs, the ratio of the
    /// lengths of the legs; or a number
    #[arg(long, value_name = "hips|legs|FACTOR", default_value = "hips", value_parser = hips_scale)]
    hips_scale: HipsScale,
    /// Write a report: as JSON, the pairs of joints, the joints without a partner, and the distances of hands and feet
    /// from those of the input; needs a single input
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// The sequence of axes: of the angles of BVH, three different ones [default: those of the input, else ZXY]
    #[arg(long, value_name = "AXES", value_parser = sequence)]
    sequence: Option<EulerSequence>,
}

fn rest() -> impl TypedValueParser<Value = RestAlignment> {
    let help = |rest| match rest {
        RestAlignment::Auto => "directions, if one of a limb differs by more than 5°, else same",
        RestAlignment::Same => "the same rotations are the same pose",
        RestAlignment::Directions => {
            "the arms and legs of the skeleton are first rotated to the directions of the input's arms and legs"
        }
    };
    one_of(RestAlignment::ALL.map(|rest| (rest.name(), help(rest), rest)))
}

fn hips_scale(text: &str) -> Result<HipsScale, String> {
    match (text, text.parse::<f64>()) {
        ("hips", _) => Ok(HipsScale::Hips),
        ("legs", _) => Ok(HipsScale::Legs),
        (_, Ok(factor)) if factor.is_finite() && factor > 0.0 => Ok(HipsScale::Factor(factor)),
        _ => Err("expected hips, legs, or a number above 0".to_owned()),
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let files = arguments.inputs.gather(false)?;
    let results = arguments.command_line.options().of_command("retarget");
    let reader = arguments.inputs.clone();
    let work = PlannedWork {
        reader: &reader,
        options: &results,
    };
    let plan = arguments.results.plan(files, &work)?;
    check_stores_keys(&plan)?;
    check_sequence(
        arguments.sequence,
        plan.targets.first().map(ResultTarget::format),
    )?;
    let report = arguments.report.as_deref();
    let report = report.map(|file| arguments.results.beside("--report", file, &plan));
    let report = report.transpose()?;
    let options = RetargetOptions {
        bones: arguments.bones.as_deref().map_or(Ok(Vec::new()), bones)?,
        rest: arguments.rest,
        rest_frame: arguments.rest_frame,
        scale: arguments.hips_scale,
        axes: None,
    };
    let limits = arguments.inputs.limits();
    let character = Character::open(&arguments.onto, limits)?;
    let mut pipeline = arguments.results.start(reader, plan, results);
    while let Some(work) = pipeline.next_work() {
        let made = arguments.make(&work, &character, &options, report.as_ref());
        pipeline.keep(&work, made);
    }
    pipeline.finish()
}

/// The skeleton that motions are carried to.
struct Character {
    name: String,
    loaded: Loaded,
}

impl Character {
    fn open(file: &Path, limits: Limits) -> Result<Self, Failure> {
        let options = ReadOptions {
            limits,
            ..ReadOptions::default()
        };
        let loaded = open_target(file, &options).map_err(|fault| Failure::input(&fault, ""))?;
        loaded.warnings.iter().cloned().for_each(words::warn_of);
        Ok(Self {
            name: file.display().to_string(),
            loaded,
        })
    }

    fn document(&self, target: &ResultTarget) -> Option<&dyn Document> {
        let document = self.loaded.document.as_deref();
        document.filter(|document| document.writes(target.format()))
    }
}

/// The pairs of joints in a file: of the target and of the source.
fn bones(file: &Path) -> Result<Vec<(String, String)>, Failure> {
    let name = file.display().to_string();
    let refused = |code: Code, message: String| {
        Failure::input(&Diagnostic::new(name.clone(), code, message), "")
    };
    let text = std::fs::read_to_string(file)
        .map_err(|error| refused(Code::Open, format!("cannot be read: {error}")))?;
    let pairs: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(&text).map_err(|error| {
            let message =
                format!("is not {{\"joint of --onto\": \"joint of the input\", …}}: {error}");
            refused(Code::Json, message)
        })?;
    let pair = |(joint, partner): (String, serde_json::Value)| match partner {
        serde_json::Value::String(partner) => Ok((joint, partner)),
        other => Err(refused(
            Code::Json,
            format!("the partner of `{joint}` is {other}; give the name of a joint"),
        )),
    };
    pairs.into_iter().map(pair).collect()
}

/// The result of a clip, in `--json` and `--report`.
#[derive(Debug, Serialize)]
struct ClipReport {
    clip: Option<String>,
    /// The partner of each joint, by the name of the joint of `--onto`.
    pairs: serde_json::Map<String, serde_json::Value>,
    /// Joints of `--onto` that keep their rest rotations.
    resting: Vec<String>,
    /// Joints of the input without a partner.
    dropped: Vec<String>,
    /// The dropped joint that rotates furthest from its rest pose, and this angle in degrees.
    furthest_dropped: Option<(String, f64)>,
    /// The angle in degrees by which the rest pose of each joint was aligned.
    aligned: serde_json::Map<String, serde_json::Value>,
    scale: f64,
    /// x y z w.
    axes: [f64; 4],
    axes_assumed: bool,
    dropped_translation: f64,
    largest_difference: f64,
    /// How far hands and feet come away from the input's, in heights of the hips.
    ends: serde_json::Map<String, serde_json::Value>,
    below_ground: f64,
    frames: usize,
}

impl ClipReport {
    fn new(clip: &Motion, report: RetargetReport) -> Self {
        fn object<T: Into<serde_json::Value>>(
            list: Vec<(String, T)>,
        ) -> serde_json::Map<String, serde_json::Value> {
            list.into_iter()
                .map(|(name, value)| (name, value.into()))
                .collect()
        }
        Self {
            clip: clip.name.clone(),
            pairs: object(report.pairs),
            resting: report.resting,
            dropped: report.dropped,
            furthest_dropped: report.furthest_dropped,
            aligned: object(report.aligned),
            scale: report.scale,
            axes: report.axes.to_array(),
            axes_assumed: report.are_axes_assumed,
            dropped_translation: report.dropped_translation,
            largest_difference: report.largest_difference,
            ends: object(report.ends),
            below_ground: report.below_ground,
            frames: clip.key_times().len(),
        }
    }

    /// `22 of 24 joints are mapped, translations of the hips × 0.0112, hands and feet within 4 % of the hips' height`.
    fn text(&self) -> String {
        let joints = self.pairs.len() + self.resting.len();
        let ends = self.ends.values().filter_map(serde_json::Value::as_f64);
        let furthest = ends.reduce(f64::max).map_or(String::new(), |furthest| {
            let percent = furthest * 100.0;
            format!(", hands and feet within {percent:.0} % of the hips' height")
        });
        let scale = self.scale;
        format!(
            "{} of {joints} joints are mapped, translations of the hips × {scale:.4}{furthest}",
            self.pairs.len()
        )
    }
}

impl Arguments {
    fn make(
        &self,
        work: &ClipWork,
        character: &Character,
        options: &RetargetOptions,
        report: Option<&Destination>,
    ) -> Result<(EvaluatedResult, Vec<ClipReport>), Failure> {
        let name = &*work.name;
        let Some(skeleton) = character.loaded.clips.first() else {
            let message = format!("{}: has no skeleton", character.name);
            return Err(Failure::new(ALL_INPUTS, message));
        };
        let mut made = Vec::new();
        let mut reports = Vec::new();
        for clip in work.clips() {
            let clip = self.inputs.tracks.select_with_ancestors(clip, name)?;
            let found = retarget(&clip, skeleton, options);
            let (motion, report) = found.map_err(|error| failure(name, &character.name, &error))?;
            if report.dropped_translation > 1e-3 * largest_offset(&clip) {
                let message = format!(
                    "joints other than the hips move by up to {:.4} away from their rest positions, which is lost",
                    report.dropped_translation
                );
                words::warn_of(Diagnostic::new(name, Code::TranslationsDropped, message));
            }
            if let Some((joint, angle)) = &report.furthest_dropped {
                let (have, their) = match report.dropped.len() {
                    1 => ("has", "its"),
                    _ => ("have", "their"),
                };
                let message = format!(
                    "{} of the input {have} no partner, so {their} rotations are lost; the largest is that of `{}`, \
                     {angle:.1}° (--report lists such joints, --bones pairs joints)",
                    words::count(report.dropped.len(), "joint"),
                    printable(joint)
                );
                words::warn_of(Diagnostic::new(name, Code::RotationsDropped, message));
            }
            if let Some(axis) = report.stood_along {
                let axis = axis_name(axis);
                words::note(&format!(
                    "{name}: the body stands along {axis} on average, so it is rotated until y points up (--up-axis states the \
                     axis of the input)"
                ));
            }
            if let Some([at_rest, moving]) = report.rests_along {
                let [at_rest, moving] = [at_rest, moving].map(axis_name);
                words::warning(&format!(
                    "{name}: the body stands along {moving} in the motion and along {at_rest} in the rest pose of its \
                     skeleton, so the result does not stand upright; --rest-frame takes a pose of the motion as the rest pose"
                ));
            }
            if report.are_axes_assumed {
                let message = "the axes of both skeletons are taken to be the same, because it is not known which joints \
                               are the parts of the body, or where these are at rest; --up-axis rotates the input";
                words::note(&format!("{name}: {message}"));
            }
            reports.push(ClipReport::new(&motion, report));
            made.push(motion);
        }
        let written = self.write(work, character, &made)?;
        let json = serde_json::to_string_pretty(&reports).expect("strings and numbers");
        let beside = report.map(|file| file.prepare(None, |out| writeln!(out, "{json}")));
        let written = written.with(beside.transpose()?);
        let clips = words::count(made.len(), "clip");
        let text = reports
            .first()
            .map_or(String::new(), |report| format!(", {}", report.text()));
        let done = format!("{clips}{text}");
        Ok((work.result(written, &done, None), reports))
    }

    /// Writes motions into the file of the skeleton, or into a new one.
    fn write(
        &self,
        work: &ClipWork,
        character: &Character,
        motions: &[Motion],
    ) -> Result<WrittenFile, Failure> {
        let target = &work.target;
        let options = MotionOptions {
            sequence: self.sequence,
            ..target.motion_options()
        };
        if let Some(document) = character.document(target) {
            let all: Vec<&Motion> = motions.iter().collect();
            return target
                .write_motion(|out| document.write_instead(&all, &options, target.path(), out));
        }
        let all: Vec<Cow<'_, Motion>> = motions.iter().map(Cow::Borrowed).collect();
        write_keys(work, &all, None, &options)
    }
}

/// The largest offset of a joint from its parent.
fn largest_offset(clip: &Motion) -> f64 {
    let lengths = clip.skeleton.iter().filter(|joint| joint.parent.is_some());
    let lengths = lengths.map(|joint| f64::from(joint.rest.translation.length()));
    lengths.fold(0.0, f64::max)
}

fn failure(name: &str, onto: &str, error: &RetargetError) -> Failure {
    let of = |which: &str, code: Code, message: String| {
        let file = if which == "target" { onto } else { name };
        Failure::input(&Diagnostic::new(file, code, message), "")
    };
    match error {
        RetargetError::NotRecognised { which, .. } => {
            let message = error.to_string().replace("`bones`", "--bones");
            of(which, Code::NotRecognised, message)
        }
        RetargetError::NoSkeleton { which } => {
            let file = if *which == "target" { onto } else { name };
            Failure::new(ALL_INPUTS, format!("{file}: {error}"))
        }
        error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
    }
}
