//! The crowd in Bevy's render world: it is prepared when the buffer of matrices exists, and recorded before the cameras.

use std::error::Error;

use bevy::core_pipeline::schedule::camera_driver;
use bevy::prelude::*;
use bevy::render::extract_resource::{ExtractResource, ExtractResourcePlugin};
use bevy::render::render_asset::RenderAssets;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue};
use bevy::render::storage::{GpuShaderBuffer, ShaderBuffer};
use bevy::render::{Render, RenderApp, RenderSystems};
use tumble::crowd::{Crowd, CrowdError, CrowdLayer, CrowdLibrary, CrowdValues};
use tumble::verify::{Agreement, WordType, compare_buffers};
use tumble::vulkan::CrowdTarget;
use tumble::{Device, Engine, EngineOptions, WrapMode};

/// The frames that are drawn for a picture.
pub const FRAMES: u32 = 60;

/// The buffer of matrices.
#[derive(Resource, Clone, ExtractResource)]
#[extract_app(RenderApp)]
pub struct Posed(pub Handle<ShaderBuffer>);

/// Plays a crowd of so many characters.
pub struct CrowdPlugin {
    pub library: CrowdLibrary,
    pub characters: usize,
    /// Whether the matrices of frame [`FRAMES`] are compared with the CPU's.
    pub is_checked: bool,
}

#[derive(Resource)]
struct Cast {
    library: CrowdLibrary,
    characters: usize,
    is_checked: bool,
}

/// A crowd on Bevy's device. Its fields are dropped in this order: the device last.
#[derive(Resource)]
struct Playing {
    target: CrowdTarget,
    crowd: Crowd,
    frame: u32,
    buffer: wgpu::Buffer,
    device: wgpu::Device,
}

impl Drop for Playing {
    fn drop(&mut self) {
        // Nothing may use the target any more.
        let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
    }
}

impl Plugin for CrowdPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(ExtractResourcePlugin::<Posed>::default());
        let render = app.sub_app_mut(RenderApp);
        render
            .insert_resource(Cast {
                library: self.library.clone(),
                characters: self.characters,
                is_checked: self.is_checked,
            })
            .add_systems(Render, prepare.in_set(RenderSystems::PrepareResources))
            .add_systems(RenderGraph, record.before(camera_driver))
            .add_systems(Render, check.after(RenderSystems::Render));
    }
}

/// Every character plays a clip of the library in a loop, from a time and at a speed of its own.
pub fn start_layers(crowd: &mut Crowd, characters: usize) -> Result<(), CrowdError> {
    let clips = crowd.library().clip_count();
    for character in 0..characters {
        let layer = CrowdLayer::new(character % clips)
            .at(character as i64 * 99_731)
            .with_speed(0.75 + (character % 11) as f32 * 0.05)
            .with_wrap(WrapMode::Loop);
        crowd.set(character, 0, layer)?;
    }
    Ok(())
}

/// Prepares the crowd once. This system runs alone in Bevy's render world, so nothing else submits to the queue.
fn prepare(world: &mut World) -> Result<(), BevyError> {
    if world.contains_resource::<Playing>() {
        return Ok(());
    }
    let buffers = world.resource::<RenderAssets<GpuShaderBuffer>>();
    let posed = world.get_resource::<Posed>();
    let Some(matrices) = posed.and_then(|posed| buffers.get(&posed.0)) else {
        return Ok(());
    };
    let buffer: wgpu::Buffer = (*matrices.buffer).clone();
    let device = world.resource::<RenderDevice>().wgpu_device().clone();
    let cast = world.resource::<Cast>();
    // SAFETY: the crowd is dropped before its clone of the device.
    let engine = unsafe {
        let handles = tumble_wgpu::handles(&device)?;
        Engine::from_vulkan(handles, &EngineOptions::default())?
    };
    let mut crowd = engine.crowd(&cast.library, cast.characters, 1)?;
    start_layers(&mut crowd, cast.characters)?;
    // SAFETY: the buffer is a storage buffer and is kept beside the target.
    let target = unsafe { crowd.target(CrowdValues::Skinning, tumble_wgpu::range(&buffer)?)? };
    world.insert_resource(Playing {
        target,
        crowd,
        frame: 0,
        buffer,
        device,
    });
    Ok(())
}

/// Records the next frame of the crowd, before the cameras draw.
fn record(mut context: RenderContext, playing: Option<ResMut<Playing>>) -> Result<(), BevyError> {
    let Some(mut playing) = playing else {
        return Ok(());
    };
    let Playing {
        target,
        crowd,
        frame,
        device,
        ..
    } = &mut *playing;
    crowd.advance(1.0 / 60.0)?;
    // SAFETY: the commands are submitted once, in the order of the frames.
    let commands = tumble_wgpu::record(device, |commands| unsafe { crowd.record(target, commands) })?;
    context.add_command_buffer(commands);
    *frame += 1;
    Ok(())
}

/// Compares the matrices of one frame with those of a crowd on the CPU.
fn check(world: &mut World) -> Result<(), BevyError> {
    let cast = world.resource::<Cast>();
    let Some(playing) = world.get_resource::<Playing>() else {
        return Ok(());
    };
    if !cast.is_checked || playing.frame != FRAMES {
        return Ok(());
    }
    let found = read(&playing.device, world.resource::<RenderQueue>(), &playing.buffer)?;
    let mut crowd = Engine::new(Device::Cpu)?.crowd(&cast.library, cast.characters, 1)?;
    start_layers(&mut crowd, cast.characters)?;
    for _ in 0..FRAMES {
        crowd.advance(1.0 / 60.0)?;
    }
    let mut expected = vec![[0.0_f32; 4]; crowd.output_len(CrowdValues::Skinning)];
    crowd.evaluate_into(CrowdValues::Skinning, &mut expected)?;
    let found = compare_buffers(WordType::F32, &found, &expected)?;
    println!("skinning matrices of {} characters: {found}", cast.characters);
    assert_eq!(found.agreement(), Agreement::SameBits);
    Ok(())
}

/// The bytes of a buffer.
fn read(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
) -> Result<Vec<u8>, Box<dyn Error + Send + Sync>> {
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut commands = device.create_command_encoder(&Default::default());
    commands.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    queue.submit([commands.finish()]);
    staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(staging.get_mapped_range(..)?.to_vec())
}
