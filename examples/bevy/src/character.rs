//! A character of a glTF file: its clips for a crowd, its skin and its texture.

use std::collections::HashMap;
use std::error::Error;
use std::path::Path;

use bevy::asset::RenderAssetUsages;
use bevy::image::Image;
use bevy::mesh::{Indices, Mesh, MeshVertexAttribute, PrimitiveTopology, VertexAttributeValues};
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat, VertexFormat};
use tumble::crowd::CrowdLibrary;
use tumble::glam::{Affine3A, Mat4};
use tumble_formats::crowd_library::crowd_library;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::{Format, ReadOptions};

/// The joints of a vertex in the order of the library, and their weights. Bevy would skin a mesh with its own attributes
/// itself.
pub const JOINTS: MeshVertexAttribute =
    MeshVertexAttribute::new("TumbleJoints", 3_418_700_431, VertexFormat::Uint16x4);
pub const WEIGHTS: MeshVertexAttribute =
    MeshVertexAttribute::new("TumbleWeights", 3_418_700_432, VertexFormat::Float32x4);

/// A character, for a crowd and a renderer.
pub struct Character {
    pub library: CrowdLibrary,
    pub mesh: Mesh,
    pub texture: Image,
    /// The height of the mesh in the file's unit.
    pub height: f32,
}

impl Character {
    /// The first skin of the file, and all clips.
    pub fn read(file: &Path) -> Result<Self, Box<dyn Error>> {
        let clips = Format::open_detected(file, &ReadOptions::default())?.clips;
        let mut library = crowd_library(&clips, ChannelMethods::AUTHORED)?;
        let (document, buffers, images) = gltf::import(file)?;
        let node = document
            .nodes()
            .find(|node| node.mesh().is_some() && node.skin().is_some())
            .ok_or("the file has no mesh with a skin")?;
        let (skin, mesh) = (node.skin().ok_or("no skin")?, node.mesh().ok_or("no mesh")?);

        // Joints are matched by name: the skin has an order of its own.
        let indices: HashMap<&str, usize> = library
            .joint_names()
            .iter()
            .enumerate()
            .map(|(index, name)| (name.as_str(), index))
            .collect();
        let joint_of_skin: Vec<usize> = skin
            .joints()
            .map(|joint| {
                let name = joint.name().unwrap_or_default();
                let index = indices.get(name).copied();
                index.ok_or_else(|| format!("no clip moves the joint `{name}` of the skin"))
            })
            .collect::<Result<_, _>>()?;
        let matrices = skin
            .reader(|buffer| Some(&buffers[buffer.index()]))
            .read_inverse_bind_matrices()
            .ok_or("the skin has no inverse bind matrices")?;
        let mut inverse_bind = vec![Affine3A::IDENTITY; library.joint_count()];
        for (columns, &joint) in matrices.zip(&joint_of_skin) {
            inverse_bind[joint] = Affine3A::from_mat4(Mat4::from_cols_array_2d(&columns));
        }
        library.set_inverse_bind(&inverse_bind)?;

        let primitive = mesh.primitives().next().ok_or("the mesh is empty")?;
        let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
        let positions: Vec<[f32; 3]> = reader.read_positions().ok_or("no positions")?.collect();
        let heights = positions.iter().map(|position| position[1]);
        let height = heights.fold(0.0, f32::max);
        let joints: Vec<[u16; 4]> = (reader.read_joints(0).ok_or("no joints")?.into_u16())
            .map(|joints| joints.map(|joint| joint_of_skin[usize::from(joint)] as u16))
            .collect();
        let weights: Vec<[f32; 4]> = (reader.read_weights(0).ok_or("no weights")?)
            .into_f32()
            .collect();
        let uvs: Vec<[f32; 2]> = match reader.read_tex_coords(0) {
            Some(uvs) => uvs.into_f32().collect(),
            None => vec![[0.0; 2]; positions.len()],
        };
        let normals: Option<Vec<[f32; 3]>> = reader.read_normals().map(Iterator::collect);
        let indices = reader.read_indices().map(|list| list.into_u32().collect());
        let indices = indices.unwrap_or_else(|| (0..positions.len() as u32).collect());
        let mut mesh = Mesh::new(
            PrimitiveTopology::TriangleList,
            RenderAssetUsages::RENDER_WORLD,
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, uvs)
        .with_inserted_attribute(JOINTS, VertexAttributeValues::Uint16x4(joints))
        .with_inserted_attribute(WEIGHTS, weights)
        .with_inserted_indices(Indices::U32(indices));
        match normals {
            Some(normals) => mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, normals),
            None => mesh.compute_smooth_normals(),
        }

        let texture = (primitive.material().pbr_metallic_roughness()).base_color_texture();
        let texture = match texture.map(|info| &images[info.texture().source().index()]) {
            Some(image) => texture_of(image)?,
            None => Image::default(),
        };
        Ok(Self {
            library,
            mesh,
            texture,
            height,
        })
    }
}

fn texture_of(image: &gltf::image::Data) -> Result<Image, Box<dyn Error>> {
    let pixels = match image.format {
        gltf::image::Format::R8G8B8A8 => image.pixels.clone(),
        gltf::image::Format::R8G8B8 => {
            let pixels = image.pixels.chunks_exact(3);
            pixels.flat_map(|rgb| [rgb[0], rgb[1], rgb[2], 255]).collect()
        }
        other => return Err(format!("the texture has the format {other:?}").into()),
    };
    let size = Extent3d {
        width: image.width,
        height: image.height,
        depth_or_array_layers: 1,
    };
    let (dimension, format) = (TextureDimension::D2, TextureFormat::Rgba8UnormSrgb);
    let usages = RenderAssetUsages::RENDER_WORLD;
    Ok(Image::new(size, dimension, pixels, format, usages))
}
