//! `tumble info` of a robot: its bodies in both orders, and its joints.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;
use tumble::trees::{BodyOrder, JointKind, Siblings, TreeJoint};
use tumble_formats::robot::Robot;

use crate::messages::exit::Failure;
use crate::messages::{names, words};

/// The report of a robot; also the form of the JSON.
#[derive(Serialize)]
pub(super) struct RobotSummary {
    input: String,
    /// `mjcf` or `urdf`.
    robot: &'static str,
    name: String,
    bodies: Vec<BodySummary>,
    /// The names of the hinges and slides that have a value each, in the order of arrays of joints.
    joint_names: Vec<String>,
    /// The names of the configurations in the file.
    poses: Vec<String>,
    warnings: Vec<String>,
}

/// A body; its place in the list is its number depth first.
#[derive(Serialize)]
struct BodySummary {
    name: String,
    /// The parent's number in this list; absent in the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    parent: Option<usize>,
    /// Its number breadth first.
    breadth_first: usize,
    joints: Vec<JointSummary>,
}

#[derive(Serialize)]
struct JointSummary {
    name: String,
    kind: &'static str,
    /// The axis in the body's frame, for hinges and slides.
    #[serde(skip_serializing_if = "Option::is_none")]
    axis: Option<[f64; 3]>,
    /// In radians; for slides in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    limits: Option<[f64; 2]>,
    /// The joint whose value determines that of this one, as `multiplier * value + offset`.
    #[serde(skip_serializing_if = "Option::is_none")]
    mimic: Option<MimicSummary>,
}

#[derive(Serialize)]
struct MimicSummary {
    joint: String,
    multiplier: f64,
    offset: f64,
}

impl RobotSummary {
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        let robot = Robot::open(path).map_err(|fault| Failure::input(&fault, ""))?;
        let tree = &robot.tree;
        let mut breadth_first = vec![0; tree.bodies().len()];
        let order = tree.order(BodyOrder::BreadthFirst, Siblings::File);
        for (number, body) in order.into_iter().enumerate() {
            breadth_first[body] = number;
        }
        let numbered = tree.bodies().iter().zip(breadth_first);
        let bodies = numbered.map(|(body, breadth_first)| BodySummary {
            name: body.name.clone(),
            parent: body.parent,
            breadth_first,
            joints: body.joints.iter().map(JointSummary::new).collect(),
        });
        let mut warnings: Vec<String> = robot.warnings.iter().map(ToString::to_string).collect();
        if robot.couplings > 0 {
            let relations = words::count(robot.couplings, "relation");
            warnings.push(format!(
                "{relations} between joints (<equality>) not applied, as MuJoCo's kinematics do not apply them"
            ));
        }
        Ok(Self {
            input: names::input(path),
            robot: robot.format.name(),
            name: robot.name,
            bodies: bodies.collect(),
            joint_names: tree
                .scalar_joints()
                .map(|joint| joint.name.clone())
                .collect(),
            poses: robot.poses.into_iter().map(|(name, _)| name).collect(),
            warnings,
        })
    }

    pub(super) fn text(&self) -> String {
        let mut text = format!("{}\n", self.input);
        let mut line = |label: &str, value: String| {
            let _ = writeln!(text, "  {label:18} {value}");
        };
        let name = if self.name.is_empty() {
            String::new()
        } else {
            format!("{}, ", self.name)
        };
        line("robot", format!("{name}{}", self.robot));
        let joints: usize = self.bodies.iter().map(|body| body.joints.len()).sum();
        let values = words::count(self.joint_names.len(), "value");
        line(
            "joints",
            format!("{joints}; hinges and slides have {values} in all"),
        );
        if !self.poses.is_empty() {
            line("poses", self.poses.join(", "));
        }
        for warning in &self.warnings {
            line("warning", warning.clone());
        }
        line(
            "bodies",
            format!(
                "{}: number depth first, number breadth first, name, joints",
                self.bodies.len()
            ),
        );
        let width = self
            .bodies
            .iter()
            .map(|body| body.name.chars().count())
            .max()
            .unwrap_or(0);
        for (number, body) in self.bodies.iter().enumerate() {
            let joints: Vec<String> = body.joints.iter().map(JointSummary::text).collect();
            let joints = if joints.is_empty() {
                "fixed".to_owned()
            } else {
                joints.join(", ")
            };
            let (name, other) = (&body.name, body.breadth_first);
            let _ = writeln!(text, "  {number:5} {other:5}  {name:width$}  {joints}");
        }
        text
    }
}

impl JointSummary {
    fn new(joint: &TreeJoint) -> Self {
        let has_axis = matches!(joint.kind, JointKind::Hinge | JointKind::Slide);
        Self {
            name: joint.name.clone(),
            kind: joint.kind.name(),
            axis: has_axis.then(|| joint.axis.to_array()),
            limits: joint.limits,
            mimic: joint.mimic.as_ref().map(|mimic| MimicSummary {
                joint: mimic.joint.clone(),
                multiplier: mimic.multiplier,
                offset: mimic.offset,
            }),
        }
    }

    fn text(&self) -> String {
        let mut text = format!("{} {}", self.kind, self.name);
        if let Some([smallest, largest]) = self.limits {
            let unit = if self.kind == JointKind::Slide.name() {
                "m"
            } else {
                "rad"
            };
            let _ = write!(text, " {smallest:.4} to {largest:.4} {unit}");
        }
        if let Some(mimic) = &self.mimic {
            let MimicSummary {
                joint,
                multiplier,
                offset,
            } = mimic;
            let _ = write!(text, " = {multiplier} * {joint} + {offset}");
        }
        text
    }
}
