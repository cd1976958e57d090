//! The joints of a robot in the clips of a file: the root and the scalars get the names of the robot's joints. In files
//! that do not name joints, their order is found by the poses of bodies that the file also has.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use tumble::names::counted;
use tumble::trees::{BodyOrder, BodyPose, JointKind, Mimic, Siblings, Tree, TreeJoint};
use tumble::{Channel, ScalarKeys, TrackError, TrackSet};

use crate::diagnostic::{Code, Diagnostic};
use crate::dialect::write::WrittenDialect;
use crate::format::{Adjustment, Loaded};
use crate::motion::scalars::COARSE_ANGLE;
use crate::motion::{Motion, RecordedBodies, Scalar, ScalarKind, carry_key_data};
use crate::printable::printable;
use crate::quaternion::ComponentOrder;
use crate::robot::Robot;
use crate::robot::bodies::unwrap_joint;
use crate::robot::merge::kept_bodies;
use crate::warnings::{Warnings, listed};

/// The largest distance of a body from where its joints put it, in metres.
const FITS: f64 = 1e-3;

/// An order of bodies, with the order of bodies that have the same parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ListedOrder(BodyOrder, Siblings);

/// How the joints and bodies of a file may belong to those of a robot.
struct Candidate {
    /// `None` if names say it.
    listed: Option<ListedOrder>,
    /// The joint of each scalar, as [`Tree::scalar_joints`] counts them.
    joints: Vec<usize>,
    /// For each body of the file, the body of the robot.
    bodies: Vec<Option<usize>>,
    quaternions: ComponentOrder,
}

impl Robot {
    /// Gives the root and the scalars of clips the names of this robot's joints, with their limits. Angles of hinges
    /// without limits are unwrapped. The root of a file in a dialect is the robot's free joint; of a robot without one,
    /// its first body, which moves the base. `file` is the input's name in messages.
    ///
    /// `order` is the order of joints and bodies in files that do not name them. Without, it is the order in which the
    /// file's bodies are where their joints put them, and depth first in files without bodies.
    ///
    /// # Errors
    /// When no clip has the joints of this robot (`E904`), or the bodies contradict the order (`E907`). If
    /// only some of several clips are refused, their errors are in [`Loaded::refused`].
    pub fn assign(
        &self,
        loaded: &mut Loaded,
        file: &str,
        order: Option<BodyOrder>,
    ) -> Result<(), Diagnostic> {
        let mut warnings = Warnings::new(file);
        let mut refused = Vec::new();
        for clip in std::mem::take(&mut loaded.clips) {
            match self.assigned(&clip, file, order, &mut warnings) {
                Ok(clip) => loaded.clips.push(clip),
                Err(error) => refused.push(match &clip.name {
                    Some(name) => error.inside(format!("['{name}']")),
                    None => error,
                }),
            }
        }
        if loaded.clips.is_empty() && !refused.is_empty() {
            return Err(refused.swap_remove(0));
        }
        loaded.refused.append(&mut refused);
        // The robot names the joints, so the warning about unnamed joints is removed.
        loaded.warnings.retain(|warning| {
            !matches!(
                warning.code,
                Code::UnnamedJoints | Code::AngleJumps | Code::CoarseAngles
            )
        });
        loaded.warnings.extend(warnings.into_list());
        loaded.adjustment = loaded.adjustment.or(Some(Adjustment::Robot));
        Ok(())
    }

    /// A clip whose root and scalars have the names of this robot's joints, as of [`Robot::assign`], and the warnings. `name`
    /// is the clip's name in messages.
    ///
    /// # Errors
    /// When the clip does not have the joints of this robot (`E904`), or the bodies contradict the order (`E907`).
    pub fn assign_clip(
        &self,
        clip: &Motion,
        name: &str,
    ) -> Result<(Motion, Vec<Diagnostic>), Diagnostic> {
        let mut warnings = Warnings::new(name);
        let clip = self.assigned(clip, name, None, &mut warnings)?;
        Ok((clip, warnings.into_list()))
    }

    fn assigned(
        &self,
        clip: &Motion,
        file: &str,
        order: Option<BodyOrder>,
        warnings: &mut Warnings,
    ) -> Result<Motion, Diagnostic> {
        let refuse = |message: String| Diagnostic::new(file, Code::JointsDoNotFit, message);
        let tree = &self.tree;
        let scalars = scalars_of_robot(tree, clip, warnings, &refuse)?;
        let scalars = valued_scalars(tree, clip, scalars, warnings);
        let candidate = choose(self, clip, &scalars, order, warnings, &refuse)?;
        let mut motion = Motion {
            set: TrackSet::new(),
            ..clip.without_tracks()
        };
        motion.is_world = true;
        (motion.skeleton, motion.channels, motion.origins) = Default::default();
        let kept = |error: TrackError| refuse(format!("the clip cannot be kept: {error}"));
        for (track, name) in tracks(tree, clip, &refuse)? {
            let (keys, index) = (clip.set.track(track), motion.set.track_count());
            motion.set.push(name, keys.times, keys.keys).map_err(kept)?;
            carry_key_data(&mut motion.set, index, &keys, 0..keys.keys.len()).map_err(kept)?;
            if let Some(at) = clip.set.vector_keys(Channel::Translation, track) {
                let moved = motion
                    .set
                    .set_translations(index, at.times, at.keys, at.tangents);
                moved.map_err(kept)?;
            }
            if !clip.channels.is_empty() {
                motion.channels.push(clip.channel(track));
            }
            motion.set_origin(index, clip.origin(track));
        }
        let joints: Vec<&TreeJoint> = tree.scalar_joints().collect();
        for (&joint, &(index, keys)) in candidate.joints.iter().zip(&scalars) {
            let (joint, scalar) = (joints[joint], clip.scalar(index));
            let is_in_degrees = (clip.robot.as_ref())
                .and_then(|robot| WrittenDialect::named(robot.dialect))
                .is_some_and(|dialect| dialect.has_degrees);
            if joint.kind == JointKind::Slide && is_in_degrees {
                return Err(refuse(format!(
                    "`{}` slides, and the file has angles in degrees for all joints",
                    joint.name
                )));
            }
            let mut values: Vec<f64> = keys
                .keys
                .iter()
                .map(|&key| f64::from(key) + scalar.origin)
                .collect();
            unwrap_joint(tree, &joint.name, &mut values);
            let scalar = Scalar {
                kind: match joint.kind {
                    JointKind::Slide => ScalarKind::Length,
                    _ => ScalarKind::Angle,
                },
                origin: whole_circles(&values)
                    .filter(|_| joint.kind == JointKind::Hinge)
                    .unwrap_or(0.0),
                limits: joint.limits,
                ..scalar
            };
            let values: Vec<f32> = values
                .iter()
                .map(|value| (value - scalar.origin) as f32)
                .collect();
            motion
                .add_scalar(scalar, &joint.name, keys.times, &values, keys.tangents)
                .map_err(kept)?;
        }
        let resting = joints
            .iter()
            .filter(|joint| motion.set.scalar_named(&joint.name).is_none());
        if let Some(resting) = listed(resting.map(|joint| joint.name.clone()).collect()) {
            warnings.warn(Code::RestingJoints, || {
                (
                    None,
                    format!("joints without keys stay where the robot's file has them: {resting}"),
                )
            });
        }
        if let Some(message) = motion.coarse_angle() {
            warnings.warn(Code::CoarseAngles, || (None, message));
        }
        Ok(motion)
    }
}

/// The scalars that are of the robot, with the names of its joints. If the file has its scalars in groups, such as
/// `observation.state.left_knee` of `LeRobot`, these are the scalars of the groups with the robot's names.
fn scalars_of_robot<'a>(
    tree: &'a Tree,
    clip: &'a Motion,
    warnings: &mut Warnings,
    refuse: &impl Fn(String) -> Diagnostic,
) -> Result<Vec<(usize, ScalarKeys<'a>)>, Diagnostic> {
    let joints = tree.bodies().iter().flat_map(|body| &body.joints);
    let joints: HashSet<&str> = joints.map(|joint| &*joint.name).collect();
    let motors = motors(&joints);
    let joint_of = |name: &str| {
        joints
            .get(name)
            .or_else(|| motors.get(name)?.as_ref())
            .copied()
    };
    let all: Vec<(usize, ScalarKeys<'a>)> = clip.scalar_keys().enumerate().collect();
    if all.iter().any(|(_, keys)| joints.contains(keys.name)) {
        return Ok(all);
    }
    // The joints of each group; a group is the joints whose names have the same prefix, such as `action.`.
    let mut groups: BTreeMap<&str, HashSet<&str>> = BTreeMap::new();
    for (_, keys) in &all {
        let mut points = keys.name.match_indices('.');
        let found = points.find_map(|(point, _)| {
            let (group, joint) = keys.name.split_at(point + 1);
            Some((group, joint_of(joint)?))
        });
        if let Some((group, joint)) = found {
            groups.entry(group).or_default().insert(joint);
        }
    }
    let is_unambiguous = |groups: &BTreeMap<&str, HashSet<&str>>| {
        let mut all = HashSet::new();
        groups.values().flatten().all(|joint| all.insert(*joint))
    };
    if !is_unambiguous(&groups) {
        // Actions are commands to the robot, states are its measured motion. If the file has both, the states are used.
        groups.retain(|group, _| !group.starts_with("action"));
    }
    if !is_unambiguous(&groups) {
        let groups: Vec<&str> = groups.into_keys().collect();
        return Err(refuse(format!(
            "the file has the robot's joints more than once, as `{}…`; choose one group (--map)",
            groups.join("…`, `")
        )));
    }
    let group_of =
        |keys: &ScalarKeys<'a>| groups.keys().find(|group| keys.name.starts_with(**group));
    let (of_robot, others): (Vec<_>, Vec<_>) =
        (all.into_iter()).partition(|(_, keys)| groups.is_empty() || group_of(keys).is_some());
    if let Some(names) = listed(
        others
            .iter()
            .map(|(_, keys)| format!("`{}`", keys.name))
            .collect(),
    ) {
        warnings.warn_of(others.len(), Code::OtherScalars, || {
            let groups: Vec<&str> = groups.keys().copied().collect();
            let message = format!(
                "the joints of the robot are those called `{}…`; these scalars are left out: {names}",
                groups.join("…`, `")
            );
            (None, message)
        });
    }
    let named = of_robot.into_iter().map(|(index, mut keys)| {
        let before = group_of(&keys).map_or(0, |group| group.len());
        let name = &keys.name[before..];
        keys.name = joint_of(name).unwrap_or(name);
        (index, keys)
    });
    Ok(named.collect())
}

/// The joints of a robot by the names of their motors in Unitree's programs: `kLeftElbow` of `left_elbow_joint`. `None`
/// for a name of two joints.
fn motors<'a>(joints: &HashSet<&'a str>) -> HashMap<String, Option<&'a str>> {
    let mut motors = HashMap::new();
    for joint in joints {
        let words = joint.strip_suffix("_joint").unwrap_or(joint).split('_');
        let mut motor = "k".to_owned();
        for word in words {
            let mut letters = word.chars();
            motor.extend(letters.next().map(|first| first.to_ascii_uppercase()));
            motor.push_str(letters.as_str());
        }
        let known = motors.entry(motor);
        known
            .and_modify(|known| *known = None)
            .or_insert(Some(*joint));
    }
    motors
}

/// The scalars of joints with values of their own, and their names. Joints that follow others (`mimic`) are computed; a
/// warning says how far the file's values are from the computed ones.
fn valued_scalars<'a>(
    tree: &Tree,
    clip: &'a Motion,
    scalars: Vec<(usize, ScalarKeys<'a>)>,
    warnings: &mut Warnings,
) -> Vec<(usize, ScalarKeys<'a>)> {
    let joints = tree.bodies().iter().flat_map(|body| &body.joints);
    let mimics: HashMap<&str, &Mimic> = joints
        .filter_map(|joint| Some((&*joint.name, joint.mimic.as_ref()?)))
        .collect();
    let values = |index: usize, keys: &ScalarKeys<'a>| {
        let origin = clip.scalar(index).origin;
        let values = keys.keys.iter();
        values
            .map(move |&key| f64::from(key) + origin)
            .collect::<Vec<f64>>()
    };
    let mut valued = Vec::new();
    let find = |name: &str| scalars.iter().find(|(_, keys)| keys.name == name);
    for &(index, keys) in &scalars {
        let Some(mimic) = mimics.get(keys.name) else {
            valued.push((index, keys));
            continue;
        };
        let source = find(&mimic.joint).filter(|(_, source)| source.times == keys.times);
        let largest = source.map(|(source, source_keys)| {
            let computed = values(*source, source_keys).into_iter();
            let computed = computed.map(|value| mimic.multiplier * value + mimic.offset);
            let apart = computed
                .zip(values(index, &keys))
                .map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f64::max)
        });
        warnings.warn(Code::FollowingJoints, || {
            let apart = match largest {
                Some(largest) => format!("the file's values are up to {largest:.2e} from these"),
                None => "the file's values were not compared with these".to_owned(),
            };
            let message = format!(
                "joint `{}` follows `{}` (mimic), and is computed from it; {apart}",
                printable(keys.name),
                mimic.joint
            );
            (None, message)
        });
    }
    valued
}

/// The whole turns nearest to the middle of some angles, to be subtracted from them. `None` unless the largest
/// magnitude then becomes less than half, or becomes smaller and was so large that f32 has coarse steps there. So
/// angles near 0 keep the digits of the file.
fn whole_circles(angles: &[f64]) -> Option<f64> {
    let [low, high] = [f64::min, f64::max].map(|pick| angles.iter().copied().reduce(pick));
    let (low, high) = (low?, high?);
    let circles = (f64::midpoint(low, high) / TAU).round() * TAU;
    let [before, after] =
        [0.0, circles].map(|circles| (low - circles).abs().max((high - circles).abs()));
    let is_coarse = before >= f64::from(COARSE_ANGLE);
    (2.0 * after < before || (is_coarse && after < before)).then_some(circles)
}

/// The tracks that move joints, with the names of these.
fn tracks<'a>(
    tree: &'a Tree,
    clip: &Motion,
    refuse: &impl Fn(String) -> Diagnostic,
) -> Result<Vec<(usize, &'a str)>, Diagnostic> {
    let bodies = tree.bodies();
    let of_joints = bodies.iter().flat_map(|body| {
        let joints = body
            .joints
            .iter()
            .filter(|joint| matches!(joint.kind, JointKind::Free | JointKind::Ball));
        joints.map(move |joint| (joint.kind, &*joint.name, &*body.name))
    });
    let mut moving: Vec<(JointKind, &str, &str)> = of_joints.collect();
    let root = match tree.counts().free {
        0 => bodies.first().map(|body| &*body.name),
        1 => moving
            .iter()
            .find(|joint| joint.0 == JointKind::Free)
            .map(|joint| joint.1),
        _ => None,
    };
    if let (0, Some(root)) = (tree.counts().free, root) {
        moving.push((JointKind::Free, root, root));
    }
    let all = || 0..clip.set.track_count();
    if clip.robot.is_some() && clip.set.track_count() > 0 {
        let Some(root) = root else {
            return Err(refuse(format!(
                "the file has the motion of one root, and the robot has {} free joints",
                tree.counts().free
            )));
        };
        let first = bodies.first().map_or("", |body| &*body.name);
        let named = all().find(|&track| clip.set.track_name(track) == first);
        return Ok(vec![(named.unwrap_or(0), root)]);
    }
    let joint_of = |track: usize| {
        let name = clip.set.track_name(track);
        let joint = moving.iter().find(|joint| joint.1 == name).or_else(|| {
            let mut free = moving.iter().filter(|joint| joint.0 == JointKind::Free);
            free.find(|joint| joint.2 == name)
        });
        let only = root.filter(|_| clip.set.track_count() == 1 && name == "root");
        joint.map(|joint| joint.1).or(only).map(|joint| (track, joint)).ok_or_else(|| {
            let known = listed(moving.iter().map(|joint| joint.1.to_owned()).collect());
            refuse(format!(
                "track {track} is called `{name}`, which is no joint of the robot; tracks move {}",
                known.unwrap_or_else(|| "none of its joints".to_owned())
            ))
        })
    };
    all().map(joint_of).collect()
}

/// The joints that have values, in the order of their bodies.
pub(crate) fn joints_of(tree: &Tree, bodies: &[usize]) -> Vec<usize> {
    let mut next = 0;
    let has_value = |joint: &&TreeJoint| {
        matches!(joint.kind, JointKind::Hinge | JointKind::Slide) && joint.mimic.is_none()
    };
    let of_body = tree.bodies().iter().map(|body| {
        let first = next;
        next += body.joints.iter().filter(has_value).count();
        first..next
    });
    let of_body: Vec<_> = of_body.collect();
    bodies
        .iter()
        .flat_map(|&body| of_body[body].clone())
        .collect()
}

/// The joints of the scalars: by their names, or by the order that fits best.
fn choose(
    robot: &Robot,
    clip: &Motion,
    scalars: &[(usize, ScalarKeys<'_>)],
    stated: Option<BodyOrder>,
    warnings: &mut Warnings,
    refuse: &impl Fn(String) -> Diagnostic,
) -> Result<Candidate, Diagnostic> {
    let tree = &robot.tree;
    let names: Vec<&str> = scalars.iter().map(|(_, keys)| keys.name).collect();
    let recorded = clip.robot.as_ref().and_then(|robot| robot.bodies.as_ref());
    let is_numbered = names
        .iter()
        .enumerate()
        .all(|(i, name)| *name == format!("joint_{i}"));
    let names_joints = clip
        .robot
        .as_ref()
        .map_or(!is_numbered, |robot| robot.names_joints);
    let orders: Vec<ListedOrder> = BodyOrder::ALL
        .into_iter()
        .flat_map(|order| Siblings::ALL.map(|siblings| ListedOrder(order, siblings)))
        .collect();
    let by_name = names_joints
        .then(|| joints_by_name(tree, &names, refuse))
        .transpose()?;
    if names.is_empty() && tree.counts().scalars > 0 {
        return Err(refuse(
            "the file has no joint angles, so it is no motion of a robot; motions of people cannot be retargeted to \
             robots"
                .to_owned(),
        ));
    }
    if by_name.is_none() && names.len() != tree.counts().scalars {
        let joints: Vec<&str> = tree.scalar_joints().map(|joint| &*joint.name).collect();
        let all = tree.bodies().iter().flat_map(|body| &body.joints);
        let mimics = all.filter(|joint| joint.mimic.is_some());
        let mimics = listed(mimics.map(|joint| joint.name.clone()).collect());
        let mimics = mimics.map_or(String::new(), |mimics| {
            format!(" (and these, which follow them: {mimics})")
        });
        return Err(refuse(format!(
            "the file has {} without names, but the robot has {}: {}{mimics}",
            counted(names.len(), "joint"),
            joints.len(),
            joints.join(", ")
        )));
    }
    let merged = merged_bodies(robot, recorded);
    let mut candidates: Vec<Candidate> = Vec::new();
    for &ListedOrder(order, siblings) in &orders {
        let listed = ListedOrder(order, siblings);
        let all = match &merged {
            None => tree.order(order, siblings),
            Some((merged, kept)) => {
                let all = merged.order(order, siblings).into_iter();
                all.map(|body| kept[body]).collect()
            }
        };
        let joints = by_name.clone().unwrap_or_else(|| joints_of(tree, &all));
        let bodies = bodies_of(tree, recorded, &all);
        for quaternions in
            recorded.map_or(vec![ComponentOrder::Wxyz], |_| ComponentOrder::ALL.to_vec())
        {
            let is_known = |known: &Candidate| {
                (&known.joints, &known.bodies, known.quaternions) == (&joints, &bodies, quaternions)
            };
            if !candidates.iter().any(is_known) {
                candidates.push(Candidate {
                    listed: Some(listed),
                    joints: joints.clone(),
                    bodies: bodies.clone(),
                    quaternions,
                });
            }
        }
    }
    let first = |candidates: Vec<Candidate>| {
        let order = stated.unwrap_or_default();
        let mut all = candidates.into_iter();
        all.find(|candidate| candidate.listed.is_some_and(|listed| listed.0 == order))
    };
    let none = || refuse("the robot has no bodies".to_owned());
    let errors = recorded
        .filter(|recorded| !recorded.samples.is_empty())
        .and_then(|recorded| {
            let errors = candidates
                .iter()
                .map(|candidate| error(tree, (clip, scalars), recorded, candidate));
            errors.collect::<Option<Vec<f64>>>()
        });
    let (Some(errors), Some(recorded)) = (errors, recorded) else {
        let is_doubtful = by_name.is_none() && stated.is_none();
        if is_doubtful
            && candidates
                .iter()
                .any(|other| other.joints != candidates[0].joints)
        {
            warnings.warn(Code::UnnamedJoints, || {
                let unchecked = match recorded {
                    Some(_) => "its bodies are not those of the robot",
                    None => "has no bodies that would show their order",
                };
                let message = format!(
                    "the file does not name its joints, and {unchecked}; they are taken depth first, as in the \
                     robot's file; --source-body-order gives another order"
                );
                (None, message)
            });
        }
        return first(candidates).ok_or_else(none);
    };
    checked(
        candidates,
        &errors,
        recorded,
        (stated, by_name.is_some()),
        warnings,
        refuse,
    )
}

/// The candidate that fits best, if it is the one that is stated.
fn checked(
    mut candidates: Vec<Candidate>,
    errors: &[f64],
    recorded: &RecordedBodies,
    (stated, is_named): (Option<BodyOrder>, bool),
    warnings: &mut Warnings,
    refuse: &impl Fn(String) -> Diagnostic,
) -> Result<Candidate, Diagnostic> {
    let is_stated = |candidate: &Candidate| {
        let is_order = |order| candidate.listed.is_some_and(|listed| listed.0 == order);
        candidate.quaternions == recorded.order && (is_named || stated.is_none_or(is_order))
    };
    let best_of = |of: &dyn Fn(&Candidate) -> bool| {
        let fitting = (0..errors.len()).filter(|&index| of(&candidates[index]));
        fitting.min_by(|&a, &b| errors[a].total_cmp(&errors[b]))
    };
    let (Some(best), Some(of_stated)) = (best_of(&|_| true), best_of(&is_stated)) else {
        return Err(refuse("the robot has no bodies".to_owned()));
    };
    if errors[of_stated] <= FITS {
        // Joints that never move fit in every order, so they decide nothing.
        let other = candidates.iter().zip(errors).find(|(other, error)| {
            **error <= FITS && is_stated(other) && other.joints != candidates[of_stated].joints
        });
        if other.is_some() && stated.is_none() {
            warnings.warn(Code::UnnamedJoints, || {
                let message = "the file does not name its joints, and its bodies fit the robot in several orders; they \
                               are taken depth first; --source-body-order gives another order";
                (None, message)
            });
            let index = candidates.iter().position(is_stated).unwrap_or(of_stated);
            return Ok(candidates.swap_remove(index));
        }
        return Ok(candidates.swap_remove(of_stated));
    }
    let (found, array) = (&candidates[best], &recorded.positions);
    if errors[best] <= FITS {
        let message = match found.listed {
            _ if found.quaternions != recorded.order => {
                let (order, rotations) = (found.quaternions.name(), &recorded.rotations);
                format!("`{rotations}` is in the order {order}; give --source-order {order}")
            }
            Some(ListedOrder(order, _)) => {
                format!("`{array}` is in {order} order; give --source-body-order {order}")
            }
            None => format!("`{array}` is in another order"),
        };
        let message = format!(
            "{message}: with this order, the bodies agree with the joints within {:.1e} m, otherwise within {:.2} m",
            errors[best], errors[of_stated]
        );
        return Err(Diagnostic {
            code: Code::OrderContradicts,
            ..refuse(message)
        });
    }
    let farthest = errors[of_stated];
    if !is_named && stated.is_none() {
        return Err(refuse(format!(
            "the file does not name its joints, and in no order do the bodies of `{array}` agree with the \
             robot's joints (they are at least {farthest:.3} m away): the file may be of another robot, or of \
             another version of it; --source-body-order takes an order without this check"
        )));
    }
    warnings.warn(Code::OtherRobot, || {
        let message = format!(
            "the bodies of `{array}` are up to {farthest:.3} m from where the robot's joints put them: it may be another \
             version of the robot; bodies are computed from the joints"
        );
        (None, message)
    });
    Ok(candidates.swap_remove(of_stated))
}

fn joints_by_name(
    tree: &Tree,
    names: &[&str],
    refuse: &impl Fn(String) -> Diagnostic,
) -> Result<Vec<usize>, Diagnostic> {
    let joints: Vec<&str> = tree.scalar_joints().map(|joint| &*joint.name).collect();
    let position = |name: &&str| joints.iter().position(|joint| joint == name);
    let found: Option<Vec<usize>> = names.iter().map(position).collect();
    found.ok_or_else(|| {
        let repeated = names.iter().find_map(|name| {
            let (first, number) = name.rsplit_once('#')?;
            (number.parse::<u32>().is_ok() && names.contains(&first)).then_some(first)
        });
        if let Some(repeated) = repeated {
            return refuse(format!("the file names the joint `{repeated}` twice"));
        }
        let unknown = names.iter().filter(|name| position(name).is_none());
        let unknown = unknown.map(|name| format!("`{name}`"));
        let all = |names: &[&str]| {
            let names = names.iter().map(|&name| name.to_owned());
            listed(names.collect()).unwrap_or_default()
        };
        refuse(format!(
            "the robot has no joint {}; the file has {}, and the robot {}; for tables and arrays, \
             --map JOINT=COLUMN:scalar:angle names them",
            listed(unknown.collect()).unwrap_or_default(),
            all(names),
            all(&joints)
        ))
    })
}

/// The tree without the bodies that have no joints, and for each of its bodies the index of the robot's body. Some
/// programs merge such bodies into others. `None` unless the file has exactly as many bodies as this tree.
fn merged_bodies(robot: &Robot, recorded: Option<&RecordedBodies>) -> Option<(Tree, Vec<usize>)> {
    let kept = kept_bodies(&robot.tree);
    let is_merged = recorded?.count == kept.len() && kept.len() < robot.tree.bodies().len();
    let merged = is_merged.then(|| robot.merged().ok()).flatten()?;
    Some((merged.tree, kept))
}

/// For each body of the file, its index in the tree: by its name, or else in the order `order`.
fn bodies_of(
    tree: &Tree,
    recorded: Option<&RecordedBodies>,
    order: &[usize],
) -> Vec<Option<usize>> {
    let Some(recorded) = recorded else {
        return Vec::new();
    };
    if !recorded.names.is_empty() {
        let named = |name: &String| tree.bodies().iter().position(|body| body.name == *name);
        return recorded.names.iter().map(named).collect();
    }
    match recorded.count {
        count if count == order.len() => order.iter().copied().map(Some).collect(),
        count => vec![None; count],
    }
}

/// The largest distance of a recorded body from where its joints put it; `None` if it cannot be compared.
fn error(
    tree: &Tree,
    (clip, scalars): (&Motion, &[(usize, ScalarKeys<'_>)]),
    recorded: &RecordedBodies,
    candidate: &Candidate,
) -> Option<f64> {
    // The comparison needs the rotation of the first body, which the file must contain, and at most one free joint.
    (candidate.bodies.first() == Some(&Some(0)) && tree.counts().free < 2).then_some(())?;
    let mut largest: f64 = 0.0;
    for sample in &recorded.samples {
        let mut at = tree.rest();
        for (&joint, (index, keys)) in candidate.joints.iter().zip(scalars) {
            let key = keys.keys.get(sample.key)?;
            at.scalars[joint] = f64::from(*key) + clip.scalar(*index).origin;
        }
        let [a, b, c, d] = sample.root;
        let rotation = match candidate.quaternions {
            ComponentOrder::Xyzw => DQuat::from_xyzw(a, b, c, d),
            ComponentOrder::Wxyz => DQuat::from_xyzw(b, c, d, a),
        };
        let pose = BodyPose {
            position: *sample.positions.first()?,
            rotation: rotation.normalize(),
        };
        *at.free.first_mut().unwrap_or(&mut at.base) = pose;
        let poses = tree.poses(&at).ok()?;
        let of_file = candidate.bodies.iter().zip(&sample.positions);
        let distance = |(body, position): (&Option<usize>, &DVec3)| {
            body.map_or(0.0, |body| poses[body].position.distance(*position))
        };
        largest = of_file.map(distance).fold(largest, f64::max);
    }
    largest.is_finite().then_some(largest)
}
