//! A crowd on the Vulkan device of wgpu: `cargo run --manifest-path wgpu/Cargo.toml --example crowd [CHARACTERS]`.
//!
//! wgpu makes the device, the buffers and the command buffers, and a kernel of the renderer in WGSL moves a point of each
//! joint by the joint's matrix. Tumble records the matrices of every frame into wgpu's command buffers. At the end the
//! matrices and the points are compared with the CPU's. docs/wgpu.md explains the three traps.

#![allow(clippy::disallowed_methods)] // poses to look at

use std::error::Error;

use tumble::crowd::{Crowd, CrowdLayer, CrowdLibrary, CrowdValues};
use tumble::glam::{Quat, Vec3};
use tumble::verify::{Agreement, WordBound, WordType, compare_buffers};
use tumble::{Device, Engine, EngineOptions, Skeleton, TrackSet, VectorMethod, method};

const JOINTS: usize = 12;
const FRAMES: usize = 30;

/// The renderer's kernel: the matrices are three rows of four numbers.
const KERNEL: &str = "
@group(0) @binding(0) var<storage, read> rows: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> points: array<vec4<f32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&points) {
        let point = vec4<f32>(0.5, 0.25, -1.0, 1.0);
        let row = 3u * id.x;
        points[id.x] = vec4<f32>(dot(rows[row], point), dot(rows[row + 1u], point), dot(rows[row + 2u], point), 1.0);
    }
}";

/// wgpu's device and queue.
struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
}

impl Renderer {
    fn new() -> Result<Self, Box<dyn Error>> {
        let mut options = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        options.backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(options);
        let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
        let request = wgpu::DeviceDescriptor {
            // The feature is optional; with it, software devices are faster.
            required_features: adapter.features() & wgpu::Features::SHADER_INT64,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&request))?;
        println!("{}", adapter.get_info().name);
        Ok(Self { device, queue })
    }

    /// An engine on wgpu's device. It must be dropped before the device.
    fn engine(&self) -> Result<Engine, Box<dyn Error>> {
        let handles = tumble_wgpu::handles(&self.device)?;
        // SAFETY: the handles belong together, and the engine is dropped before them. The engine submits to wgpu's
        // queue, and nothing else may submit at the same time (trap 3 of docs/wgpu.md). This program has only one
        // thread.
        Ok(unsafe { Engine::from_vulkan(handles, &EngineOptions::default())? })
    }

    /// A buffer for results.
    fn buffer(&self, size: u64) -> wgpu::Buffer {
        tumble_wgpu::buffer(&self.device, &self.queue, size, wgpu::BufferUsages::COPY_SRC)
    }

    /// The bytes of a buffer.
    fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, Box<dyn Error>> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut commands = self.device.create_command_encoder(&Default::default());
        commands.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        self.queue.submit([commands.finish()]);
        staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        let bytes = staging.get_mapped_range(..)?.to_vec();
        Ok(bytes)
    }
}

/// A chain of joints with two clips of two seconds.
fn library() -> Result<CrowdLibrary, Box<dyn Error>> {
    let mut library = CrowdLibrary::new(&Skeleton::chain(JOINTS, 0.25)?)?;
    let times: Vec<f64> = (0..=20).map(|key| f64::from(key) * 0.1).collect();
    for speed in [1.0f32, 2.0] {
        let mut set = TrackSet::new();
        for joint in 0..JOINTS {
            let angle = |key: i32| (key as f32 * speed * 0.3 + joint as f32).sin() * 0.4;
            let keys: Vec<Quat> = (0..=20)
                .map(|key| Quat::from_rotation_x(angle(key)))
                .collect();
            set.push(format!("joint{joint}"), &times, &keys)?;
        }
        library.push(&set, method::SLERP, VectorMethod::Linear)?;
    }
    Ok(library)
}

/// The layers of all characters, and their changes in some frames.
fn play(crowd: &mut Crowd, characters: usize, frame: usize) -> Result<(), Box<dyn Error>> {
    for character in (0..characters).filter(|character| frame == 0 || character % FRAMES == frame) {
        let layer = CrowdLayer::new((character + frame) % 2).at(character as i64 * 9_973);
        crowd.set(
            character,
            0,
            layer.with_speed(0.5 + (character % 7) as f32 * 0.125),
        )?;
    }
    crowd.advance(1.0 / 60.0)?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let characters = std::env::args()
        .nth(1)
        .map_or(Ok(500), |text| text.parse())?;
    let renderer = Renderer::new()?;
    let engine = renderer.engine()?;
    let library = library()?;
    let mut crowd = engine.crowd(&library, characters, 1)?;
    let joints = (characters * JOINTS) as u64;
    let matrices = renderer.buffer(48 * joints);
    let points = renderer.buffer(16 * joints);
    // SAFETY: wgpu's buffer has these usages and outlives the target.
    let target = unsafe { crowd.target(CrowdValues::Model, tumble_wgpu::range(&matrices)?)? };

    let module = renderer
        .device
        .create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(KERNEL.into()),
        });
    let pipeline = renderer
        .device
        .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            cache: None,
        });
    let bound = renderer
        .device
        .create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: matrices.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: points.as_entire_binding(),
                },
            ],
        });

    for frame in 0..FRAMES {
        play(&mut crowd, characters, frame)?;
        // SAFETY: the commands are submitted once, in the order of the frames.
        let record = |commands| unsafe { crowd.record(&target, commands) };
        let posed = tumble_wgpu::record(&renderer.device, record)?;
        let mut drawing = renderer.device.create_command_encoder(&Default::default());
        {
            let mut pass = drawing.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bound, &[]);
            pass.dispatch_workgroups(joints.div_ceil(64) as u32, 1, 1);
        }
        renderer.queue.submit([posed, drawing.finish()]);
    }

    let mut on_cpu = Engine::new(Device::Cpu)?.crowd(&library, characters, 1)?;
    for frame in 0..FRAMES {
        play(&mut on_cpu, characters, frame)?;
    }
    let mut expected = vec![[0.0f32; 4]; 3 * joints as usize];
    on_cpu.evaluate_into(CrowdValues::Model, &mut expected)?;
    let found = compare_buffers(WordType::F32, &renderer.read(&matrices)?, &expected)?;
    println!("matrices: {found}");
    assert_eq!(found.agreement(), Agreement::SameBits);

    let point = Vec3::new(0.5, 0.25, -1.0);
    let moved: Vec<[f32; 4]> = (expected.chunks_exact(3))
        .map(|rows| {
            let [x, y, z] = [0, 1, 2].map(|row| {
                let [a, b, c, d] = rows[row];
                Vec3::new(a, b, c).dot(point) + d
            });
            [x, y, z, 1.0]
        })
        .collect();
    let found = compare_buffers(WordType::F32, &renderer.read(&points)?, &moved)?;
    println!("points: {found}");
    assert!(found.agreement_within(WordBound::Distance(1e-5)) <= Agreement::WithinBounds);
    // All work has ended, so nothing uses what is dropped now: the target, the crowd, the engine, then wgpu's device.
    drop((target, crowd, engine));
    Ok(())
}
