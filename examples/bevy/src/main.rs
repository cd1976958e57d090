//! Ten thousand skinned characters in Bevy, each at its own time of a clip:
//! `cargo run --release --manifest-path examples/bevy/Cargo.toml -- fox.glb [CHARACTERS] [PICTURE.png]`.
//!
//! With the name of a picture there is no window: 60 frames are drawn, the last one is written, and its matrices are
//! compared with those of the CPU.

mod character;
mod crowd;

use std::error::Error;
use std::path::PathBuf;
use std::time::Duration;

use bevy::app::ScheduleRunnerPlugin;
use bevy::asset::{RenderAssetUsages, embedded_asset};
use bevy::camera::RenderTarget;
use bevy::mesh::{MeshTag, MeshVertexBufferLayoutRef};
use bevy::pbr::{MaterialPipeline, MaterialPipelineKey};
use bevy::prelude::*;
use bevy::render::render_resource::{
    AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError, TextureFormat,
    TextureUsages,
};
use bevy::render::storage::ShaderBuffer;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy::shader::ShaderRef;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;

use character::{Character, JOINTS, WEIGHTS};
use crowd::{CrowdPlugin, FRAMES, Posed};

const SHADER: &str = "embedded://tumble_bevy_example/foxes.wesl";

/// The material of all characters: the matrices that Tumble writes, and the file's texture.
#[derive(Asset, TypePath, AsBindGroup, Debug, Clone)]
struct Skinned {
    #[storage(0, read_only, visibility(vertex))]
    matrices: Handle<ShaderBuffer>,
    #[uniform(1)]
    joints: u32,
    #[texture(2)]
    #[sampler(3)]
    base_color: Handle<Image>,
}

impl Material for Skinned {
    fn vertex_shader() -> ShaderRef {
        SHADER.into()
    }

    fn fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        layout: &MeshVertexBufferLayoutRef,
        _: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let vertex = layout.0.get_layout(&[
            Mesh::ATTRIBUTE_POSITION.at_shader_location(0),
            Mesh::ATTRIBUTE_NORMAL.at_shader_location(1),
            Mesh::ATTRIBUTE_UV_0.at_shader_location(2),
            JOINTS.at_shader_location(3),
            WEIGHTS.at_shader_location(4),
        ])?;
        descriptor.vertex.buffers = vec![vertex];
        Ok(())
    }
}

/// The things that the first frame needs.
#[derive(Resource)]
struct Scene {
    character: Option<Character>,
    characters: usize,
    picture: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("give a glTF file with a skin and animations")?;
    let characters = arguments.next().map_or(Ok(10_000), |text| text.parse())?;
    let picture = arguments.next().map(PathBuf::from);
    let character = Character::read(file.as_ref())?;

    let mut app = App::new();
    let plugins = DefaultPlugins.set(ImagePlugin::default_nearest());
    match picture {
        None => app.add_plugins(plugins),
        Some(_) => app
            .add_plugins(plugins.disable::<WinitPlugin>().set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..default()
            }))
            .add_plugins(ScheduleRunnerPlugin::run_loop(Duration::ZERO)),
    };
    embedded_asset!(app, "foxes.wesl");
    app.add_plugins((
        MaterialPlugin::<Skinned>::default(),
        CrowdPlugin {
            library: character.library.clone(),
            characters,
            is_checked: picture.is_some(),
        },
    ))
    .insert_resource(Scene {
        character: Some(character),
        characters,
        picture,
    })
    .add_systems(Startup, set_up)
    .add_systems(Update, take_picture)
    .run();
    Ok(())
}

/// The characters stand in rows. They share a mesh and a material, so Bevy draws them by one call.
fn set_up(
    mut commands: Commands,
    mut scene: ResMut<Scene>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut images: ResMut<Assets<Image>>,
    mut buffers: ResMut<Assets<ShaderBuffer>>,
    mut materials: ResMut<Assets<Skinned>>,
) {
    let Some(character) = scene.character.take() else {
        return;
    };
    let (characters, joints) = (scene.characters, character.library.joint_count());
    // A buffer with content: wgpu would clear an empty one after Tumble has written it.
    let zeros = vec![[0.0_f32; 4]; 3 * joints * characters];
    let matrices = buffers.add(ShaderBuffer::new(zeros, RenderAssetUsages::RENDER_WORLD));
    commands.insert_resource(Posed(matrices.clone()));
    let material = materials.add(Skinned {
        matrices,
        joints: joints as u32,
        base_color: images.add(character.texture),
    });
    let mesh = meshes.add(character.mesh);
    let columns = (characters as f32).sqrt().ceil() as usize;
    let (size, distance) = (1.0 / character.height, 1.6);
    let middle = (columns as f32 - 1.0) / 2.0;
    for index in 0..characters {
        let coordinate = |cell: usize| (cell as f32 - middle) * distance;
        let (x, z) = (coordinate(index % columns), coordinate(index / columns));
        commands.spawn((
            Mesh3d(mesh.clone()),
            MeshMaterial3d(material.clone()),
            MeshTag::new(index as u32),
            Transform::from_xyz(x, 0.0, z).with_scale(Vec3::splat(size)),
        ));
    }
    let extent = middle * distance;
    let camera = commands
        .spawn((
            Camera3d::default(),
            Transform::from_xyz(extent * 0.5, 4.0 + extent * 0.25, extent * 1.15)
                .looking_at(Vec3::new(0.0, 0.0, extent * 0.4), Vec3::Y),
        ))
        .id();
    if let Some(picture) = scene.picture.take() {
        let format = TextureFormat::Rgba8UnormSrgb;
        let mut image = Image::new_target_texture(1280, 720, format, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let image = images.add(image);
        commands
            .entity(camera)
            .insert(RenderTarget::Image(image.clone().into()));
        commands.insert_resource(Picture { image, picture });
    }
}

/// The picture that is written after the last frame.
#[derive(Resource)]
struct Picture {
    image: Handle<Image>,
    picture: PathBuf,
}

/// Writes the picture when enough frames were drawn, and then ends.
fn take_picture(
    mut commands: Commands,
    picture: Option<Res<Picture>>,
    mut frames: Local<u32>,
    mut exit: MessageWriter<AppExit>,
) {
    let Some(picture) = picture else {
        return;
    };
    *frames += 1;
    // The render world starts later than this one.
    if *frames == FRAMES + 20 {
        commands
            .spawn(Screenshot::image(picture.image.clone()))
            .observe(save_to_disk(picture.picture.clone()));
    }
    if *frames > FRAMES + 20 && picture.picture.exists() {
        exit.write(AppExit::Success);
    }
}
