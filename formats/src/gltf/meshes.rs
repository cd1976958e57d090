//! The triangles of a scene, where its nodes rest.

use std::path::Path;

use glam::{DMat4, DQuat, DVec3};

use crate::diagnostic::{Code, Diagnostic};
use crate::gltf::container::Container;
use crate::gltf::json::Json;
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::Reader;
use crate::gltf::schema::{Mesh, Node, Primitive, Scene};
use crate::gltf::{bytes_of, check_version};
use crate::text::lines::Limits;
use crate::warnings::Warnings;

/// Triangles of a whole file.
#[derive(Debug, Clone, Default)]
pub struct Triangles {
    /// Of the vertices, in the scene.
    pub positions: Vec<DVec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// What was odd with the file.
    pub warnings: Vec<Diagnostic>,
}

/// Reads the triangles of all meshes that nodes of the file's scene carry; of all nodes where it
/// names no scene. `-` is standard input.
///
/// # Errors
/// When the file or a mesh is broken, or its positions are compressed in a way that is not known.
pub fn read_triangles(path: &Path, limits: Limits) -> Result<Triangles, Diagnostic> {
    let (name, bytes, folder) = bytes_of(path, limits, false)?;
    let mut warnings = Warnings::new(&name);
    let container = Container::parse(&name, bytes, &mut warnings)?;
    let mut json = Json::parse(&name, &container.text)?;
    json.take_apart("meshes")?;
    json.take_apart("scenes")?;
    check_version(&json)?;
    let reader = Reader::new(&json, &container, folder, limits.file, warnings)?;
    let nodes = Nodes::read(&json)?;
    let is_shown = shown(&json, &nodes)?;
    let mut all = Triangles::default();
    for index in (0..nodes.count()).filter(|&index| is_shown[index]) {
        let node: Node = json.entry("nodes", index, "/nodes")?;
        if let Some(mesh) = node.mesh {
            let place = world(&json, &nodes, index)?;
            let mesh_entry: Mesh = json.entry("meshes", mesh, &format!("/nodes/{index}/mesh"))?;
            for (own, primitive) in mesh_entry.primitives.iter().enumerate() {
                let pointer = format!("/meshes/{mesh}/primitives/{own}");
                add(&reader, primitive, &pointer, place, &mut all)?;
            }
        }
    }
    all.warnings = reader.warnings.into_inner().into_list();
    Ok(all)
}

/// The nodes of the scene and those that hang on them.
fn shown(json: &Json<'_>, nodes: &Nodes) -> Result<Vec<bool>, Diagnostic> {
    let Some(raw) = json.member("scene")? else {
        return Ok(vec![true; nodes.count()]);
    };
    let scene: usize = json.typed(raw, "/scene")?;
    let scene: Scene = json.entry("scenes", scene, "/scene")?;
    // The root of a node is in the scene.
    let root = |mut node| {
        while let Some(parent) = nodes.parent(node) {
            node = parent;
        }
        node
    };
    Ok((0..nodes.count())
        .map(|node| scene.nodes.contains(&root(node)))
        .collect())
}

/// Where a node rests in the scene.
fn world(json: &Json<'_>, nodes: &Nodes, node: usize) -> Result<DMat4, Diagnostic> {
    let mut place = DMat4::IDENTITY;
    let mut next = Some(node);
    while let Some(index) = next {
        let node: Node = json.entry("nodes", index, "/nodes")?;
        let own = match node.matrix {
            Some(matrix) => DMat4::from_cols_array(&matrix),
            None => DMat4::from_scale_rotation_translation(
                node.scale.map_or(DVec3::ONE, DVec3::from_array),
                node.rotation
                    .map_or(DQuat::IDENTITY, |own| DQuat::from_array(own).normalize()),
                node.translation.map_or(DVec3::ZERO, DVec3::from_array),
            ),
        };
        place = own * place;
        next = nodes.parent(index);
    }
    Ok(place)
}

fn add(
    reader: &Reader<'_>,
    primitive: &Primitive<'_>,
    pointer: &str,
    place: DMat4,
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
        let message = "the mesh is compressed by Draco, which is not known; export it without";
        return Err(json.refuse(pointer, Code::Extension, message));
    }
    let Some(position) = primitive.attributes.position else {
        return Ok(());
    };
    let from = format!("{pointer}/attributes/POSITION");
    let accessor = reader.accessor(position, &from)?;
    let numbers = reader.numbers(position, &accessor, 3, &from)?;
    let first = all.positions.len();
    let count = numbers.len() / 3;
    if first + count > u32::MAX as usize {
        let message = "the file has more than 4294967295 vertices; simplify it";
        return Err(json.refuse(pointer, Code::IndexRange, message));
    }
    let positions = numbers.chunks_exact(3).map(DVec3::from_slice);
    all.positions
        .extend(positions.map(|own| place.transform_point3(own)));
    let indices: Vec<u32> = match primitive.indices {
        None => (0..count as u32).collect(),
        Some(indices) => {
            let from = format!("{pointer}/indices");
            let accessor = reader.accessor(indices, &from)?;
            reader.indices(indices, &accessor, &from)?
        }
    };
    if let Some(outside) = indices.iter().find(|&&index| index as usize >= count) {
        return Err(json.no_such("positions", *outside as usize, count, pointer));
    }
    let corner = |index: u32| first as u32 + index;
    let mut push = |own: [u32; 3]| all.triangles.push(own.map(corner));
    match primitive.mode {
        4 => indices
            .chunks_exact(3)
            .for_each(|own| push([own[0], own[1], own[2]])),
        5 => indices.windows(3).enumerate().for_each(|(place, own)| {
            let swap = place % 2;
            push([own[0], own[1 + swap], own[2 - swap]]);
        }),
        _ => indices
            .windows(2)
            .skip(1)
            .for_each(|own| push([indices[0], own[0], own[1]])),
    }
    Ok(())
}
