//! Reads the meshes that move with the tracks of a clip: deformed by the joints of a skin, or fixed to a joint.

use std::collections::HashMap;

use glam::DMat4;

use crate::diagnostic::{Code, Diagnostic};
use crate::gltf::meshes::{Triangles, add, local_matrix, parents_first, shown};
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Mesh, Node, Primitive, Skin};
use crate::motion::Motion;
use crate::motion::carried_mesh::{Bone, CarriedMesh};

/// Bytes of memory of a vertex with its bones and weights, while they are read.
const VERTEX: usize = 160;

/// The largest number of bones, which are numbered in 16 bits.
const MAX_BONES: usize = u16::MAX as usize + 1;

/// The lists of a file that [`carried`] reads in addition to its nodes.
pub(super) const LISTS: [&str; 3] = ["meshes", "scenes", "skins"];

/// The meshes of the file's scene that move with tracks of a clip; `None` if there are none. The [`LISTS`] of the
/// file must have been split into entries.
///
/// # Errors
/// When a mesh or a skin is invalid or compressed in an unknown form, or when a joint of a skin is not a track of the
/// clip.
pub(super) fn carried(
    reader: &GltfReader<'_>,
    clip: &Motion,
) -> Result<Option<CarriedMesh>, Diagnostic> {
    let json = reader.json;
    let nodes = Nodes::read(json)?;
    let order = parents_first(&nodes);
    let is_shown = shown(json, &nodes, &order)?;
    let tracks = (0..clip.set.track_count()).map(|track| (clip.set.track_name(track), track));
    let mut making = CarriedMeshBuilder {
        reader,
        nodes: &nodes,
        tracks: tracks.collect(),
        mesh: CarriedMesh::default(),
    };
    for index in (0..nodes.count()).filter(|&index| is_shown[index]) {
        let node: Node = json.entry("nodes", index, "/nodes")?;
        if let Some(mesh) = node.mesh {
            making.add_node(index, mesh, node.skin)?;
        }
    }
    let found = making.mesh;
    Ok((!found.triangles.is_empty()).then_some(found))
}

struct CarriedMeshBuilder<'a, 'file> {
    reader: &'a GltfReader<'file>,
    nodes: &'a Nodes,
    /// The tracks by name; the names are those of their nodes.
    tracks: HashMap<String, usize>,
    mesh: CarriedMesh,
}

impl CarriedMeshBuilder<'_, '_> {
    fn add_node(
        &mut self,
        index: usize,
        mesh: usize,
        skin: Option<usize>,
    ) -> Result<(), Diagnostic> {
        let json = self.reader.json;
        let first_bone = self.mesh.bones.len();
        match skin {
            Some(skin) => self.add_bones(skin, index)?,
            None => match self.carrier(index)? {
                Some(bone) => self.mesh.bones.push(bone),
                // The clip has no keys for this target, so there is nothing to store.
                None => return Ok(()),
            },
        }
        let bones = self.mesh.bones.len();
        if bones > MAX_BONES {
            let message = format!("meshes follow {bones} joints, more than {MAX_BONES}");
            return Err(json.refuse(&format!("/nodes/{index}"), Code::IndexRange, message));
        }
        let entry: Mesh<'_> = json.entry("meshes", mesh, &format!("/nodes/{index}/mesh"))?;
        for (i, primitive) in entry.primitives.iter().enumerate() {
            let pointer = format!("/meshes/{mesh}/primitives/{i}");
            self.add_primitive(primitive, &pointer, first_bone, skin.is_some())?;
        }
        Ok(())
    }

    /// Adds the joints of a skin as bones.
    fn add_bones(&mut self, index: usize, node: usize) -> Result<(), Diagnostic> {
        let json = self.reader.json;
        let pointer = format!("/skins/{index}");
        let skin: Skin = json.entry("skins", index, &format!("/nodes/{node}/skin"))?;
        let inverses = match skin.inverse_bind_matrices {
            None => Vec::new(),
            Some(accessor) => {
                let from = format!("{pointer}/inverseBindMatrices");
                let matrices = self.reader.accessor(accessor, &from)?;
                self.reader.numbers(accessor, &matrices, 16, &from)?
            }
        };
        let inverses: Vec<&[f64]> = inverses.chunks_exact(16).collect();
        if !inverses.is_empty() && inverses.len() < skin.joints.len() {
            let message = format!(
                "{} matrices for {} joints",
                inverses.len(),
                skin.joints.len()
            );
            return Err(json.refuse(&pointer, Code::TooShort, message));
        }
        for (i, &joint) in skin.joints.iter().enumerate() {
            let from = format!("{pointer}/joints/{i}");
            if joint >= self.nodes.count() {
                return Err(json.no_such("nodes", joint, self.nodes.count(), &from));
            }
            let Some(&track) = self.tracks.get(self.nodes.name(joint)) else {
                let name = self.nodes.name(joint);
                let message = format!("the joint {name} of the skin is not a track of the clip");
                return Err(json.refuse(&from, Code::Property, message));
            };
            let to_joint = match inverses.get(i) {
                Some(inverse) => DMat4::from_cols_slice(inverse),
                None => DMat4::IDENTITY,
            };
            let to_joint = to_joint.as_mat4().to_cols_array();
            self.mesh.bones.push(Bone { track, to_joint });
        }
        Ok(())
    }

    /// The track that moves a node, with the node's rest transform in it.
    fn carrier(&self, node: usize) -> Result<Option<Bone>, Diagnostic> {
        let mut to_joint = DMat4::IDENTITY;
        let mut next = Some(node);
        while let Some(node) = next {
            if let Some(&track) = self.tracks.get(self.nodes.name(node)) {
                let to_joint = to_joint.as_mat4().to_cols_array();
                return Ok(Some(Bone { track, to_joint }));
            }
            let entry: Node = self.reader.json.entry("nodes", node, "/nodes")?;
            to_joint = local_matrix(&entry) * to_joint;
            next = self.nodes.parent(node);
        }
        Ok(None)
    }

    fn add_primitive(
        &mut self,
        primitive: &Primitive<'_>,
        pointer: &str,
        first_bone: usize,
        has_skin: bool,
    ) -> Result<(), Diagnostic> {
        let json = self.reader.json;
        let mut added = Triangles::default();
        add(self.reader, primitive, pointer, DMat4::IDENTITY, &mut added)?;
        let count = added.positions.len();
        self.reader.take(count, VERTEX, pointer)?;
        let attributes = &primitive.attributes;
        let (bones_of, weights) = match (has_skin, attributes.joints, attributes.weights) {
            (true, Some(joints), Some(weights)) => {
                let from = format!("{pointer}/attributes/JOINTS_0");
                let accessor = self.reader.accessor(joints, &from)?;
                let joints = self.reader.whole_numbers(joints, &accessor, 4, &from)?;
                let from = format!("{pointer}/attributes/WEIGHTS_0");
                let accessor = self.reader.accessor(weights, &from)?;
                let weights = self.reader.numbers(weights, &accessor, 4, &from)?;
                (joints, weights)
            }
            // If there are no weights, the whole mesh moves with the first joint.
            _ => {
                let all = |first: f64| [first, 0.0, 0.0, 0.0].repeat(count);
                (vec![0; count * 4], all(1.0))
            }
        };
        let lengths = [bones_of.len(), weights.len()].map(|length| length / 4);
        if lengths != [count, count] {
            let [joints, weights] = lengths;
            let message =
                format!("{count} positions, {joints} times joints, {weights} times weights");
            return Err(json.refuse(pointer, Code::TooShort, message));
        }
        let bones = self.mesh.bones.len() - first_bone;
        if let Some(&outside) = bones_of.iter().find(|&&bone| bone as usize >= bones) {
            return Err(json.no_such("the skin's joints", outside as usize, bones, pointer));
        }
        let first = self.mesh.positions.len();
        if first + count > u32::MAX as usize {
            let message = "the file has more than 4294967295 vertices; simplify it";
            return Err(json.refuse(pointer, Code::IndexRange, message));
        }
        let corners = added.triangles.iter();
        let moved = corners.map(|three| three.map(|corner| corner + first as u32));
        self.mesh.triangles.extend(moved);
        let positions = added
            .positions
            .iter()
            .map(|position| position.as_vec3().to_array());
        self.mesh.positions.extend(positions);
        let bones_of = bones_of.as_chunks().0.iter();
        let numbers =
            bones_of.map(|four: &[u32; 4]| four.map(|bone| (first_bone + bone as usize) as u16));
        self.mesh.bones_of.extend(numbers);
        let weights = weights.as_chunks().0.iter();
        self.mesh.weights.extend(weights.map(whole));
        Ok(())
    }
}

/// Weights with the sum 1. A vertex without weights follows the first bone.
fn whole(four: &[f64; 4]) -> [f32; 4] {
    let four = four.map(|weight| if weight > 0.0 { weight } else { 0.0 });
    let sum: f64 = four.iter().sum();
    match sum > 0.0 && sum.is_finite() {
        true => four.map(|weight| (weight / sum) as f32),
        false => [1.0, 0.0, 0.0, 0.0],
    }
}
