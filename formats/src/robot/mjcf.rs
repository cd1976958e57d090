//! MJCF, `MuJoCo`'s XML. The rules are those of its documentation (`XMLreference`, `modeling`). Elements that do not
//! move frames are not read.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DMat3, DQuat, DVec3};
use tumble::trees::{BodyPose, Configuration, JointKind, Tree, TreeBody, TreeJoint};

use crate::diagnostic::{Code, Diagnostic};
use crate::robot::xml::{Documents, Element, about};
use crate::robot::{MAX_BODIES, MAX_DEPTH, Robot, RobotFormat};

/// Elements of a body that would make more bodies.
const NOT_READ: [&str; 4] = ["replicate", "attach", "composite", "flexcomp"];

/// Elements that give an orientation; an element has at most one.
const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// The attributes of joints that are read and that classes can give.
const OF_JOINTS: [&str; 6] = ["type", "axis", "pos", "range", "limited", "ref"];

/// The attributes of a joint, over those of its classes.
type Attributes<'a> = HashMap<&'a str, (Element, &'a str)>;

struct Reader<'a> {
    documents: &'a Documents<'a>,
    /// Radians in the file's unit of angles.
    unit: f64,
    euler_sequence: Vec<EulerAxis>,
    /// Whether a joint with a range is limited unless it says otherwise.
    has_automatic_limits: bool,
    /// The attributes of joints of each class.
    classes: HashMap<&'a str, Attributes<'a>>,
    bodies: Vec<TreeBody>,
    masses: Vec<Option<f64>>,
    joint_count: usize,
}

/// One rotation of a sequence of Euler angles.
struct EulerAxis {
    axis: DVec3,
    /// Whether the rotation is about the axis as rotated by the rotations before it, instead of about the fixed axis.
    is_intrinsic: bool,
}

/// An element whose children are read: the world, a body or a frame.
struct Level<'a> {
    children: std::vec::IntoIter<Element>,
    body: Option<usize>,
    class: Option<&'a str>,
    /// The transform of the frames around, relative to the body.
    frame: BodyPose,
}

pub(super) fn read(documents: &Documents<'_>) -> Result<Robot, Diagnostic> {
    let root = documents.root();
    let mut reader = Reader::new(documents)?;
    let (mut couplings, mut warnings) = (0, Vec::new());
    for element in documents.children(root) {
        match documents.tag(element) {
            "worldbody" => reader.world(element)?,
            "equality" => couplings += documents.tagged(element, "joint").count(),
            "compiler" if documents.attribute(element, "fusestatic") == Some("true") => {
                let message = "`fusestatic` makes MuJoCo merge the bodies without joints into their parents; here they stay (`--fixed-bodies merge` merges them)";
                warnings.push(documents.refuse(element, Code::RobotMerged, message));
            }
            _ => {}
        }
    }
    let refuse = |message: String| documents.refuse(root, Code::RobotTree, message);
    if reader.bodies.is_empty() {
        return Err(refuse("has no <body>".to_owned()));
    }
    let tree = Tree::new(reader.bodies).map_err(|error| refuse(error.to_string()))?;
    let poses = poses(documents, &tree)?;
    Ok(Robot {
        name: documents
            .attribute(root, "model")
            .unwrap_or_default()
            .to_owned(),
        format: RobotFormat::Mjcf,
        tree,
        masses: reader.masses,
        merged: Vec::new(),
        poses,
        couplings,
        warnings,
    })
}

impl<'a> Reader<'a> {
    fn new(documents: &'a Documents<'a>) -> Result<Self, Diagnostic> {
        let root = documents.root();
        // If there are several elements, later attributes replace earlier ones.
        let mut options: Attributes<'a> = HashMap::new();
        for compiler in documents.tagged(root, "compiler") {
            options.extend(
                documents
                    .attributes(compiler)
                    .map(|(name, value)| (name, (compiler, value))),
            );
        }
        let option = |name: &str, choices: &[&str]| match options.get(name) {
            None => Ok(0),
            Some(&(element, value)) => {
                let choice = choices.iter().position(|&choice| choice == value);
                choice.ok_or_else(|| {
                    let message =
                        format!("`{name}` is `{value}`; {} are read", choices.join(" and "));
                    documents.refuse(element, Code::RobotElement, message)
                })
            }
        };
        option("coordinate", &["local"])?;
        let unit = [PI / 180.0, 1.0][option("angle", &["degree", "radian"])?];
        let has_automatic_limits = option("autolimits", &["true", "false"])? == 0;
        let euler_sequence = match options.get("eulerseq") {
            None => euler_sequence("xyz").unwrap_or_default(),
            Some(&(element, value)) => euler_sequence(value).ok_or_else(|| {
                let message =
                    format!("`eulerseq` is `{value}`; it must have three of the letters xyzXYZ");
                documents.refuse(element, Code::RobotElement, message)
            })?,
        };
        Ok(Self {
            classes: classes(documents),
            documents,
            unit,
            euler_sequence,
            has_automatic_limits,
            bodies: Vec::new(),
            masses: Vec::new(),
            joint_count: 0,
        })
    }

    /// Reads the bodies of a `worldbody`.
    fn world(&mut self, world: Element) -> Result<(), Diagnostic> {
        let documents = self.documents;
        let mut levels = vec![Level {
            children: documents.children(world).into_iter(),
            body: None,
            class: documents.attribute(world, "childclass"),
            frame: BodyPose::IDENTITY,
        }];
        while let Some(level) = levels.last_mut() {
            let Some(element) = level.children.next() else {
                levels.pop();
                continue;
            };
            let (body, class, frame) = (level.body, level.class, level.frame);
            let tag = documents.tag(element);
            let inner = match tag {
                "joint" | "freejoint" => {
                    let joint = self.joint(element, body, class, frame)?;
                    if let Some(body) = body {
                        self.bodies[body].joints.push(joint);
                    }
                    continue;
                }
                "frame" => (body, self.placed(element, frame)?),
                "body" => (Some(self.body(element, body, frame)?), BodyPose::IDENTITY),
                _ if NOT_READ.contains(&tag) => {
                    let message = format!(
                        "<{tag}> is not read; save the compiled model by MuJoCo (mj_saveLastXML)"
                    );
                    return Err(documents.refuse(element, Code::RobotElement, message));
                }
                _ => continue,
            };
            if levels.len() >= MAX_DEPTH {
                let message = format!("bodies are nested more than {MAX_DEPTH} deep");
                return Err(documents.refuse(element, Code::RobotTree, message));
            }
            levels.push(Level {
                children: documents.children(element).into_iter(),
                body: inner.0,
                class: documents.attribute(element, "childclass").or(class),
                frame: inner.1,
            });
        }
        Ok(())
    }

    /// Adds a body without its joints; returns its index.
    fn body(
        &mut self,
        element: Element,
        parent: Option<usize>,
        frame: BodyPose,
    ) -> Result<usize, Diagnostic> {
        let documents = self.documents;
        let refuse = |code, message: String| Err(documents.refuse(element, code, message));
        let index = self.bodies.len();
        if index >= MAX_BODIES {
            return refuse(
                Code::RobotTree,
                format!("has more than {MAX_BODIES} bodies"),
            );
        }
        if documents.attribute(element, "mocap") == Some("true") {
            return refuse(
                Code::RobotElement,
                "a body with `mocap` has no joint that moves it; give it a <freejoint>".to_owned(),
            );
        }
        let BodyPose { position, rotation } = self.placed(element, frame)?;
        let inertial = documents.tagged(element, "inertial").next();
        let mass_centre = inertial.map(|inertial| documents.vector(inertial, "pos"));
        let mass = inertial.and_then(|inertial| documents.list::<1>(inertial, "mass").ok()?);
        self.masses.push(mass.map(|[mass]| mass));
        self.bodies.push(TreeBody {
            name: match documents.attribute(element, "name") {
                Some(name) => name.to_owned(),
                None => format!("body{index}"),
            },
            parent,
            position,
            rotation,
            joints: Vec::new(),
            mass_centre: mass_centre.transpose()?,
        });
        Ok(index)
    }

    /// The pose of an element in a frame, by its `pos` and its orientation.
    fn placed(&self, element: Element, frame: BodyPose) -> Result<BodyPose, Diagnostic> {
        let position = self.documents.vector(element, "pos")?;
        Ok(BodyPose {
            position: frame.position + frame.rotation * position,
            rotation: frame.rotation * self.orientation(element)?,
        })
    }

    fn orientation(&self, element: Element) -> Result<DQuat, Diagnostic> {
        let documents = self.documents;
        let mut names = ORIENTATIONS
            .into_iter()
            .filter(|name| documents.attribute(element, name).is_some());
        let Some(name) = names.next() else {
            return Ok(DQuat::IDENTITY);
        };
        if let Some(other) = names.next() {
            let message =
                format!("has both `{name}` and `{other}`; only one may state the orientation");
            return Err(documents.refuse(element, Code::RobotTree, message));
        }
        let unit = |vector| documents.unit(element, name, vector);
        let axis_angle = || documents.list::<4>(element, "axisangle");
        if let Some([w, x, y, z]) = documents.list::<4>(element, "quat")? {
            let q = DQuat::from_xyzw(x, y, z, w);
            let length = q.length();
            if length > 1e-14 && length.is_finite() {
                return Ok(q / length);
            }
            let message = "`quat` has the length 0, so that it is no rotation";
            return Err(documents.refuse(element, Code::RobotTree, message));
        }
        if name == "axisangle"
            && let Some([x, y, z, angle]) = axis_angle()?
        {
            return Ok(about(unit(DVec3::new(x, y, z))?, angle * self.unit));
        }
        if let Some(angles) = documents.list::<3>(element, "euler")? {
            let mut q = DQuat::IDENTITY;
            for (euler, angle) in self.euler_sequence.iter().zip(angles) {
                let r = about(euler.axis, angle * self.unit);
                q = if euler.is_intrinsic { q * r } else { r * q };
            }
            return Ok(q);
        }
        if let Some([a, b, c, d, e, f]) = documents.list::<6>(element, "xyaxes")? {
            let x = unit(DVec3::new(a, b, c))?;
            let y = DVec3::new(d, e, f);
            let y = unit(y - x * x.dot(y))?;
            return Ok(DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize());
        }
        let z = unit(documents.vector(element, "zaxis")?)?;
        let across = DVec3::Z.cross(z);
        let sine = across.length();
        let axis = if sine > 1e-10 {
            across / sine
        } else {
            DVec3::X
        };
        Ok(about(axis, libm::atan2(sine, z.z)))
    }

    /// Reads a joint of a body, in frames within it.
    fn joint(
        &mut self,
        element: Element,
        body: Option<usize>,
        class: Option<&'a str>,
        frame: BodyPose,
    ) -> Result<TreeJoint, Diagnostic> {
        let documents = self.documents;
        let Some(body) = body.map(|body| &self.bodies[body]) else {
            let message = "a joint must be in a body, but this one is in the world";
            return Err(documents.refuse(element, Code::RobotTree, message));
        };
        let index = self.joint_count;
        self.joint_count += 1;
        let attributes = self.attributes(element, class)?;
        let text = |name: &str| attributes.get(name).copied();
        let vector = |name: &str, default: DVec3| match text(name) {
            None => Ok(default),
            Some((at, value)) => {
                let numbers = documents.numbers(at, (name, value), 3..4)?;
                Ok(DVec3::from_slice(&numbers))
            }
        };
        let kind = match text("type") {
            _ if documents.tag(element) == "freejoint" => JointKind::Free,
            None => JointKind::Hinge,
            Some((at, value)) => value.parse().map_err(|_| {
                let message = format!(
                    "`{value}` is not a type of joint; there are free, ball, slide and hinge"
                );
                documents.refuse(at, Code::RobotTree, message)
            })?,
        };
        if kind == JointKind::Free && body.parent.is_some() {
            let message = format!(
                "body `{}` has a free joint and is in another body; a free joint is for a body in the world",
                body.name
            );
            return Err(documents.refuse(element, Code::RobotTree, message));
        }
        let name = match (documents.attribute(element, "name"), kind) {
            (Some(name), _) => name.to_owned(),
            (None, JointKind::Free) => body.name.clone(),
            (None, _) => format!("joint{index}"),
        };
        // A free joint has no defaults and no constants.
        if kind == JointKind::Free {
            return Ok(TreeJoint::new(name, kind));
        }
        let scale = if kind == JointKind::Slide {
            1.0
        } else {
            self.unit
        };
        let number = |name: &str| match text(name) {
            Some((at, value)) => Ok(documents.numbers(at, (name, value), 1..2)?[0]),
            None => Ok(0.0),
        };
        let reference = match kind {
            JointKind::Ball => 0.0,
            _ => number("ref")? * scale,
        };
        let range = match text("range") {
            None => None,
            Some((at, value)) => {
                let numbers = documents.numbers(at, ("range", value), 2..3)?;
                Some([numbers[0] * scale, numbers[1] * scale])
            }
        };
        let is_limited = match text("limited").map(|(_, value)| value) {
            Some("true") => true,
            Some("false") => false,
            _ => self.has_automatic_limits,
        };
        let axis = vector("axis", DVec3::Z)?;
        let axis = match kind {
            JointKind::Ball => DVec3::Z,
            _ => frame.rotation * documents.unit(element, "axis", axis)?,
        };
        Ok(TreeJoint {
            name,
            kind,
            axis,
            anchor: frame.position + frame.rotation * vector("pos", DVec3::ZERO)?,
            reference,
            limits: match range.filter(|_| is_limited) {
                Some(range) => Some(documents.limits(element, range)?),
                None => None,
            },
            mimic: None,
        })
    }

    /// The attributes of a joint: those that it has over those of its class.
    fn attributes(
        &self,
        element: Element,
        class: Option<&'a str>,
    ) -> Result<Attributes<'a>, Diagnostic> {
        let documents = self.documents;
        let named = documents.attribute(element, "class").or(class);
        let mut attributes = match named.map(|name| (name, self.classes.get(name))) {
            None => self.classes.get("main").cloned().unwrap_or_default(),
            Some((_, Some(class))) => class.clone(),
            Some((name, None)) => {
                let message = format!("the class `{name}` has no <default>");
                return Err(documents.refuse(element, Code::RobotTree, message));
            }
        };
        attributes.extend(joint_attributes(documents, element));
        Ok(attributes)
    }
}

fn euler_sequence(text: &str) -> Option<Vec<EulerAxis>> {
    let axis = |letter: char| {
        let axis = match letter.to_ascii_lowercase() {
            'x' => DVec3::X,
            'y' => DVec3::Y,
            'z' => DVec3::Z,
            _ => return None,
        };
        let is_intrinsic = letter.is_ascii_lowercase();
        Some(EulerAxis { axis, is_intrinsic })
    };
    let axes: Option<Vec<_>> = text.chars().map(axis).collect();
    axes.filter(|axes| axes.len() == 3)
}

/// The attributes of joints of each class; nested classes have those of the classes around.
fn classes<'a>(documents: &'a Documents<'a>) -> HashMap<&'a str, Attributes<'a>> {
    let mut classes = HashMap::from([("main", Attributes::new())]);
    let mut waiting: Vec<(Element, &str)> = Vec::new();
    let tops: Vec<_> = documents.tagged(documents.root(), "default").collect();
    waiting.extend(tops.into_iter().rev().map(|top| (top, "main")));
    while let Some((element, outer)) = waiting.pop() {
        let name = documents.attribute(element, "class").unwrap_or("main");
        let mut attributes = classes.get(outer).cloned().unwrap_or_default();
        for joint in documents.tagged(element, "joint") {
            attributes.extend(joint_attributes(documents, joint));
        }
        classes.insert(name, attributes);
        let nested: Vec<_> = documents.tagged(element, "default").collect();
        waiting.extend(nested.into_iter().rev().map(|nested| (nested, name)));
    }
    classes
}

fn joint_attributes<'a>(
    documents: &'a Documents<'a>,
    joint: Element,
) -> impl Iterator<Item = (&'a str, (Element, &'a str))> {
    OF_JOINTS.into_iter().filter_map(move |name| {
        let value = documents.attribute(joint, name)?;
        Some((name, (joint, value)))
    })
}

/// The configurations of `keyframe/key`.
fn poses(
    documents: &Documents<'_>,
    tree: &Tree,
) -> Result<Vec<(String, Configuration)>, Diagnostic> {
    let mut poses = Vec::new();
    let counts = tree.counts();
    let length = counts.scalars + 4 * counts.balls + 7 * counts.free;
    for keyframe in documents.tagged(documents.root(), "keyframe") {
        for key in documents.tagged(keyframe, "key") {
            let name = match documents.attribute(key, "name") {
                Some(name) => name.to_owned(),
                None => format!("key{}", poses.len()),
            };
            let mut configuration = tree.rest();
            if let Some(text) = documents.attribute(key, "qpos") {
                let numbers = documents.numbers(key, ("qpos", text), length..length + 1)?;
                fill(tree, &mut configuration, &numbers);
            }
            poses.push((name, configuration));
        }
    }
    Ok(poses)
}

/// Sets a configuration to the numbers of `MuJoCo`'s `qpos`, whose quaternions are w x y z.
fn fill(tree: &Tree, configuration: &mut Configuration, mut numbers: &[f64]) {
    let mut next = |count: usize| {
        let (first, rest) = numbers.split_at(count);
        numbers = rest;
        first
    };
    let quaternion = |q: &[f64]| DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
    let mut free = configuration.free.iter_mut();
    let mut balls = configuration.balls.iter_mut();
    let mut scalars = configuration.scalars.iter_mut();
    for joint in tree.joints() {
        match joint.kind {
            JointKind::Free => {
                let values = next(7);
                if let Some(pose) = free.next() {
                    pose.position = DVec3::from_slice(values);
                    pose.rotation = quaternion(&values[3..]);
                }
            }
            JointKind::Ball => {
                let values = next(4);
                if let Some(ball) = balls.next() {
                    *ball = quaternion(values);
                }
            }
            JointKind::Hinge | JointKind::Slide => {
                let values = next(1);
                if let Some(scalar) = scalars.next() {
                    *scalar = values[0];
                }
            }
        }
    }
}
