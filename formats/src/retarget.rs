//! Carries a motion from one skeleton to another: rotations away from the rest pose, exactly, and the way of the hips.
//!
//! With the world rotations of a joint at rest `R_s` and now `W_s`, and the rotation `C` from the axes of the source to
//! those of the target, the difference from rest is `D = C W_s R_s⁻¹ C⁻¹`. The joint of the target is then `D A R_t` in
//! the world, where `A` aligns the target's rest pose with the source's; local rotations follow from the parents that
//! were computed. Joints of the source that the target lacks collapse into the joint below, because `D` is relative to
//! the world.

mod roles;

use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use tumble::reference::angle_between;
use tumble::{TrackError, names};

pub use roles::{Role, Roles, missing_text, recognise, standing_axis};

use crate::diagnostic::Diagnostic;
use crate::format::{Format, Loaded, ReadOptions, Space};
use crate::gltf;
use crate::learning::rotation_between;
use crate::motion::adjust::UpAxis;
use crate::motion::keyed::{KeyedError, keyed_tracks};
use crate::motion::world::{HierarchyError, parents_first};
use crate::motion::{Channels, Motion};

/// How a motion is carried over.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RetargetOptions {
    /// Joints of the target and of the source, by names; empty to recognise both skeletons by their names.
    pub bones: Vec<(String, String)>,
    /// How the rest poses are compared.
    pub rest: RestAlignment,
    /// The key of the source whose pose counts as the source's rest pose, from 0; `None` for the rest pose of the
    /// skeleton. Takes of motion capture often begin in a T-pose, while their skeleton has another rest pose.
    pub rest_frame: Option<usize>,
    /// The factor for the translations of the hips.
    pub scale: HipsScale,
    /// The rotation from the axes of the source to those of the target; `None` to find it from where hips, head and
    /// legs are at rest.
    pub axes: Option<DQuat>,
}

/// How the rest poses of two skeletons are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RestAlignment {
    /// [`Directions`](Self::Directions) if the directions of a limb differ by more than 5°, otherwise
    /// [`Same`](Self::Same).
    #[default]
    Auto,
    /// The rest poses are the same: nothing is aligned.
    Same,
    /// The limbs of the target's rest pose are rotated to the directions that the source's limbs have at rest.
    Directions,
}

names! {
    RestAlignment, "alignment of rest poses",
    Auto => "auto",
    Same => "same",
    Directions => "directions",
}

/// The factor for the translations of the hips, since the skeletons may differ in size.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum HipsScale {
    /// The ratio of the heights of the hips above the lowest joint at rest.
    #[default]
    Hips,
    /// The ratio of the lengths of the legs.
    Legs,
    /// A number.
    Factor(f64),
}

/// How a motion was retargeted.
#[derive(Debug, Clone, PartialEq)]
pub struct RetargetReport {
    /// Joints of the target and the joints of the source that they follow, by names.
    pub pairs: Vec<(String, String)>,
    /// Joints of the target that keep their rest rotations.
    pub resting: Vec<String>,
    /// Joints of the source without a partner.
    pub dropped: Vec<String>,
    /// The dropped joint that rotates furthest from its rest pose, and this angle in degrees; `None` if all rest.
    pub furthest_dropped: Option<(String, f64)>,
    /// The joints of the target whose rest pose was aligned, each with the angle in degrees.
    pub aligned: Vec<(String, f64)>,
    /// The factor by which the translations of the hips were multiplied.
    pub scale: f64,
    /// The rotation from the axes of the source to those of the target.
    pub axes: DQuat,
    /// Whether `axes` was neither given nor found, and is the identity.
    pub are_axes_assumed: bool,
    /// For a source that is an SMPL body: the axis along which it stands on average, if this is not y and the clip does
    /// not state which axis points up. The motion was then rotated, so that y points up.
    pub stood_along: Option<DVec3>,
    /// The axes along which the source stands in its rest pose and, on average, in the motion, if these two differ.
    /// Then another pose must be used as the rest pose, such as one of the motion ([`RetargetOptions::rest_frame`]).
    pub rests_along: Option<[DVec3; 2]>,
    /// The translations that are lost: the largest distance of a joint of the source, other than the hips, from its
    /// rest position, in the source's unit.
    pub dropped_translation: f64,
    /// The largest angle in radians between the differences from rest of a joint and of its partner, caused by
    /// rounding.
    pub largest_difference: f64,
    /// For each hand and foot, by the name of the target's joint: its largest distance from the source's, both relative
    /// to the hips, in heights of the hips. Empty if a skeleton is not recognised.
    pub ends: Vec<(String, f64)>,
    /// The largest distance of a foot of the target below the lowest joint of the rest pose, in the target's unit; 0 if
    /// no foot is below it, or if the skeleton is not recognised.
    pub below_ground: f64,
}

/// An error of retargeting a motion.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RetargetError {
    /// A clip is no skeleton.
    #[error("the {which} has no skeleton; give a clip with joints, parents and offsets")]
    NoSkeleton {
        /// `source` or `target`.
        which: &'static str,
    },
    /// The names of a skeleton's joints are not known.
    #[error(
        "the joints of the {which} are not those of a known human skeleton: {}; pair them by `bones`",
        missing_text(missing)
    )]
    NotRecognised {
        /// `source` or `target`.
        which: &'static str,
        /// The roles without a joint.
        missing: Vec<&'static str>,
    },
    /// The positions of the source's joints are not known.
    #[error("{0}")]
    NoPositions(String),
    /// A joint in `bones` does not exist, or occurs twice.
    #[error("bones: the {which} has no joint `{name}`, or it is paired twice")]
    Bone {
        /// `source` or `target`.
        which: &'static str,
        /// The name.
        name: String,
    },
    /// There is no such key.
    #[error("rest frame: there is no frame {frame}; the source has {count}, from 0")]
    RestFrame {
        /// The number of the key.
        frame: usize,
        /// How many keys the source has.
        count: usize,
    },
    /// The scale is not a positive number.
    #[error("scale: {0} is not a number greater than 0")]
    Scale(f64),
    /// The keys of the source are at different times.
    #[error(transparent)]
    Keyed(#[from] KeyedError),
    /// The parents do not form a hierarchy.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
    /// The motion cannot be stored.
    #[error(transparent)]
    Track(#[from] TrackError),
}

/// Rotations and positions of joints.
struct Pose {
    rotations: Vec<DQuat>,
    positions: Vec<DVec3>,
}

/// A skeleton: joints parents first, and its rest pose in the world.
struct Rig<'a> {
    clip: &'a Motion,
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    order: Vec<usize>,
    rest: Pose,
}

impl<'a> Rig<'a> {
    fn new(clip: &'a Motion, which: &'static str) -> Result<Self, RetargetError> {
        if clip.skeleton.is_empty() {
            return Err(RetargetError::NoSkeleton { which });
        }
        let joints = clip.set.track_count();
        let mut rig = Self {
            clip,
            names: (0..joints)
                .map(|joint| clip.set.track_name(joint))
                .collect(),
            parents: clip.skeleton.iter().map(|joint| joint.parent).collect(),
            order: parents_first(clip, joints)?,
            rest: Pose {
                rotations: Vec::new(),
                positions: Vec::new(),
            },
        };
        rig.rest = rig.world(|joint| (rig.local_rest(joint), clip.rest_position(joint)));
        Ok(rig)
    }

    fn local_rest(&self, joint: usize) -> DQuat {
        let rest = self.clip.skeleton[joint].rest.rotation;
        rest.as_dquat().normalize()
    }

    fn world(&self, local: impl Fn(usize) -> (DQuat, DVec3)) -> Pose {
        let mut pose = Pose {
            rotations: vec![DQuat::IDENTITY; self.names.len()],
            positions: vec![DVec3::ZERO; self.names.len()],
        };
        for &joint in &self.order {
            let (rotation, position) = local(joint);
            (pose.rotations[joint], pose.positions[joint]) = match self.parents[joint] {
                None => (rotation, position),
                Some(parent) => (
                    pose.rotations[parent] * rotation,
                    pose.positions[parent] + pose.rotations[parent] * position,
                ),
            };
        }
        pose
    }

    /// The axis that points up: y or z, along which the joints at rest are further apart.
    fn up(&self) -> DVec3 {
        let extent = |axis: DVec3| {
            let along = self.rest.positions.iter().map(|point| point.dot(axis));
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        match extent(DVec3::Z) > extent(DVec3::Y) {
            true => DVec3::Z,
            false => DVec3::Y,
        }
    }

    fn named(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|joint| joint == name)
    }

    /// Places the rest pose on the ground, at height 0, with its root above the origin. This is necessary for SMPL
    /// bodies: their motion is relative to the ground, but the rest pose of the model has an arbitrary height.
    fn stand_on_ground(&mut self) {
        let root = { self.order.iter() }.find(|&&joint| self.parents[joint].is_none());
        let lowest = self.rest.positions.iter().map(|point| point.y);
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        if let Some(&root) = root {
            let DVec3 { x, z, .. } = self.rest.positions[root];
            for position in &mut self.rest.positions {
                *position -= DVec3::new(x, lowest, z);
            }
        }
    }
}

/// The indices of up to 64 samples of a motion, spread evenly.
fn some_of(samples: usize) -> impl Iterator<Item = usize> {
    (0..samples).step_by(samples.div_ceil(64).max(1))
}

/// The axis that a direction is nearest to.
fn nearest_axis(direction: DVec3) -> Option<DVec3> {
    let largest = direction.abs().max_element();
    let axis = DVec3::AXES
        .into_iter()
        .find(|axis| direction.dot(*axis).abs() == largest)?;
    (largest > 0.0).then(|| axis * direction.dot(axis).signum())
}

/// Reads the target skeleton. A glTF file needs no animations; its [`document`](Loaded::document) can be written with
/// other animations. For any other file, the skeleton is that of its first clip.
///
/// # Errors
/// When the file cannot be opened or is invalid, or has no skeleton.
pub fn open_target(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let format = Format::detected(path);
    if std::ptr::eq(format, &raw const gltf::FORMAT) {
        return gltf::open_skeleton(path, options);
    }
    let mut loaded = format.open(path, options)?;
    loaded.document = None;
    loaded.clips.truncate(1);
    match loaded.refused.pop().filter(|_| loaded.clips.is_empty()) {
        Some(refused) => Err(refused),
        None => Ok(loaded),
    }
}

/// Carries the keys of `source` over to the skeleton of `target`; times, rate, names and scalars of the clip are the
/// source's.
/// Joints of the target without a partner rest.
///
/// # Errors
/// A [`RetargetError`].
pub fn retarget(
    source: &Motion,
    target: &Motion,
    options: &RetargetOptions,
) -> Result<(Motion, RetargetReport), RetargetError> {
    let mut from = Rig::new(source, "source")?;
    let to = Rig::new(target, "target")?;
    if let Some(reason) = source.no_world.as_ref().filter(|_| source.lacks_offsets()) {
        return Err(RetargetError::NoPositions(reason.clone()));
    }
    let samples = keyed_tracks(source)?;
    let joints = from.names.len();
    let stored = |sample: usize, joint: usize| {
        let index = sample * joints + joint;
        let moved = samples.translations.get(index);
        let position = moved.map_or_else(
            || source.rest_position(joint),
            |&moved| source.origin(joint) + moved.as_dvec3(),
        );
        (samples.rotations[index].as_dquat().normalize(), position)
    };
    // The rest pose of a body model (SMPL) has y up, but its motion has the axes of the file's world. So the motion is
    // rotated to y up.
    let mut stood_along = None;
    let mut to_model = DQuat::IDENTITY;
    if let Some(body) = &source.body {
        let found = || {
            let roles = recognise(&from.names, &from.parents).ok()?;
            let poses = some_of(samples.times.len());
            let poses = poses.map(|sample| from.world(|joint| stored(sample, joint)).positions);
            stood_along = standing_axis(&roles, poses).filter(|axis| *axis != DVec3::Y);
            stood_along
        };
        let up = body.up.and_then(nearest_axis).or_else(found);
        let space = Space {
            up: up.unwrap_or(DVec3::Y),
            metres: 1.0,
        };
        to_model = UpAxis::Y.rotation_from(Some(space));
        from.stand_on_ground();
    }
    let local = |sample: usize, joint: usize| {
        let (rotation, position) = stored(sample, joint);
        match from.parents[joint] {
            None => (to_model * rotation, to_model * position),
            Some(_) => (rotation, position),
        }
    };
    if let Some(frame) = options.rest_frame {
        let count = samples.times.len();
        if frame >= count {
            return Err(RetargetError::RestFrame { frame, count });
        }
        let rest = from.world(|joint| local(frame, joint));
        from.rest = rest;
    }
    let roles = [&from, &to].map(|rig| recognise(&rig.names, &rig.parents));
    let pairs = match &options.bones[..] {
        [] => Pairs::by_roles(&from, &to, &roles)?,
        bones => Pairs::by_names(&from, &to, bones)?,
    };
    let [from_roles, to_roles] = roles.map(Result::ok);
    let found = || {
        Some(axes_of(&to, to_roles.as_ref()?)? * axes_of(&from, from_roles.as_ref()?)?.inverse())
    };
    let rests_along = || {
        let roles = from_roles.as_ref()?;
        let poses = some_of(samples.times.len());
        let poses = poses.map(|sample| from.world(|joint| local(sample, joint)).positions);
        let [at_rest, moving] = [
            standing_axis(roles, [&from.rest.positions])?,
            standing_axis(roles, poses)?,
        ];
        (at_rest != moving).then_some([at_rest, moving])
    };
    let rests_along = rests_along();
    let known_axes = options.axes.map(DQuat::normalize).or_else(found);
    let axes = known_axes.unwrap_or(DQuat::IDENTITY);
    let segments = pairs.segments(&to, to_roles.as_ref());
    let alignments = pairs.alignments(&from, &to, &segments, axes, options.rest);
    let scale = match options.scale {
        HipsScale::Factor(factor) if factor.is_finite() && factor > 0.0 => factor,
        HipsScale::Factor(factor) => return Err(RetargetError::Scale(factor)),
        HipsScale::Hips => pairs.height_ratio(&from, &to, axes),
        HipsScale::Legs => Pairs::leg_ratio(&from, &to, [from_roles.as_ref(), to_roles.as_ref()]),
    };
    let (mut rotations, mut hips) = (vec![Vec::new(); to.names.len()], Vec::new());
    let mut dropped_translation = 0f64;
    let mut ends = Ends::of(
        &from,
        &to,
        from_roles.as_ref(),
        to_roles.as_ref(),
        &pairs,
        axes,
    );
    let mut largest_difference = 0f64;
    for sample in 0..samples.times.len() {
        for joint in (0..joints).filter(|&joint| Some(joint) != pairs.hips.map(|hips| hips.1)) {
            let moved = (local(sample, joint).1 - source.rest_position(joint)).length();
            if from.parents[joint].is_some() {
                dropped_translation = dropped_translation.max(moved);
            }
        }
        let now = from.world(|joint| local(sample, joint));
        let mut world = vec![DQuat::IDENTITY; to.names.len()];
        for &joint in &to.order {
            let above = to.parents[joint].map_or(DQuat::IDENTITY, |parent| world[parent]);
            world[joint] = match pairs.source_of[joint] {
                None => above * to.local_rest(joint),
                Some(partner) => {
                    let from_rest = now.rotations[partner] * from.rest.rotations[partner].inverse();
                    let difference = axes * from_rest * axes.inverse();
                    (difference * alignments[joint] * to.rest.rotations[joint]).normalize()
                }
            };
            if let Some(partner) = pairs.source_of[joint] {
                let key = (above.inverse() * world[joint]).normalize().as_quat();
                rotations[joint].push(key);
                let from_rest = now.rotations[partner] * from.rest.rotations[partner].inverse();
                let stored = above * key.as_dquat() * to.rest.rotations[joint].inverse();
                let kept = stored * alignments[joint].inverse();
                let off = kept * (axes * from_rest * axes.inverse()).inverse();
                largest_difference =
                    largest_difference.max(2.0 * libm::asin(off.xyz().length().min(1.0)));
            }
        }
        if let Some((joint, partner)) = pairs.hips {
            let moved = now.positions[partner] - from.rest.positions[partner];
            let position = to.rest.positions[joint] + scale * (axes * moved);
            // The joints above the hips stay in their rest poses.
            hips.push(match to.parents[joint] {
                None => position,
                Some(parent) => {
                    to.rest.rotations[parent].inverse() * (position - to.rest.positions[parent])
                }
            });
        }
        ends.add(
            &now,
            &posed(&to, &world, hips.last().copied().zip(pairs.hips)),
        );
    }
    let mut motion = Motion {
        name: source.name.clone(),
        rate: source.rate,
        time_offset: source.time_offset,
        channels: Vec::new(),
        ..target.without_tracks()
    };
    for (joint, keys) in rotations.iter().enumerate() {
        let name = &*to.names[joint];
        let rest = [to.local_rest(joint).as_quat()];
        let (times, keys) = match keys.is_empty() {
            true => (samples.times.get(..1).unwrap_or(&[0.0]), &rest[..]),
            false => (&samples.times[..], &keys[..]),
        };
        motion.set.push(name, times, keys)?;
    }
    if let Some((joint, _)) = pairs.hips {
        motion.set_positions(joint, &samples.times, &hips)?;
    }
    let mut motion = motion.with_scalars_of(source, 1.0)?;
    if let Some(body) = &mut motion.body {
        // The motion was rotated to the axes of the model, in which y is up.
        body.up = Some(DVec3::Y);
    }
    if !source.channels.is_empty() {
        let channel = |partner: &Option<usize>| {
            let partner = partner.map_or(Channels::default(), |partner| source.channel(partner));
            Channels {
                scale: None,
                ..partner
            }
        };
        motion.channels = pairs.source_of.iter().map(channel).collect();
    }
    let aligned = alignments
        .iter()
        .enumerate()
        .filter_map(|(joint, rotation)| {
            let angle = 2.0 * libm::acos(rotation.w.abs().min(1.0));
            (angle > 1e-9).then(|| (to.names[joint].clone(), angle.to_degrees()))
        });
    let used = |joint: &usize| pairs.source_of.contains(&Some(*joint));
    let furthest = |joint: usize| {
        let rest = source.skeleton[joint].rest.rotation.as_dquat().normalize();
        let samples = 0..samples.times.len();
        let angles = samples.map(|sample| angle_between(local(sample, joint).0, rest));
        angles.fold(0.0, f64::max).to_degrees()
    };
    let furthest_dropped = (0..joints)
        .filter(|joint| !used(joint))
        .map(|joint| (from.names[joint].clone(), furthest(joint)))
        .max_by(|(_, one), (_, other)| one.total_cmp(other))
        .filter(|(_, angle)| *angle > RESTS);
    let report = RetargetReport {
        pairs: pairs.named(&from, &to),
        resting: (0..to.names.len())
            .filter(|&joint| pairs.source_of[joint].is_none())
            .map(|joint| to.names[joint].clone())
            .collect(),
        dropped: (0..joints)
            .filter(|joint| !used(joint))
            .map(|joint| from.names[joint].clone())
            .collect(),
        furthest_dropped,
        aligned: aligned.collect(),
        scale,
        axes,
        are_axes_assumed: known_axes.is_none(),
        stood_along,
        rests_along,
        dropped_translation,
        largest_difference,
        below_ground: ends.below_ground,
        ends: ends.distances(&to),
    };
    Ok((motion, report))
}

/// The maximum rotation in degrees of a joint that counts as resting; rounded keys rotate by less.
const RESTS: f64 = 0.01;

/// Where the joints of the target are with these rotations in the world, and the hips at this position in their parent.
fn posed(to: &Rig<'_>, world: &[DQuat], hips: Option<(DVec3, (usize, usize))>) -> Pose {
    let mut positions = vec![DVec3::ZERO; world.len()];
    for &joint in &to.order {
        let local = match hips {
            Some((position, (moved, _))) if moved == joint => position,
            _ => to.clip.rest_position(joint),
        };
        positions[joint] = match to.parents[joint] {
            None => local,
            Some(parent) => positions[parent] + world[parent] * local,
        };
    }
    Pose {
        rotations: world.to_vec(),
        positions,
    }
}

/// Where hands and feet are, compared between source and target.
struct Ends {
    axes: DQuat,
    /// The hips of the source and of the target, and their heights above the ground.
    hips: [(usize, f64); 2],
    up: DVec3,
    /// The height of the target's lowest joint at rest.
    ground: f64,
    /// Hands and feet: of the source and of the target, whether it is a foot, and the largest distance so far.
    all: Vec<([usize; 2], bool, f64)>,
    below_ground: f64,
}

impl Ends {
    fn of(
        from: &Rig<'_>,
        to: &Rig<'_>,
        from_roles: Option<&Roles>,
        to_roles: Option<&Roles>,
        pairs: &Pairs,
        axes: DQuat,
    ) -> Self {
        let up = axes * from.up();
        let lowest = |rig: &Rig<'_>, up: DVec3| {
            let heights = rig.rest.positions.iter().map(|point| point.dot(up));
            heights.fold(f64::INFINITY, f64::min)
        };
        let (joint, partner) = pairs.hips.unwrap_or_default();
        let ground = lowest(to, up);
        let heights = [
            from.rest.positions[partner].dot(from.up()) - lowest(from, from.up()),
            to.rest.positions[joint].dot(up) - ground,
        ];
        let roles = [
            Role::LeftHand,
            Role::RightHand,
            Role::LeftFoot,
            Role::RightFoot,
        ];
        let paired = |role: Role| {
            let both = [from_roles?.joint(role)?, to_roles?.joint(role)?];
            let is_foot = matches!(role, Role::LeftFoot | Role::RightFoot);
            Some((both, is_foot, 0.0))
        };
        let are_high = pairs.hips.is_some() && heights.iter().all(|&height| height > 0.0);
        Self {
            axes,
            hips: [(partner, heights[0]), (joint, heights[1])],
            up,
            ground,
            all: roles
                .into_iter()
                .filter(|_| are_high)
                .filter_map(paired)
                .collect(),
            below_ground: 0.0,
        }
    }

    /// Compares the poses of a sample.
    fn add(&mut self, source: &Pose, target: &Pose) {
        let [(of_source, source_height), (of_target, target_height)] = self.hips;
        for ([partner, joint], is_foot, largest) in &mut self.all {
            let from = (source.positions[*partner] - source.positions[of_source]) / source_height;
            let to = (target.positions[*joint] - target.positions[of_target]) / target_height;
            *largest = largest.max((to - self.axes * from).length());
            if *is_foot {
                let below = self.ground - target.positions[*joint].dot(self.up);
                self.below_ground = self.below_ground.max(below);
            }
        }
    }

    fn distances(&self, to: &Rig<'_>) -> Vec<(String, f64)> {
        let all = self.all.iter();
        all.map(|([_, joint], _, largest)| (to.names[*joint].clone(), *largest))
            .collect()
    }
}

/// The axes of a skeleton, from the positions of its parts at rest: left, up and forward as columns, each along an axis
/// of the coordinates. `None` if left and up are not clear.
fn axes_of(rig: &Rig<'_>, roles: &Roles) -> Option<DQuat> {
    let at = |role| roles.joint(role).map(|joint| rig.rest.positions[joint]);
    let up = nearest_axis(at(Role::Head)? - at(Role::Hips)?)?;
    let left = nearest_axis(at(Role::LeftUpperLeg)? - at(Role::RightUpperLeg)?)?;
    (up.dot(left) == 0.0).then(|| DQuat::from_mat3(&DMat3::from_cols(left, up, left.cross(up))))
}

/// The limb, or the trunk, whose direction at rest differs most from the direction in a T-pose with y up that faces z:
/// its first and its last joint, and the angle in degrees. The rotations of the joints at rest are ignored.
#[must_use]
pub fn furthest_from_t_pose(clip: &Motion, roles: &Roles) -> Option<([usize; 2], f64)> {
    let limbs = [
        (Role::Hips, Role::Head, DVec3::Y),
        (Role::LeftUpperArm, Role::LeftHand, DVec3::X),
        (Role::RightUpperArm, Role::RightHand, DVec3::NEG_X),
        (Role::LeftUpperLeg, Role::LeftFoot, DVec3::NEG_Y),
        (Role::RightUpperLeg, Role::RightFoot, DVec3::NEG_Y),
    ];
    let angles = limbs.into_iter().filter_map(|(first, last, expected)| {
        let (first, last) = (roles.joint(first)?, roles.joint(last)?);
        let (mut joint, mut along) = (last, DVec3::ZERO);
        for _ in 0..clip.skeleton.len() {
            if joint == first {
                break;
            }
            along += clip.rest_position(joint);
            joint = clip.skeleton.get(joint)?.parent?;
        }
        let angle = libm::atan2(along.cross(expected).length(), along.dot(expected));
        Some(([first, last], angle.to_degrees()))
    });
    angles.max_by(|(_, one), (_, other)| one.total_cmp(other))
}

/// Which joint follows which.
struct Pairs {
    /// The joint of the source for each joint of the target.
    source_of: Vec<Option<usize>>,
    /// The hips of the target and of the source: the target's hips follow the path of the source's.
    hips: Option<(usize, usize)>,
}

impl Pairs {
    fn new(to: &Rig<'_>, source_of: Vec<Option<usize>>) -> Self {
        // The first joint from the root on that has a partner.
        let first = to.order.iter();
        let hips = { first }.find_map(|&joint| Some((joint, source_of[joint]?)));
        Self { source_of, hips }
    }

    /// Pairs the joints of both skeletons that have the same role; and, below these, joints without a role that have
    /// the same name.
    fn by_roles(
        from: &Rig<'_>,
        to: &Rig<'_>,
        [from_roles, to_roles]: &[Result<Roles, Vec<&'static str>>; 2],
    ) -> Result<Self, RetargetError> {
        let refused = |which, missing: &Vec<&'static str>| RetargetError::NotRecognised {
            which,
            missing: missing.clone(),
        };
        let from_roles = from_roles
            .as_ref()
            .map_err(|missing| refused("source", missing))?;
        let to_roles = to_roles
            .as_ref()
            .map_err(|missing| refused("target", missing))?;
        let mut source_of = vec![None; to.names.len()];
        for role in Role::ALL {
            if let Some(joint) = to_roles.joint(role) {
                source_of[joint] = from_roles.joint(role);
            }
        }
        let mut pairs = Self::new(to, source_of);
        // From the root on, so that fingers below a thumb find their partners too.
        for &joint in &to.order {
            let is_only = |rig: &Rig<'_>, name: &String| {
                rig.names.iter().filter(|other| *other == name).count() == 1
            };
            let name = &to.names[joint];
            let partner = from.named(name).filter(|partner| {
                let above = pairs
                    .above(to, joint)
                    .and_then(|above| pairs.source_of[above]);
                let is_used = pairs.source_of.contains(&Some(*partner));
                !is_used && above.is_some() && above == pairs.used_above(from, *partner)
            });
            let is_free = pairs.source_of[joint].is_none();
            if is_free && is_only(to, name) && is_only(from, name) {
                pairs.source_of[joint] = partner;
            }
        }
        Ok(pairs)
    }

    /// The nearest joint above one of the source that a joint of the target follows.
    fn used_above(&self, from: &Rig<'_>, joint: usize) -> Option<usize> {
        let mut above = from.parents[joint];
        while let Some(next) = above.filter(|next| !self.source_of.contains(&Some(*next))) {
            above = from.parents[next];
        }
        above
    }

    /// The joints of `bones`: names of the target's and of the source's.
    fn by_names(
        from: &Rig<'_>,
        to: &Rig<'_>,
        bones: &[(String, String)],
    ) -> Result<Self, RetargetError> {
        let mut source_of = vec![None; to.names.len()];
        for (target, source) in bones {
            let unknown = |which, name: &String| RetargetError::Bone {
                which,
                name: name.clone(),
            };
            let joint = to.named(target).ok_or_else(|| unknown("target", target))?;
            let partner = from
                .named(source)
                .ok_or_else(|| unknown("source", source))?;
            if source_of[joint].replace(partner).is_some() {
                return Err(unknown("target", target));
            }
        }
        Ok(Self::new(to, source_of))
    }

    fn named(&self, from: &Rig<'_>, to: &Rig<'_>) -> Vec<(String, String)> {
        let pairs = self.source_of.iter().enumerate();
        let pairs = pairs.filter_map(|(joint, partner)| Some((joint, (*partner)?)));
        let names = |(joint, partner): (usize, usize)| {
            (to.names[joint].clone(), from.names[partner].clone())
        };
        pairs.map(names).collect()
    }

    /// The nearest ancestor that has a partner.
    fn above(&self, to: &Rig<'_>, joint: usize) -> Option<usize> {
        let mut above = to.parents[joint];
        while let Some(next) = above.filter(|&next| self.source_of[next].is_none()) {
            above = to.parents[next];
        }
        above
    }

    /// The joint at the other end of each limb's part, for the joints of the target that have one. Without roles, parts
    /// with one paired joint below them are limbs, from where the skeleton branches on.
    fn segments(&self, to: &Rig<'_>, roles: Option<&Roles>) -> Vec<Option<usize>> {
        let mut segments = vec![None; to.names.len()];
        if let Some(roles) = roles {
            for role in Role::ALL {
                if let (Some(joint), Some(end)) = (roles.joint(role), role.limb_end()) {
                    segments[joint] = roles
                        .joint(end)
                        .filter(|&end| self.source_of[end].is_some());
                }
            }
            return segments;
        }
        let mut below = vec![Vec::new(); to.names.len()];
        for joint in (0..to.names.len()).filter(|&joint| self.source_of[joint].is_some()) {
            if let Some(above) = self.above(to, joint) {
                below[above].push(joint);
            }
        }
        for (segment, below) in segments.iter_mut().zip(&below) {
            if let [end] = below[..] {
                *segment = Some(end);
            }
        }
        segments
    }

    /// The rotation in the world that aligns each joint of the target with the source's rest pose.
    fn alignments(
        &self,
        from: &Rig<'_>,
        to: &Rig<'_>,
        segments: &[Option<usize>],
        axes: DQuat,
        rest: RestAlignment,
    ) -> Vec<DQuat> {
        let mut alignments = vec![DQuat::IDENTITY; to.names.len()];
        if rest == RestAlignment::Same {
            return alignments;
        }
        let of_segment = |joint: usize| {
            let end = segments[joint]?;
            let (start_partner, end_partner) = (self.source_of[joint]?, self.source_of[end]?);
            let direction = |pose: &Pose, a: usize, b: usize| pose.positions[b] - pose.positions[a];
            let target = direction(&to.rest, joint, end);
            let source = axes * direction(&from.rest, start_partner, end_partner);
            (target.length() > 0.0 && source.length() > 0.0)
                .then(|| rotation_between(target, source))
        };
        let found: Vec<Option<DQuat>> = (0..to.names.len()).map(of_segment).collect();
        // The cosine of half of 5°.
        let is_large = |rotation: &DQuat| rotation.w < 0.999_048_221_581_857_8;
        if rest == RestAlignment::Auto && !found.iter().flatten().any(is_large) {
            return alignments;
        }
        for &joint in &to.order {
            if self.source_of[joint].is_none() {
                continue;
            }
            // Joints below a part of a limb, such as a hand, are oriented as the part is.
            let above = self.above(to, joint).map(|above| alignments[above]);
            alignments[joint] = found[joint].or(above).unwrap_or_default();
        }
        alignments
    }

    fn height_ratio(&self, from: &Rig<'_>, to: &Rig<'_>, axes: DQuat) -> f64 {
        let Some((joint, partner)) = self.hips else {
            return 1.0;
        };
        let height = |rig: &Rig<'_>, hips: usize, up: DVec3| {
            let heights = rig.rest.positions.iter().map(|point| point.dot(up));
            rig.rest.positions[hips].dot(up) - heights.fold(f64::INFINITY, f64::min)
        };
        let up = from.up();
        let [source, target] = [height(from, partner, up), height(to, joint, axes * up)];
        match source > 0.0 && target > 0.0 {
            true => target / source,
            false => 1.0,
        }
    }

    fn leg_ratio(from: &Rig<'_>, to: &Rig<'_>, roles: [Option<&Roles>; 2]) -> f64 {
        let length = |rig: &Rig<'_>, roles: &Roles| {
            let at = |role| roles.joint(role).map(|joint| rig.rest.positions[joint]);
            let leg = [Role::LeftUpperLeg, Role::LeftLowerLeg, Role::LeftFoot].map(at);
            let [upper, lower, foot] = leg;
            Some((lower? - upper?).length() + (foot? - lower?).length())
        };
        let [source, target] = roles;
        let lengths = (
            source.and_then(|it| length(from, it)),
            target.and_then(|it| length(to, it)),
        );
        match lengths {
            (Some(source), Some(target)) if source > 0.0 && target > 0.0 => target / source,
            _ => 1.0,
        }
    }
}
