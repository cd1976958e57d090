//! Where the joints of a sampled clip are in the world.

use glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};

use crate::motion::Motion;
use crate::motion::sample::Samples;

/// A joint's pose in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldPose {
    /// Where its origin is.
    pub position: DVec3,
    /// How it is turned: the product of the rotations of its ancestors and of itself, without their scales, also
    /// where a negative scale mirrors its axes, which no rotation equals.
    pub rotation: Quat,
}

/// Why poses in the world cannot be computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum HierarchyError {
    /// The file says something that rotations, translations and scales cannot.
    #[error("{reason}")]
    Refused {
        /// The reason, as a sentence.
        reason: String,
    },
    /// A joint is its own ancestor.
    #[error("joint {joint} is its own ancestor")]
    Circle {
        /// One joint of the circle, from 0.
        joint: usize,
    },
    /// A parent that does not exist.
    #[error("joint {joint} has the parent {parent}, but there are {joints} joints")]
    NoSuchParent {
        /// The joint, from 0.
        joint: usize,
        /// Its parent.
        parent: usize,
        /// How many there are.
        joints: usize,
    },
}

/// The poses of all joints at all samples, `[sample][joint]`, computed in f64 along the hierarchy
/// and their rotations rounded once. Joints of a clip without a skeleton are roots.
///
/// # Errors
/// When the parents make no hierarchy, or the clip says why its poses cannot be computed.
pub fn world(clip: &Motion, samples: &Samples) -> Result<Vec<WorldPose>, HierarchyError> {
    along_hierarchy(clip, samples, |pose| WorldPose {
        position: pose.position,
        rotation: pose.rotation.normalize().as_quat(),
    })
}

/// As [`world`], where all points that go with the joints are: their scales too.
///
/// # Errors
/// As there.
pub fn world_matrices(clip: &Motion, samples: &Samples) -> Result<Vec<DAffine3>, HierarchyError> {
    along_hierarchy(clip, samples, |pose| {
        DAffine3::from_mat3_translation(pose.linear, pose.position)
    })
}

/// The results of `make` for the transforms of all joints at all samples, `[sample][joint]`.
fn along_hierarchy<T>(
    clip: &Motion,
    samples: &Samples,
    make: impl Fn(&Accumulated) -> T,
) -> Result<Vec<T>, HierarchyError> {
    if let Some(reason) = &clip.no_world {
        let reason = reason.clone();
        return Err(HierarchyError::Refused { reason });
    }
    let joints = clip.set.track_count();
    let order = parents_first(clip, joints)?;
    let mut poses = Vec::with_capacity(samples.rotations.len());
    let mut done = vec![Accumulated::default(); joints];
    for (sample, rotations) in samples.rotations.chunks_exact(joints.max(1)).enumerate() {
        let at = |list: &[Vec3], joint: usize| list.get(sample * joints + joint).copied();
        for &joint in &order {
            let local = Accumulated {
                rotation: rotations[joint].as_dquat(),
                linear: DMat3::from_quat(rotations[joint].as_dquat())
                    * DMat3::from_diagonal(at(&samples.scales, joint).unwrap_or(Vec3::ONE).into()),
                position: clip.origin(joint)
                    + at(&samples.translations, joint)
                        .unwrap_or(Vec3::ZERO)
                        .as_dvec3(),
            };
            let parent = clip.skeleton.get(joint).and_then(|joint| joint.parent);
            done[joint] = match parent {
                Some(parent) if !clip.is_world => done[parent].then(&local),
                _ => local,
            };
        }
        poses.extend(done.iter().map(&make));
    }
    Ok(poses)
}

/// The transform of a joint and its ancestors.
#[derive(Clone, Default)]
struct Accumulated {
    rotation: DQuat,
    linear: DMat3,
    position: DVec3,
}

impl Accumulated {
    /// A child of this joint, in the world.
    fn then(&self, child: &Self) -> Self {
        Self {
            rotation: self.rotation * child.rotation,
            linear: self.linear * child.linear,
            position: self.position + self.linear * child.position,
        }
    }
}

/// All joints, parents before their children.
pub(crate) fn parents_first(clip: &Motion, joints: usize) -> Result<Vec<usize>, HierarchyError> {
    let parent = |joint: usize| clip.skeleton.get(joint).and_then(|joint| joint.parent);
    let mut order = Vec::with_capacity(joints);
    let mut is_placed = vec![false; joints];
    let mut line = Vec::new();
    for joint in 0..joints {
        let mut next = Some(joint);
        while let Some(current) = next.filter(|&joint| !is_placed[joint]) {
            if line.len() >= joints {
                return Err(HierarchyError::Circle { joint });
            }
            line.push(current);
            next = parent(current);
            if let Some(parent) = next.filter(|&parent| parent >= joints) {
                return Err(HierarchyError::NoSuchParent {
                    joint: current,
                    parent,
                    joints,
                });
            }
        }
        while let Some(current) = line.pop() {
            is_placed[current] = true;
            order.push(current);
        }
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::{Joint, Transform};

    fn clip(parents: &[Option<usize>]) -> Motion {
        let mut clip = Motion::default();
        for &parent in parents {
            clip.set.push("", &[0.0], &[Quat::IDENTITY]).unwrap();
            let rest = Transform::default();
            clip.skeleton.push(Joint { parent, rest });
        }
        clip
    }

    #[test]
    fn children_follow_what_moves_turns_and_scales_their_parents() {
        // The child comes first; its parent moves up, turns a quarter about z and doubles.
        let clip = clip(&[Some(1), None]);
        let quarter = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        let samples = Samples {
            times: vec![0.0],
            rotations: vec![Quat::IDENTITY, quarter],
            translations: vec![Vec3::X, Vec3::Z],
            scales: vec![Vec3::ONE, Vec3::splat(2.0)],
            scalars: Vec::new(),
        };
        let found = world(&clip, &samples).unwrap();
        assert!(found[0].position.distance(DVec3::new(0.0, 2.0, 1.0)) < 1e-6);
        assert!(found[0].rotation.dot(quarter).abs() > 1.0 - 1e-6);
        assert_eq!(found[1].position, DVec3::Z);
    }

    /// As docs/formats.md says: rotations are multiplied, and positions and matrices are mirrored.
    #[test]
    fn under_a_mirrored_parent_rotations_are_those_without_the_mirror() {
        let clip = clip(&[None, Some(0), Some(1), Some(1)]);
        let quarter = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        let samples = Samples {
            times: vec![0.0],
            rotations: vec![Quat::IDENTITY, quarter, Quat::IDENTITY, Quat::IDENTITY],
            translations: vec![Vec3::ZERO, Vec3::ZERO, Vec3::X, Vec3::Y],
            scales: vec![Vec3::new(-1.0, 1.0, 1.0), Vec3::ONE, Vec3::ONE, Vec3::ONE],
            scalars: Vec::new(),
        };
        let found = world(&clip, &samples).unwrap();
        for pose in &found[1..4] {
            assert!(pose.rotation.dot(quarter) > 1.0 - 1e-6, "{}", pose.rotation);
        }
        assert!(found[2].position.distance(DVec3::Y) < 1e-6);
        assert!(found[3].position.distance(DVec3::X) < 1e-6);
        let matrices = world_matrices(&clip, &samples).unwrap();
        assert!((matrices[1].matrix3.determinant() + 1.0).abs() < 1e-6);
    }

    #[test]
    fn circles_and_missing_parents_are_refused() {
        let samples = Samples::default();
        let found = |parents: &[_]| world(&clip(parents), &samples).unwrap_err();
        assert!(matches!(
            found(&[Some(1), Some(0)]),
            HierarchyError::Circle { .. }
        ));
        let parent = 5;
        assert!(matches!(
            found(&[Some(parent)]),
            HierarchyError::NoSuchParent {
                joint: 0,
                parent: 5,
                joints: 1
            }
        ));
    }
}
