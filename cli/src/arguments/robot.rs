//! The options for the motion of robots: the layout of another program that results have, and its orders.

use std::borrow::Cow;
use std::f64::consts::TAU;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use tumble::trees::{BodyOrder, Siblings};
use tumble::{Engine, Error, FrameRate, SampleTimes};
use tumble_formats::dialect::write::{RobotMotion, WRITTEN, WrittenDialect, written_joints};
use tumble_formats::format::Format;
use tumble_formats::motion::Motion;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::robot::{
    Bodies, BodiesError, BodiesRequest, FixedBodies, LimitExcess, LimitRule, Robot, VelocityPoint,
    VelocitySource, bodies, clamp_scalars, scalar_excesses,
};
use tumble_formats::sample::ChannelMethods;
use tumble_formats::times::clock_text;
use tumble_formats::{Code, Diagnostic};

use crate::arguments::output::{body_order, one_of};
use crate::arguments::results::ResultArguments;
use crate::batch::pipeline::ClipWork;
use crate::batch::target::WrittenFile;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::{names, words};

/// How the motion of a robot is written.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Writing motion of robots")]
pub(crate) struct DialectArguments {
    /// Write the motion of --robot in the layout of another program: joints are interpolated, and bodies
    /// and velocities computed from them
    #[arg(long, value_name = "DIALECT", requires = "robot", value_parser = dialect())]
    dialect: Option<&'static WrittenDialect>,
    /// The order of bodies in the result [default: that of the dialect]
    #[arg(long, value_name = "ORDER", requires = "dialect", value_parser = body_order())]
    body_order: Option<BodyOrder>,
    /// The order of joints in the result, by their bodies [default: that of the bodies]
    #[arg(long, value_name = "ORDER", requires = "dialect", value_parser = body_order())]
    joint_order: Option<BodyOrder>,
    /// The order of bodies with the same parent
    #[arg(long, value_name = "ORDER", requires = "dialect", default_value_t, value_parser = siblings())]
    siblings: Siblings,
    /// Bodies without joints: merge them into the bodies that they are fixed to, or keep them
    /// [default: beyondmimic and isaaclab merge the links of URDF]
    #[arg(long, value_name = "RULE", requires = "dialect", value_parser = fixed_bodies())]
    fixed_bodies: Option<FixedBodies>,
    /// The point of a body whose velocity is written [default: that of the dialect]
    #[arg(long, value_name = "POINT", requires = "dialect", value_parser = velocity_at())]
    velocity_at: Option<VelocityPoint>,
    /// How velocities are computed
    #[arg(long, value_name = "HOW", requires = "dialect", default_value_t, value_parser = velocities())]
    velocities: VelocitySource,
    /// What to do with joints outside the limits of --robot
    #[arg(long, value_name = "RULE", requires = "robot", default_value_t, value_parser = limits())]
    limits: LimitRule,
    /// mjlab, beyondmimic: also write the names and orders of joints and bodies, and how the result was
    /// made, in arrays that the programs ignore
    #[arg(long, requires = "dialect")]
    describe: bool,
}

fn dialect() -> impl TypedValueParser<Value = &'static WrittenDialect> {
    let all = WRITTEN.iter().copied();
    one_of(
        all.map(|dialect| (dialect.name, dialect.summary, dialect))
            .collect::<Vec<_>>(),
    )
}

fn siblings() -> impl TypedValueParser<Value = Siblings> {
    let help = |siblings| match siblings {
        Siblings::File => "as in the file of the robot",
        Siblings::BodyName => "by their names",
        Siblings::JointName => "by the names of their joints, as pinocchio has them",
    };
    one_of(Siblings::ALL.map(|siblings| (siblings.name(), help(siblings), siblings)))
}

fn fixed_bodies() -> impl TypedValueParser<Value = FixedBodies> {
    let help = |rule| match rule {
        FixedBodies::Keep => "they are bodies of the result",
        FixedBodies::Merge => "only bodies with joints are in the result",
    };
    one_of(FixedBodies::ALL.map(|rule| (rule.name(), help(rule), rule)))
}

fn velocity_at() -> impl TypedValueParser<Value = VelocityPoint> {
    let help = |point| match point {
        VelocityPoint::Origin => "the origin of its frame: mjlab",
        VelocityPoint::Mass => "its centre of mass: IsaacLab, BeyondMimic",
    };
    one_of(VelocityPoint::ALL.map(|point| (point.name(), help(point), point)))
}

/// `exact` is a name of the curve's own velocities too.
fn velocities() -> impl TypedValueParser<Value = VelocitySource> {
    let value = |source: VelocitySource| match (source, PossibleValue::new(source.name())) {
        (VelocitySource::Curve, value) => {
            value.help("the derivatives of the curves").alias("exact")
        }
        (VelocitySource::Differences, value) => {
            value.help("differences of the samples on both sides, as other programs compute them")
        }
    };
    PossibleValuesParser::new(VelocitySource::ALL.map(value))
        .map(|name| name.parse().unwrap_or_default())
}

fn limits() -> impl TypedValueParser<Value = LimitRule> {
    let help = |rule| match rule {
        LimitRule::Report => "a warning; values are kept",
        LimitRule::Clamp => "they stay at the limit, with velocity 0",
        LimitRule::Refuse => "an error",
    };
    one_of(LimitRule::ALL.map(|rule| (rule.name(), help(rule), rule)))
}

/// The samples of a robot's motion.
pub(crate) struct RobotFrames<'a> {
    pub(crate) frames: &'a SampleTimes,
    /// The rate of which all samples are neighbouring frames.
    pub(crate) rate: Option<FrameRate>,
    pub(crate) methods: ChannelMethods,
}

/// The part of an evaluation's JSON about a robot's motion: the names, orders and rules of its file.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct RobotReport {
    dialect: &'static str,
    /// The names of the joints, in the order of the result.
    joints: Vec<String>,
    joint_order: &'static str,
    /// The names of the bodies; absent if the dialect has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    bodies: Option<Vec<String>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    body_order: Option<&'static str>,
    /// The bodies of the robot's file that are parts of others.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    merged_bodies: Vec<String>,
    siblings: &'static str,
    /// The order of quaternions; absent if the dialect has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    quaternion: Option<&'static str>,
    velocities: &'static str,
    velocity_at: &'static str,
    /// Joints outside their limits.
    outside_limits: usize,
}

impl RobotReport {
    /// How many bodies were computed for each frame; at least the root.
    pub(crate) fn body_count(&self) -> usize {
        self.bodies.as_ref().map_or(1, Vec::len)
    }

    /// The order of quaternions.
    pub(crate) fn quaternion(&self) -> Option<&'static str> {
        self.quaternion
    }

    /// `13 joints depth-first, 15 bodies depth-first, 2 fixed bodies merged into them`.
    pub(crate) fn text(&self) -> String {
        let joints = words::count(self.joints.len(), "joint");
        let joints = format!("{joints} {}", self.joint_order);
        let bodies = self.bodies.as_ref().zip(self.body_order);
        let bodies = bodies.map(|(bodies, order)| match bodies.len() {
            1 => format!(", 1 body {order}"),
            count => format!(", {count} bodies {order}"),
        });
        let merged = match self.merged_bodies.len() {
            0 => String::new(),
            1 => ", 1 fixed body merged into them".to_owned(),
            count => format!(", {count} fixed bodies merged into them"),
        };
        let bodies = bodies.unwrap_or_default();
        format!("{}: {joints}{bodies}{merged}", self.dialect)
    }
}

impl DialectArguments {
    /// The dialect of results.
    pub(crate) fn chosen(&self) -> Option<&'static WrittenDialect> {
        self.dialect
    }

    /// The format of results: that of the dialect, or else the one that the command line names.
    pub(crate) fn format(
        &self,
        results: &ResultArguments,
    ) -> Result<Option<&'static Format>, Failure> {
        let asked = results.format();
        let Some(dialect) = self.dialect else {
            return Ok(asked);
        };
        if let Some(out) = results.out()
            && let Some(named) = Format::of(out).filter(|named| named.name != dialect.format)
            && !out.is_dir()
        {
            return Err(Failure::usage(format!(
                "{}: ends as {}, and {} is {}; end the output in .{}",
                out.display(),
                named.name,
                dialect.name,
                dialect.format,
                dialect.extension()
            )));
        }
        if let (Some(out), Some(meaning)) = (results.out(), dialect.other_endings)
            && let Some(ending) = out.extension().filter(|_| Format::of(out).is_some())
            && !ending.eq_ignore_ascii_case(dialect.extension())
            && !out.is_dir()
        {
            return Err(Failure::usage(format!(
                "{}: {meaning}; end the output in .{}",
                out.display(),
                dialect.extension()
            )));
        }
        if self.velocity_at.is_some() && !dialect.has_bodies {
            return Err(Failure::usage(format!(
                "--velocity-at has no effect on {}, which has no velocities of bodies; leave it out",
                dialect.name
            )));
        }
        if self.fixed_bodies.is_some() && !dialect.has_bodies {
            return Err(Failure::usage(format!(
                "--fixed-bodies has no effect on {}, which has no bodies; leave it out",
                dialect.name
            )));
        }
        if self.describe && !dialect.takes_descriptions {
            return Err(Failure::usage(format!(
                "--describe has no effect on {}; leave it out",
                dialect.name
            )));
        }
        let format = Format::named(dialect.format);
        match asked.filter(|asked| asked.name != dialect.format) {
            None => Ok(format),
            Some(asked) => Err(Failure::usage(format!(
                "{} is {}, not {}; leave out --format",
                dialect.name, dialect.format, asked.name
            ))),
        }
    }

    /// The robot with the bodies that a dialect stores: the robot of the file, or the one whose fixed bodies are merged
    /// into others.
    pub(crate) fn robot_of<'a>(
        &self,
        dialect: &WrittenDialect,
        robot: &'a Robot,
    ) -> Result<Cow<'a, Robot>, Failure> {
        let of_dialect = dialect.fixed_bodies(robot.format);
        match self.fixed_bodies.unwrap_or(of_dialect) {
            FixedBodies::Merge if dialect.has_bodies => robot
                .merged()
                .map(Cow::Owned)
                .map_err(|error| Failure::new(ALL_INPUTS, format!("--robot: {error}"))),
            _ => Ok(Cow::Borrowed(robot)),
        }
    }

    /// The bodies and joints of a clip at some samples, which `run` has an engine for.
    pub(crate) fn evaluate(
        &self,
        dialect: &WrittenDialect,
        robot: &Robot,
        (name, clip): (&str, &Motion),
        frames: &RobotFrames<'_>,
        run: impl FnOnce(&dyn Fn(&Engine) -> Result<Bodies, BodiesError>) -> Result<Bodies, BodiesError>,
    ) -> Result<Bodies, Failure> {
        let methods = &frames.methods;
        let method = methods.moving_method_of(clip).map_err(|[first, second]| {
            let message = format!(
                "its channels are interpolated by {first} and {second}; name a method with -m"
            );
            Failure::usage(format!("{name}: {message}"))
        })?;
        let request = BodiesRequest {
            frames: frames.frames.clone(),
            rotations: methods.options.with(method),
            vectors: clip
                .numbers_method(methods)
                .unwrap_or(method.scalar_method()),
            order: self.body_order.unwrap_or(dialect.order),
            siblings: self.siblings,
            velocity_at: self.velocity_at.unwrap_or(dialect.velocity_at),
            velocities: self.velocities,
            limits: self.limits,
            origins: clip.origins.clone(),
        };
        let found = run(&|engine| bodies(engine, &robot.tree, &clip.set, &request));
        found.map_err(|error| match error {
            BodiesError::Engine(error) => Failure::evaluating(name, &error),
            BodiesError::NoMassCentre { .. } => {
                let message = format!("{error} (--velocity-at origin)");
                Failure::input(&Diagnostic::new(name, Code::NoMassCentre, message), "")
            }
            BodiesError::OutsideLimits { .. } => Failure::input(
                &Diagnostic::new(name, Code::OutsideLimits, error.to_string()),
                "",
            ),
            error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
        })
    }

    /// The text of the message about joints that leave their limits; `None` if none does.
    fn limits_text(
        &self,
        excesses: &[LimitExcess],
        clip: &Motion,
        times: &[f64],
    ) -> Option<String> {
        let joint = |excess: &LimitExcess| {
            let time = times.get(excess.sample).copied().unwrap_or(0.0);
            let time = clock_text(clip.time_offset, time);
            format!(
                "`{}` by up to {:.4} {} (first at {time} s)",
                excess.joint, excess.excess, excess.unit
            )
        };
        let joints: Vec<String> = excesses.iter().map(joint).collect();
        let done = match self.limits {
            LimitRule::Clamp => "they are kept inside",
            LimitRule::Report => "their values are kept (--limits clamp changes them)",
            LimitRule::Refuse => "--limits report keeps their values",
        };
        // If the file's angles are degrees but are read as radians, even an ordinary pose exceeds its limits by whole
        // turns.
        let is_circles_away = |excess: &&LimitExcess| excess.unit == "rad" && excess.excess > TAU;
        let doubt = match 2 * excesses.iter().filter(is_circles_away).count() > excesses.len() {
            true => "; by more than a turn: are the file's angles in degrees?",
            false => "",
        };
        let text = || {
            format!(
                "joints leave their limits: {}; {done}{doubt}",
                joints.join(", ")
            )
        };
        (!joints.is_empty()).then(text)
    }

    /// Applies the rule for limits to the scalars of a clip at samples, `[sample][scalar]`; `rates` are their
    /// velocities.
    pub(crate) fn limit_scalars(
        &self,
        work: &ClipWork,
        (clip, times): (&Motion, &[f64]),
        values: &mut [f32],
        rates: Option<&mut [f32]>,
    ) -> Result<(), Failure> {
        let excesses = scalar_excesses(clip, values);
        let Some(message) = self.limits_text(&excesses, clip, times) else {
            return Ok(());
        };
        match self.limits {
            LimitRule::Refuse => {
                let refusal = Diagnostic::new(&work.name, Code::OutsideLimits, message);
                return Err(Failure::input(&refusal, ""));
            }
            LimitRule::Clamp => clamp_scalars(clip, values, rates),
            LimitRule::Report => {}
        }
        words::warn_of(Diagnostic::new(&work.name, Code::JointLimits, message));
        Ok(())
    }

    /// Writes the motion of a robot; `notes` say how it was made.
    pub(crate) fn write(
        &self,
        dialect: &WrittenDialect,
        robot: &Robot,
        (work, clip): (&ClipWork, &Motion),
        (bodies, rate): (&Bodies, Option<FrameRate>),
        notes: Vec<(&'static str, String)>,
    ) -> Result<(WrittenFile, RobotReport), Failure> {
        let (name, tree) = (&*work.name, &robot.tree);
        let Some(rate) = rate else {
            let message = format!(
                "{} stores frames of one rate, and the keys have none; give --fps FPS (with `tumble eval`)",
                dialect.name
            );
            return Err(Failure::input(
                &Diagnostic::new(name, Code::Dialect, message),
                "",
            ));
        };
        if let Some(message) = self.limits_text(&bodies.excesses, clip, &bodies.times) {
            words::warn_of(Diagnostic::new(name, Code::JointLimits, message));
        }
        let order = self.body_order.unwrap_or(dialect.order);
        let joint_order = self.joint_order.unwrap_or(order);
        let origin = |joint: &str| {
            clip.set
                .scalar_named(joint)
                .map_or(0.0, |index| clip.scalar(index).origin)
        };
        let target = work.target.to_string();
        let joints = written_joints(tree, &tree.order(joint_order, self.siblings));
        let all: Vec<String> = tree
            .scalar_joints()
            .map(|joint| joint.name.clone())
            .collect();
        let report = RobotReport {
            dialect: dialect.name,
            joints: joints.iter().map(|&joint| all[joint].clone()).collect(),
            joint_order: joint_order.name(),
            bodies: dialect.has_bodies.then(|| {
                let name = |&body: &usize| tree.bodies()[body].name.clone();
                bodies.order.iter().map(name).collect()
            }),
            body_order: dialect.has_bodies.then_some(order.name()),
            merged_bodies: robot.merged.clone(),
            siblings: self.siblings.name(),
            quaternion: dialect.quaternions.map(ComponentOrder::name),
            velocities: self.velocities.name(),
            velocity_at: self.velocity_at.unwrap_or(dialect.velocity_at).name(),
            outside_limits: bodies.excesses.len(),
        };
        let description = || {
            let mut all = vec![("order", report.text())];
            all.extend(
                report
                    .quaternion
                    .map(|order| ("quaternion", order.to_owned())),
            );
            let notes = notes.iter().map(|(note, text)| format!("{note}={text}"));
            let made: Vec<String> = notes.collect();
            all.push(("tumble", made.join(" ")));
            all
        };
        let file_name = name_of_file(work);
        let motion = RobotMotion {
            tree,
            bodies,
            origins: all.iter().map(|name| origin(name)).collect(),
            joints,
            rate,
            name: clip.name.as_deref().unwrap_or(&file_name),
            description: self.describe.then(description),
            output: &target,
        };
        let written = work
            .target
            .write_motion(|out| dialect.write(&motion, out))?;
        Ok((written, report))
    }
}

/// The name for a clip without a name: the name of the result's file up to the first point, because loaders find clips
/// by this name; if the result is written to standard output, the name of the input's file.
fn name_of_file(work: &ClipWork) -> String {
    let file = match names::is_standard(work.target.path()) {
        true => work.path(),
        false => work.target.path(),
    };
    let stem = names::stem(file);
    let first = stem.split('.').next().filter(|name| !name.is_empty());
    first.map_or(stem.clone(), ToOwned::to_owned)
}

/// Returns an error of the engine as such, so that another device may take over; other errors stay in the result.
pub(crate) fn or_engine_error(
    found: Result<Bodies, BodiesError>,
) -> Result<Result<Bodies, BodiesError>, Error> {
    match found {
        Err(BodiesError::Engine(error)) => Err(error),
        found => Ok(found),
    }
}
