//! Kinematic trees: the bodies of a robot and the joints between them, and where the bodies are for the values of the
//! joints.
//!
//! * [`Tree`]: [`TreeBody`]s, each with the [`TreeJoint`]s that connect it with its parent.
//! * [`Configuration`]: a value for each joint; [`ConfigurationRates`]: how fast they change.
//! * [`Tree::frames`]: constants in f32, with which libraries of motions compute the bodies, on the CPU or on a device.
//! * [`Tree::poses`] and [`Tree::motions`] compute the bodies in f64, with the same bits on every processor;
//!   [`Tree::walk`] those of many configurations.
//!
//! The formulas are those of `MuJoCo`'s kinematics (`mj_kinematics`): a body's joints act in their order, each about
//! its anchor.

mod configuration;
pub(crate) mod frames;
mod joint_frames;
mod kinematics;
mod order;
mod walk;

use glam::{DQuat, DVec3};

pub use configuration::{BodyMotion, BodyPose, BodyVelocity, Configuration, ConfigurationRates};
pub use frames::{FrameWords, JointTracks, TreeFrames};
pub use kinematics::{BodyArrays, BodyRows, TreeWalk, WalkMemory};
pub use order::{BodyOrder, Siblings};

use crate::names::names;
use configuration::check_counts;

/// The bodies of a robot, each after its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    bodies: Vec<TreeBody>,
    /// Where the value of each joint is found, body by body.
    values: Vec<JointValue>,
    counts: JointCounts,
    /// All bodies, in order.
    walk: TreeWalk,
}

/// A rigid part of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeBody {
    /// Its name.
    pub name: String,
    /// The index of its parent; `None` in the world.
    pub parent: Option<usize>,
    /// The position, in metres in the parent's frame, while the joints are at their references.
    pub position: DVec3,
    /// The rotation in the parent's frame while the joints are at their references: a unit quaternion.
    pub rotation: DQuat,
    /// The joints between the body and its parent, in the order in which they act. A body without joints is fixed.
    pub joints: Vec<TreeJoint>,
    /// The centre of mass, in metres in the body's frame, if the file has it.
    pub mass_centre: Option<DVec3>,
}

/// A joint between a body and its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeJoint {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// The unit axis of a hinge or a slide, in the body's frame.
    pub axis: DVec3,
    /// The point about which a hinge or a ball turns, in metres in the body's frame.
    pub anchor: DVec3,
    /// The value of a hinge (rad) or a slide (metres) at which it does not move the body.
    pub reference: f64,
    /// The smallest and the largest value: of a hinge in rad, of a slide in metres, of a ball the angle in rad.
    pub limits: Option<[f64; 2]>,
    /// The joint whose value determines that of this hinge or slide.
    pub mimic: Option<Mimic>,
}

impl TreeJoint {
    /// A joint about the body's z axis and origin, with the reference 0 and no limits.
    #[must_use]
    pub fn new(name: impl Into<String>, kind: JointKind) -> Self {
        Self {
            name: name.into(),
            kind,
            axis: DVec3::Z,
            anchor: DVec3::ZERO,
            reference: 0.0,
            limits: None,
            mimic: None,
        }
    }
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum JointKind {
    /// It turns about an axis.
    Hinge,
    /// It shifts along an axis.
    Slide,
    /// It turns about a point.
    Ball,
    /// It moves freely.
    Free,
}

names! {
    JointKind, "kind of joint",
    Hinge => "hinge",
    Slide => "slide",
    Ball => "ball",
    Free => "free",
}

/// A joint's value is `multiplier * value of another joint + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Mimic {
    /// The name of the other joint, a hinge or a slide.
    pub joint: String,
    /// The factor.
    pub multiplier: f64,
    /// The joint's value when the value of the other joint is 0.
    pub offset: f64,
}

/// Where the value of a joint is in a [`Configuration`].
#[derive(Debug, Clone, Copy, PartialEq)]
enum JointValue {
    /// `multiplier * scalars[index] + offset`.
    Scalar {
        index: usize,
        multiplier: f64,
        offset: f64,
    },
    Ball(usize),
    Free(usize),
}

/// How many values of each kind a configuration has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct JointCounts {
    /// Hinges and slides that mimic no other joint.
    pub scalars: usize,
    /// Balls.
    pub balls: usize,
    /// Free joints.
    pub free: usize,
}

/// Why bodies are not a tree, or values are none of a tree.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TreeError {
    /// A body's parent does not come before it.
    #[error("body {body} (`{name}`) has the parent {parent}; parents come before their children")]
    Parent {
        /// The body's index.
        body: usize,
        /// Its name.
        name: String,
        /// The index of the parent.
        parent: usize,
    },
    /// Two bodies or two joints have the same name.
    #[error("two {kind} have the name `{name}`; rename one of them")]
    RepeatedName {
        /// `bodies` or `joints`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A constant is not finite, or a rotation or an axis does not have the length 1.
    #[error("the {quantity} of `{name}` is {value}")]
    Constant {
        /// The quantity, and the condition that it must meet.
        quantity: &'static str,
        /// The body or the joint.
        name: String,
        /// The value.
        value: String,
    },
    /// A free joint is not the only joint of its body.
    #[error(
        "the free joint `{name}` has other joints beside it; a free joint is alone in its body"
    )]
    FreeNotAlone {
        /// The joint.
        name: String,
    },
    /// A joint mimics a joint that does not exist or has no scalar value, or itself.
    #[error("joint `{name}` mimics `{joint}`, which {reason}")]
    Mimic {
        /// The joint.
        name: String,
        /// The joint that it mimics.
        joint: String,
        /// Why it cannot.
        reason: &'static str,
    },
    /// A body does not exist.
    #[error("there is no body {body}; there are {count}, from 0")]
    MissingBody {
        /// The index.
        body: usize,
        /// How many bodies the tree has.
        count: usize,
    },
    /// A configuration has not one value for each joint.
    #[error("{found} {kind} were given, and the tree has {expected}; give one for each")]
    Count {
        /// Which values.
        kind: &'static str,
        /// How many there are.
        found: usize,
        /// How many the tree has.
        expected: usize,
    },
    /// A value is not finite or is beyond 1e8, or a quaternion is 0.
    #[error(
        "{kind} {index} is {value}; values are finite and at most 1e8, and quaternions are not 0"
    )]
    Value {
        /// Which values.
        kind: &'static str,
        /// Its index.
        index: usize,
        /// The value.
        value: String,
    },
}

impl Tree {
    /// Makes a tree of bodies, parents before their children.
    ///
    /// # Errors
    /// * When a parent does not come before its child, or a name is repeated.
    /// * When a constant is not finite, or a rotation or an axis does not have the length 1.
    /// * When a body has another joint beside a free one.
    /// * When a joint mimics a joint that does not exist, is neither a hinge nor a slide, or mimics the first joint in
    ///   a circle.
    pub fn new(bodies: Vec<TreeBody>) -> Result<Self, TreeError> {
        check_parents(&bodies)?;
        check_names("bodies", bodies.iter().map(|body| &body.name))?;
        let joints = || bodies.iter().flat_map(|body| &body.joints);
        check_names("joints", joints().map(|joint| &joint.name))?;
        for body in &bodies {
            check_body(body)?;
        }
        let (values, counts) = joint_values(&joints().collect::<Vec<_>>())?;
        let order: Vec<usize> = (0..bodies.len()).collect();
        let mut tree = Self {
            bodies,
            values,
            counts,
            walk: TreeWalk::default(),
        };
        tree.walk = tree.walk(&order, &[])?;
        Ok(tree)
    }

    /// The bodies, parents before their children.
    #[must_use]
    pub fn bodies(&self) -> &[TreeBody] {
        &self.bodies
    }

    /// All joints, body by body.
    pub fn joints(&self) -> impl Iterator<Item = &TreeJoint> {
        self.bodies.iter().flat_map(|body| &body.joints)
    }

    /// The hinges and slides that mimic no other joint: those with a value in [`Configuration::scalars`], in its order.
    pub fn scalar_joints(&self) -> impl Iterator<Item = &TreeJoint> {
        self.joints().filter(|joint| {
            matches!(joint.kind, JointKind::Hinge | JointKind::Slide) && joint.mimic.is_none()
        })
    }

    /// All hinges and slides, each with the index in [`Configuration::scalars`] of the value that moves it, and the factor
    /// and the offset with which it does: 1 and 0 but for joints that mimic others.
    pub fn scalar_values(&self) -> impl Iterator<Item = (&TreeJoint, usize, [f64; 2])> {
        let pairs = self.joints().zip(&self.values);
        pairs.filter_map(|(joint, value)| match *value {
            JointValue::Scalar {
                index,
                multiplier,
                offset,
            } => Some((joint, index, [multiplier, offset])),
            JointValue::Ball(_) | JointValue::Free(_) => None,
        })
    }

    /// How many values a configuration has.
    #[must_use]
    pub fn counts(&self) -> JointCounts {
        self.counts
    }

    /// Refuses bodies that do not exist, and points that are neither none nor one for each body of the tree.
    fn check_bodies(&self, bodies: &[usize], points: &[DVec3]) -> Result<(), TreeError> {
        let count = self.bodies.len();
        if !points.is_empty() {
            check_counts([("points", points.len(), count)])?;
        }
        match bodies.iter().find(|&&body| body >= count) {
            None => Ok(()),
            Some(&body) => Err(TreeError::MissingBody { body, count }),
        }
    }
}

fn check_parents(bodies: &[TreeBody]) -> Result<(), TreeError> {
    let mut pairs = bodies.iter().enumerate();
    let late = pairs.find_map(|(body, TreeBody { name, parent, .. })| {
        let parent = parent.filter(|&parent| parent >= body)?;
        Some((body, name.clone(), parent))
    });
    match late {
        None => Ok(()),
        Some((body, name, parent)) => Err(TreeError::Parent { body, name, parent }),
    }
}

fn check_names<'a>(
    kind: &'static str,
    names: impl Iterator<Item = &'a String>,
) -> Result<(), TreeError> {
    let mut names: Vec<&String> = names.collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(()),
        Some(pair) => Err(TreeError::RepeatedName {
            kind,
            name: pair[0].clone(),
        }),
    }
}

/// How far the length of an axis or of a quaternion may be from 1.
const LENGTH_TOLERANCE: f64 = 1e-9;

fn check_body(body: &TreeBody) -> Result<(), TreeError> {
    let constant = |is_right: bool, quantity, name: &str, value: &dyn std::fmt::Debug| {
        if is_right {
            return Ok(());
        }
        let (name, value) = (name.to_owned(), format!("{value:?}"));
        Err(TreeError::Constant {
            quantity,
            name,
            value,
        })
    };
    let is_unit = |length: f64| (length - 1.0).abs() <= LENGTH_TOLERANCE;
    let (position, rotation) = (body.position, body.rotation);
    constant(
        position.is_finite(),
        "position, which is finite,",
        &body.name,
        &position,
    )?;
    constant(
        is_unit(rotation.length()),
        "rotation, a unit quaternion,",
        &body.name,
        &rotation,
    )?;
    if let Some(centre) = body.mass_centre {
        constant(
            centre.is_finite(),
            "centre of mass, which is finite,",
            &body.name,
            &centre,
        )?;
    }
    for joint in &body.joints {
        let name = &joint.name;
        let has_axis = matches!(joint.kind, JointKind::Hinge | JointKind::Slide);
        let (axis, anchor) = (joint.axis, joint.anchor);
        constant(
            !has_axis || is_unit(axis.length()),
            "axis, a unit vector,",
            name,
            &axis,
        )?;
        constant(
            anchor.is_finite(),
            "anchor, which is finite,",
            name,
            &anchor,
        )?;
        let reference = joint.reference;
        constant(
            reference.is_finite(),
            "reference, which is finite,",
            name,
            &reference,
        )?;
        if joint.kind == JointKind::Free && body.joints.len() > 1 {
            let name = name.clone();
            return Err(TreeError::FreeNotAlone { name });
        }
    }
    Ok(())
}

/// Where the value of each joint is found; joints that mimic others are followed to the one that has a value.
fn joint_values(joints: &[&TreeJoint]) -> Result<(Vec<JointValue>, JointCounts), TreeError> {
    let mut counts = JointCounts::default();
    let next = |count: &mut usize| std::mem::replace(count, *count + 1);
    let mut values: Vec<Option<JointValue>> = Vec::with_capacity(joints.len());
    for joint in joints {
        values.push(match joint.kind {
            JointKind::Ball => Some(JointValue::Ball(next(&mut counts.balls))),
            JointKind::Free => Some(JointValue::Free(next(&mut counts.free))),
            JointKind::Hinge | JointKind::Slide => joint.mimic.is_none().then(|| {
                let index = next(&mut counts.scalars);
                JointValue::Scalar {
                    index,
                    multiplier: 1.0,
                    offset: 0.0,
                }
            }),
        });
    }
    let by_name: std::collections::HashMap<&str, usize> = (joints.iter().enumerate())
        .map(|(i, joint)| (&*joint.name, i))
        .collect();
    for start in 0..joints.len() {
        // A stack of joints whose value depends on the next one.
        let (mut waiting, mut i) = (Vec::new(), start);
        while let (None, Some(mimic)) = (values[i], &joints[i].mimic) {
            let refuse = |reason| {
                Err(TreeError::Mimic {
                    name: joints[i].name.clone(),
                    joint: mimic.joint.clone(),
                    reason,
                })
            };
            waiting.push((i, mimic));
            let Some(&source) = by_name.get(&*mimic.joint) else {
                return refuse("does not exist");
            };
            if !matches!(joints[source].kind, JointKind::Hinge | JointKind::Slide) {
                return refuse("is neither a hinge nor a slide");
            }
            if waiting.len() > joints.len() {
                return refuse("mimics it in a circle");
            }
            i = source;
        }
        let mut value = values[i];
        for (i, mimic) in waiting.into_iter().rev() {
            if let Some(JointValue::Scalar {
                multiplier, offset, ..
            }) = &mut value
            {
                *multiplier *= mimic.multiplier;
                *offset = mimic.multiplier * *offset + mimic.offset;
            }
            values[i] = value;
        }
    }
    Ok((values.into_iter().flatten().collect(), counts))
}

#[cfg(test)]
mod tests;
