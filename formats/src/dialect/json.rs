//! Motion of robots in JSON: frames of AMP for legged robots and of `DeepMimic`'s humanoid, and the episodes of Unitree's
//! `xr_teleoperate`.

use std::path::Path;

use serde::Deserialize;
use serde_json::{Map, Value};
use tumble::Layout;

use super::{archive_of, root};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::motion::ScalarKind;
use crate::npz;
use crate::npz::plan::{ArchivePlan, KeyArray, KeyKind, RobotArrays, TimeList};
use crate::quaternion::ComponentOrder;
use crate::source::Source;
use crate::warnings::Warnings;

/// The format of robots' motion in JSON.
pub static FORMAT: Format = Format {
    name: "robot-json",
    summary: "motion of robots in JSON: frames of AMP and DeepMimic, episodes of xr_teleoperate",
    extensions: &[],
    probe: |start| {
        let has = |word: &[u8]| start.windows(word.len()).any(|window| window == word);
        let is_object = start.trim_ascii_start().starts_with(b"{");
        is_object && KNOWN.iter().any(|word| has(word.as_bytes()))
    },
    numbers_in_line: None,
    is_text: true,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_json,
    read_bytes: read_json,
    write: None,
    write_motion: None,
    features: &[
        Feature::Quaternions,
        Feature::TrackNames,
        Feature::Translations,
        Feature::Scalars,
        Feature::Curves,
        Feature::World,
    ],
    options: &[
        FormatOption::SourceRate,
        FormatOption::OverrideRate,
        FormatOption::SourceOrder,
    ],
};

/// Names by which such files are known; one is near their beginning.
const KNOWN: [&str; 5] = [
    "\"Frames\"",
    "\"FrameDuration\"",
    "\"LoopMode\"",
    "\"Loop\"",
    "\"joint_names\"",
];

/// The numbers of a frame of AMP before those of joints: the root's position and rotation.
const ROOT: usize = 7;

/// For the robot A1: the numbers of a frame (in addition to 12 joints it has positions of toes and velocities), and the
/// number of joints.
const A1: [usize; 2] = [61, 12];

/// The parts of a robot in an episode.
const PARTS: [&str; 5] = ["left_arm", "right_arm", "left_ee", "right_ee", "body"];

/// How the names of the joints of the left and of the right arm begin.
const SIDES: [&str; 2] = ["kLeft", "kRight"];

fn open_json(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let file = source.name.clone();
    read_json(&file, source.into_bytes(options.limits.file)?, options)
}

/// Reads the bytes of a file; `file` is the input's name in messages.
///
/// # Errors
/// When it is no JSON, or in none of these layouts, or a number is missing.
pub fn read_json(file: &str, bytes: Vec<u8>, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let refused = |error: serde_json::Error| Diagnostic {
        location: Some(Location::Text {
            line: error.line() as u64,
            column: error.column().max(1) as u64,
        }),
        ..Diagnostic::new(
            file,
            Code::Json,
            format!("the JSON cannot be read: {error}"),
        )
    };
    let budget = Budget::of(bytes.len(), options.limits);
    let charged = budget.take(bytes.len(), size_of::<Value>() / 2);
    charged.map_err(|error| Diagnostic::new(file, Code::Memory, error.to_string()))?;
    let value: Map<String, Value> = serde_json::from_slice(&bytes).map_err(refused)?;
    let mut warnings = Warnings::new(file);
    if let (Some(frames), None, Some(_)) = (
        value.get("Frames"),
        value.get("FrameDuration"),
        value.get("Loop"),
    ) {
        return frames_of_deepmimic(file, frames, budget, options, warnings);
    }
    if let Some(frames) = value.get("Frames") {
        return frames_of_amp(
            file,
            (frames, value.get("FrameDuration")),
            budget,
            options,
            warnings,
        );
    }
    if let (Some(Value::Array(data)), Some(info)) = (value.get("data"), value.get("info")) {
        let info = Info::deserialize(info)
            .map_err(|error| Diagnostic::new(file, Code::Json, error.to_string()).inside("info"))?;
        return episode(file, data, &info, budget, options, &mut warnings);
    }
    let message =
        "the file has neither `Frames` (AMP, DeepMimic) nor `info` and `data` (xr_teleoperate)";
    Err(Diagnostic::new(file, Code::UnknownArrays, message))
}

/// The rows of a list of lists of numbers, and how many each has.
fn rows(file: &str, frames: &Value) -> Result<(Vec<f64>, usize), Diagnostic> {
    let refuse = |index: usize, message: String| {
        Diagnostic::new(file, Code::Shape, message).inside(format!("Frames[{index}]"))
    };
    let frames = frames.as_array().map_or(&[][..], Vec::as_slice);
    let mut numbers = Vec::new();
    let mut width = None;
    for (index, frame) in frames.iter().enumerate() {
        let list = frame.as_array().map_or(&[][..], Vec::as_slice);
        let expected = *width.get_or_insert(list.len());
        if list.len() != expected || expected <= ROOT {
            let message = format!(
                "{} numbers, but the first frame has {expected}: {ROOT} numbers of the root, then those of joints",
                list.len()
            );
            return Err(refuse(index, message));
        }
        for number in list {
            let number = number.as_f64();
            numbers.push(number.ok_or_else(|| refuse(index, "not numbers alone".to_owned()))?);
        }
    }
    match width {
        Some(width) => Ok((numbers, width)),
        None => Err(refuse(0, "there are no frames".to_owned())),
    }
}

/// The motion of AMP: position, rotation and joints of each frame.
fn frames_of_amp(
    file: &str,
    (frames, duration): (&Value, Option<&Value>),
    budget: Budget,
    options: &ReadOptions,
    mut warnings: Warnings,
) -> Result<Loaded, Diagnostic> {
    let (numbers, width) = rows(file, frames)?;
    let count = numbers.len() / width;
    let [a1, joints] = A1;
    let (numbers, width) = match width == a1 {
        false => (numbers, width),
        true => {
            warnings.warn(Code::ArraysNotRead, || {
                let message = format!(
                    "{} of the {a1} numbers of a frame are positions of toes, and velocities, which are not read",
                    a1 - ROOT - joints
                );
                (None, message)
            });
            let rows = numbers.chunks_exact(a1);
            (
                rows.flat_map(|row| &row[..ROOT + joints])
                    .copied()
                    .collect(),
                ROOT + joints,
            )
        }
    };
    let rate = duration
        .and_then(Value::as_f64)
        .map(|seconds| 1.0 / seconds);
    let fps = rate.map(|rate| ("fps".to_owned(), Vec::new(), vec![rate]));
    let all = [("Frames".to_owned(), vec![count, width], numbers)]
        .into_iter()
        .chain(fps);
    let archive = archive_of(file, budget, all);
    let mut plan = ArchivePlan {
        is_world: true,
        is_part: true,
        names: vec!["root".to_owned()],
        robot: Some(RobotArrays::of("amp", false)),
        ..ArchivePlan::default()
    };
    let order = options.source_order.unwrap_or(ComponentOrder::Xyzw);
    plan.add(
        &archive,
        root(&archive, "Frames", KeyKind::Quaternion(order), 3)?,
    )?;
    plan.add(&archive, root(&archive, "Frames", KeyKind::Translation, 0)?)?;
    let columns = (super::member(&archive, "Frames")?, Layout::FrameMajor, ROOT);
    plan.add_scalars(
        &archive,
        columns,
        None,
        |_| ScalarKind::Angle,
        &mut warnings,
    )?;
    plan.read_rate(&archive, &["fps"])?;
    npz::read_plan(&archive, &mut plan, options, warnings)
}

/// The numbers of a frame of `DeepMimic`'s humanoid: how long it lasts, where the root is, a quaternion for the root and
/// each ball, and an angle for each hinge.
const DEEPMIMIC: usize = 44;
const DEEPMIMIC_ROOT: usize = 1;
const DEEPMIMIC_ROTATIONS: [(&str, usize); 9] = [
    ("root", 4),
    ("chest", 8),
    ("neck", 12),
    ("right_hip", 16),
    ("right_ankle", 21),
    ("right_shoulder", 25),
    ("left_hip", 30),
    ("left_ankle", 35),
    ("left_shoulder", 39),
];
const DEEPMIMIC_HINGES: [(&str, usize); 4] = [
    ("right_knee", 20),
    ("right_elbow", 29),
    ("left_knee", 34),
    ("left_elbow", 43),
];

/// The motion of `DeepMimic`'s humanoid: rotations of the root and the balls, each relative to the body before it, y up, and
/// angles of the knees and elbows.
fn frames_of_deepmimic(
    file: &str,
    frames: &Value,
    budget: Budget,
    options: &ReadOptions,
    mut warnings: Warnings,
) -> Result<Loaded, Diagnostic> {
    let (numbers, width) = rows(file, frames)?;
    if width != DEEPMIMIC {
        let message = format!(
            "the frames have {width} numbers; those of DeepMimic's humanoid have {DEEPMIMIC}, and files of AMP have a \
             `FrameDuration`"
        );
        return Err(Diagnostic::new(file, Code::Shape, message).inside("Frames"));
    }
    let rows = || numbers.chunks_exact(DEEPMIMIC);
    let count = rows().len();
    let of_each = |columns: &[(&str, usize)], width: usize| -> Vec<f64> {
        let parts = rows().flat_map(|row| {
            let columns = columns.iter();
            columns.flat_map(move |&(_, first)| &row[first..first + width])
        });
        parts.copied().collect()
    };
    let durations: Vec<f64> = rows().map(|row| row[0]).collect();
    let is_even = durations.iter().all(|duration| *duration == durations[0]);
    let times = durations.iter().scan(0.0, |end, duration| {
        let start = *end;
        *end += duration;
        Some(start)
    });
    // The rate, or the times if frames have different durations.
    let clock = match is_even {
        true => ("fps".to_owned(), Vec::new(), vec![1.0 / durations[0]]),
        false => ("times".to_owned(), vec![count], times.collect()),
    };
    let balls = DEEPMIMIC_ROTATIONS.len();
    let arrays = [
        (
            "rotations".to_owned(),
            vec![count, balls, 4],
            of_each(&DEEPMIMIC_ROTATIONS, 4),
        ),
        (
            "root".to_owned(),
            vec![count, 3],
            of_each(&[("root", DEEPMIMIC_ROOT)], 3),
        ),
        (
            "hinges".to_owned(),
            vec![count, DEEPMIMIC_HINGES.len()],
            of_each(&DEEPMIMIC_HINGES, 1),
        ),
        clock,
    ];
    let archive = archive_of(file, budget, arrays);
    let mut plan = ArchivePlan {
        is_part: true,
        names: DEEPMIMIC_ROTATIONS.map(|(name, _)| name.to_owned()).into(),
        ..ArchivePlan::default()
    };
    let order = options.source_order.unwrap_or(ComponentOrder::Wxyz);
    for (name, kind) in [
        ("rotations", KeyKind::Quaternion(order)),
        ("root", KeyKind::Translation),
    ] {
        if let Some(part) = KeyArray::of(&archive, name, kind, 0, Layout::FrameMajor)? {
            plan.add(&archive, part)?;
        }
    }
    let columns = (super::member(&archive, "hinges")?, Layout::FrameMajor, 0);
    let names = DEEPMIMIC_HINGES.map(|(name, _)| name.to_owned()).into();
    let kind = |_| ScalarKind::Angle;
    plan.add_scalars(&archive, columns, Some(names), kind, &mut warnings)?;
    match is_even {
        true => plan.read_rate(&archive, &["fps"])?,
        false => {
            let member = super::member(&archive, "times")?;
            plan.times = Some(TimeList { member, column: 0 });
        }
    }
    npz::read_plan(&archive, &mut plan, options, warnings)
}

/// The metadata of an episode.
#[derive(Deserialize)]
struct Info {
    image: Option<Image>,
    joint_names: Map<String, Value>,
}

#[derive(Deserialize)]
struct Image {
    fps: Option<f64>,
}

impl Info {
    /// The names of some joints of a part; those of the right arm are those of the left one. `None` if there are not as
    /// many.
    fn names(&self, part: &str, count: usize) -> Option<Vec<String>> {
        let of = |part: &str| -> Vec<String> {
            let names = self.joint_names.get(part).and_then(Value::as_array);
            let names = names.map_or(&[][..], Vec::as_slice).iter();
            names
                .filter_map(|name| Some(name.as_str()?.to_owned()))
                .collect()
        };
        let mut names = of(part);
        if names.is_empty() && part == PARTS[1] {
            names = of(PARTS[0]);
            for name in &mut names {
                *name = name.replacen(SIDES[0], SIDES[1], 1);
            }
        }
        (names.len() == count).then_some(names)
    }
}

/// The joints of an episode, as scalars: `states.left_arm.kLeftElbow`.
fn episode(
    file: &str,
    data: &[Value],
    info: &Info,
    budget: Budget,
    options: &ReadOptions,
    warnings: &mut Warnings,
) -> Result<Loaded, Diagnostic> {
    let mut arrays = Vec::new();
    let mut names = Vec::new();
    let mut unnamed = Vec::new();
    for list in ["states", "actions"] {
        for part in PARTS {
            let pointer = format!("/{list}/{part}/qpos");
            let values = |frame: &Value| frame.pointer(&pointer).and_then(Value::as_array).cloned();
            let count = data.first().and_then(values).map_or(0, |list| list.len());
            if count == 0 {
                continue;
            }
            let mut numbers = Vec::with_capacity(count * data.len());
            for (index, frame) in data.iter().enumerate() {
                let list = values(frame).unwrap_or_default();
                let found: Vec<f64> = list.iter().filter_map(Value::as_f64).collect();
                if found.len() != count || list.len() != count {
                    let message = format!(
                        "this frame has {} numbers, and the first frame has {count}",
                        found.len()
                    );
                    let refusal = Diagnostic::new(file, Code::Shape, message);
                    return Err(refusal.inside(format!("data[{index}]{pointer}")));
                }
                numbers.extend(found);
            }
            let of_part = info.names(part, count).unwrap_or_else(|| {
                unnamed.push(format!("{list}.{part}"));
                (0..count).map(|joint| format!("joint_{joint}")).collect()
            });
            let named = of_part.iter().map(|name| format!("{list}.{part}.{name}"));
            names.push((named.collect::<Vec<String>>(), part.ends_with("_ee")));
            arrays.push((format!("{list}.{part}"), vec![data.len(), count], numbers));
        }
    }
    if arrays.is_empty() {
        let message = "there are no `states` or `actions` with `qpos` in the first frame";
        return Err(Diagnostic::new(file, Code::UnknownArrays, message));
    }
    if !unnamed.is_empty() {
        warnings.warn(Code::UnnamedJoints, || {
            let message = format!(
                "the file does not name the joints of {}; they are called joint_0, joint_1 …",
                unnamed.join(", ")
            );
            (None, message)
        });
    }
    let fps = info.image.as_ref().and_then(|image| image.fps);
    let count = arrays.len();
    arrays.extend(fps.map(|fps| ("fps".to_owned(), Vec::new(), vec![fps])));
    let archive = archive_of(file, budget, arrays);
    let mut plan = ArchivePlan {
        frames: data.len(),
        is_part: true,
        ..ArchivePlan::default()
    };
    for (member, (names, is_hand)) in (0..count).zip(names) {
        let kind = match is_hand {
            true => ScalarKind::Plain,
            false => ScalarKind::Angle,
        };
        let columns = (member, Layout::FrameMajor, 0);
        plan.add_scalars(&archive, columns, Some(names), |_| kind, warnings)?;
    }
    plan.read_rate(&archive, &["fps"])?;
    let warnings = std::mem::replace(warnings, Warnings::new(file));
    npz::read_plan(&archive, &mut plan, options, warnings)
}
