//! The nodes and skins of a new glTF file: a node for each track of a skeleton.

use std::collections::{HashMap, HashSet};

use glam::{DAffine3, DMat3, DVec3, Quat, Vec3};
use tumble::Skeleton;

use crate::gltf::write_new::json::{BvhExtras, Extras, Node};
use crate::motion::WrittenJoint;
use crate::motion::{Motion, Transform};

/// The nodes of all skeletons of a file.
#[derive(Default)]
pub(super) struct NewNodes {
    pub(super) list: Vec<Node>,
    pub(super) roots: Vec<usize>,
    /// The rest transform of each node, and the vector to add to its translations.
    rests: Vec<(Transform, DVec3)>,
    rigs: Vec<Rig>,
    names: UniqueNames,
    /// The number of nodes that already have their parents.
    children_until: usize,
}

/// The joints of several clips that belong to one skeleton; or tracks without parents.
struct Rig {
    has_skeleton: bool,
    /// The node of each joint, by its parent node, its name, and its index among the joints with this name.
    nodes: HashMap<(Option<usize>, String, usize), usize>,
    roots: Vec<usize>,
}

/// The joints of a skin, the root first, and their inverse bind matrices.
pub(super) type SkinOf = (Vec<usize>, Vec<[f32; 16]>);

impl NewNodes {
    /// The node of each track of a clip. Joints with the same names, parents and rest transforms are the same nodes
    /// in all clips, unless another joint of the two clips rests differently in one than in the other.
    ///
    /// # Errors
    /// Why the joints are not trees, as text.
    pub(super) fn add(&mut self, clip: &Motion) -> Result<Vec<usize>, String> {
        let tracks = clip.set.track_count();
        let parents: Vec<Option<usize>> = match clip.skeleton.is_empty() {
            true => vec![None; tracks],
            false => clip.skeleton.iter().map(|joint| joint.parent).collect(),
        };
        let skeleton = Skeleton::new(parents.clone(), vec![Vec3::ZERO; tracks]);
        skeleton.map_err(|error| error.to_string())?;
        let rest = |track: usize| {
            let joint = clip.skeleton.get(track).map(|joint| joint.rest);
            joint.unwrap_or_default()
        };
        // Joints in the world become relative to their parents, so that only roots keep an origin.
        let origin = |track: usize| match parents[track] {
            Some(_) if clip.is_world => DVec3::ZERO,
            _ => clip.origin(track),
        };
        let is_finite = |rest: Transform| {
            rest.translation.is_finite() && rest.rotation.is_finite() && rest.scale.is_finite()
        };
        if let Some(track) = (0..tracks).find(|&track| !is_finite(rest(track))) {
            let name = clip.set.track_name(track);
            return Err(format!(
                "the rest pose of `{name}` has a number that is not finite"
            ));
        }
        let order = parents_first(&parents);
        let names: Vec<String> = (0..tracks)
            .map(|track| clip.set.track_name(track))
            .collect();
        let has_skeleton = !clip.skeleton.is_empty();
        let fitting = self.rigs.iter().enumerate().find_map(|(index, rig)| {
            let both = |track| (rest(track), origin(track));
            let found = self.shared(rig, (&order, &parents, &names), &both)?;
            (rig.has_skeleton == has_skeleton).then_some((index, found))
        });
        let (index, found) = fitting.unwrap_or_else(|| {
            self.rigs.push(Rig {
                has_skeleton,
                nodes: HashMap::new(),
                roots: Vec::new(),
            });
            (self.rigs.len() - 1, vec![None; tracks])
        });
        // New nodes, in the order of the tracks.
        let mut nodes = Vec::with_capacity(tracks);
        for (track, found) in found.into_iter().enumerate() {
            nodes.push(found.unwrap_or_else(|| {
                let (rest, origin) = (rest(track), origin(track));
                let node = self.list.len();
                self.rests.push((rest, origin));
                self.list.push(Node {
                    name: self.names.unique(names[track].clone(), node),
                    translation: rest.translation.to_array().map(shortest),
                    rotation: rest.rotation.to_array(),
                    scale: rest.scale.to_array(),
                    children: Vec::new(),
                    extras: clip.written_joints.get(track).map(extras),
                });
                node
            }));
        }
        let rig = &mut self.rigs[index];
        let mut seen = HashMap::new();
        for track in order {
            let (parent, node) = (parents[track].map(|parent| nodes[parent]), nodes[track]);
            let key = (parent, names[track].clone());
            let which: &mut usize = seen.entry(key.clone()).or_default();
            let key = (key.0, key.1, *which);
            *which += 1;
            if rig.nodes.insert(key, node).is_none() && parent.is_none() {
                rig.roots.push(node);
            }
        }
        for (track, parent) in parents.iter().enumerate() {
            // Shared nodes were given their parents before.
            if nodes[track] >= self.children_until {
                let child = self.below_origin(nodes[track]);
                match parent.map(|parent| nodes[parent]) {
                    Some(parent) => self.list[parent].children.push(child),
                    None => self.roots.push(child),
                }
            }
        }
        self.children_until = self.list.len();
        Ok(nodes)
    }

    /// The origin of a node: a new parent node if its positions need an origin, otherwise the node itself. Positions
    /// of maps are larger than f32 can store exactly, and the sum of the translations of both nodes is as exact as
    /// the program that computes it.
    fn below_origin(&mut self, node: usize) -> usize {
        let origin = self.rests[node].1;
        if origin == DVec3::ZERO {
            return node;
        }
        let carrier = self.list.len();
        self.rests.push((Transform::default(), DVec3::ZERO));
        self.list.push(Node {
            name: self
                .names
                .unique(format!("{} origin", self.list[node].name), carrier),
            translation: origin.to_array(),
            rotation: Quat::IDENTITY.to_array(),
            scale: [1.0; 3],
            children: vec![node],
            extras: Some(Extras {
                bvh: None,
                tumble_origin: true,
            }),
        });
        carrier
    }

    /// The nodes that a clip shares with a rig, `None` for each new node. `None` for the whole if they share no root,
    /// or if a joint rests differently.
    fn shared(
        &self,
        rig: &Rig,
        (order, parents, names): (&[usize], &[Option<usize>], &[String]),
        rest: &impl Fn(usize) -> (Transform, DVec3),
    ) -> Option<Vec<Option<usize>>> {
        let mut found: Vec<Option<usize>> = vec![None; names.len()];
        let mut seen = HashMap::new();
        let mut shares_root = false;
        for &track in order {
            let parent = match parents[track] {
                None => None,
                Some(parent) => match found[parent] {
                    // If the parent is a new node, its children are new nodes, too.
                    None => continue,
                    some => some,
                },
            };
            let which: &mut usize = seen.entry((parent, &names[track])).or_default();
            let node = rig.nodes.get(&(parent, names[track].clone(), *which));
            *which += 1;
            if node.is_some_and(|&node| self.rests[node] != rest(track)) {
                return None;
            }
            shares_root |= parent.is_none() && node.is_some();
            found[track] = node.copied();
        }
        shares_root.then_some(found)
    }

    /// A skin for each tree of a skeleton, because the joints of a skin have a common root.
    pub(super) fn skins(&self) -> Vec<SkinOf> {
        let rigs = self.rigs.iter().filter(|rig| rig.has_skeleton);
        rigs.flat_map(|rig| rig.roots.iter().map(|&root| self.skin(root)))
            .collect()
    }

    /// A skin of all nodes under `root`.
    fn skin(&self, root: usize) -> SkinOf {
        let mut joints = vec![(root, DAffine3::IDENTITY)];
        let mut next = 0;
        while let Some(&(node, parent)) = joints.get(next) {
            let world = parent * affine(&self.rests[node].0);
            joints[next].1 = world;
            joints.extend(self.list[node].children.iter().map(|&child| (child, world)));
            next += 1;
        }
        let matrices = joints.iter().map(|(_, world)| inverse(*world)).collect();
        let joints = joints.into_iter().map(|(node, _)| node).collect();
        (joints, matrices)
    }
}

/// The joints of trees, parents before their children.
fn parents_first(parents: &[Option<usize>]) -> Vec<usize> {
    let mut children = vec![Vec::new(); parents.len()];
    let mut open = Vec::new();
    for (track, parent) in parents.iter().enumerate().rev() {
        match parent {
            Some(parent) => children[*parent].push(track),
            None => open.push(track),
        }
    }
    let mut order = Vec::with_capacity(parents.len());
    while let Some(track) = open.pop() {
        order.push(track);
        open.append(&mut children[track]);
    }
    order
}

/// How a file of BVH wrote a joint, for programs that write it as BVH again.
fn extras(joint: &WrittenJoint) -> Extras {
    let sites = joint.end_sites.iter();
    Extras {
        bvh: Some(BvhExtras {
            channels: joint.channels_text(),
            end_sites: sites.map(glam::Vec3::to_array).collect(),
        }),
        tumble_origin: false,
    }
}

/// The f64 with the shortest digits of an f32.
fn shortest(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}

fn affine(rest: &Transform) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        rest.scale.as_dvec3(),
        rest.rotation.as_dquat(),
        rest.translation.as_dvec3(),
    )
}

/// The columns of the inverse matrix, whose last row is exactly 0 0 0 1. If there is no inverse, as for a joint with
/// scale 0, which is invisible at rest, it is the identity.
fn inverse(world: DAffine3) -> [f32; 16] {
    let columns = |of: DAffine3| {
        let DMat3 {
            x_axis,
            y_axis,
            z_axis,
        } = of.matrix3;
        let columns = [
            (x_axis, 0.0),
            (y_axis, 0.0),
            (z_axis, 0.0),
            (of.translation, 1.0),
        ];
        let rows = columns.map(|(v, last)| [v.x as f32, v.y as f32, v.z as f32, last]);
        std::array::from_fn(|i| rows[i / 4][i % 4])
    };
    let inverse: [f32; 16] = columns(world.inverse());
    match inverse.iter().all(|number| number.is_finite()) {
        true => inverse,
        false => columns(DAffine3::IDENTITY),
    }
}

/// The names that were used.
#[derive(Default)]
pub(in crate::gltf) struct UniqueNames(HashSet<String>);

impl UniqueNames {
    /// `name`, or `name#index` if `name` was used.
    pub(in crate::gltf) fn unique(&mut self, name: String, index: usize) -> String {
        let mut unique = name;
        while !self.0.insert(unique.clone()) {
            unique = format!("{unique}#{index}");
        }
        unique
    }
}
