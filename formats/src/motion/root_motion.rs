//! Removes the motion over the ground from a sampled clip, or gives it to a new joint that carries the root.

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::{Channel, Engine, Error, SampleTimes, TrackError, names};

use crate::learning::heading::Ground;
use crate::learning::root_motion::{HeadingSource, RootMotion};
use crate::motion::origin::relative;
use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::similarity::Similarity;
use crate::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform, WrittenJoint};

/// The treatment of the motion over the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum RootMotionRule {
    /// The root keeps it.
    #[default]
    Keep,
    /// It is removed: the root stays above the origin, and faces heading 0.
    InPlace,
    /// A new joint, [`ROOT_MOTION`], gets it and carries the root. The poses in the world stay the same.
    Extract,
}

names! {
    RootMotionRule, "root motion",
    Keep => "keep",
    InPlace => "in-place",
    Extract => "extract",
}

/// The name of the joint with the extracted motion.
pub const ROOT_MOTION: &str = "root_motion";

/// How the motion over the ground is found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RootMotionOptions {
    /// The axis that points up.
    pub ground: Ground,
    /// The heading of the root.
    pub heading: HeadingSource,
    /// The name of the root. By default the root is the joint that moves and whose ancestors do not.
    pub joint: Option<String>,
}

/// Why the motion over the ground cannot be removed from the root.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RootMotionError {
    /// No joint has translations.
    #[error("no joint has keys of translations, so that nothing moves over the ground")]
    NoRoot,
    /// Several joints move independently of each other.
    #[error("several joints move on their own: {names}; name the root")]
    SeveralRoots {
        /// Their names.
        names: String,
    },
    /// No joint has the name in the options.
    #[error("no joint is called `{name}`")]
    NoJoint {
        /// The name.
        name: String,
    },
    /// Joints whose poses are relative to the world cannot be carried by another.
    #[error(
        "the poses of its {tracks} joints are in the world and not relative to a root; write it as GLB or BVH first"
    )]
    World {
        /// Number of joints.
        tracks: usize,
    },
    /// An ancestor has a scale that differs between axes.
    #[error("`{name}`, an ancestor of the root, is scaled differently along its axes")]
    Scale {
        /// The name of the ancestor.
        name: String,
    },
    /// The joint of the extracted motion could not be added.
    #[error(transparent)]
    Track(#[from] TrackError),
}

/// Applies a rule for the motion over the ground to a sampled clip. By [`RootMotionRule::InPlace`] and by
/// [`RootMotionRule::Extract`] the root gets the same samples. By `Extract`, poses in the world change by the rounding of
/// f32 at most: 3e-7 rad, and 3e-7 of the farthest position.
///
/// # Errors
/// A [`RootMotionError`].
pub fn with_root_motion(
    clip: &Motion,
    samples: &Samples,
    options: &RootMotionOptions,
    rule: RootMotionRule,
) -> Result<(Motion, Samples), RootMotionError> {
    let (mut clip, mut samples) = (clip.clone(), samples.clone());
    if rule == RootMotionRule::Keep {
        return Ok((clip, samples));
    }
    let tracks = clip.set.track_count();
    let root = root_joint(&clip, options)?;
    if clip.is_world && tracks > 1 {
        return Err(RootMotionError::World { tracks });
    }
    let frames = samples.times.len();
    let parents: Vec<Similarity> = (0..frames)
        .map(|frame| parent_in_world(&clip, &samples, frame, root))
        .collect::<Result<_, _>>()?;
    let origin = clip.origin(root);
    let local = |frame: usize| {
        let at = frame * tracks + root;
        let position = origin + samples.translations[at].as_dvec3();
        (position, samples.rotations[at].as_dquat().normalize())
    };
    let in_world = |frame: usize| {
        let ((position, rotation), parent) = (local(frame), parents[frame]);
        (parent.point(position), parent.rotation * rotation)
    };
    let (positions, rotations): (Vec<DVec3>, Vec<DQuat>) = (0..frames).map(in_world).unzip();
    let motion = RootMotion::of(&positions, &rotations, options.ground, options.heading);
    // The pose of the joint between the root and its parent, rounded as it is stored.
    let carried = |frame: usize| {
        let parent = parents[frame];
        let moved = motion.restored(frame, parent.position, parent.rotation);
        let rotation = parent.rotation.conjugate() * moved.1;
        (parent.point_back(moved.0), rotation.normalize())
    };
    let (carried, headings): (Vec<DVec3>, Vec<DQuat>) = (0..frames).map(carried).unzip();
    let (carrier_origin, positions) = relative(&carried);
    let carrier = Carrier {
        origin: carrier_origin,
        positions,
        rotations: headings.iter().map(|heading| heading.as_quat()).collect(),
    };
    let rest = |frame: usize| {
        let (position, rotation) = local(frame);
        let back = carrier.rotations[frame].as_dquat().normalize().conjugate();
        let carried = carrier.origin + carrier.positions[frame].as_dvec3();
        (back * (position - carried), (back * rotation).normalize())
    };
    let (points, rotations): (Vec<DVec3>, Vec<DQuat>) = (0..frames).map(rest).unzip();
    let (origin, points) = relative(&points);
    for (frame, (point, rotation)) in points.iter().zip(&rotations).enumerate() {
        let at = frame * tracks + root;
        samples.translations[at] = *point;
        samples.rotations[at] = rotation.as_quat();
    }
    clip.set_origin(root, origin);
    if let Some(channels) = clip.channels.get_mut(root) {
        channels.rotation = Some(ChannelInterpolation::Linear);
        channels.translation = Some(ChannelInterpolation::Linear);
    }
    match rule {
        RootMotionRule::Extract => carrier.added(&clip, &samples, root),
        _ => Ok((clip, samples)),
    }
}

/// The samples of a clip at the key times of its tracks.
///
/// # Errors
/// As [`Engine::evaluate`].
pub fn track_samples(clip: &Motion, engine: &Engine) -> Result<Samples, Error> {
    let times = SampleTimes::at(clip.track_key_times());
    ChannelMethods::AUTHORED.sample(engine, clip, &times)
}

/// Applies a rule for the motion over the ground to samples of a clip ([`track_samples`]), and returns a clip with the
/// results as the keys of its tracks. Scalars keep their keys; cubic splines become lines.
///
/// # Errors
/// As [`with_root_motion`].
pub fn keys_with_root_motion(
    clip: &Motion,
    samples: &Samples,
    options: &RootMotionOptions,
    rule: RootMotionRule,
) -> Result<Motion, RootMotionError> {
    let (treated, samples) = with_root_motion(clip, samples, options, rule)?;
    let keyed = treated.with_track_keys(&samples)?;
    Ok(Motion {
        rate: clip.rate,
        ..keyed.with_scalars_of(clip, 1.0)?
    })
}

impl Motion {
    /// Whether other keys, near 0, can replace the keys of a root's rotation and position.
    #[must_use]
    pub fn root_has_keys(&self, root: usize) -> bool {
        let channels = self.channels.get(root);
        let is_step = channels.is_some_and(|channels| {
            [channels.rotation, channels.translation].contains(&Some(ChannelInterpolation::Step))
        });
        let rotations = self.set.track(root).times.len();
        let positions = self.set.vector_keys(Channel::Translation, root);
        let positions = positions.map_or(0, |keys| keys.times.len());
        !is_step && rotations > 1 && positions > 1 && self.origin(root) == DVec3::ZERO
    }
}

/// The joint that moves over the ground.
///
/// # Errors
/// When no joint has keys of translations, when several joints move independently and `options` name none, or when the
/// named joint does not exist or has no such keys.
pub fn root_joint(clip: &Motion, options: &RootMotionOptions) -> Result<usize, RootMotionError> {
    let tracks = 0..clip.set.track_count();
    let keys = |track: usize| clip.set.vector_keys(Channel::Translation, track);
    if let Some(name) = &options.joint {
        let named = tracks
            .clone()
            .find(|&track| clip.set.track_name(track) == *name);
        let name = name.clone();
        let track = named.ok_or(RootMotionError::NoJoint { name })?;
        return keys(track).map(|_| track).ok_or(RootMotionError::NoRoot);
    }
    let moves = |track: usize| {
        keys(track).is_some_and(|keys| keys.keys.iter().any(|key| *key != keys.keys[0]))
    };
    let mut candidates: Vec<usize> = tracks.clone().filter(|&track| moves(track)).collect();
    if candidates.is_empty() {
        candidates = tracks.filter(|&track| keys(track).is_some()).collect();
    }
    let all = candidates.clone();
    candidates.retain(|&track| {
        let above = clip.with_ancestors(&[track]);
        !above
            .iter()
            .any(|&other| other != track && all.contains(&other))
    });
    match candidates[..] {
        [] => Err(RootMotionError::NoRoot),
        [root] => Ok(root),
        _ => {
            let names = candidates
                .iter()
                .map(|&track| format!("`{}`", clip.set.track_name(track)));
            let names = names.collect::<Vec<_>>().join(", ");
            Err(RootMotionError::SeveralRoots { names })
        }
    }
}

/// The pose of the root's parent in the world, at a sample.
fn parent_in_world(
    clip: &Motion,
    samples: &Samples,
    frame: usize,
    root: usize,
) -> Result<Similarity, RootMotionError> {
    let parent = |track: usize| clip.skeleton.get(track).and_then(|joint| joint.parent);
    let mut chain: Vec<usize> = Vec::new();
    let mut next = parent(root).filter(|_| !clip.is_world);
    while let Some(track) = next.filter(|track| !chain.contains(track)) {
        chain.push(track);
        next = parent(track);
    }
    chain
        .iter()
        .rev()
        .try_fold(Similarity::IDENTITY, |above, &track| {
            let local = Similarity::of_joint(clip, samples, frame, track);
            local.map(|local| above.then(local)).ok_or_else(|| {
                let name = clip.set.track_name(track);
                RootMotionError::Scale { name }
            })
        })
}

/// The samples of the joint that carries the root.
struct Carrier {
    origin: DVec3,
    positions: Vec<Vec3>,
    rotations: Vec<Quat>,
}

impl Carrier {
    /// Adds this joint to a clip: as the first track, between the root and its parent.
    fn added(
        self,
        clip: &Motion,
        samples: &Samples,
        root: usize,
    ) -> Result<(Motion, Samples), RootMotionError> {
        let tracks = clip.set.track_count();
        let mut all = clip.with_track_keys(samples)?;
        all.set.push(ROOT_MOTION, &samples.times, &self.rotations)?;
        all.set
            .set_translations(tracks, &samples.times, &self.positions, &[])?;
        all.set_origin(tracks, self.origin);
        if all.skeleton.is_empty() {
            let rest = Transform::default();
            all.skeleton = vec![Joint { parent: None, rest }; tracks];
        }
        let parent = all.skeleton[root].parent.replace(tracks);
        let rest = Transform::default();
        all.skeleton.push(Joint { parent, rest });
        if !all.channels.is_empty() {
            all.channels.push(Channels {
                rotation: Some(ChannelInterpolation::Linear),
                translation: Some(ChannelInterpolation::Linear),
                scale: None,
            });
        }
        if !all.written_joints.is_empty() {
            all.written_joints.push(WrittenJoint::default());
        }
        all.is_world = false;
        // The body shape of SMPL determines the position of the first joint, which is another joint now.
        all.body = None;
        all.robot = None;
        let order: Vec<usize> = std::iter::once(tracks).chain(0..tracks).collect();
        let all = all.with_scalars_of(clip, 1.0)?.select(&order)?;
        let with = |list: &[Vec3], first: &dyn Fn(usize) -> Vec3| -> Vec<Vec3> {
            let rows = list.chunks_exact(tracks).enumerate();
            rows.flat_map(|(frame, row)| std::iter::once(first(frame)).chain(row.iter().copied()))
                .collect()
        };
        let rotations = samples.rotations.chunks_exact(tracks).zip(&self.rotations);
        let rotations =
            rotations.flat_map(|(row, &first)| std::iter::once(first).chain(row.iter().copied()));
        let samples = Samples {
            times: samples.times.clone(),
            rotations: rotations.collect(),
            translations: with(&samples.translations, &|frame| self.positions[frame]),
            scales: with(&samples.scales, &|_| Vec3::ONE),
            scalars: samples.scalars.clone(),
        };
        Ok((all, samples))
    }
}
