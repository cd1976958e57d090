//! Skeletons: a bone from the parent of each joint to the joint, a cube for each root, and meshes that
//! follow them. The shapes are those of the page of `tumble view`.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Quat, Vec3};
use tumble_formats::carried_mesh::CarriedMesh;
use tumble_formats::motion::Motion;

use crate::commands::render::solids::{Face, SIDES};
use crate::messages::colours::{BOXES, Colour};

/// The width of a bone relative to its length, and where on the bone it is, from the parent to the
/// joint.
const BREADTH: f32 = 0.18;
const BROADEST: f32 = 0.15;
/// The edge of a root's cube, relative to the median length of the bones.
const CUBE: f32 = 0.2;
/// The length of bones if all have the length 0, relative to the extent of the motion.
const LONE_LENGTH: f32 = 0.15;
/// The colour of the meshes of a file.
const SKIN: Colour = [0xc9, 0xb8, 0xa4];

/// The bones of a clip.
#[derive(Debug, Clone)]
pub(crate) struct Bones {
    parents: Vec<Option<usize>>,
    /// The End Sites of BVH: a joint, and where its last bone ends relative to it.
    tips: Vec<(usize, Vec3)>,
    /// For each joint, the axis of its parent that turns the bone about itself.
    across: Vec<Vec3>,
    /// A length to which distances are compared.
    pub(crate) length: f32,
}

impl Bones {
    /// The bones of a clip, whose joints are in the world as these lists say, `[frame][joint]`.
    pub(crate) fn new(clip: &Motion, rotations: &[Quat], positions: &[Vec3]) -> Self {
        let joints = clip.set.track_count();
        let parent = |joint: usize| clip.skeleton.get(joint).and_then(|it| it.parent);
        let parents: Vec<Option<usize>> = (0..joints).map(parent).collect();
        let sites = clip.written_joints.iter().enumerate();
        let tips: Vec<(usize, Vec3)> = sites
            .flat_map(|(joint, written)| written.end_sites.iter().map(move |&tip| (joint, tip)))
            .filter(|(_, tip)| tip.length() > 0.0)
            .collect();
        let across = parents.iter().enumerate().map(|(joint, parent)| {
            let Some(parent) = *parent else {
                return Vec3::X;
            };
            let along = rotations[parent].inverse() * (positions[joint] - positions[parent]);
            axis_across(along)
        });
        let mut lengths: Vec<f32> = (parents.iter().enumerate())
            .filter_map(|(joint, parent)| Some(positions[joint].distance(positions[(*parent)?])))
            .filter(|&length| length > 0.0)
            .collect();
        lengths.sort_by(f32::total_cmp);
        let extent = || {
            let low = positions.iter().copied().fold(Vec3::MAX, Vec3::min);
            let high = positions.iter().copied().fold(Vec3::MIN, Vec3::max);
            Some(LONE_LENGTH * (high - low).max_element()).filter(|&length| length > 0.0)
        };
        let middle = lengths.get(lengths.len() / 2).copied();
        Self {
            across: across.collect(),
            length: middle.or_else(extent).unwrap_or(1.0),
            parents,
            tips,
        }
    }

    /// The ends of all bones at a frame: joints, and tips without a joint.
    pub(crate) fn ends(&self, rotations: &[Quat], positions: &[Vec3]) -> Vec<Vec3> {
        let tips = self.tips.iter();
        let tips = tips.map(|&(joint, tip)| positions[joint] + rotations[joint] * tip);
        positions.iter().copied().chain(tips).collect()
    }

    /// All bones at a frame.
    pub(crate) fn faces(&self, rotations: &[Quat], positions: &[Vec3]) -> Vec<Face> {
        let mut faces = Vec::new();
        let colour = |joint: usize| BOXES[joint % BOXES.len()];
        for (joint, parent) in self.parents.iter().enumerate() {
            match *parent {
                Some(parent) => {
                    let across = rotations[parent] * self.across[joint];
                    let ends = [positions[parent], positions[joint]];
                    faces.extend(bone(ends, across, colour(joint)));
                }
                None => faces.extend(cube(
                    positions[joint],
                    rotations[joint],
                    self.length * CUBE,
                    colour(joint),
                )),
            }
        }
        for &(joint, tip) in &self.tips {
            let ends = [positions[joint], positions[joint] + rotations[joint] * tip];
            let across = rotations[joint] * axis_across(tip);
            faces.extend(bone(ends, across, colour(joint)));
        }
        faces
    }
}

/// The axis that is furthest from a direction.
fn axis_across(along: Vec3) -> Vec3 {
    let sizes = along.abs();
    match sizes.min_element() {
        least if least == sizes.x => Vec3::X,
        least if least == sizes.y => Vec3::Y,
        _ => Vec3::Z,
    }
}

/// A bone from the parent to the joint; none without length.
fn bone([from, to]: [Vec3; 2], across: Vec3, colour: Colour) -> Vec<Face> {
    let along = to - from;
    let half = along.length() * BREADTH / 2.0;
    let Some(direction) = along.try_normalize() else {
        return Vec::new();
    };
    let aside = across.reject_from_normalized(direction);
    let aside = aside
        .try_normalize()
        .unwrap_or_else(|| direction.any_orthonormal_vector());
    let over = direction.cross(aside);
    let middle = from + along * BROADEST;
    let ring = [aside, over, -aside, -over].map(|side| middle + side * half);
    let sides = (0..4).flat_map(|i| {
        let (corner, next) = (ring[i], ring[(i + 1) % 4]);
        [[to, corner, next], [from, next, corner]]
    });
    sides.map(|corners| face(corners, colour)).collect()
}

/// A cube about a position.
fn cube(at: Vec3, rotation: Quat, edge: f32, colour: Colour) -> impl Iterator<Item = Face> {
    SIDES.into_iter().flat_map(move |(side, _)| {
        let [a, b, c, d] = side.map(|sign| at + rotation * (sign * edge / 2.0));
        [[a, b, c], [a, c, d]].map(|corners| face(corners, colour))
    })
}

/// A triangle, shaded by its normal.
fn face(corners: [Vec3; 3], colour: Colour) -> Face {
    let [a, b, c] = corners;
    Face {
        corners,
        normal: Some((b - a).cross(c - a).normalize_or_zero()),
        colour,
        two_sided: true,
    }
}

/// The mesh of a file, which follows its joints.
#[derive(Debug, Clone)]
pub(crate) struct Skin {
    mesh: Arc<CarriedMesh>,
    /// The transforms of the joints in the world, relative to the origin of the picture, `[frame][joint]`.
    matrices: Vec<DAffine3>,
    joints: usize,
}

impl Skin {
    pub(crate) fn new(mesh: Arc<CarriedMesh>, matrices: Vec<DAffine3>, joints: usize) -> Self {
        Self {
            mesh,
            matrices,
            joints,
        }
    }

    /// The vertices at a frame.
    pub(crate) fn vertices(&self, frame: usize) -> Vec<Vec3> {
        let joints = &self.matrices[frame * self.joints..(frame + 1) * self.joints];
        let bones: Vec<DAffine3> = (self.mesh.bones.iter())
            .map(|bone| {
                let to_joint = bone.to_joint.map(f64::from);
                let [x, y, z, w] = [0, 4, 8, 12].map(|at| DVec3::from_slice(&to_joint[at..]));
                joints[bone.track] * DAffine3::from_cols(x, y, z, w)
            })
            .collect();
        let each = self.mesh.positions.iter().enumerate().map(|(vertex, &at)| {
            let at = Vec3::from_array(at).as_dvec3();
            let (of, weights) = (self.mesh.bones_of[vertex], self.mesh.weights[vertex]);
            let moved = of.iter().zip(weights).map(|(&bone, weight)| {
                let bone = bones.get(usize::from(bone)).copied().unwrap_or_default();
                bone.transform_point3(at) * f64::from(weight)
            });
            moved.sum::<DVec3>().as_vec3()
        });
        each.collect()
    }

    /// All triangles at a frame.
    pub(crate) fn faces(&self, frame: usize) -> Vec<Face> {
        let vertices = self.vertices(frame);
        let corners = self.mesh.triangles.iter();
        let corners = corners.map(|corners| corners.map(|corner| vertices[corner as usize]));
        corners.map(|corners| face(corners, SKIN)).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;
    use tumble_formats::motion::{Joint, Transform};

    use super::*;

    /// A bone starts at the parent and ends at the joint, and its faces look outwards.
    #[test]
    fn a_bone_joins_its_parent_and_its_joint() {
        let (from, to) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 4.0, 3.0));
        let faces = bone([from, to], Vec3::X, BOXES[0]);
        assert_eq!(faces.len(), 8);
        let corners: Vec<Vec3> = faces.iter().flat_map(|face| face.corners).collect();
        assert!(corners.contains(&from) && corners.contains(&to));
        let low = corners.iter().copied().fold(Vec3::MAX, Vec3::min);
        let high = corners.iter().copied().fold(Vec3::MIN, Vec3::max);
        assert!(
            (high - low).abs_diff_eq(Vec3::new(0.36, 2.0, 0.36), 1e-6),
            "{low} {high}"
        );
        let centre = from.lerp(to, 0.3);
        for face in &faces {
            let outward = (face.corners[0] - centre).dot(face.normal.unwrap());
            assert!(outward > 0.0, "{face:?}");
        }
        assert!(bone([from, from], Vec3::X, BOXES[0]).is_empty());
    }

    /// The bones of several joints with one parent start at the parent: a body is not a chain.
    #[test]
    fn bones_go_by_parents() {
        let mut clip = Motion::default();
        for (name, parent) in [("hip", None), ("left", Some(0)), ("right", Some(0))] {
            clip.set.push(name, &[0.0], &[Quat::IDENTITY]).unwrap();
            clip.skeleton.push(Joint {
                parent,
                rest: Transform::default(),
            });
        }
        let positions = [Vec3::ZERO, Vec3::X, Vec3::NEG_X * 3.0];
        let rotations = [Quat::IDENTITY; 3];
        let bones = Bones::new(&clip, &rotations, &positions);
        assert_eq!(bones.length, 3.0);
        let faces = bones.faces(&rotations, &positions);
        assert_eq!(faces.len(), 12 + 2 * 8);
        let starts = faces.iter().flat_map(|face| face.corners);
        assert_eq!(starts.filter(|&corner| corner == Vec3::ZERO).count(), 8);
        assert_eq!(bones.ends(&rotations, &positions), positions);
    }
}
