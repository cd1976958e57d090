//! `tumble features`: features for learning.

use std::ops::RangeInclusive;

use clap::Args;
use clap::builder::TypedValueParser;
use glam::DVec3;
use serde::Serialize;
use tumble::trees::{BodyOrder, Siblings};
use tumble::{Device, Engine, FrameRate, SampleTimes};
use tumble_formats::format::Format;
use tumble_formats::learning::{
    ContactLimits, FeatureRequest, FeatureSet, Ground, WorldFrames, feature_arrays, mirror_pairs,
    without_partner, write_features,
};
use tumble_formats::motion::{Joint, Motion};
use tumble_formats::printable::printable;
use tumble_formats::retarget::{
    Role, Roles, furthest_from_t_pose, missing_text, recognise, standing_axis,
};
use tumble_formats::robot::{
    BodiesError, BodiesRequest, LimitRule, Robot, VelocityPoint, VelocitySource, bodies,
};
use tumble_formats::sample::{ChannelMethods, MethodChoice};
use tumble_formats::world::world;
use tumble_formats::{Code, Diagnostic};

use crate::arguments::input::Inputs;
use crate::arguments::interpolation::method_argument;
use crate::arguments::options::CommandLine;
use crate::arguments::output::one_of;
use crate::arguments::results::ResultArguments;
use crate::arguments::root_motion::VerticalArguments;
use crate::batch::pipeline::{ClipWork, EvaluatedResult};
use crate::batch::preview::PlannedWork;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Compute features for learning: six numbers of rotations, headings, contacts, mirrors, HumanML3D, Kimodo
#[derive(Debug, Args)]
#[command(after_help = "\
The result is an NPZ file with arrays of f32 for all frames and joints in the world, the times and the \
names of the joints. With --robot the joints are the robot's bodies, and velocities are derivatives of the \
curves; for other skeletons they are differences of poses 1/32 of a frame apart. HumanML3D needs metres, y \
up, 20 frames a second and the 22 joints of SMPL, or of a skeleton that is recognised by its names; bodies of SMPL need \
--body-model. Kimodo needs the same with joints that have the axes of the world at rest in a T-pose, as SMPL's, at any rate.

Examples:
  tumble features walk.bvh --sets six-columns,heading -o walk.npz
  tumble features walk.pkl --robot g1.xml -f 50 --sets contacts,positions --vertical z -o walk.npz
  tumble features amass --body-model models --up-axis y --fps 20 --sets humanml3d -o out --resume")]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    results: ResultArguments,
    /// Which features, separated by commas
    #[arg(long, value_name = "SETS", value_delimiter = ',', required = true, value_parser = sets())]
    sets: Vec<FeatureSet>,
    /// Frames per second [default: the rate of the input]
    #[arg(short = 'f', long, value_name = "FPS")]
    fps: Option<FrameRate>,
    /// How to interpolate: `authored`, or a method (`tumble methods`)
    #[arg(short, long, value_name = "METHOD", default_value = "authored", value_parser = method_argument())]
    method: MethodChoice,
    #[command(flatten)]
    vertical: VerticalArguments,
    /// The height below which a slow joint touches the ground, metres
    #[arg(long, value_name = "METRES", default_value_t = ContactLimits::PROTOMOTIONS.height)]
    contact_height: f64,
    /// The speed below which a low joint touches the ground, metres a second
    #[arg(long, value_name = "SPEED", default_value_t = ContactLimits::PROTOMOTIONS.speed)]
    contact_speed: f64,
    /// Replace each contact by the majority of this many frames around it, an odd number
    #[arg(long, value_name = "FRAMES", default_value_t = 1)]
    contact_window: usize,
    /// The axis whose direction the mirror reverses [default: x with y up, y with z up]
    #[arg(long, value_name = "AXIS", value_parser = mirror_axis())]
    mirror_axis: Option<usize>,
}

fn sets() -> impl TypedValueParser<Value = FeatureSet> {
    let help = |set| match set {
        FeatureSet::Positions => "positions and velocities",
        FeatureSet::SixColumns => "two columns of each matrix: Zhou 2019, HumanML3D, Kimodo",
        FeatureSet::SixRows => "two rows of each matrix: PyTorch3D",
        FeatureSet::SixInterleaved => "two columns side by side: SPIN",
        FeatureSet::Heading => "the twist of the first joint about the axis that points up, rad",
        FeatureSet::Contacts => "whether each joint touches the ground",
        FeatureSet::Mirror => "left and right exchanged",
        FeatureSet::Humanml3d => "the 263 numbers of HumanML3D",
        FeatureSet::Kimodo => "the 273 numbers of Kimodo for the joints of SMPL",
    };
    one_of(FeatureSet::ALL.map(|set| (set.name(), help(set), set)))
}

pub(crate) fn mirror_axis() -> impl TypedValueParser<Value = usize> {
    one_of([
        ("x", "for y-up skeletons of people that face z", 0),
        ("y", "for z-up robots that face x", 1),
        ("z", "for skeletons of people that face x", 2),
    ])
}

/// The computed features, with `--json`.
#[derive(Debug, Serialize)]
struct FeatureReport {
    frames: usize,
    joints: usize,
    arrays: Vec<&'static str>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.contact_window.is_multiple_of(2) {
        let message = "--contact-window: give an odd number of frames, because the frame is in the middle of the window";
        return Err(Failure::usage(message));
    }
    let files = arguments.inputs.gather(false)?;
    let format = Format::named("npz");
    if let Some(asked) = arguments
        .results
        .format()
        .filter(|asked| asked.name != "npz")
    {
        let message = format!(
            "features are written as npz, not {}; leave out --format",
            asked.name
        );
        return Err(Failure::usage(message));
    }
    if let Some(out) = arguments.results.out()
        && let Some(named) = Format::of(out).filter(|named| named.name != "npz")
        && !out.is_dir()
    {
        let (out, name) = (out.display(), named.name);
        let message = format!(
            "{out}: is the name of {name}, and features are written as NPZ; end the output in .npz"
        );
        return Err(Failure::usage(message));
    }
    let options = arguments.command_line.options().of_command("features");
    let reader = arguments.inputs.clone();
    let work = PlannedWork {
        reader: &reader,
        options: &options,
    };
    let plan = arguments.results.plan_in(files, format, &work)?;
    let engine =
        Engine::new(Device::Cpu).map_err(|error| Failure::evaluating("features", &error))?;
    let mut pipeline = arguments.results.start(reader, plan, options);
    while let Some(work) = pipeline.next_work() {
        let made = arguments.make(&work, &engine);
        pipeline.keep(&work, made);
    }
    pipeline.finish()
}

/// Warns if the rate differs from that of HumanML3D's models: its numbers are steps from frame to frame, so they would
/// have another meaning.
fn warn_of_other_rate(name: &str, rate: FrameRate) {
    /// Frames a second of HumanML3D.
    const RATE: u64 = 20;
    if FrameRate::new(RATE, 1).is_ok_and(|of_set| of_set != rate) {
        let message = format!(
            "HumanML3D has {RATE} frames a second, and its numbers are steps from frame to frame; these are of {} \
             (--fps {RATE})",
            rate.in_words()
        );
        words::warn_of(Diagnostic::new(name, Code::SetRate, message));
    }
}

/// Warns of bodies that are too small or too large for the metres of a set.
fn warn_of_other_unit(name: &str, set: &str, poses: &WorldFrames) {
    /// The distance between the joints of a person that are furthest apart along an axis, in metres.
    const PERSON: RangeInclusive<f64> = 0.5..=3.0;
    let first = &poses.positions[..poses.names.len().min(poses.positions.len())];
    let low = first.iter().copied().reduce(DVec3::min);
    let high = first.iter().copied().reduce(DVec3::max);
    let size = low.zip(high).map(|(low, high)| (high - low).max_element());
    if let Some(size) = size.filter(|size| !PERSON.contains(size)) {
        let message = format!(
            "{set} is in metres, and the body is {} units tall; is it in another unit? (--scale)",
            words::decimals(size)
        );
        words::warn_of(Diagnostic::new(name, Code::SetUnit, message));
    }
}

/// Warns of joints that name a side, but are mirrored in place.
pub(crate) fn lost_partners(name: &str, names: &[String], pairs: &[usize]) -> Option<Diagnostic> {
    let alone = without_partner(names, pairs);
    let &first = alone.first()?;
    let message = format!(
        "mirrored in place: {} with the name of a side and no partner on the other (the first: {})",
        words::count(alone.len(), "joint"),
        names[first]
    );
    Some(Diagnostic::new(name, Code::LostPartner, message))
}

/// Refuses skeletons that rest otherwise than SMPL: in a T-pose with y up that faces z, where all joints have the axes of
/// the world.
fn check_rest(name: &str, clip: &Motion, roles: &Roles) -> Result<(), Failure> {
    let refused = |difference: String| {
        let message = format!(
            "{name}: Kimodo's rotations are those of SMPL, which rests in a T-pose with y up that faces z, where all joints \
             have the axes of the world; {difference}; `tumble retarget --onto` carries the motion to such a skeleton"
        );
        Err(Failure::new(ALL_INPUTS, message))
    };
    let is_rotated = |joint: &Joint| joint.rest.rotation.w.abs() < 1.0 - 1e-6;
    if let Some(joint) = clip.skeleton.iter().position(is_rotated) {
        let joint = clip.set.track_name(joint);
        return refused(format!("here `{}` is rotated at rest", printable(&joint)));
    }
    if let Some(([first, last], apart)) = furthest_from_t_pose(clip, roles)
        && apart > T_POSE
    {
        let [first, last] = [first, last].map(|joint| clip.set.track_name(joint));
        return refused(format!(
            "here the direction from `{}` to `{}` is {apart:.0}° away from that at rest",
            printable(&first),
            printable(&last)
        ));
    }
    Ok(())
}

/// How far the limbs of a T-pose are from the axes at most, in degrees; legs are often apart.
const T_POSE: f64 = 30.0;

/// Whether a set of features depends on the upward axis.
fn depends_on_ground(set: FeatureSet) -> bool {
    matches!(
        set,
        FeatureSet::Heading | FeatureSet::Contacts | FeatureSet::Humanml3d | FeatureSet::Kimodo
    )
}

impl Arguments {
    fn make(
        &self,
        work: &ClipWork,
        engine: &Engine,
    ) -> Result<(EvaluatedResult, FeatureReport), Failure> {
        let (name, clips) = (&*work.name, work.clips());
        let [clip] = clips[..] else {
            let message =
                format!("{name}: a file has the features of one clip; choose it with --animation");
            return Err(Failure::usage(message));
        };
        let clip = self.inputs.tracks.select_with_ancestors(clip, name)?;
        let rate = self.fps.or(clip.rate).or_else(|| clip.rate_of_keys());
        let rate = rate
            .ok_or_else(|| Failure::usage(format!("{name}: its keys have no rate; give --fps")))?;
        let robot = self.inputs.reading.robot()?;
        let ground = self.vertical.ground(&clip, robot.is_some());
        let poses = match &robot {
            Some(robot) => self.of_robot(name, &clip, robot, rate, engine)?,
            None => self.of_skeleton(name, &clip, rate, engine)?,
        };
        let roles = roles_of(&clip, &poses.names);
        if let (None, Ok(roles)) = (&robot, &roles) {
            self.check_up(name, &poses, roles, ground)?;
        }
        let request = FeatureRequest {
            sets: self.sets.clone(),
            ground,
            limits: ContactLimits {
                height: self.contact_height,
                speed: self.contact_speed,
            },
            window: self.contact_window,
            mirror_axis: self.mirror_axis.unwrap_or(match ground {
                Ground::Y => 0,
                Ground::Z => 1,
            }),
            humanml3d_joints: roles
                .as_ref()
                .map_err(String::clone)
                .and_then(joints_of_smpl),
            rate,
        };
        if let (true, Ok(roles)) = (self.sets.contains(&FeatureSet::Kimodo), &roles) {
            check_rest(name, &clip, roles)?;
        }
        if self.sets.contains(&FeatureSet::Humanml3d) {
            warn_of_other_rate(name, rate);
        }
        for (set, of_set) in [
            (FeatureSet::Humanml3d, "HumanML3D"),
            (FeatureSet::Kimodo, "Kimodo"),
        ] {
            if self.sets.contains(&set) {
                warn_of_other_unit(name, of_set, &poses);
            }
        }
        if self.sets.contains(&FeatureSet::Mirror)
            && let Some(warning) = lost_partners(name, &poses.names, &mirror_pairs(&poses.names))
        {
            words::warn_of(warning);
        }
        let failed =
            |error: &dyn std::fmt::Display| Failure::new(ALL_INPUTS, format!("{name}: {error}"));
        let arrays = feature_arrays(&poses, &request).map_err(|error| failed(&error))?;
        let written = work.target.write_motion(|out| {
            write_features(&poses, &arrays, out)?;
            Ok(Vec::new())
        })?;
        let report = FeatureReport {
            frames: poses.times.len(),
            joints: poses.names.len(),
            arrays: arrays.iter().map(|array| array.name).collect(),
        };
        let done = format!(
            "{} of {}: {}",
            words::count(report.frames, "frame"),
            words::count(report.joints, "joint"),
            report.arrays.join(", ")
        );
        Ok((work.result(written, &done, None), report))
    }

    /// Refuses a body that stands along another axis than the one that points up, for sets that depend on it. Where the command
    /// line states the axis, this is a warning: a body may lie or crawl.
    fn check_up(
        &self,
        name: &str,
        poses: &WorldFrames,
        roles: &Roles,
        ground: Ground,
    ) -> Result<(), Failure> {
        let sets = self.sets.iter().copied();
        let Some(set) = { sets }.find(|&set| depends_on_ground(set)) else {
            return Ok(());
        };
        let frames = poses.positions.chunks(poses.names.len().max(1));
        let Some(axis) = standing_axis(roles, frames).filter(|axis| *axis != ground.up()) else {
            return Ok(());
        };
        let (up, axis) = (ground.name(), axis_name(axis));
        let message = format!("{name}: the body stands along {axis}, from its feet to its head");
        let option = match (self.vertical.is_set(), self.inputs.reading.sets_up_axis()) {
            (true, _) => "--vertical",
            (false, true) => "--up-axis",
            (false, false) => {
                let message = format!(
                    "{message}, and {set} is computed with {up} up; --up-axis {up} converts a body that stands along z, \
                     --vertical {up} accepts the axes as they are"
                );
                return Err(Failure::new(ALL_INPUTS, message));
            }
        };
        words::warning(&format!(
            "{message}, and {option} states that {up} points up"
        ));
        Ok(())
    }

    fn methods(&self) -> ChannelMethods {
        ChannelMethods {
            method: self.method,
            ..ChannelMethods::AUTHORED
        }
    }

    /// The bodies of a robot.
    fn of_robot(
        &self,
        name: &str,
        clip: &Motion,
        robot: &Robot,
        rate: FrameRate,
        engine: &Engine,
    ) -> Result<WorldFrames, Failure> {
        let methods = self.methods();
        let method = methods.moving_method_of(clip).map_err(|[first, second]| {
            let message = format!(
                "its channels are interpolated by {first} and {second}; name a method with -m"
            );
            Failure::usage(format!("{name}: {message}"))
        })?;
        let request = BodiesRequest {
            frames: SampleTimes::rate(rate),
            rotations: methods.options.with(method),
            vectors: clip
                .numbers_method(&methods)
                .unwrap_or(method.scalar_method()),
            order: BodyOrder::DepthFirst,
            siblings: Siblings::File,
            velocity_at: VelocityPoint::Origin,
            velocities: VelocitySource::Curve,
            limits: LimitRule::Report,
            origins: clip.origins.clone(),
        };
        let found =
            bodies(engine, &robot.tree, &clip.set, &request).map_err(|error| match error {
                BodiesError::Engine(error) => Failure::evaluating(name, &error),
                error => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
            })?;
        let names = found
            .order
            .iter()
            .map(|&body| robot.tree.bodies()[body].name.clone());
        Ok(WorldFrames {
            names: names.collect(),
            times: found.times,
            positions: found
                .motions
                .iter()
                .map(|motion| motion.pose.position)
                .collect(),
            rotations: found
                .motions
                .iter()
                .map(|motion| motion.pose.rotation)
                .collect(),
            velocities: found
                .motions
                .iter()
                .map(|motion| motion.velocity.linear)
                .collect(),
        })
    }

    /// The joints of a skeleton.
    fn of_skeleton(
        &self,
        name: &str,
        clip: &Motion,
        rate: FrameRate,
        engine: &Engine,
    ) -> Result<WorldFrames, Failure> {
        let at = |frames: &SampleTimes| {
            let samples = self.methods().sample(engine, clip, frames);
            let samples = samples.map_err(|error| Failure::evaluating(name, &error))?;
            let poses = world(clip, &samples);
            let failed = |error| Failure::new(ALL_INPUTS, format!("{name}: {error}"));
            Ok::<_, Failure>((samples.times, poses.map_err(failed)?))
        };
        let (times, poses) = at(&SampleTimes::rate(rate))?;
        // Velocities are differences of samples a 32nd of a frame apart, inside the clip.
        let step = rate.time_of(1) / 64.0;
        let (first, last) = clip.set.time_span().unwrap_or_default();
        let beside = |side: f64| -> Vec<f64> {
            times
                .iter()
                .map(|time| (time + side * step).clamp(first, last))
                .collect()
        };
        let (before, from) = at(&SampleTimes::at(beside(-1.0)))?;
        let (after, to) = at(&SampleTimes::at(beside(1.0)))?;
        let joints = clip.set.track_count();
        let velocity = |index: usize| {
            let seconds = after[index / joints] - before[index / joints];
            match seconds > 0.0 {
                true => (to[index].position - from[index].position) / seconds,
                false => DVec3::ZERO,
            }
        };
        Ok(WorldFrames {
            names: (0..joints)
                .map(|track| clip.set.track_name(track))
                .collect(),
            velocities: (0..poses.len()).map(velocity).collect(),
            positions: poses.iter().map(|pose| pose.position).collect(),
            rotations: poses.iter().map(|pose| pose.rotation.as_dquat()).collect(),
            times,
        })
    }
}

/// `-z` for the negative z axis.
pub(crate) fn axis_name(axis: DVec3) -> String {
    let name = ["x", "y", "z"][axis.abs().max_position()];
    match axis.element_sum() < 0.0 {
        true => format!("-{name}"),
        false => name.to_owned(),
    }
}

/// The parts of the body that the names of a skeleton's joints mean; or why they are not known, with the remedy.
fn roles_of(clip: &Motion, names: &[String]) -> Result<Roles, String> {
    let parents: Vec<Option<usize>> = clip.skeleton.iter().map(|joint| joint.parent).collect();
    recognise(names, &parents).map_err(|missing| {
        format!(
            "the joints are not those of a known human skeleton: {}; {REMEDY}",
            missing_text(&missing)
        )
    })
}

/// For skeletons without the joints of SMPL.
const REMEDY: &str = "`tumble retarget --onto FILE --bones FILE` carries the motion to a skeleton that has all, such as one of SMPL";

/// The joints of SMPL in its order, by the parts of the body that the joints of a skeleton are; or why there are not all of
/// them.
fn joints_of_smpl(roles: &Roles) -> Result<[usize; 22], String> {
    const ROLES: [Role; 22] = [
        Role::Hips,
        Role::LeftUpperLeg,
        Role::RightUpperLeg,
        Role::Spine,
        Role::LeftLowerLeg,
        Role::RightLowerLeg,
        Role::Chest,
        Role::LeftFoot,
        Role::RightFoot,
        Role::UpperChest,
        Role::LeftToes,
        Role::RightToes,
        Role::Neck,
        Role::LeftShoulder,
        Role::RightShoulder,
        Role::Head,
        Role::LeftUpperArm,
        Role::RightUpperArm,
        Role::LeftLowerArm,
        Role::RightLowerArm,
        Role::LeftHand,
        Role::RightHand,
    ];
    let joints = ROLES.map(|role| roles.joint(role));
    let missing = ROLES.iter().filter(|&&role| roles.joint(role).is_none());
    let missing: Vec<&str> = missing.map(|role| role.name()).collect();
    match missing[..] {
        [] => Ok(joints.map(Option::unwrap_or_default)),
        _ => Err(format!(
            "the skeleton is that of {}, and {}; {REMEDY}",
            roles.kind,
            missing_text(&missing)
        )),
    }
}
