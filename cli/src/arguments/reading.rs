//! Options for reading motion files and adjusting their clips.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use tumble::FrameRate;
use tumble::trees::BodyOrder;
use tumble_formats::adjust::{JointOffsets, OffsetsError, UpAxis, adjust_all, set_all_offsets};
use tumble_formats::format::{FormatOption, TimeUnit};
use tumble_formats::keys::Duplicates;
use tumble_formats::kitti::open_frame_times;
use tumble_formats::motion::Motion;
use tumble_formats::npz::body_offsets;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::robot::Robot;
use tumble_formats::{Code, Diagnostic, FORMATS, Format, Limits, Loaded, ReadOptions};

use crate::arguments::options::{AppliesTo, OPTIONS};
use crate::arguments::output::{body_order, component_order, one_of};
use crate::messages::exit::{self, Failure};
use crate::messages::{names, words};

/// How files are read. All of these options change results.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = READING)]
pub(crate) struct ReadingArguments {
    /// The format of the inputs [default: by their first bytes, then by their names]
    #[arg(long, value_name = "FORMAT", value_parser = format())]
    pub(crate) from: Option<&'static Format>,
    /// The animation of a file that has several: its name, or its index from 0
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// Keep key times exactly as stored, instead of moving them to the frames that they were rounded from
    #[arg(long)]
    raw_times: bool,
    /// Which of two different keys at the same time to keep
    #[arg(long, value_enum, value_name = "WHICH")]
    duplicates: Option<DuplicatesArgument>,
    /// The frame rate of the keys of files that state neither times nor a rate
    #[arg(long, value_name = "FPS")]
    source_fps: Option<FrameRate>,
    /// The frame rate of the keys of files that store no times, in place of the rate that such a file states (BVH, NPZ)
    #[arg(long, value_name = "FPS", conflicts_with = "source_fps")]
    override_fps: Option<FrameRate>,
    /// The key times of files without times (KITTI): a file of seconds, one line for each pose
    #[arg(long, value_name = "FILE", conflicts_with_all = ["source_fps", "override_fps"])]
    source_times: Option<PathBuf>,
    /// The meaning of arrays or columns whose names are not known, such as rotations=keys:wxyz,time=t
    #[arg(long, value_name = "MAP")]
    map: Option<String>,
    /// The unit of times that are whole numbers
    #[arg(long, value_name = "UNIT", value_parser = time_unit())]
    time_unit: Option<TimeUnit>,
    /// The order of a quaternion's components in TUM and EuRoC files, and in files of robots' motion, that
    /// do not follow their format
    #[arg(long, value_name = "ORDER", value_parser = component_order())]
    source_order: Option<ComponentOrder>,
    /// Skip keys with missing numbers in tables, trajectories and logs (blank cells, nulls, NaN): the track is
    /// interpolated between the keys before and after them
    #[arg(long)]
    bridge_gaps: bool,
    /// FBX: read only the file's keys, instead of adding keys that follow its curves [default: only if
    /// `eval -m` names a method]
    #[arg(long)]
    keyframes: bool,
    /// The robot that moves, MJCF or URDF: it gives the names and limits of joints and the order of bodies, which are
    /// compared with the bodies of the input
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// --robot: the order of joints and bodies in inputs that do not name them [default: the order in which the bodies
    /// agree with the joints]
    #[arg(long, value_name = "ORDER", requires = "robot", value_parser = body_order())]
    source_body_order: Option<BodyOrder>,
    /// Whether joints at rest are read with partners that move: the motion will be mirrored.
    #[arg(skip)]
    pub(crate) with_partners: bool,
    /// The robot, once it is read.
    #[arg(skip)]
    opened_robot: Arc<OnceLock<Arc<Robot>>>,
    /// The same, because the command line names a method.
    #[arg(skip)]
    names_method: OnceLock<()>,
    /// The offset of each joint from its parent, for SMPL bodies, whose files do not store it: a text
    /// file with `x y z` per line, in the order of the joints, or `name x y z` in any order
    #[arg(long, value_name = "FILE")]
    offsets: Option<PathBuf>,
    /// A model of SMPL, SMPL-H or SMPL-X as NPZ or pickle, or a folder with one per gender: the offsets of joints
    /// are computed from it, for the body shape of the motion
    #[arg(long, value_name = "MODEL", conflicts_with = "offsets")]
    body_model: Option<PathBuf>,
    /// Multiply all translations, and the length of boxes, by this number; `metres`: convert the unit
    /// that an FBX file states to metres
    #[arg(long, value_name = "FACTOR|metres", value_parser = scale)]
    scale: Option<ScaleArgument>,
    /// Convert to this up axis: rotate the roots from the up axis that an FBX file states, otherwise by 90° about x
    #[arg(id = "up_axis", long = "up-axis", alias = "up", value_name = "AXIS", value_parser = up_axis())]
    up_axis: Option<UpAxis>,
}

fn up_axis() -> impl TypedValueParser<Value = UpAxis> {
    let help = |axis| match axis {
        UpAxis::Y => "y up; for inputs with z up, as SMPL's files",
        UpAxis::Z => "z up; for inputs with y up, as glTF and BVH",
    };
    one_of(UpAxis::ALL.map(|axis| (axis.name(), help(axis), axis)))
}

#[derive(Debug, Clone, Copy)]
enum ScaleArgument {
    Factor(f64),
    Metres,
}

fn scale(text: &str) -> Result<ScaleArgument, String> {
    match text.parse::<f64>() {
        _ if text == "metres" => Ok(ScaleArgument::Metres),
        Ok(value) if value.is_finite() && value > 0.0 => Ok(ScaleArgument::Factor(value)),
        _ => Err("expected a number above 0, or `metres`".to_owned()),
    }
}

/// The heading of these options in help.
const READING: &str = "Reading motion files";

#[derive(Debug, Clone, Copy, ValueEnum)]
enum DuplicatesArgument {
    /// the first of them
    First,
    /// the last of them
    Last,
    /// both, as a jump: the first key is moved earlier by the smallest step of f32
    Both,
}

fn time_unit() -> impl TypedValueParser<Value = TimeUnit> {
    let help = |unit| match unit {
        TimeUnit::Seconds => "seconds",
        TimeUnit::Milliseconds => "milliseconds",
        TimeUnit::Microseconds => "microseconds",
        TimeUnit::Nanoseconds => "nanoseconds",
    };
    one_of(TimeUnit::ALL.map(|unit| (unit.name(), help(unit), unit)))
}

/// Reads the name of a format, for clap.
fn format() -> impl TypedValueParser<Value = &'static Format> {
    let value = |format: &&Format| PossibleValue::new(format.name).help(format.summary);
    PossibleValuesParser::new(FORMATS.iter().map(value))
        .map(|name| Format::named(&name).expect("clap takes names of the table alone"))
}

impl ReadingArguments {
    /// The command line names a method: only the file's keys are read.
    pub(crate) fn set_method_named(&self) {
        self.names_method.get_or_init(|| ());
    }

    /// Whether only the file's keys are read.
    pub(crate) fn reads_file_keys(&self) -> bool {
        self.keyframes || self.names_method.get().is_some()
    }

    /// Whether the command line converts inputs to an up axis.
    pub(crate) fn sets_up_axis(&self) -> bool {
        self.up_axis.is_some()
    }

    /// Whether the command line chooses one animation.
    pub(crate) fn chooses_animation(&self) -> bool {
        self.animation.is_some()
    }

    /// Whether an option changes the keys or the times that are read.
    pub(crate) fn changes_keys(&self) -> bool {
        self.duplicates.is_some()
            || self.source_fps.is_some()
            || self.override_fps.is_some()
            || self.source_times.is_some()
            || self.map.is_some()
            || self.time_unit.is_some()
            || self.source_order.is_some()
            || self.bridge_gaps
            || self.keyframes
            || self.offsets.is_some()
            || self.body_model.is_some()
            || self.robot.is_some()
    }

    /// Whether the command line has any of these options.
    pub(crate) fn is_set(&self) -> bool {
        let Self {
            from,
            animation,
            raw_times,
            duplicates,
            source_fps,
            override_fps,
            source_times,
            map,
            time_unit,
            source_order,
            bridge_gaps,
            keyframes,
            robot,
            source_body_order: _,
            with_partners: _,
            opened_robot: _,
            names_method: _,
            offsets,
            body_model,
            scale,
            up_axis,
        } = self;
        *raw_times
            || *bridge_gaps
            || *keyframes
            || from.is_some()
            || animation.is_some()
            || duplicates.is_some()
            || source_fps.is_some()
            || override_fps.is_some()
            || source_times.is_some()
            || map.is_some()
            || time_unit.is_some()
            || source_order.is_some()
            || offsets.is_some()
            || body_model.is_some()
            || robot.is_some()
            || scale.is_some()
            || up_axis.is_some()
    }

    /// The same options, with this order of quaternions' components.
    pub(crate) fn with_source_order(&self, order: ComponentOrder) -> Self {
        Self {
            source_order: Some(order),
            ..self.clone()
        }
    }

    /// The robot that moves. It is read once, and its warnings are printed then.
    pub(crate) fn robot(&self) -> Result<Option<Arc<Robot>>, Failure> {
        let Some(file) = &self.robot else {
            return Ok(None);
        };
        if let Some(robot) = self.opened_robot.get() {
            return Ok(Some(robot.clone()));
        }
        let robot = Robot::open(file).map_err(|fault| Failure::input(&fault, ""))?;
        let opened = self.opened_robot.get_or_init(|| {
            robot.warnings.iter().cloned().for_each(words::warn_of);
            Arc::new(robot)
        });
        Ok(Some(opened.clone()))
    }

    pub(crate) fn options(&self, limits: Limits, pipes: bool) -> Result<ReadOptions, Diagnostic> {
        let frame_times = self.source_times.as_deref();
        let frame_times = frame_times.map(|file| open_frame_times(file, limits));
        Ok(ReadOptions {
            limits,
            pipes,
            raw_times: self.raw_times,
            duplicates: match self.duplicates {
                None => Duplicates::Refuse,
                Some(DuplicatesArgument::First) => Duplicates::First,
                Some(DuplicatesArgument::Last) => Duplicates::Last,
                Some(DuplicatesArgument::Both) => Duplicates::Both,
            },
            source_rate: self.source_fps,
            override_rate: self.override_fps,
            frame_times: frame_times.transpose()?.map(Arc::new),
            map: self.map.clone(),
            time_unit: self.time_unit,
            source_order: self.source_order,
            bridge_gaps: self.bridge_gaps,
            keyframes: self.reads_file_keys(),
            has_body_model: self.body_model.is_some(),
            tracks: None,
            with_partners: self.with_partners,
        })
    }

    /// Whether the command line has an option for certain formats.
    fn sets(&self, option: FormatOption) -> bool {
        match option {
            FormatOption::RawTimes => self.raw_times,
            FormatOption::Duplicates => self.duplicates.is_some(),
            FormatOption::SourceRate => self.source_fps.is_some(),
            FormatOption::OverrideRate => self.override_fps.is_some(),
            FormatOption::TimesApart => self.source_times.is_some(),
            FormatOption::Map => self.map.is_some(),
            FormatOption::TimeUnit => self.time_unit.is_some(),
            FormatOption::SourceOrder => self.source_order.is_some(),
            FormatOption::BridgeGaps => self.bridge_gaps,
            FormatOption::Keyframes => self.keyframes,
            _ => false,
        }
    }

    /// Refuses options that have no effect on any of the inputs' formats.
    pub(crate) fn check<I: Iterator<Item = &'static Format>>(
        &self,
        formats: impl Fn() -> I,
    ) -> Result<(), String> {
        for rule in OPTIONS {
            let AppliesTo::Inputs(option) = rule.applies_to else {
                continue;
            };
            let name = rule.name.replace('_', "-");
            let is_set = self.sets(option);
            if is_set && !formats().any(|format| format.takes(option)) {
                let format_name = formats().next().map_or("", |format| format.name);
                return Err(format!(
                    "--{name} has no effect on {format_name}; it is for {}; leave it out",
                    Format::names_taking(option)
                ));
            }
        }
        Ok(())
    }

    /// Keeps the requested clip, in the requested units and axes.
    pub(crate) fn apply(&self, loaded: &mut Loaded, path: &Path) -> Result<(), Failure> {
        if let Some(requested) = &self.animation {
            choose(loaded, requested, path)?;
        }
        if let Some(robot) = self.robot()? {
            let assigned = robot.assign(loaded, &names::input(path), self.source_body_order);
            assigned.map_err(|fault| Failure::input(&fault, ""))?;
        }
        if let Some(file) = &self.offsets {
            let offsets = JointOffsets::open(file);
            let offsets = offsets.map_err(|fault| Failure::input(&fault, ""))?;
            let of_clips = loaded.clips.iter().map(|clip| offsets.of_clip(clip));
            let of_clips: Result<Vec<Vec<f64>>, OffsetsError> = of_clips.collect();
            let placed =
                of_clips.and_then(|numbers| set_all_offsets(loaded, &names::input(path), &numbers));
            placed.map_err(|error| {
                let message = format!("{}: {error}", names::input(path));
                let file = file.display().to_string();
                Failure::input(&Diagnostic::new(file, Code::Offsets, message), "")
            })?;
        }
        if let Some(model) = &self.body_model {
            let of_clip = |clip| body_offsets(model, clip, Limits::default());
            let of_clips: Result<Vec<Vec<f64>>, Diagnostic> =
                loaded.clips.iter().map(of_clip).collect();
            let numbers = of_clips.map_err(|fault| Failure::input(&fault, ""))?;
            set_all_offsets(loaded, &names::input(path), &numbers).map_err(|error| {
                let model = model.display().to_string();
                let fault = Diagnostic::new(model, Code::BodyModel, error.to_string());
                Failure::input(&fault, "")
            })?;
        }
        if self.up_axis.is_some() && loaded.box_length.is_some() {
            let message = "--up-axis has no effect on a chain of boxes; leave it out";
            return Err(Failure::usage(format!("{}: {message}", names::input(path))));
        }
        if self.scale.is_some() || self.up_axis.is_some() {
            let scale = match (self.scale, loaded.space) {
                (None, _) => 1.0,
                (Some(ScaleArgument::Factor(factor)), _) => factor,
                (Some(ScaleArgument::Metres), Some(space)) => space.metres,
                (Some(ScaleArgument::Metres), None) => {
                    let message = "does not state its unit of length; give --scale as a number";
                    return Err(Failure::usage(format!("{}: {message}", names::input(path))));
                }
            };
            adjust_all(loaded, scale, self.up_axis).map_err(|error| {
                Failure::new(exit::ALL_INPUTS, format!("{}: {error}", names::input(path)))
            })?;
        }
        Ok(())
    }
}

/// Keeps only the clip of that name, or of that index.
fn choose(loaded: &mut Loaded, requested: &str, path: &Path) -> Result<(), Failure> {
    let named = |clip: &Motion| clip.name.as_deref() == Some(requested);
    let same: Vec<String> = (loaded.clips.iter().filter(|clip| named(clip)))
        .map(|clip| clip.index.to_string())
        .collect();
    if let [_, _, ..] = &*same {
        let (name, indices) = (names::input(path), same.join(" and "));
        let message = format!(
            "{name}: has {} animations called `{requested}`, at the indices {indices}; give the index",
            same.len()
        );
        return Err(Failure::new(exit::ALL_INPUTS, message));
    }
    let found = loaded.clips.iter().position(named).or_else(|| {
        let index = requested.parse::<usize>().ok()?;
        loaded.clips.iter().position(|clip| clip.index == index)
    });
    let Some(index) = found else {
        let (name, names) = (names::input(path), names::clips(loaded));
        let message = format!("{name}: has no animation `{requested}`; it has {names}");
        return Err(Failure::new(exit::ALL_INPUTS, message));
    };
    loaded.clips = vec![loaded.clips.swap_remove(index)];
    loaded.refused.clear();
    Ok(())
}
