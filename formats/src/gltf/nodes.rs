//! The nodes of a file: their parents, names and rest transforms.

use std::cell::OnceCell;
use std::collections::{BTreeSet, HashMap, HashSet};

use glam::{DQuat, DVec3, Vec3};
use serde_json::value::RawValue;

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::gltf::json::Json;
use crate::gltf::matrix::split;
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Extras, Node, NodeBeside, OriginExtras, Skin};
use crate::motion::Transform;
use crate::motion::WrittenJoint;
use crate::motion::keys::{Duplicates, Origin};

/// Every node of a file.
pub(super) struct Nodes {
    list: Vec<Node>,
    parents: Vec<Option<usize>>,
    names: Vec<String>,
    rests: Vec<OnceCell<Result<RestPose, Diagnostic>>>,
    /// The joints of each skin that exist as nodes.
    skins: Vec<Vec<usize>>,
    /// The skins of each node that is a joint.
    skins_of: HashMap<usize, Vec<usize>>,
    /// How a file of BVH wrote the joints that became nodes; empty if the file does not contain it.
    written_joints: Vec<WrittenJoint>,
    /// For each node that is only an origin, the vector that it adds to the positions of its children.
    origins: Vec<Option<DVec3>>,
}

/// The rest transform of a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestPose {
    pub(super) transform: Transform,
    /// Whether its matrix has shear or a projection, which a transform does not have.
    pub(super) is_sheared: bool,
}

impl Nodes {
    /// # Errors
    /// When a node is invalid, or when the nodes are not trees.
    pub(super) fn read(json: &Json<'_>) -> Result<Self, Diagnostic> {
        let count = json.entries("nodes").len();
        let node = |index| json.entry("nodes", index, "/nodes");
        let list: Vec<Node> = (0..count).map(node).collect::<Result<_, _>>()?;
        let skins = json.optional::<Skin>("skins").into_iter();
        let skins = skins.map(|skin| skin.joints);
        let skins: Vec<Vec<usize>> = skins
            .map(|joints| joints.into_iter().filter(|&joint| joint < count).collect())
            .collect();
        let mut skins_of: HashMap<usize, Vec<usize>> = HashMap::new();
        for (skin, joints) in skins.iter().enumerate() {
            for &joint in joints {
                skins_of.entry(joint).or_default().push(skin);
            }
        }
        Ok(Self {
            skins,
            skins_of,
            written_joints: written_joints(json),
            origins: origins(json, &list),
            parents: parents(json, &list)?,
            names: names(&list),
            rests: list.iter().map(|_| OnceCell::new()).collect(),
            list,
        })
    }

    pub(super) fn count(&self) -> usize {
        self.list.len()
    }

    pub(super) fn parent(&self, node: usize) -> Option<usize> {
        self.parents[node]
    }

    /// The parent of a node, without nodes that are origins, and the translation of these origins.
    pub(super) fn carrier(&self, node: usize) -> (Option<usize>, DVec3) {
        let mut origin = DVec3::ZERO;
        let mut next = self.parents[node];
        while let Some(parent) = next
            && let Some(moved) = self.origins.get(parent).copied().flatten()
        {
            origin += moved;
            next = self.parents[parent];
        }
        (next, origin)
    }

    /// Whether a node is only an origin.
    pub(super) fn is_origin(&self, node: usize) -> bool {
        self.origins.get(node).is_some_and(Option::is_some)
    }

    /// The name of a node's track, which is unique.
    pub(super) fn name(&self, node: usize) -> &str {
        &self.names[node]
    }

    /// Adds the nodes that are connected with those in `nodes`: all their ancestors, and all joints of a skin that
    /// contains one of them.
    pub(super) fn complete(&self, nodes: &mut BTreeSet<usize>) {
        let mut open: Vec<usize> = std::mem::take(nodes).into_iter().collect();
        let mut is_done = vec![false; self.skins.len()];
        while let Some(node) = open.pop() {
            if !nodes.insert(node) {
                continue;
            }
            open.extend(self.carrier(node).0);
            for &skin in self.skins_of.get(&node).into_iter().flatten() {
                if !std::mem::replace(&mut is_done[skin], true) {
                    open.extend(&self.skins[skin]);
                }
            }
        }
    }

    /// How a file of BVH wrote the joint that became a node; `None` if the file does not contain it.
    pub(super) fn written_joint(&self, node: usize) -> Option<&WrittenJoint> {
        self.written_joints.get(node)
    }

    /// The mesh of a node.
    pub(super) fn mesh(&self, node: usize) -> Option<usize> {
        self.list[node].mesh
    }

    pub(super) fn has_matrix(&self, node: usize) -> bool {
        self.list[node].matrix.is_some()
    }

    /// The rest transform of a node.
    ///
    /// # Errors
    /// When its numbers are too large for f32, or when its rotation is invalid.
    pub(super) fn rest(
        &self,
        node: usize,
        reader: &GltfReader<'_>,
    ) -> Result<RestPose, Diagnostic> {
        let find = || find_rest(&self.list[node], node, reader);
        self.rests[node].get_or_init(find).clone()
    }
}

/// How a file of BVH wrote the joints, if the extras of nodes contain it, as Tumble writes them.
fn written_joints(json: &Json<'_>) -> Vec<WrittenJoint> {
    if !json.text.contains("\"bvh\"") {
        return Vec::new();
    }
    let joint = |raw: &&RawValue| {
        let beside: NodeBeside<'_> = serde_json::from_str(raw.get()).ok()?;
        let extras: Extras = serde_json::from_str(beside.extras?.get()).ok()?;
        let sites = extras.bvh.end_sites.into_iter();
        let sites: Vec<Vec3> = sites
            .map(|site| DVec3::from_array(site).as_vec3())
            .collect();
        let is_whole = sites.iter().all(|site| site.is_finite());
        Some(WrittenJoint {
            channels: WrittenJoint::channels_of(&extras.bvh.channels).filter(|_| is_whole)?,
            end_sites: sites,
        })
    };
    let all: Vec<Option<WrittenJoint>> = json.entries("nodes").iter().map(joint).collect();
    match all.iter().any(Option::is_some) {
        true => all.into_iter().map(Option::unwrap_or_default).collect(),
        false => Vec::new(),
    }
}

/// The nodes that are origins, as Tumble writes them: nodes that only translate their children.
fn origins(json: &Json<'_>, list: &[Node]) -> Vec<Option<DVec3>> {
    if !json.text.contains("\"tumbleOrigin\"") {
        return Vec::new();
    }
    let origin = |(node, raw): (&Node, &&RawValue)| {
        let beside: NodeBeside<'_> = serde_json::from_str(raw.get()).ok()?;
        let extras: OriginExtras = serde_json::from_str(beside.extras?.get()).ok()?;
        let is_plain = node.matrix.is_none()
            && node
                .rotation
                .is_none_or(|rotation| rotation == [0.0, 0.0, 0.0, 1.0])
            && node.scale.is_none_or(|scale| scale == [1.0; 3]);
        let at = node.translation.map(DVec3::from_array);
        at.filter(|at| extras.tumble_origin && is_plain && at.is_finite())
    };
    list.iter()
        .zip(json.entries("nodes").iter())
        .map(origin)
        .collect()
}

/// The parent of each node.
fn parents(json: &Json<'_>, list: &[Node]) -> Result<Vec<Option<usize>>, Diagnostic> {
    let mut parents: Vec<Option<usize>> = vec![None; list.len()];
    for (parent, node) in list.iter().enumerate() {
        for (i, &child) in node.children.iter().enumerate() {
            let pointer = format!("/nodes/{parent}/children/{i}");
            match parents.get_mut(child) {
                None => return Err(json.no_such("nodes", child, list.len(), &pointer)),
                Some(unset @ None) => *unset = Some(parent),
                Some(Some(other)) => {
                    let message = format!(
                        "node {child} is a child of nodes {other} and {parent}; a node has at most one parent"
                    );
                    return Err(json.refuse(&pointer, Code::NodeTree, message));
                }
            }
        }
    }
    // For each node, the number of the traversal that visited it, from 1.
    let mut walks = vec![0; list.len()];
    for start in 0..list.len() {
        let mut next = Some(start);
        while let Some(node) = next.filter(|&node| walks[node] == 0) {
            walks[node] = start + 1;
            next = parents[node];
        }
        if let Some(node) = next.filter(|&node| walks[node] == start + 1) {
            let message = format!("node {node} is its own ancestor");
            return Err(json.refuse(&format!("/nodes/{node}"), Code::NodeTree, message));
        }
    }
    Ok(parents)
}

/// The names of the nodes; `node7` for a node without a name, and `hand#12` if an earlier node is named `hand`.
fn names(list: &[Node]) -> Vec<String> {
    let mut used = HashSet::new();
    let name = |(index, node): (usize, &Node)| {
        let stored_name = node.name.clone().filter(|name| !name.is_empty());
        let mut name = stored_name.unwrap_or_else(|| format!("node{index}"));
        while !used.insert(name.clone()) {
            name = format!("{name}#{index}");
        }
        name
    };
    list.iter().enumerate().map(name).collect()
}

fn find_rest(node: &Node, index: usize, reader: &GltfReader<'_>) -> Result<RestPose, Diagnostic> {
    let pointer = format!("/nodes/{index}");
    let too_large = |property: &str| {
        let message = "a number here passes the largest f32, 3.4e38";
        reader
            .json
            .refuse(&format!("{pointer}/{property}"), Code::TooLarge, message)
    };
    if let Some(matrix) = node.matrix {
        let (transform, is_sheared) = split(matrix).ok_or_else(|| too_large("matrix"))?;
        return Ok(RestPose {
            transform,
            is_sheared,
        });
    }
    let mut transform = Transform::default();
    let vector = |components: Option<[f64; 3]>, property| match components {
        None => Ok(None),
        Some(components) => {
            let vector = Vec3::from_array(components.map(|number| number as f32));
            vector
                .is_finite()
                .then_some(Some(vector))
                .ok_or_else(|| too_large(property))
        }
    };
    if let Some(translation) = vector(node.translation, "translation")? {
        transform.translation = translation;
    }
    if let Some(scale) = vector(node.scale, "scale")? {
        transform.scale = scale;
    }
    if let Some(rotation) = node.rotation {
        let origin = Origin {
            file: reader.json.name,
            location: &|_| Location::Inside(format!("{pointer}/rotation")),
            duplicates: Duplicates::default(),
        };
        let keys = origin.unit(
            [DQuat::from_array(rotation)],
            &mut reader.warnings.borrow_mut(),
        )?;
        transform.rotation = keys[0];
    }
    Ok(RestPose {
        transform,
        is_sheared: false,
    })
}
