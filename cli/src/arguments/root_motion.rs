//! The options for the motion of a root over the ground.

use clap::Args;
use clap::builder::TypedValueParser;
use glam::DVec3;
use tumble_formats::learning::{Ground, HeadingSource};
use tumble_formats::motion::Motion;
use tumble_formats::root_motion::{RootMotionOptions, RootMotionRule, root_joint};

use crate::arguments::options::CommandLine;
use crate::arguments::output::one_of;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// The axis that points up in a motion.
#[derive(Debug, Clone, Args)]
pub(crate) struct VerticalArguments {
    /// The axis that points up, for headings, contacts and root motion [default: z for robots, otherwise y]
    #[arg(long, value_name = "AXIS", value_parser = vertical())]
    vertical: Option<Ground>,
}

impl VerticalArguments {
    /// Whether the command line names the axis.
    pub(crate) fn is_set(&self) -> bool {
        self.vertical.is_some()
    }

    /// The axis that points up in a clip. `is_robot`: the clip is of a robot that the command line names.
    pub(crate) fn ground(&self, clip: &Motion, is_robot: bool) -> Ground {
        let up_of_body = clip.body.as_ref().and_then(|body| body.up);
        let is_z_up = is_robot || clip.robot.is_some() || up_of_body == Some(DVec3::Z);
        self.vertical.unwrap_or(match is_z_up {
            true => Ground::Z,
            false => Ground::Y,
        })
    }
}

/// How a root moves in results.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Root motion")]
pub(crate) struct RootMotionArguments {
    /// What to do with the motion of the root over the ground (its translation there, and its heading)
    #[arg(long, value_name = "RULE", default_value_t, value_parser = rule())]
    root_motion: RootMotionRule,
    /// How the heading of the root is defined
    #[arg(long, value_name = "HEADING", requires = "root_motion", default_value_t, value_parser = heading())]
    heading: HeadingSource,
    /// The name of the root joint [default: the topmost joint that moves]
    #[arg(long, value_name = "NAME", requires = "root_motion")]
    root_joint: Option<String>,
    #[command(flatten)]
    vertical: VerticalArguments,
}

fn vertical() -> impl TypedValueParser<Value = Ground> {
    let help = |axis| match axis {
        Ground::Y => "as in glTF, BVH and HumanML3D",
        Ground::Z => "as robots have it",
    };
    one_of(Ground::ALL.map(|axis| (axis.name(), help(axis), axis)))
}

fn rule() -> impl TypedValueParser<Value = RootMotionRule> {
    let help = |rule| match rule {
        RootMotionRule::Keep => "unchanged: the root keeps its motion",
        RootMotionRule::InPlace => {
            "removed: the root stays above the origin and faces one direction"
        }
        RootMotionRule::Extract => {
            "moved to a new joint, root_motion, which is the parent of the root"
        }
    };
    one_of(RootMotionRule::ALL.map(|rule| (rule.name(), help(rule), rule)))
}

fn heading() -> impl TypedValueParser<Value = HeadingSource> {
    let help = |source| match source {
        HeadingSource::Twist => "the twist of the root about the axis that points up",
        HeadingSource::X => "the direction of the root's x axis on the ground",
        HeadingSource::Y => "the direction of the root's y axis on the ground",
        HeadingSource::Z => "the direction of the root's z axis on the ground",
    };
    one_of(HeadingSource::ALL.map(|source| (source.name(), help(source), source)))
}

impl RootMotionArguments {
    pub(crate) fn rule(&self) -> RootMotionRule {
        self.root_motion
    }

    /// The options for a clip. `is_robot`: the clip is of a robot that the command line names.
    pub(crate) fn options(&self, clip: &Motion, is_robot: bool) -> RootMotionOptions {
        RootMotionOptions {
            ground: self.vertical.ground(clip, is_robot),
            heading: self.heading,
            joint: self.root_joint.clone(),
        }
    }

    /// Says which axis is taken to point up for a body whose file does not state it.
    pub(crate) fn say_assumption(&self, name: &str, clip: &Motion) {
        let is_unknown = clip.body.as_ref().is_some_and(|body| body.up.is_none());
        if is_unknown && !self.vertical.is_set() {
            words::warning(&format!(
                "{name}: files of SMPL bodies do not state what points up, so y is taken; most have z up (--up-axis y \
                 converts them, --vertical z takes z)"
            ));
        }
    }

    /// Refuses the other options of root motion if the root keeps its motion.
    pub(crate) fn check(&self, line: &CommandLine) -> Result<(), Failure> {
        if self.root_motion != RootMotionRule::Keep {
            return Ok(());
        }
        let all = [
            ("vertical", "--vertical"),
            ("heading", "--heading"),
            ("root_joint", "--root-joint"),
        ];
        let remedy = "add --root-motion in-place or extract, or leave it out";
        line.refuse(&all, "roots that keep their motion", remedy)
    }

    /// Refuses to write a file again if its root would need new channels.
    pub(crate) fn check_kept(&self, name: &str, clip: &Motion) -> Result<(), Failure> {
        let root = root_joint(clip, &self.options(clip, false));
        let root = root.map_err(|error| self.failure(name, &error))?;
        if clip.root_has_keys(root) {
            return Ok(());
        }
        let joint = clip.set.track_name(root);
        Err(Failure::usage(format!(
            "{name}: `{joint}` cannot move in a copy of the file, because a copy gets no new channels: the joint has no \
             rotation keys or no translation keys, or its keys are steps, or it is far from 0; write another format"
        )))
    }

    /// The failure of the input with this name.
    pub(crate) fn failure(&self, name: &str, error: &dyn std::fmt::Display) -> Failure {
        Failure::new(
            ALL_INPUTS,
            format!("{name}: --root-motion {}: {error}", self.root_motion),
        )
    }
}
