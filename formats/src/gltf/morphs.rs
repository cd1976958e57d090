//! Morph targets: how many the mesh of a node has, and their names, which become those of scalars.

use std::collections::{HashMap, HashSet};

use serde_json::value::RawValue;

use crate::diagnostic::Diagnostic;
use crate::gltf::json::Json;
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{MorphExtras, MorphMesh};

/// The morph targets of all meshes.
#[derive(Default)]
pub(super) struct Morphs {
    meshes: Vec<MeshTargets>,
    /// How many targets of nodes have a name.
    uses: HashMap<String, usize>,
}

/// The morph targets of a mesh.
#[derive(Default)]
struct MeshTargets {
    count: usize,
    /// Their names in its extras; empty if it has none, or repeats one. There may be fewer than targets.
    names: Vec<String>,
}

impl Morphs {
    /// The targets of a file. Meshes with errors have none, because no animation needs them.
    ///
    /// # Errors
    /// When the names take more memory than the budget allows.
    pub(super) fn read(reader: &GltfReader<'_>, nodes: &Nodes) -> Result<Self, Diagnostic> {
        let json = reader.json;
        if !has_weights(json) {
            return Ok(Self::default());
        }
        let meshes = json.optional::<&RawValue>("meshes").into_iter();
        let meshes: Vec<MeshTargets> = meshes.map(MeshTargets::of).collect();
        let mut users = vec![0; meshes.len()];
        for mesh in (0..nodes.count()).filter_map(|node| nodes.mesh(node)) {
            if let Some(users) = users.get_mut(mesh) {
                *users += 1;
            }
        }
        let mut morphs = Self {
            meshes,
            uses: HashMap::new(),
        };
        for (mesh, users) in morphs.meshes.iter().zip(users) {
            let bytes = mesh.names.iter().map(|name| 2 * (name.len() + NAME));
            reader.take(bytes.sum(), 1, "/meshes")?;
            for name in mesh.names.iter().filter(|name| !name.is_empty()) {
                *morphs.uses.entry(name.clone()).or_default() += users;
            }
        }
        Ok(morphs)
    }

    /// The number of morph targets of a node's mesh; 0 for a node without a mesh.
    pub(super) fn count(&self, nodes: &Nodes, node: usize) -> usize {
        self.of_node(nodes, node).map_or(0, |mesh| mesh.count)
    }

    /// The name of the scalar of a target: the target's name if no other target has the same, else `NODE.NAME`; without
    /// a name `NODE.weights[3]`.
    pub(super) fn name(&self, nodes: &Nodes, node: usize, target: usize) -> String {
        let mesh = self.of_node(nodes, node);
        let name = mesh.and_then(|mesh| mesh.names.get(target));
        let node = nodes.name(node);
        match name.filter(|name| !name.is_empty()) {
            Some(name) if self.uses.get(name) == Some(&1) => name.clone(),
            Some(name) => format!("{node}.{name}"),
            None => format!("{node}.weights[{target}]"),
        }
    }

    fn of_node(&self, nodes: &Nodes, node: usize) -> Option<&MeshTargets> {
        self.meshes.get(nodes.mesh(node)?)
    }
}

/// Bytes of memory of a name without its characters.
const NAME: usize = 64;

/// Whether a channel may move weights, by its path or by a pointer.
fn has_weights(json: &Json<'_>) -> bool {
    ["\"weights\"", "/weights\""]
        .iter()
        .any(|path| json.text.contains(path))
}

impl MeshTargets {
    fn of(mesh: &RawValue) -> Self {
        let Ok(mesh) = serde_json::from_str::<MorphMesh<'_>>(mesh.get()) else {
            return Self::default();
        };
        let count = mesh
            .primitives
            .first()
            .map_or(0, |first| first.targets.len());
        let extras = mesh.extras.map(RawValue::get);
        let extras = extras.and_then(|extras| serde_json::from_str::<MorphExtras>(extras).ok());
        let mut names = extras.map(|extras| extras.target_names).unwrap_or_default();
        names.truncate(count);
        let mut known = HashSet::new();
        let is_new: Vec<bool> = names
            .iter()
            .map(|name| known.insert(name.clone()))
            .collect();
        for (name, is_new) in names.iter_mut().zip(is_new) {
            if !is_new {
                name.clear();
            }
        }
        Self { count, names }
    }
}
