//! The triangles of a scene with its nodes at rest.

use std::collections::HashSet;
use std::path::Path;

use glam::{DMat4, DQuat, DVec3};

use crate::diagnostic::{Code, Diagnostic};
use crate::gltf::container::Container;
use crate::gltf::json::Json;
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Mesh, Node, Primitive, Scene};
use crate::gltf::{FORMAT, check_version};
use crate::limits::Limits;
use crate::surface::{Polygons, Surface, SurfaceFormat, SurfaceKind};
use crate::warnings::Warnings;

/// The triangles of a file.
#[derive(Debug, Clone, Default)]
pub struct Triangles {
    /// Positions of the vertices, in the coordinates of the scene.
    pub positions: Vec<DVec3>,
    /// Three vertex indices for each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Warnings about the file.
    pub warnings: Vec<Diagnostic>,
}

/// The glTF format of surfaces: the meshes of a scene.
pub static SURFACE: SurfaceFormat = SurfaceFormat {
    name: FORMAT.name,
    summary: "glTF 2.0: the triangles of the scene, with its nodes at rest",
    extensions: FORMAT.extensions,
    kind: SurfaceKind::Mesh,
    read_bytes: |name, bytes, folder, limits| {
        let found = triangles_of(name, bytes, folder, limits)?;
        Ok(Surface::Mesh(Polygons {
            positions: found.positions,
            corners: found.triangles.into_flattened(),
            ends: Vec::new(),
            warnings: found.warnings,
        }))
    },
};

/// The triangles of all meshes of the file's scene, or of all nodes if the file names no scene. `name` is the input's
/// name in messages; `folder` is the folder of the files that it names.
///
/// # Errors
/// When the file or a mesh is invalid, or positions are compressed in an unknown form.
pub fn triangles_of(
    name: &str,
    bytes: Vec<u8>,
    folder: Option<&Path>,
    limits: Limits,
) -> Result<Triangles, Diagnostic> {
    let mut warnings = Warnings::new(name);
    let container = Container::parse(name, bytes, &mut warnings)?;
    let mut json = Json::parse(name, &container.text)?;
    json.take_apart("meshes")?;
    json.take_apart("scenes")?;
    check_version(&json)?;
    let reader = GltfReader::new(&json, &container, folder, limits, warnings)?;
    let nodes = Nodes::read(&json)?;
    let order = parents_first(&nodes);
    let is_shown = shown(&json, &nodes, &order)?;
    let mut to_world = vec![DMat4::IDENTITY; nodes.count()];
    for &index in &order {
        let node: Node = json.entry("nodes", index, "/nodes")?;
        let parent = nodes.parent(index).map(|parent| to_world[parent]);
        to_world[index] = parent.unwrap_or(DMat4::IDENTITY) * local_matrix(&node);
    }
    let mut all = Triangles::default();
    for index in (0..nodes.count()).filter(|&index| is_shown[index]) {
        let node: Node = json.entry("nodes", index, "/nodes")?;
        if let Some(mesh) = node.mesh {
            let node_to_world = to_world[index];
            let mesh_entry: Mesh = json.entry("meshes", mesh, &format!("/nodes/{index}/mesh"))?;
            for (i, primitive) in mesh_entry.primitives.iter().enumerate() {
                let pointer = format!("/meshes/{mesh}/primitives/{i}");
                add(&reader, primitive, &pointer, node_to_world, &mut all)?;
            }
        }
    }
    all.warnings = reader.warnings.into_inner().into_list();
    Ok(all)
}

/// All nodes, parents before their children.
pub(super) fn parents_first(nodes: &Nodes) -> Vec<usize> {
    let mut is_there = vec![false; nodes.count()];
    let mut order = Vec::with_capacity(nodes.count());
    let mut chain = Vec::new();
    for start in 0..nodes.count() {
        let mut next = Some(start);
        while let Some(node) = next.filter(|&node| !is_there[node]) {
            is_there[node] = true;
            chain.push(node);
            next = nodes.parent(node);
        }
        order.extend(chain.drain(..).rev());
    }
    order
}

/// The nodes of the scene and their descendants.
pub(super) fn shown(
    json: &Json<'_>,
    nodes: &Nodes,
    order: &[usize],
) -> Result<Vec<bool>, Diagnostic> {
    let Some(raw) = json.member("scene")? else {
        return Ok(vec![true; nodes.count()]);
    };
    let scene_index: usize = json.typed(raw, "/scene")?;
    let scene: Scene = json.entry("scenes", scene_index, "/scene")?;
    let roots: HashSet<usize> = scene.nodes.into_iter().collect();
    let mut is_shown = vec![false; nodes.count()];
    for &node in order {
        is_shown[node] = match nodes.parent(node) {
            Some(parent) => is_shown[parent],
            None => roots.contains(&node),
        };
    }
    Ok(is_shown)
}

/// The transform of a node at rest, relative to its parent.
pub(super) fn local_matrix(node: &Node) -> DMat4 {
    match node.matrix {
        Some(matrix) => DMat4::from_cols_array(&matrix),
        None => DMat4::from_scale_rotation_translation(
            node.scale.map_or(DVec3::ONE, DVec3::from_array),
            node.rotation.map_or(DQuat::IDENTITY, |rotation| {
                DQuat::from_array(rotation).normalize()
            }),
            node.translation.map_or(DVec3::ZERO, DVec3::from_array),
        ),
    }
}

/// Bytes of memory of a vertex and of a triangle: here, while they are read, and in the mesh.
const VERTEX: usize = 200;
const TRIANGLE: usize = 400;

/// Adds the triangles of a primitive, transformed to the world.
pub(super) fn add(
    reader: &GltfReader<'_>,
    primitive: &Primitive<'_>,
    pointer: &str,
    to_world: DMat4,
    all: &mut Triangles,
) -> Result<(), Diagnostic> {
    let json = reader.json;
    // 4 triangles, 5 a strip, 6 a fan (glTF 2.0, 3.7.2.1); points and lines have no area.
    if !(4..=6).contains(&primitive.mode) {
        return Ok(());
    }
    if primitive
        .extensions
        .get("KHR_draco_mesh_compression")
        .is_some()
    {
        let message = "the mesh is compressed by Draco, which is not supported; export it without compression";
        return Err(json.refuse(pointer, Code::Extension, message));
    }
    let Some(position) = primitive.attributes.position else {
        return Ok(());
    };
    let from = format!("{pointer}/attributes/POSITION");
    let accessor = reader.accessor(position, &from)?;
    let count = usize::try_from(accessor.count).unwrap_or(usize::MAX);
    reader.take(count, VERTEX, pointer)?;
    let numbers = reader.numbers(position, &accessor, 3, &from)?;
    let first = all.positions.len();
    let count = numbers.len() / 3;
    if first + count > u32::MAX as usize {
        let message = "the file has more than 4294967295 vertices; simplify it";
        return Err(json.refuse(pointer, Code::IndexRange, message));
    }
    let positions = numbers.chunks_exact(3).map(DVec3::from_slice);
    all.positions
        .extend(positions.map(|point| to_world.transform_point3(point)));
    let indices: Vec<u32> = match primitive.indices {
        None => {
            reader.take(count, TRIANGLE, pointer)?;
            (0..count as u32).collect()
        }
        Some(indices) => {
            let from = format!("{pointer}/indices");
            let accessor = reader.accessor(indices, &from)?;
            let count = usize::try_from(accessor.count).unwrap_or(usize::MAX);
            let corners = if primitive.mode == 4 { 3 } else { 1 };
            reader.take(count / corners, TRIANGLE, pointer)?;
            reader.indices(indices, &accessor, &from)?
        }
    };
    if let Some(outside) = indices.iter().find(|&&index| index as usize >= count) {
        return Err(json.no_such("positions", *outside as usize, count, pointer));
    }
    let corner = |index: u32| first as u32 + index;
    let mut push = |indices: [u32; 3]| all.triangles.push(indices.map(corner));
    match primitive.mode {
        4 => indices
            .chunks_exact(3)
            .for_each(|triangle| push([triangle[0], triangle[1], triangle[2]])),
        5 => indices
            .windows(3)
            .enumerate()
            .for_each(|(triangle, strip)| {
                let swap = triangle % 2;
                push([strip[0], strip[1 + swap], strip[2 - swap]]);
            }),
        _ => indices
            .windows(2)
            .skip(1)
            .for_each(|edge| push([indices[0], edge[0], edge[1]])),
    }
    Ok(())
}
