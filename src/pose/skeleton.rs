//! Skeletons: the parent of each track, and its offset from the parent.

use glam::Vec3;

use crate::math::canonical::canonical;
use crate::memory::reserved;
use crate::output::pose_error::{MAX_TRACKS, SkeletonError};
use crate::shader::{Link, ROOT};

/// The parent of each track, and its offset in the parent's frame.
///
/// Results ([`Rotations`](crate::Rotations)) have no names, so they are combined with a skeleton by index. A
/// [`CrowdLibrary`](crate::crowd::CrowdLibrary) matches the tracks of its clips to the joints by name.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// The tracks in the order of evaluation, parents before their children.
    links: Vec<Link>,
    /// The name of each track; empty if the tracks have none.
    names: Vec<String>,
}

impl Skeleton {
    /// Makes a skeleton from the parent of each track (`None` for a root) and its offset, in any unit of length.
    /// Offsets are in the parent's frame; those of roots are in the world.
    ///
    /// # Errors
    /// * When the numbers of parents and offsets differ, or an offset is not finite.
    /// * When a parent does not exist, or a joint is its own ancestor.
    /// * When there is not enough memory.
    pub fn new(parents: Vec<Option<usize>>, offsets: Vec<Vec3>) -> Result<Self, SkeletonError> {
        let tracks = parents.len();
        if tracks > MAX_TRACKS {
            return Err(SkeletonError::TooMany { tracks });
        }
        if offsets.len() != tracks {
            return Err(SkeletonError::Lengths {
                parents: tracks,
                offsets: offsets.len(),
            });
        }
        if let Some(track) = offsets.iter().position(|offset| !offset.is_finite()) {
            let offset = offsets[track];
            return Err(SkeletonError::OffsetNotFinite { track, offset });
        }
        let mut children = reserved(tracks, "a skeleton")?;
        children.resize(tracks, Vec::new());
        let mut order = reserved(tracks, "a skeleton")?;
        for (track, &parent) in parents.iter().enumerate() {
            match parent {
                None => order.push(track),
                Some(parent) if parent < tracks => children[parent].push(track),
                Some(parent) => {
                    return Err(SkeletonError::NoSuchParent {
                        track,
                        parent,
                        tracks,
                    });
                }
            }
        }
        // Breadth first: parents come before their children.
        let mut next = 0;
        while let Some(&track) = order.get(next) {
            order.append(&mut children[track]);
            next += 1;
        }
        // Tracks that cannot be reached from a root form a circle, or are below one.
        if let Some(track) = children.iter().position(|left| !left.is_empty()) {
            return Err(SkeletonError::Cycle { track });
        }
        let link = |track: usize| Link {
            offset: offsets[track].to_array().map(canonical),
            track: track as u32,
            parent: parents[track].map_or(ROOT, |parent| parent as u32),
            padding_3: [0; 3],
        };
        let mut links = reserved(tracks, "a skeleton")?;
        links.extend(order.into_iter().map(link));
        let names = Vec::new();
        Ok(Self { links, names })
    }

    /// The same skeleton with a name for each track, by which a [`CrowdLibrary`](crate::crowd::CrowdLibrary) matches
    /// the tracks of its clips.
    ///
    /// # Errors
    /// When there is not one name for each track.
    pub fn with_names<T: Into<String>>(
        self,
        names: impl IntoIterator<Item = T>,
    ) -> Result<Self, SkeletonError> {
        let names: Vec<String> = names.into_iter().map(Into::into).collect();
        match names.len() == self.len() {
            true => Ok(Self { names, ..self }),
            false => Err(SkeletonError::Names {
                names: names.len(),
                tracks: self.len(),
            }),
        }
    }

    /// The name of each track; empty if they were not set.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Makes a chain of joints: the first joint is at the origin, and each other joint is at `(0, -length, 0)`
    /// relative to the one before it.
    ///
    /// # Errors
    /// When the length is not finite, there are too many joints, or there is not enough memory.
    pub fn chain(boxes: usize, length: f64) -> Result<Self, SkeletonError> {
        if boxes > MAX_TRACKS {
            return Err(SkeletonError::TooMany { tracks: boxes });
        }
        let label = "a chain";
        let (mut parents, mut offsets) = (reserved(boxes, label)?, reserved(boxes, label)?);
        parents.extend((0..boxes).map(|track| track.checked_sub(1)));
        offsets.extend((0..boxes).map(|track| match track {
            0 => Vec3::ZERO,
            _ => Vec3::new(0.0, -length as f32, 0.0),
        }));
        Self::new(parents, offsets)
    }

    /// Number of tracks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.links.len()
    }

    /// Whether the skeleton has no tracks.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    pub(crate) fn links(&self) -> &[Link] {
        &self.links
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_come_first_and_circles_are_refused() {
        let parents = vec![Some(2), None, Some(1), Some(2)];
        let skeleton = Skeleton::new(parents, vec![Vec3::ZERO; 4]).unwrap();
        let pairs = |tree: &Skeleton| -> Vec<_> {
            let links = tree.links.iter();
            links.map(|link| (link.track, link.parent)).collect()
        };
        assert_eq!(pairs(&skeleton), [(1, ROOT), (2, 1), (0, 2), (3, 2)]);
        let refused = |parents: &[Option<usize>]| {
            Skeleton::new(parents.to_vec(), vec![Vec3::ZERO; parents.len()]).unwrap_err()
        };
        assert_eq!(refused(&[None, Some(1)]), SkeletonError::Cycle { track: 1 });
        assert_eq!(
            refused(&[Some(1), Some(0), None]),
            SkeletonError::Cycle { track: 0 }
        );
        assert!(matches!(
            refused(&[Some(7)]),
            SkeletonError::NoSuchParent { parent: 7, .. }
        ));
        assert!(matches!(
            Skeleton::new(vec![None], vec![]),
            Err(SkeletonError::Lengths { .. })
        ));
        let nowhere = Skeleton::new(vec![None], vec![Vec3::NAN]);
        assert!(matches!(
            nowhere,
            Err(SkeletonError::OffsetNotFinite { track: 0, .. })
        ));
        let chain = Skeleton::chain(3, 2.0).unwrap();
        assert_eq!(pairs(&chain), [(0, ROOT), (1, 0), (2, 1)]);
    }
}
