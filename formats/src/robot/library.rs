//! The clips of a robot for a library of motions: every clip gets the same tracks, which the robot's bodies follow.

use glam::{DVec3, Quat, Vec3};
use tumble::trees::{BodyPose, JointKind, JointTracks, Tree, TreeError, TreeFrames};
use tumble::{Channel, Skeleton, SkeletonError, TrackError, TrackSet};

use crate::motion::scalar_tracks::ScalarTracks;
use crate::motion::{Motion, carry_key_data};

/// The largest angle of a hinge in a library, in radians: f32 has angles of this size in steps of 5e-4 rad.
pub const LARGEST_ANGLE: f64 = 4096.0;

/// Which track of each clip moves each joint of a robot. The joints have the robot's names
/// ([`Robot::assign`](crate::robot::Robot::assign)). Joints that a clip does not have rest in it.
#[derive(Debug, Clone)]
pub struct RobotTracks<'a> {
    tree: &'a Tree,
    /// Tracks of rotations, each with its name and its rest pose. The first track is the base, if a clip moves the
    /// base.
    moving: Vec<(String, BodyPose)>,
    has_base: bool,
    scalars: ScalarTracks,
}

/// Why a clip cannot be part of a robot's library.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RobotClipError {
    /// A hinge is turned too far.
    #[error(
        "joint `{joint}` reaches {angle:.1} rad; a library of robots has angles up to {LARGEST_ANGLE} rad"
    )]
    LargeAngle {
        /// The joint.
        joint: String,
        /// The angle by which its body is rotated.
        angle: f64,
    },
    /// The keys are none of a set.
    #[error(transparent)]
    Keys(#[from] TrackError),
}

impl<'a> RobotTracks<'a> {
    /// The tracks for some clips.
    #[must_use]
    pub fn new(tree: &'a Tree, clips: &[Motion]) -> Self {
        let rest = tree.rest();
        let named = |kind: JointKind| {
            let joints = tree.joints().filter(move |joint| joint.kind == kind);
            joints.map(|joint| joint.name.clone())
        };
        let base = tree.bodies().first().filter(|_| tree.counts().free == 0);
        let base = base.filter(|body| {
            clips
                .iter()
                .any(|clip| track_of(&clip.set, &body.name).is_some())
        });
        let base = base.map(|body| (body.name.clone(), rest.base));
        let free = named(JointKind::Free).zip(rest.free.iter().copied());
        let still = |rotation| BodyPose {
            rotation,
            ..BodyPose::IDENTITY
        };
        let balls = named(JointKind::Ball).zip(rest.balls.iter().map(|&ball| still(ball)));
        let names = tree.scalar_joints().map(|joint| joint.name.clone());
        Self {
            tree,
            has_base: base.is_some(),
            moving: base.into_iter().chain(free).chain(balls).collect(),
            scalars: ScalarTracks::new(names.collect(), clips),
        }
    }

    /// The tracks of a library, none of which has a parent.
    ///
    /// # Errors
    /// Never, for a tree with a joint.
    pub fn skeleton(&self) -> Result<Skeleton, SkeletonError> {
        let count = (self.moving.len() + self.scalars.track_count()).max(1);
        Skeleton::new(vec![None; count], vec![Vec3::ZERO; count])
    }

    /// The bodies that follow the tracks, as [`Tree::frames`].
    ///
    /// # Errors
    /// As there.
    pub fn frames(&self, bodies: &[usize], points: &[DVec3]) -> Result<TreeFrames, TreeError> {
        let counts = self.tree.counts();
        let first = u32::from(self.has_base);
        let mut next = first..;
        let of_scalars = self.moving.len() as u32;
        let scalar =
            |[track, coordinate]: [usize; 2]| [of_scalars + track as u32, coordinate as u32];
        let tracks = JointTracks {
            base: self.has_base.then_some(0),
            free: next.by_ref().take(counts.free).collect(),
            balls: next.by_ref().take(counts.balls).collect(),
            scalars: self.scalars.coordinates().map(scalar).collect(),
        };
        self.tree.frames(&tracks, bodies, points)
    }

    /// The tracks of a clip.
    ///
    /// # Errors
    /// When a hinge is turned by more than [`LARGEST_ANGLE`].
    pub fn set(&self, clip: &Motion) -> Result<TrackSet, RobotClipError> {
        self.check_angles(clip)?;
        let mut set = TrackSet::new();
        let start = clip.set.time_span().map_or(0.0, |(first, _)| first);
        for (name, rest) in &self.moving {
            let (index, position) = (set.track_count(), rest.position.as_vec3());
            let Some(track) = track_of(&clip.set, name) else {
                set.push("", &[start], &[rest.rotation.as_quat()])?;
                set.set_translations(index, &[start], &[position], &[])?;
                continue;
            };
            let keys = clip.set.track(track);
            set.push("", keys.times, keys.keys)?;
            carry_key_data(&mut set, index, &keys, 0..keys.keys.len())?;
            let Some(at) = clip.set.vector_keys(Channel::Translation, track) else {
                set.set_translations(index, &keys.times[..1], &[position], &[])?;
                continue;
            };
            let origin = clip.origin(track);
            let moved = at
                .keys
                .iter()
                .map(|key| (key.as_dvec3() + origin).as_vec3());
            set.set_translations(index, at.times, &moved.collect::<Vec<_>>(), at.tangents)?;
        }
        let rest = self.tree.rest();
        self.scalars
            .add_to(&mut set, clip, |scalar| rest.scalars[scalar])?;
        if set.track_count() == 0 {
            // A robot without joints.
            set.push("", &[start], &[Quat::IDENTITY])?;
        }
        Ok(set)
    }

    fn check_angles(&self, clip: &Motion) -> Result<(), RobotClipError> {
        let joints = self.tree.scalar_values();
        for (joint, scalar, [multiplier, offset]) in joints {
            let index = clip.set.scalar_named(&self.scalars.names()[scalar]);
            let Some(index) = index.filter(|_| joint.kind == JointKind::Hinge) else {
                continue;
            };
            let origin = clip.scalar(index).origin;
            let keys = clip.set.scalar(index).map_or(&[][..], |scalar| scalar.keys);
            let angle =
                |&key: &f32| multiplier * (f64::from(key) + origin) + offset - joint.reference;
            let largest = keys
                .iter()
                .map(angle)
                .max_by(|a, b| a.abs().total_cmp(&b.abs()));
            if let Some(angle) = largest.filter(|angle| angle.abs() > LARGEST_ANGLE) {
                let joint = joint.name.clone();
                return Err(RobotClipError::LargeAngle { joint, angle });
            }
        }
        Ok(())
    }
}

fn track_of(set: &TrackSet, name: &str) -> Option<usize> {
    (0..set.track_count()).find(|&track| set.track_name(track) == name)
}
