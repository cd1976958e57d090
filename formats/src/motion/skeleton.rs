//! The skeleton that all clips of a library share, and the tracks of each clip in the order of its joints.

use std::borrow::Cow;

use glam::{DVec3, Vec3};
use tumble::{
    Channel, JointMatchError, JointPairs, Joints, Skeleton, SkeletonError, TrackError, TrackSet,
};

use crate::motion::adjust::{OffsetsError, set_offsets};
use crate::motion::{Joint, Motion, Transform};

/// The joints of a library of clips.
#[derive(Debug, Clone, Default)]
pub struct ClipSkeleton {
    joints: Joints,
    /// The parent of each joint, and its transform in clips that do not contain it.
    rest: Vec<Joint>,
}

/// Which offsets joints without translation keys have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OffsetSource {
    /// Each clip uses its own offsets.
    Clip,
    /// All clips use the offsets of the library's skeleton, which the caller chose. They also place the joints of clips
    /// without offsets.
    Skeleton,
}

/// Why a clip cannot be added to a library.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SkeletonMatchError {
    /// Its joints are others.
    #[error(transparent)]
    Joints(#[from] JointMatchError),
    /// Its rotations are relative to the world.
    #[error("{clip}: its rotations are relative to the world, not to the parents")]
    World {
        /// The name of the clip in messages.
        clip: String,
    },
    /// Its positions are relative to an origin, which a library cannot store.
    #[error("{clip}: its positions count from an origin (`clip.origins`); subtract it first")]
    Origins {
        /// The name of the clip in messages.
        clip: String,
    },
    /// Its poses in the world are not defined by its parents, rotations, translations and scales.
    #[error("{clip}: {reason}")]
    NoWorld {
        /// The name of the clip in messages.
        clip: String,
        /// The reason.
        reason: String,
    },
    /// The offsets of the skeleton do not fit the clip.
    #[error("{clip}: {error}")]
    Offsets {
        /// The name of the clip in messages.
        clip: String,
        /// The reason.
        error: Box<OffsetsError>,
    },
    /// A rest transform is no valid key.
    #[error(transparent)]
    Track(#[from] TrackError),
}

impl ClipSkeleton {
    /// The joints of a clip.
    #[must_use]
    pub fn of(clip: &Motion) -> Self {
        let mut skeleton = Self::default();
        let root = || Joint {
            parent: None,
            rest: Transform::default(),
        };
        let tracks = 0..clip.set.track_count();
        let rest = tracks.map(|track| clip.skeleton.get(track).copied().unwrap_or_else(root));
        skeleton.set(clip.joints(), rest.collect());
        skeleton
    }

    /// The joints of arrays without names: they are those of `first`, the first clip of the library, in the same order.
    /// `names` are the names of the skeleton and the clip in messages.
    ///
    /// # Errors
    /// When the clip has another number of tracks, or a joint has another parent in it.
    pub fn of_arrays(
        parents: &[Option<usize>],
        offsets: &[Vec3],
        first: &Motion,
        names: [&str; 2],
    ) -> Result<Self, JointMatchError> {
        let of_first = first.joints();
        if parents.len() != of_first.len() {
            return Err(JointMatchError::Count {
                clips: names.map(str::to_owned),
                joints: [parents.len(), of_first.len()],
            });
        }
        let joints = Joints::of(&first.set).with_parents(parents.to_vec());
        let pairs = JointPairs::in_order(joints.len());
        joints.check_parents(&of_first, &pairs, names)?;
        let rest = parents.iter().zip(offsets).map(|(&parent, &translation)| {
            let rest = Transform {
                translation,
                ..Transform::default()
            };
            Joint { parent, rest }
        });
        Ok(Self {
            joints,
            rest: rest.collect(),
        })
    }

    /// Joints without names.
    #[must_use]
    pub fn unnamed(joints: Vec<Joint>) -> Self {
        let mut skeleton = Self::default();
        skeleton.set(Joints::named(vec![String::new(); joints.len()]), joints);
        skeleton
    }

    /// The same joints with other names, one for each.
    #[must_use]
    pub fn with_names(mut self, names: &[String]) -> Self {
        self.set(Joints::named(names), self.rest.clone());
        self
    }

    fn set(&mut self, joints: Joints, rest: Vec<Joint>) {
        let parents = rest.iter().map(|joint| joint.parent).collect();
        (self.joints, self.rest) = (joints.with_parents(parents), rest);
    }

    /// Adds the joints of a clip that are new; they follow the others. `names` are the names of the skeleton and the
    /// clip in messages.
    ///
    /// # Errors
    /// When two joints have the same name, or a joint has another parent. The skeleton is then unchanged.
    pub fn extend(&mut self, clip: &Motion, names: [&str; 2]) -> Result<(), JointMatchError> {
        let before = self.rest.len();
        let indices = self.joints.extend(&clip.joints(), names)?;
        let tracks = indices.iter().enumerate();
        let added = tracks.filter(|&(_, &joint)| joint >= before);
        self.rest.extend(added.map(|(track, _)| {
            let joint = clip.skeleton.get(track);
            Joint {
                parent: joint.and_then(|joint| indices.get(joint.parent?).copied()),
                rest: joint.map(|joint| joint.rest).unwrap_or_default(),
            }
        }));
        Ok(())
    }

    /// The skeleton in the form that the engine takes.
    ///
    /// # Errors
    /// When there are no joints, the parents form a cycle, or an offset is not finite.
    pub fn of_engine(&self) -> Result<Skeleton, SkeletonError> {
        let parents = self.rest.iter().map(|joint| joint.parent).collect();
        let offsets = self.rest.iter().map(|joint| joint.rest.translation);
        let skeleton = Skeleton::new(parents, offsets.collect())?;
        match self.is_named() {
            true => skeleton.with_names(self.names()),
            false => Ok(skeleton),
        }
    }

    /// Whether any joint has a name.
    #[must_use]
    pub fn is_named(&self) -> bool {
        self.joints.is_named()
    }

    /// The names of the joints.
    #[must_use]
    pub fn names(&self) -> &[String] {
        self.joints.names()
    }

    /// The parent of each joint, and its transform at rest.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.rest
    }

    /// Pairs of joints and the tracks of a clip that has the same joints. `names` are the names of the skeleton and the
    /// clip in messages.
    ///
    /// # Errors
    /// The first difference.
    pub fn all_pairs(
        &self,
        clip: &Motion,
        names: [&str; 2],
    ) -> Result<JointPairs, JointMatchError> {
        let order = self.joints.order_of(&clip.joints(), names)?;
        let mut matched = JointPairs::default();
        let pairs = order.into_iter().enumerate();
        matched.pairs = pairs.map(|(joint, track)| [joint, track]).collect();
        Ok(matched)
    }

    /// Pairs of joints and the tracks of a clip that has some of the joints. `names` are the names of the skeleton and
    /// the clip in messages.
    ///
    /// # Errors
    /// When the clip has a joint that the skeleton does not have, or a joint has another parent.
    pub fn some_pairs(
        &self,
        clip: &Motion,
        names: [&str; 2],
    ) -> Result<JointPairs, JointMatchError> {
        let joints = clip.joints();
        let matched = self.joints.pairs(&joints, names)?;
        self.joints.check_extra(&joints, &matched, names)?;
        self.joints.check_parents(&joints, &matched, names)?;
        Ok(matched)
    }

    /// The tracks of a clip in the order of the joints. Joints without a track are at rest; a channel without keys is at
    /// rest where the clip has it, or where the skeleton has it if `offsets` says so. `name` is the name of the clip in
    /// messages.
    ///
    /// # Errors
    /// When the clip's rotations or positions are not relative to the parents.
    pub fn tracks<'a>(
        &self,
        clip: &'a Motion,
        matched: &JointPairs,
        offsets: OffsetSource,
        name: &str,
    ) -> Result<Cow<'a, TrackSet>, SkeletonMatchError> {
        let clip_name = || name.to_owned();
        if clip.is_world {
            return Err(SkeletonMatchError::World { clip: clip_name() });
        }
        if clip.origins.iter().any(|&origin| origin != DVec3::ZERO) {
            return Err(SkeletonMatchError::Origins { clip: clip_name() });
        }
        let mut all = Cow::Borrowed(&clip.set);
        match (&clip.no_world, offsets) {
            (Some(_), OffsetSource::Skeleton) if clip.lacks_offsets() => {
                all = Cow::Owned(self.placed(clip, matched, name)?.set);
            }
            (Some(reason), _) if !clip.lacks_offsets() => {
                let (clip, reason) = (clip_name(), reason.clone());
                return Err(SkeletonMatchError::NoWorld { clip, reason });
            }
            _ => {}
        }
        let start = clip.set.time_span().map_or(0.0, |(first, _)| first);
        let mut track_of = vec![None; self.rest.len()];
        for &[joint, track] in &matched.pairs {
            track_of[joint] = Some(track);
        }
        let mut order = Vec::with_capacity(track_of.len());
        for (joint, track) in track_of.into_iter().enumerate() {
            let at_rest = self.rest[joint].rest;
            let (track, moved, scale) = match track {
                Some(track) => {
                    let rest = |channel| clip.rest(channel, track);
                    (track, rest(Channel::Translation), rest(Channel::Scale))
                }
                None => {
                    let name = self.names()[joint].as_str();
                    all.to_mut().push(name, &[start], &[at_rest.rotation])?;
                    (all.track_count() - 1, at_rest.translation, at_rest.scale)
                }
            };
            let is_keyed = |channel| all.vector_keys(channel, track).is_some();
            let (has_moved, has_scale) = (is_keyed(Channel::Translation), is_keyed(Channel::Scale));
            let is_elsewhere = moved != at_rest.translation && offsets == OffsetSource::Clip;
            if !has_moved && is_elsewhere {
                all.to_mut()
                    .set_translations(track, &[start], &[moved], &[])?;
            }
            if !has_scale && scale != Vec3::ONE {
                all.to_mut().set_scales(track, &[start], &[scale], &[])?;
            }
            order.push(track);
        }
        Ok(match all.is_in_order(&order) {
            true => all,
            false => Cow::Owned(all.select(order)?),
        })
    }

    /// A clip without offsets, with those of the skeleton.
    fn placed(
        &self,
        clip: &Motion,
        matched: &JointPairs,
        name: &str,
    ) -> Result<Motion, SkeletonMatchError> {
        let mut numbers = vec![0.0; 3 * clip.set.track_count()];
        for &[joint, track] in &matched.pairs {
            let offset = self.rest[joint].rest.translation.as_dvec3().to_array();
            numbers[3 * track..][..3].copy_from_slice(&offset);
        }
        let mut placed = clip.clone();
        set_offsets(&mut placed, &numbers).map_err(|error| {
            let clip = name.to_owned();
            SkeletonMatchError::Offsets {
                clip,
                error: Box::new(error),
            }
        })?;
        Ok(placed)
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    const LABELS: [&str; 2] = ["the clips before", "the clip"];

    /// A clip whose joints have these names, and parents if there are any.
    fn clip(names: &[&str], parents: &[Option<usize>]) -> Motion {
        let mut clip = Motion::default();
        for name in names {
            clip.set.push(*name, &[0.0], &[Quat::IDENTITY]).unwrap();
        }
        let joint = |(joint, &parent): (usize, &Option<usize>)| Joint {
            parent,
            rest: Transform {
                translation: Vec3::X * joint as f32,
                ..Transform::default()
            },
        };
        clip.skeleton = parents.iter().enumerate().map(joint).collect();
        clip
    }

    fn parents(skeleton: &ClipSkeleton) -> Vec<Option<usize>> {
        skeleton.joints().iter().map(|joint| joint.parent).collect()
    }

    #[test]
    fn a_skeleton_grows_by_the_joints_that_are_new() {
        let mut skeleton = ClipSkeleton::default();
        let first = clip(&["hip", "arm"], &[None, Some(0)]);
        let second = clip(&["tail", "hip", "hand"], &[Some(1), None, Some(0)]);
        for clip in [&first, &second, &first] {
            skeleton.extend(clip, LABELS).unwrap();
        }
        assert_eq!(skeleton.names(), ["hip", "arm", "tail", "hand"]);
        assert_eq!(parents(&skeleton), [None, Some(0), Some(0), Some(2)]);
        let rest = |joint: usize| skeleton.joints()[joint].rest.translation.x;
        assert_eq!([0, 1, 2, 3].map(rest), [0.0, 1.0, 0.0, 2.0]);
        assert_eq!(
            skeleton.some_pairs(&second, LABELS).unwrap().pairs,
            [[0, 1], [2, 0], [3, 2]]
        );
    }

    #[test]
    fn a_clip_that_does_not_fit_changes_nothing() {
        let mut skeleton = ClipSkeleton::of(&clip(&["hip", "arm"], &[None, Some(0)]));
        let wrong = clip(&["toe", "arm", "hip"], &[None, None, None]);
        let error = skeleton.extend(&wrong, LABELS).unwrap_err();
        let text = "`arm` has the parent `hip` in the clips before, but is a root in the clip";
        assert_eq!(error.to_string(), text);
        assert_eq!(skeleton.names(), ["hip", "arm"]);
        assert_eq!(parents(&skeleton), [None, Some(0)]);
    }

    #[test]
    fn numbered_joints_are_not_added_again() {
        let mut skeleton = ClipSkeleton::of(&clip(&["joint0", "joint1"], &[None, Some(0)]));
        let more = clip(&["joint0", "joint1", "tool"], &[None, Some(0), Some(1)]);
        skeleton.extend(&more, LABELS).unwrap();
        assert_eq!(skeleton.names(), ["joint0", "joint1", "tool"]);
    }

    #[test]
    fn arrays_have_a_joint_for_each_track() {
        let first = clip(&["hip", "arm"], &[None, Some(0)]);
        let made = |parents: &[Option<usize>]| {
            let offsets = vec![Vec3::ZERO; parents.len()];
            ClipSkeleton::of_arrays(parents, &offsets, &first, ["arrays", "the clip"])
        };
        assert_eq!(made(&[None, Some(0)]).unwrap().names(), ["hip", "arm"]);
        for (parents, text) in [
            (&[None][..], "the clip: 2 tracks; arrays has 1 joints"),
            (
                &[None, None][..],
                "`arm` is a root in arrays, but has the parent `hip` in the clip",
            ),
        ] {
            assert_eq!(made(parents).unwrap_err().to_string(), text);
        }
    }
}
