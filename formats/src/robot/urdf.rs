//! URDF, the Unified Robot Description Format of ROS. Links are bodies; the joint above a link is the body's.

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use tumble::trees::{JointKind, Mimic, Tree, TreeBody, TreeJoint};

use crate::diagnostic::{Code, Diagnostic};
use crate::robot::xml::{Documents, Element, about};
use crate::robot::{MAX_BODIES, Robot, RobotFormat};

struct Link<'a> {
    element: Element,
    name: &'a str,
    /// The joint above it.
    joint: Option<Element>,
    /// The joints below it, in the order of the file, each with the index of its child.
    below: Vec<(Element, usize)>,
}

pub(super) fn read(documents: &Documents<'_>) -> Result<Robot, Diagnostic> {
    let root = documents.root();
    for element in documents.children(root) {
        let is_macro = documents
            .namespace(element)
            .is_some_and(|namespace| namespace.contains("xacro"));
        if is_macro && documents.tag(element) != "property" {
            let message = format!(
                "<xacro:{}> is a macro that is not run; write the URDF by `xacro FILE > robot.urdf` first",
                documents.tag(element)
            );
            return Err(documents.refuse(element, Code::RobotElement, message));
        }
    }
    let links = links(documents)?;
    let mut roots = links
        .iter()
        .enumerate()
        .filter(|(_, link)| link.joint.is_none());
    let refuse = |message: String| documents.refuse(root, Code::RobotTree, message);
    let top = match (roots.next(), roots.next()) {
        (Some((top, _)), None) => top,
        (None, _) if links.is_empty() => return Err(refuse("has no <link>".to_owned())),
        (None, _) => {
            return Err(refuse(
                "every link has a parent: the joints form a circle".to_owned(),
            ));
        }
        (Some((_, first)), Some((_, second))) => {
            return Err(refuse(format!(
                "`{}` and `{}` have no parent; a URDF has one link that is the root",
                first.name, second.name
            )));
        }
    };
    let mut bodies = Vec::with_capacity(links.len());
    let mut masses = Vec::with_capacity(links.len());
    let mut waiting = vec![(top, None)];
    while let Some((link, parent)) = waiting.pop() {
        let body = body(documents, &links[link], parent)?;
        let index = bodies.len();
        bodies.push(body);
        masses.push(mass(documents, links[link].element));
        let below = links[link].below.iter().rev();
        waiting.extend(below.map(|&(_, child)| (child, Some(index))));
    }
    if bodies.len() < links.len() {
        return Err(refuse(
            "some joints form a circle, so that the root does not lead to all links".to_owned(),
        ));
    }
    let tree = Tree::new(bodies).map_err(|error| refuse(error.to_string()))?;
    Ok(Robot {
        name: documents
            .attribute(root, "name")
            .unwrap_or_default()
            .to_owned(),
        format: RobotFormat::Urdf,
        tree,
        masses,
        merged: Vec::new(),
        poses: Vec::new(),
        couplings: 0,
        warnings: Vec::new(),
    })
}

fn links<'a>(documents: &'a Documents<'_>) -> Result<Vec<Link<'a>>, Diagnostic> {
    let root = documents.root();
    let (mut links, mut by_name) = (Vec::new(), HashMap::new());
    for element in documents.tagged(root, "link") {
        let name = documents.required(element, "name")?;
        if by_name.insert(name, links.len()).is_some() {
            let message = format!("another link has the name `{name}`, too; rename one of them");
            return Err(documents.refuse(element, Code::RobotTree, message));
        }
        if links.len() >= MAX_BODIES {
            let message = format!("has more than {MAX_BODIES} links");
            return Err(documents.refuse(element, Code::RobotTree, message));
        }
        links.push(Link {
            element,
            name,
            joint: None,
            below: Vec::new(),
        });
    }
    for joint in documents.tagged(root, "joint") {
        let end = |tag: &str| {
            let Some(element) = documents.tagged(joint, tag).next() else {
                let message = format!("a joint without a <{tag}>");
                return Err(documents.refuse(joint, Code::RobotTree, message));
            };
            let name = documents.required(element, "link")?;
            by_name.get(name).copied().ok_or_else(|| {
                let message = format!("there is no link `{name}`");
                documents.refuse(element, Code::RobotTree, message)
            })
        };
        let (parent, child) = (end("parent")?, end("child")?);
        if links[child].joint.is_some() {
            let message = format!(
                "`{}` has two joints to parents; a link has one",
                links[child].name
            );
            return Err(documents.refuse(joint, Code::RobotTree, message));
        }
        links[child].joint = Some(joint);
        links[parent].below.push((joint, child));
    }
    Ok(links)
}

/// The mass of a link: 0 without `inertial`, as URDF defines it.
fn mass(documents: &Documents<'_>, link: Element) -> Option<f64> {
    let Some(inertial) = documents.tagged(link, "inertial").next() else {
        return Some(0.0);
    };
    let mass = documents.tagged(inertial, "mass").next()?;
    let [mass] = documents.list::<1>(mass, "value").ok()??;
    Some(mass)
}

fn body(
    documents: &Documents<'_>,
    link: &Link<'_>,
    parent: Option<usize>,
) -> Result<TreeBody, Diagnostic> {
    let child = |element, tag| documents.tagged(element, tag).next();
    let inertial = child(link.element, "inertial");
    let mass_centre = inertial.map(|inertial| match child(inertial, "origin") {
        Some(origin) => documents.vector(origin, "xyz"),
        None => Ok(DVec3::ZERO),
    });
    let mass_centre = mass_centre.transpose()?;
    let origin = link.joint.and_then(|joint| child(joint, "origin"));
    let (position, rotation) = match origin {
        None => (DVec3::ZERO, DQuat::IDENTITY),
        Some(origin) => {
            let [roll, pitch, yaw] = documents.vector(origin, "rpy")?.to_array();
            let rotation = about(DVec3::Z, yaw) * about(DVec3::Y, pitch) * about(DVec3::X, roll);
            (documents.vector(origin, "xyz")?, rotation)
        }
    };
    let joint = link
        .joint
        .map(|joint| self::joint(documents, joint))
        .transpose()?;
    // Without `inertial` a link has no mass. If it is fixed, simulators take its origin for its centre.
    let is_fixed = joint.as_ref().is_some_and(Option::is_none);
    let mass_centre = mass_centre.or(is_fixed.then_some(DVec3::ZERO));
    Ok(TreeBody {
        name: link.name.to_owned(),
        parent,
        position,
        rotation,
        joints: joint.flatten().into_iter().collect(),
        mass_centre,
    })
}

/// The joint of an element; none if it is fixed.
fn joint(documents: &Documents<'_>, element: Element) -> Result<Option<TreeJoint>, Diagnostic> {
    let kind = documents.required(element, "type")?;
    let name = documents.required(element, "name")?;
    let joint_kind = match kind {
        "fixed" => return Ok(None),
        "revolute" | "continuous" => JointKind::Hinge,
        "prismatic" => JointKind::Slide,
        "floating" => JointKind::Free,
        _ => {
            let message = format!(
                "the joint `{name}` is of the type `{kind}`; revolute, continuous, prismatic, fixed and floating are read"
            );
            return Err(documents.refuse(element, Code::RobotElement, message));
        }
    };
    let child = |tag| documents.tagged(element, tag).next();
    let has_axis = joint_kind != JointKind::Free;
    let axis = match child("axis").filter(|_| has_axis) {
        Some(axis) => {
            documents.required(axis, "xyz")?;
            documents.unit(axis, "xyz", documents.vector(axis, "xyz")?)?
        }
        None => DVec3::X,
    };
    let number = |element, name, default| {
        let list = documents.list::<1>(element, name)?;
        Ok(list.map_or(default, |[number]| number))
    };
    let limits = match child("limit").filter(|_| matches!(kind, "revolute" | "prismatic")) {
        Some(limit) => {
            let both = [number(limit, "lower", 0.0)?, number(limit, "upper", 0.0)?];
            Some(documents.limits(limit, both)?)
        }
        None => None,
    };
    let mimic = match child("mimic").filter(|_| has_axis) {
        None => None,
        Some(mimic) => Some(Mimic {
            joint: documents.required(mimic, "joint")?.to_owned(),
            multiplier: number(mimic, "multiplier", 1.0)?,
            offset: number(mimic, "offset", 0.0)?,
        }),
    };
    Ok(Some(TreeJoint {
        name: name.to_owned(),
        kind: joint_kind,
        axis,
        anchor: DVec3::ZERO,
        reference: 0.0,
        limits,
        mimic,
    }))
}
