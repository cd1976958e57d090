//! Makes a clip of some tracks of a clip.

use std::fmt;

use tumble::TrackError;

use crate::motion::Motion;

/// A track of a clip, by its name or its index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TrackName {
    /// By its name.
    Name(String),
    /// By its index in the file, from 0.
    Index(usize),
}

impl TrackName {
    /// Whether it is that of this track.
    #[must_use]
    pub fn is_of(&self, index: usize, name: &str) -> bool {
        match self {
            Self::Name(known) => known == name,
            &Self::Index(known) => known == index,
        }
    }
}

impl fmt::Display for TrackName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(f, "`{name}`"),
            Self::Index(index) => write!(f, "{index}"),
        }
    }
}

/// The tracks that will be selected from the clips of a file: readers do not read the keys of the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrackSelection {
    /// The tracks.
    pub tracks: Vec<TrackName>,
    /// Whether their ancestors are needed, too.
    pub with_ancestors: bool,
}

impl TrackSelection {
    /// Whether each track of a file will be needed, by the names and the parents of all; `parents` may be empty. If the
    /// selection has a track that the file does not have, all are needed: a name may be one that tracks without names get.
    pub(crate) fn are_needed<'a>(
        &self,
        names: impl ExactSizeIterator<Item = &'a str>,
        parents: &[Option<usize>],
    ) -> Vec<bool> {
        let names: Vec<&str> = names.collect();
        let index_of = |one: &TrackName| (0..names.len()).find(|&it| one.is_of(it, names[it]));
        let mut are_needed = vec![false; names.len()];
        for track in &self.tracks {
            let Some(index) = index_of(track) else {
                return vec![true; names.len()];
            };
            let mut next = Some(index);
            // Stop at a track that was visited before, which also ends circles.
            while let Some(needed) = next.filter(|&it| are_needed.get(it) == Some(&false)) {
                are_needed[needed] = true;
                let parent = parents.get(needed).copied().flatten();
                next = parent.filter(|_| self.with_ancestors);
            }
        }
        are_needed
    }
}

impl Motion {
    /// The clip of these tracks, in this order, and of all scalars. A joint whose parent is not among them becomes a root.
    ///
    /// # Errors
    /// When a track does not exist.
    pub fn select(&self, tracks: &[usize]) -> Result<Self, TrackError> {
        let set = self.set.select(tracks.iter().copied())?;
        let mut new_index = vec![None; self.set.track_count()];
        for (index, &track) in tracks.iter().enumerate() {
            new_index[track] = Some(index);
        }
        let mut skeleton = self.skeleton.clone();
        for joint in &mut skeleton {
            joint.parent = joint
                .parent
                .and_then(|parent| new_index.get(parent).copied().flatten());
        }
        let skeleton = tracks
            .iter()
            .filter_map(|&track| skeleton.get(track).copied());
        let channels = tracks
            .iter()
            .filter_map(|&track| self.channels.get(track).copied());
        let written_joints = tracks
            .iter()
            .filter_map(|&track| self.written_joints.get(track).cloned());
        let origins = match self.origins.is_empty() {
            true => Vec::new(),
            false => tracks.iter().map(|&track| self.origin(track)).collect(),
        };
        Ok(Self {
            set,
            origins,
            skeleton: skeleton.collect(),
            channels: channels.collect(),
            written_joints: written_joints.collect(),
            scalars: self.scalars.clone(),
            ..self.without_tracks()
        })
    }

    /// These tracks and all of their ancestors, in the order of the clip.
    #[must_use]
    pub fn with_ancestors(&self, tracks: &[usize]) -> Vec<usize> {
        let mut is_selected = vec![false; self.set.track_count()];
        for &track in tracks {
            let mut next = Some(track);
            // Stop at a track that was visited before: its ancestors are already selected. This also ends circles.
            while let Some(track) = next.filter(|&track| is_selected.get(track) == Some(&false)) {
                is_selected[track] = true;
                next = self.skeleton.get(track).and_then(|joint| joint.parent);
            }
        }
        (0..is_selected.len())
            .filter(|&track| is_selected[track])
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};
    use tumble::Channel;

    use super::*;
    use crate::motion::{Joint, Transform};

    #[test]
    fn joints_keep_their_parents_and_their_keys() {
        let mut clip = Motion::default();
        // A hand that comes before its parent, the arm.
        for (track, (name, parent)) in [
            ("hand", Some(1)),
            ("arm", Some(3)),
            ("leg", Some(3)),
            ("hip", None),
        ]
        .into_iter()
        .enumerate()
        {
            let keys = [Quat::from_rotation_x(track as f32)];
            clip.set.push(name, &[0.5], &keys).unwrap();
            clip.set
                .set_translations(track, &[0.5], &[Vec3::X * track as f32], &[])
                .unwrap();
            clip.skeleton.push(Joint {
                parent,
                rest: Transform::default(),
            });
        }
        assert_eq!(clip.with_ancestors(&[0]), [0, 1, 3]);
        let selected = clip.select(&[0, 1, 3]).unwrap();
        let parents: Vec<_> = selected.skeleton.iter().map(|joint| joint.parent).collect();
        assert_eq!(parents, [Some(1), Some(2), None]);
        assert_eq!(selected.set.track_name(2), "hip");
        let moved = selected.set.vector_keys(Channel::Translation, 2).unwrap();
        assert_eq!(
            (moved.times, moved.keys),
            (&[0.5][..], &[Vec3::X * 3.0][..])
        );
        assert_eq!(clip.select(&[0]).unwrap().skeleton[0].parent, None);
        clip.skeleton[3].parent = Some(0);
        assert_eq!(clip.with_ancestors(&[1]), [0, 1, 3]);
    }
}
