//! Mirrored clips: left becomes right, by the names of the joints and a plane.
//!
//! With the rotations `R` of the joints at rest and `W` now, in the world, and `m(q)` a mirrored rotation, the joint `j`
//! follows its partner `s`: `W'_j = m(W_s R_s⁻¹) R_j = m(W_s) B_j`, with `B_j = m(R_s)⁻¹ R_j`. The parent of the partner
//! is the partner of the parent `p`, so relative to the parents this is `L'_j = B_p⁻¹ m(L_s) B_j`: signs that change,
//! between two constants. So keys keep their times, and the curves between them are mirrored too.

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::trees::{JointKind, Tree, TreeError, TreeJoint};
use tumble::{Channel, TrackError};

use crate::learning::mirror::{mirror_pairs, mirrored_point, mirrored_rotation};
use crate::motion::world::{HierarchyError, parents_first};
use crate::motion::{Motion, Scalar, ScalarKind, carry_key_data};

/// How a clip is mirrored.
#[derive(Debug, Clone, Copy)]
pub struct Mirror<'a> {
    /// The axis from left to right, across the plane of the mirror: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// The robot whose joints are the scalars of the clip.
    pub tree: Option<&'a Tree>,
}

/// The joints of a mirrored clip.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MirrorReport {
    /// Joints and scalars that have changed their sides, each pair once.
    pub pairs: Vec<[String; 2]>,
    /// Those that have no partner and are mirrored in their place.
    pub alone: Vec<String>,
    /// The joint that is furthest from the mirror image of its partner at rest, and this distance as a part of the size
    /// of the skeleton; `None` if it is not known where the joints are at rest.
    pub asymmetry: Option<(String, f64)>,
}

/// Why a clip cannot be mirrored.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MirrorError {
    /// Two joints of the same name but for the side have parents that are no such pair.
    #[error("{}", of_parents(joint, partner, parents))]
    Parents {
        /// A joint.
        joint: String,
        /// Its partner, or itself.
        partner: String,
        /// The parent of the joint and the parent of its partner; of a joint without a partner, its parent and the partner of
        /// that. `None` for a joint without a parent.
        parents: [Option<String>; 2],
    },
    /// A joint has a scale that differs by axis, and its axes at rest are not those of its partner.
    #[error(
        "`{joint}` has a scale that differs by axis, and its axes are not the mirror image of its partner's"
    )]
    Scale {
        /// The joint.
        joint: String,
    },
    /// The axis of a joint is not known.
    #[error("the axis of the joint `{joint}` is not known; give the robot")]
    NoAxis {
        /// The scalar with the values of the joint.
        joint: String,
    },
    /// Two joints turn or move along axes that are no mirror images.
    #[error(
        "{} mirrored {}; is another axis the one from left to right? It is y for robots that face x",
        if joint == partner { format!("the joint `{joint}` does not move along its own") } else { format!("the joints `{joint}` and `{partner}` do not move along") },
        if joint == partner { "axis" } else { "axes" }
    )]
    Axes {
        /// A joint.
        joint: String,
        /// Its partner, or itself.
        partner: String,
    },
    /// Balls of robots are not mirrored.
    #[error("the robot has the ball `{joint}`; only hinges and slides are mirrored")]
    Ball {
        /// The first ball.
        joint: String,
    },
    /// The joints make no hierarchy.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
    /// The rest pose of the robot cannot be computed.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// A mirrored key is not valid.
    #[error(transparent)]
    Track(#[from] TrackError),
}

/// Why the parents of two joints do not allow that the joints are partners.
fn of_parents(joint: &str, partner: &str, parents: &[Option<String>; 2]) -> String {
    let named = |parent: &Option<String>| match parent {
        Some(parent) => format!("`{parent}`"),
        None => "none".to_owned(),
    };
    let [first, second] = [0, 1].map(|side| named(&parents[side]));
    match joint == partner {
        true => format!(
            "`{joint}` has no partner, but its parent {first} is mirrored to {second}; rename the joints, so that each joint \
             below one side has a partner on the other"
        ),
        false => format!(
            "`{joint}` and `{partner}` are a pair by their names, but their parents {first} and {second} are none; rename the \
             joints, so that the parents of a pair are one joint, or differ only in the side, such as left and right"
        ),
    }
}

/// A vector across the axes of a skeleton that is shorter than this part of a whole turn's is rounding.
const ROUNDING: f64 = 1e-6;
/// The largest difference of two axes from mirror images.
const AXES: f64 = 1e-3;

/// Mirrors a clip at the plane through the origin across an axis. Each joint gets the motion of its partner: the joint
/// of the same name with the other side ([`mirror_pairs`]), or itself. The skeleton stays as it is. Angles of robots
/// get the signs that their axes require; contacts and numbers without a unit change their sides and no sign. Twice is
/// the identity: bit for bit if the axes of the joints at rest are mirror images, else within the rounding of a key.
///
/// # Errors
/// When the parents of partners are no partners, when the axes of a robot's joints are not known or no mirror images, or
/// when a mirrored key is not valid.
pub fn mirrored(clip: &Motion, mirror: Mirror<'_>) -> Result<(Motion, MirrorReport), MirrorError> {
    let axis = mirror.axis;
    let names: Vec<String> = (0..clip.set.track_count())
        .map(|track| clip.set.track_name(track))
        .collect();
    let partners = mutual(mirror_pairs(&names));
    let parent = |joint: usize| clip.skeleton.get(joint).and_then(|joint| joint.parent);
    let of_partner = |joint: usize| parent(joint).map(|parent| partners[parent]);
    let strange = (0..names.len())
        .filter(|_| !clip.is_world)
        .find(|&joint| parent(partners[joint]) != of_partner(joint));
    if let Some(joint) = strange {
        let other = match partners[joint] == joint {
            true => of_partner(joint),
            false => parent(partners[joint]),
        };
        return Err(MirrorError::Parents {
            joint: names[joint].clone(),
            partner: names[partners[joint]].clone(),
            parents: [parent(joint), other].map(|it| it.map(|it| names[it].clone())),
        });
    }
    let robot = mirror.tree.map(|tree| RobotAtRest::new(tree, axis));
    let robot = robot.transpose()?;
    let rest = RestPose::of(clip, robot.as_ref())?;
    let between = |joint: usize| {
        let image = mirrored_rotation(rest.rotations[partners[joint]], axis);
        let between = image.conjugate() * rest.rotations[joint];
        match between.xyz().length() < ROUNDING {
            true => DQuat::IDENTITY,
            false => between.normalize(),
        }
    };
    let between: Vec<DQuat> = (0..names.len()).map(between).collect();
    let mut result = clip.without_tracks();
    if let Some(robot) = &mut result.robot {
        // These bodies are those of the motion before.
        robot.bodies = None;
    }
    for (joint, &partner) in partners.iter().enumerate() {
        let from = clip.set.track(partner);
        let above = parent(joint).filter(|_| !clip.is_world);
        let frames = Frames {
            axis,
            parent: above.map_or(DQuat::IDENTITY, |above| between[above].conjugate()),
            joint: between[joint],
        };
        let keys: Vec<Quat> = from.keys.iter().map(|&key| frames.rotation(key)).collect();
        let name = clip.set.track(joint).name.unwrap_or_default();
        let set = &mut result.set;
        set.push(name, from.times, &keys)?;
        carry_key_data(set, joint, &from, 0..keys.len())?;
        if !from.tangents.is_empty() {
            let tangents = from.tangents.iter();
            let tangents = tangents.map(|both| both.map(|it| frames.rotation(it)));
            set.set_tangents(joint, &tangents.collect::<Vec<_>>())?;
        }
        if !from.velocities.is_empty() {
            let velocities = from.velocities.iter();
            let velocities = velocities.map(|&velocity| frames.angular_velocity(velocity));
            set.set_velocities(joint, &velocities.collect::<Vec<_>>())?;
        }
        if let Some(scales) = clip.set.vector_keys(Channel::Scale, partner) {
            let is_even = |scale: &Vec3| scale.x == scale.y && scale.y == scale.z;
            if frames.joint != DQuat::IDENTITY && !scales.keys.iter().all(is_even) {
                let joint = names[joint].clone();
                return Err(MirrorError::Scale { joint });
            }
            set.set_scales(joint, scales.times, scales.keys, scales.tangents)?;
        }
        if let Some(channels) = result.channels.get_mut(joint) {
            *channels = clip.channels[partner];
        }
        // A joint with a parent gets the mirrored displacement of its partner from the partner's rest position.
        // Positions of joints without a parent are in the world, and are mirrored whole.
        let (at, rest_at) = match above {
            Some(_) => (clip.rest_position(partner), clip.rest_position(joint)),
            None => (DVec3::ZERO, DVec3::ZERO),
        };
        let position = |position: DVec3| rest_at + frames.vector(position - at);
        if above.is_none() {
            let origin = mirrored_point(clip.origin(partner), axis);
            if let Some(skeleton) = result.skeleton.get_mut(joint) {
                let resting = clip.rest(Channel::Translation, partner).as_dvec3();
                skeleton.rest.translation = mirrored_point(resting, axis).as_vec3();
            }
            result.set_origin(joint, origin);
        }
        if let Some(moved) = clip.set.vector_keys(Channel::Translation, partner) {
            let (before, origin) = (clip.origin(partner), result.origin(joint));
            let keys = moved.keys.iter();
            let keys = keys.map(|key| (position(before + key.as_dvec3()) - origin).as_vec3());
            let tangents = moved.tangents.iter();
            let tangents =
                tangents.map(|both| both.map(|it| frames.vector(it.as_dvec3()).as_vec3()));
            let (keys, tangents): (Vec<Vec3>, Vec<[Vec3; 2]>) =
                (keys.collect(), tangents.collect());
            result
                .set
                .set_translations(joint, moved.times, &keys, &tangents)?;
        }
    }
    let scalars: Vec<&str> = clip.scalar_keys().map(|keys| keys.name).collect();
    let scalar_partners = mutual(mirror_pairs(&scalars));
    for (scalar, &partner) in scalar_partners.iter().enumerate() {
        let (to, from) = (clip.scalar(scalar), clip.scalar(partner));
        let [name, other] = [scalars[scalar], scalars[partner]];
        let change = match (to.kind, &robot) {
            (ScalarKind::Plain | ScalarKind::Contact, _) => ScalarChange::default(),
            (_, Some(robot)) => robot.change(name, other)?,
            (_, None) => {
                let joint = name.to_owned();
                return Err(MirrorError::NoAxis { joint });
            }
        };
        let Some(keys) = clip.set.scalar(partner) else {
            continue;
        };
        let numbers: Vec<f32> = keys.keys.iter().map(|&key| change.number(key)).collect();
        let sign = change.sign as f32;
        let tangents: Vec<[f32; 2]> = keys
            .tangents
            .iter()
            .map(|it| it.map(|it| sign * it))
            .collect();
        let scalar = Scalar {
            origin: change.sign * from.origin,
            interpolation: from.interpolation,
            ..to
        };
        result.add_scalar(scalar, name, keys.times, &numbers, &tangents)?;
    }
    let mut report = MirrorReport {
        pairs: Vec::new(),
        alone: Vec::new(),
        asymmetry: rest.asymmetry(&names, &partners, axis),
    };
    if let Some(robot) = &robot {
        report.asymmetry = robot.asymmetry(axis);
    }
    report.add(&names, &partners);
    report.add(&scalars, &scalar_partners);
    Ok((result, report))
}

impl MirrorReport {
    fn add<T: AsRef<str>>(&mut self, names: &[T], partners: &[usize]) {
        for (joint, &partner) in partners.iter().enumerate() {
            let [name, other] = [joint, partner].map(|it| names[it].as_ref().to_owned());
            match partner {
                _ if partner == joint => self.alone.push(name),
                _ if partner > joint => self.pairs.push([name, other]),
                _ => {}
            }
        }
    }
}

/// The pairs of which each is the partner of the other; others are their own.
fn mutual(partners: Vec<usize>) -> Vec<usize> {
    let is_pair = |joint: usize| partners[partners[joint]] == joint;
    let joints = 0..partners.len();
    joints
        .map(|joint| {
            if is_pair(joint) {
                partners[joint]
            } else {
                joint
            }
        })
        .collect()
}

/// The constants by which the keys of a joint follow from those of its partner.
struct Frames {
    axis: usize,
    parent: DQuat,
    joint: DQuat,
}

impl Frames {
    fn rotation(&self, key: Quat) -> Quat {
        let image = mirrored_rotation(key.as_dquat(), self.axis);
        // A product with 1 would change the sign of zeros.
        match self.parent == DQuat::IDENTITY && self.joint == DQuat::IDENTITY {
            true => image.as_quat(),
            false => (self.parent * image * self.joint).as_quat(),
        }
    }

    /// A vector in the parent's frame.
    fn vector(&self, vector: DVec3) -> DVec3 {
        let image = mirrored_point(vector, self.axis);
        match self.parent == DQuat::IDENTITY {
            true => image,
            false => self.parent * image,
        }
    }

    /// An angular velocity in the joint's frame.
    fn angular_velocity(&self, velocity: DVec3) -> DVec3 {
        let image = -mirrored_point(velocity, self.axis);
        self.joint.conjugate() * image
    }
}

/// Where the joints of a clip are at rest, in the world.
struct RestPose {
    rotations: Vec<DQuat>,
    /// Empty if that is not known.
    positions: Vec<DVec3>,
    root: DVec3,
}

impl RestPose {
    fn of(clip: &Motion, robot: Option<&RobotAtRest<'_>>) -> Result<Self, MirrorError> {
        let tracks = clip.set.track_count();
        let mut rotations = vec![DQuat::IDENTITY; tracks];
        let mut positions = vec![DVec3::ZERO; tracks];
        let mut root = None;
        for joint in parents_first(clip, tracks)? {
            let Some(skeleton) = clip.skeleton.get(joint) else {
                continue;
            };
            let local = skeleton.rest.rotation.as_dquat().normalize();
            let offset = clip.rest_position(joint);
            (rotations[joint], positions[joint]) = match skeleton.parent {
                Some(parent) => (
                    rotations[parent] * local,
                    positions[parent] + rotations[parent] * offset,
                ),
                None => (local, offset),
            };
            if skeleton.parent.is_none() {
                root.get_or_insert(positions[joint]);
            }
        }
        if let (Some(robot), Some(first)) = (robot, rotations.first_mut()) {
            *first = robot.rotations.first().copied().unwrap_or_default();
        }
        Ok(Self {
            rotations,
            positions: if root.is_some() {
                positions
            } else {
                Vec::new()
            },
            root: root.unwrap_or_default(),
        })
    }

    fn asymmetry<T: AsRef<str>>(
        &self,
        names: &[T],
        partners: &[usize],
        axis: usize,
    ) -> Option<(String, f64)> {
        asymmetry(&self.positions, self.root, partners, axis)
            .map(|(joint, distance)| (names[joint].as_ref().to_owned(), distance))
    }
}

/// The point that is furthest from the mirror image of its partner, at a plane through `root`, and this distance as a part
/// of the largest distance from there.
fn asymmetry(
    positions: &[DVec3],
    root: DVec3,
    partners: &[usize],
    axis: usize,
) -> Option<(usize, f64)> {
    let away = |joint: usize| positions[joint] - root;
    let joints = 0..positions.len();
    let size = joints
        .clone()
        .map(|joint| away(joint).length())
        .fold(0.0, f64::max);
    let apart = |joint: usize| (mirrored_point(away(partners[joint]), axis) - away(joint)).length();
    let worst = joints.max_by(|&a, &b| apart(a).total_cmp(&apart(b)))?;
    (size > 0.0).then(|| (worst, apart(worst) / size))
}

/// How the value of a joint follows from that of its partner.
#[derive(Debug, Clone, Copy)]
struct ScalarChange {
    sign: f64,
    shift: f64,
}

impl Default for ScalarChange {
    fn default() -> Self {
        Self {
            sign: 1.0,
            shift: 0.0,
        }
    }
}

impl ScalarChange {
    fn number(self, key: f32) -> f32 {
        // A sum with 0 would change the sign of zeros.
        match self.shift == 0.0 {
            true => self.sign as f32 * key,
            false => (self.sign * f64::from(key) + self.shift) as f32,
        }
    }
}

/// The bodies of a robot with its joints at their references.
struct RobotAtRest<'a> {
    tree: &'a Tree,
    axis: usize,
    rotations: Vec<DQuat>,
    positions: Vec<DVec3>,
}

impl<'a> RobotAtRest<'a> {
    fn new(tree: &'a Tree, axis: usize) -> Result<Self, MirrorError> {
        if let Some(ball) = tree.joints().find(|joint| joint.kind == JointKind::Ball) {
            let joint = ball.name.clone();
            return Err(MirrorError::Ball { joint });
        }
        let mut rest = tree.rest();
        for (value, joint) in rest.scalars.iter_mut().zip(tree.scalar_joints()) {
            *value = joint.reference;
        }
        let poses = tree.poses(&rest)?;
        Ok(Self {
            tree,
            axis,
            rotations: poses.iter().map(|pose| pose.rotation).collect(),
            positions: poses.iter().map(|pose| pose.position).collect(),
        })
    }

    /// A joint, and its axis in the world.
    fn joint(&self, name: &str) -> Result<(&'a TreeJoint, DVec3), MirrorError> {
        let bodies = self.tree.bodies().iter().zip(&self.rotations);
        let mut joints = bodies.flat_map(|(body, rotation)| {
            body.joints
                .iter()
                .map(move |joint| (joint, *rotation * joint.axis))
        });
        let found = joints.find(|(joint, _)| joint.name == name);
        found.ok_or_else(|| MirrorError::NoAxis {
            joint: name.to_owned(),
        })
    }

    /// How the value of a joint follows from that of its partner. The mirror image of a rotation about an axis is one about
    /// the mirrored axis in the other sense.
    fn change(&self, name: &str, partner: &str) -> Result<ScalarChange, MirrorError> {
        let [(to, axis), (from, other)] = [self.joint(name)?, self.joint(partner)?];
        let along = other.dot(mirrored_point(axis, self.axis));
        if to.kind != from.kind || (along.abs() - 1.0).abs() > AXES {
            return Err(MirrorError::Axes {
                joint: name.to_owned(),
                partner: partner.to_owned(),
            });
        }
        let sign = match to.kind {
            JointKind::Slide => along.signum(),
            _ => -along.signum(),
        };
        Ok(ScalarChange {
            sign,
            shift: to.reference - sign * from.reference,
        })
    }

    fn asymmetry(&self, axis: usize) -> Option<(String, f64)> {
        let names: Vec<&str> = self.tree.bodies().iter().map(|body| &*body.name).collect();
        let partners = mutual(mirror_pairs(&names));
        let root = self.positions.first().copied()?;
        asymmetry(&self.positions, root, &partners, axis)
            .map(|(body, distance)| (names[body].to_owned(), distance))
    }
}
