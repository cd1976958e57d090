//! The skeleton that all clips of a library share, and the tracks of each clip in the order of its joints.

use std::borrow::Cow;

use glam::{DVec3, Vec3};
use tumble::{Channel, JointMatchError, JointPairs, Joints, TrackError, TrackSet};

use crate::adjust::{OffsetsError, set_offsets};
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
    /// Those of each clip.
    Clip,
    /// Those of the library's skeleton, which the caller chose for all clips. They also place the joints of clips
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
    /// `names` are what the skeleton and the clip are called in messages.
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
        let by_index = |joints: usize| Joints::named(vec![String::new(); joints]);
        by_index(parents.len()).order_of(&by_index(of_first.len()), names)?;
        let joints = Joints::of(&first.set).with_parents(parents.to_vec());
        let pairs: Vec<[usize; 2]> = (0..joints.len()).map(|joint| [joint; 2]).collect();
        joints.check_parents(&of_first, &pairs, &pairs, names)?;
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

    /// Adds the joints of a clip that are new; they follow the others. `names` are what the skeleton and the clip are
    /// called in messages.
    ///
    /// # Errors
    /// When two joints have the same name, or a joint has another parent.
    pub fn extend(&mut self, clip: &Motion, names: [&str; 2]) -> Result<(), JointMatchError> {
        let joints = clip.joints();
        let matched = self.joints.pairs(&joints, names)?;
        let mut index_of = vec![0; joints.len()];
        for &[joint, track] in &matched.pairs {
            index_of[track] = joint;
        }
        let before = self.rest.len();
        for (index, &track) in matched.missing[1].iter().enumerate() {
            index_of[track] = before + index;
        }
        let mut rest = self.rest.clone();
        for &track in &matched.missing[1] {
            let joint = clip.skeleton.get(track);
            rest.push(Joint {
                parent: joint.and_then(|joint| index_of.get(joint.parent?).copied()),
                rest: joint.map(|joint| joint.rest).unwrap_or_default(),
            });
        }
        let added = matched.missing[1]
            .iter()
            .map(|&track| &joints.names()[track]);
        let all = Joints::named(self.joints.names().iter().chain(added));
        let pairs: Vec<[usize; 2]> = (index_of.iter().enumerate())
            .map(|(track, &joint)| [joint, track])
            .collect();
        self.set(all, rest);
        self.joints.check_parents(&joints, &pairs, &pairs, names)
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

    /// Pairs of joints and the tracks of a clip that has the same joints. `names` are what the skeleton and the clip are
    /// called in messages.
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

    /// Pairs of joints and the tracks of a clip that has some of the joints. `names` are what the skeleton and the clip
    /// are called in messages.
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
        let pairs = &matched.pairs;
        self.joints.check_parents(&joints, pairs, pairs, names)?;
        Ok(matched)
    }

    /// The tracks of a clip in the order of the joints. Joints without a track are at rest; a channel without keys is at
    /// rest where the clip has it, or where the skeleton has it if `offsets` says so. `name` is what the clip is called
    /// in messages.
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
        let is_in_order = order.iter().copied().eq(0..all.track_count());
        Ok(match is_in_order {
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
