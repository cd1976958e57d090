//! A crowd on an application's Vulkan device: `crowd [CHARACTERS] [PICTURE.svg]`.
//!
//! A renderer has its device, its queue and its command buffers. The crowd records the poses of every
//! frame into these: a few bytes for each character that does something new, and nothing for the others.
//! The matrices stay in the renderer's buffer. Two frames are in flight. At the end the bits are
//! compared with the CPU's, the characters are drawn as a picture, and the times are printed.
#![allow(clippy::disallowed_methods)] // poses to look at
#![allow(unsafe_code)] // Vulkan's handles are the application's to promise; an allocator that counts

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::error::Error;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

use ash::vk;
use glam::{Quat, Vec3};
use tumble::crowd::{Crowd, CrowdLayer, CrowdLibrary, CrowdValues};
use tumble::vulkan::{CrowdTarget, VulkanBuffer, VulkanHandles, VulkanQueue};
use tumble::{
    Device, Engine, EngineOptions, Skeleton, TrackSet, VectorMethod, WrapMode, ash, glam, method,
};

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// Counts what this thread allocates.
struct Counting;

// SAFETY: each call is passed unchanged to the system's allocator; in addition, allocations are counted.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's promises are those that the system's allocator needs.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are those that the system's allocator needs.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const FRAMES: usize = 120;
const IN_FLIGHT: usize = 2;
const CLIPS: usize = 8;
const KEYS: usize = 61;

/// The joints of a figure: a spine of eight with a head, two arms and two legs of thirteen each.
fn skeleton() -> Result<Skeleton, Box<dyn Error>> {
    let (mut parents, mut offsets) = (vec![None], vec![Vec3::ZERO]);
    let mut limb = |from: usize, count: usize, first: Vec3, step: Vec3| {
        for joint in 0..count {
            parents.push(Some(if joint == 0 { from } else { parents.len() - 1 }));
            offsets.push(if joint == 0 { first } else { step });
        }
    };
    limb(0, 7, Vec3::Y * 0.08, Vec3::Y * 0.08);
    for side in [-1.0, 1.0] {
        let aside = Vec3::X * side;
        limb(7, 13, aside * 0.1, aside * 0.05);
        limb(0, 13, aside * 0.08, Vec3::Y * -0.06);
    }
    Ok(Skeleton::new(parents, offsets)?)
}

/// A clip of two seconds with keys at 30 Hz, whose end meets its start.
fn clip(number: usize, joints: usize) -> Result<TrackSet, Box<dyn Error>> {
    let times: Vec<f64> = (0..KEYS).map(|key| key as f64 / 30.0).collect();
    let mut set = TrackSet::new();
    for joint in 0..joints {
        let keys: Vec<Quat> = (0..KEYS)
            .map(|key| {
                let angle = std::f32::consts::TAU * key as f32 / (KEYS - 1) as f32;
                let phase = angle + joint as f32 * 0.37 + number as f32;
                let size = 0.05 + 0.03 * number as f32;
                let swing = Quat::from_rotation_x(size * phase.sin());
                swing * Quat::from_rotation_z(size * phase.cos())
            })
            .collect();
        set.push(format!("joint{joint}"), &times, &keys)?;
    }
    Ok(set)
}

fn library() -> Result<CrowdLibrary, Box<dyn Error>> {
    let skeleton = skeleton()?;
    let mut library = CrowdLibrary::new(&skeleton)?;
    for number in 0..CLIPS {
        let set = clip(number, skeleton.len())?;
        library.push(&set, method::SLERP, VectorMethod::Linear)?;
    }
    Ok(library)
}

/// Sets a clip, a time and a speed for every instance.
fn start(crowd: &mut Crowd) -> Result<(), Box<dyn Error>> {
    for instance in 0..crowd.instance_count() {
        let plays = CrowdLayer::new(instance % CLIPS)
            .at(instance as i64 * 9_973)
            .with_speed(0.8 + 0.05 * (instance % 9) as f32);
        crowd.set(instance, 0, plays)?;
    }
    Ok(())
}

/// One in a hundred does something new in each frame; all others go on.
fn go_on(crowd: &mut Crowd, frame: usize) -> Result<(), Box<dyn Error>> {
    crowd.advance(1.0 / 60.0)?;
    for instance in (frame % 100..crowd.instance_count()).step_by(100) {
        let plays = CrowdLayer::new((instance + frame) % CLIPS).with_wrap(WrapMode::Mirror);
        crowd.set(instance, 0, plays)?;
    }
    Ok(())
}

/// A renderer's objects: a device and a queue.
struct Renderer {
    entry: ash::Entry,
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    has_int64: bool,
    queue: vk::Queue,
    family: u32,
}

impl Renderer {
    fn new() -> Result<Self, Box<dyn Error>> {
        // SAFETY: plain creation, with structures that are alive; `close` destroys it all.
        unsafe {
            // On macOS, Homebrew's libraries are not where the system looks.
            let homebrew = || ash::Entry::load_from("/opt/homebrew/lib/libvulkan.1.dylib");
            let entry = ash::Entry::load().or_else(|error| homebrew().map_err(|_| error))?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_1);
            // Drivers without all of Vulkan (MoltenVK) are listed only with this extension and flag.
            let portability = ash::khr::portability_enumeration::NAME;
            let offered = entry.enumerate_instance_extension_properties(None)?;
            let is_offered = (offered.iter())
                .any(|offered| offered.extension_name_as_c_str() == Ok(portability));
            let (names, flags) = match is_offered {
                true => (
                    vec![portability.as_ptr()],
                    vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR,
                ),
                false => (Vec::new(), vk::InstanceCreateFlags::empty()),
            };
            let info = vk::InstanceCreateInfo::default()
                .application_info(&application)
                .enabled_extension_names(&names)
                .flags(flags);
            let instance = entry.create_instance(&info, None)?;
            let all = instance.enumerate_physical_devices()?;
            let physical_device = *all.first().ok_or("there is no Vulkan device")?;
            let families = instance.get_physical_device_queue_family_properties(physical_device);
            let computes = |family: &vk::QueueFamilyProperties| {
                family.queue_flags.contains(vk::QueueFlags::COMPUTE)
            };
            let family = families
                .iter()
                .position(computes)
                .ok_or("no queue computes")? as u32;
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(family)
                .queue_priorities(&[1.0])];
            let has = instance.get_physical_device_features(physical_device);
            let has_int64 = has.shader_int64 == vk::TRUE;
            let features = vk::PhysicalDeviceFeatures::default().shader_int64(has_int64);
            let subset = ash::khr::portability_subset::NAME;
            let offered = instance.enumerate_device_extension_properties(physical_device)?;
            let names: Vec<_> = (offered.iter())
                .any(|offered| offered.extension_name_as_c_str() == Ok(subset))
                .then_some(subset.as_ptr())
                .into_iter()
                .collect();
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&names)
                .enabled_features(&features);
            let device = instance.create_device(physical_device, &info, None)?;
            let queue = device.get_device_queue(family, 0);
            Ok(Self {
                entry,
                instance,
                physical_device,
                device,
                has_int64,
                queue,
                family,
            })
        }
    }

    fn engine(&self) -> Result<Engine, tumble::Error> {
        let mut handles = VulkanHandles::new(
            self.entry.clone(),
            self.instance.clone(),
            vk::API_VERSION_1_1,
            self.physical_device,
            self.device.clone(),
            VulkanQueue::new(self.queue, self.family),
        );
        handles.shader_int64 = self.has_int64;
        // SAFETY: the handles belong together, and `main` closes the engine before them.
        unsafe { Engine::from_vulkan(handles, &EngineOptions::default()) }
    }

    /// A buffer for matrices, which the host can see here so that it may compare them.
    fn buffer(&self, size: u64) -> Result<(vk::Buffer, vk::DeviceMemory), Box<dyn Error>> {
        let info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(vk::BufferUsageFlags::STORAGE_BUFFER);
        let required =
            vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        // SAFETY: plain creation on a device that is alive.
        unsafe {
            let buffer = self.device.create_buffer(&info, None)?;
            let needs = self.device.get_buffer_memory_requirements(buffer);
            let types = self
                .instance
                .get_physical_device_memory_properties(self.physical_device);
            // The card's memory, if the host can access it. Otherwise the host's memory, which kernels write across the
            // bus.
            let local = required | vk::MemoryPropertyFlags::DEVICE_LOCAL;
            let with = |required| {
                (0..types.memory_type_count).find(|&index| {
                    let flags = types.memory_types[index as usize].property_flags;
                    needs.memory_type_bits & 1 << index != 0 && flags.contains(required)
                })
            };
            let index = with(local).or_else(|| with(required));
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(index.ok_or("no such memory")?);
            let memory = self.device.allocate_memory(&info, None)?;
            self.device.bind_buffer_memory(buffer, memory, 0)?;
            Ok((buffer, memory))
        }
    }

    fn read(&self, memory: vk::DeviceMemory, rows: usize) -> Result<Vec<[f32; 4]>, vk::Result> {
        // SAFETY: nothing is in flight, and the memory is long enough.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let pointer = self.device.map_memory(memory, 0, vk::WHOLE_SIZE, flags)?;
            let found = std::slice::from_raw_parts(pointer.cast::<[f32; 4]>(), rows).to_vec();
            self.device.unmap_memory(memory);
            Ok(found)
        }
    }
}

/// One frame in flight: its commands, its fence, and the buffer that it draws from.
struct Slot {
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
}

/// The results and the times of the run on the device.
struct DeviceRun {
    name: String,
    /// The result of the last frame.
    values: Vec<[f32; 4]>,
    /// The host's time for a frame, its allocations, and the time from frame to frame.
    host: Duration,
    allocations: usize,
    wall: Duration,
    /// The host's time for a frame that is never submitted, so that no driver uses the same cores.
    recording: Duration,
}

fn on_device(
    library: &CrowdLibrary,
    characters: usize,
    values: CrowdValues,
) -> Result<DeviceRun, Box<dyn Error>> {
    let renderer = Renderer::new()?;
    let device = &renderer.device;
    let engine = renderer.engine()?;
    let mut crowd = engine.crowd(library, characters, 1)?;
    start(&mut crowd)?;
    let rows = crowd.output_len(values);
    let size = rows as u64 * 16;
    let info = vk::CommandPoolCreateInfo::default()
        .queue_family_index(renderer.family)
        .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
    // SAFETY: plain creation, here and below; all is destroyed at the end.
    let pool = unsafe { device.create_command_pool(&info, None)? };
    let info = vk::CommandBufferAllocateInfo::default()
        .command_pool(pool)
        .command_buffer_count(IN_FLIGHT as u32);
    // SAFETY: as above.
    let commands = unsafe { device.allocate_command_buffers(&info)? };
    let mut slots = Vec::new();
    for commands in commands {
        let (buffer, memory) = renderer.buffer(size)?;
        let signalled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        slots.push(Slot {
            commands,
            // SAFETY: as above.
            fence: unsafe { device.create_fence(&signalled, None)? },
            buffer,
            memory,
        });
    }
    // Creating a target compiles its kernels, so a game creates its targets while a level loads.
    let target = |slot: &Slot| -> Result<CrowdTarget, tumble::crowd::CrowdError> {
        let range = VulkanBuffer::new(slot.buffer, size);
        // SAFETY: the buffer is the device's, has memory and this usage, and outlives the target.
        unsafe { crowd.target(values, range) }
    };
    let targets: Vec<CrowdTarget> = slots.iter().map(target).collect::<Result<_, _>>()?;

    let (mut host, mut allocations) = (Duration::ZERO, 0);
    let began = Instant::now();
    for frame in 0..FRAMES {
        let (slot, target) = (&slots[frame % IN_FLIGHT], &targets[frame % IN_FLIGHT]);
        // SAFETY: the slot's work has ended before its commands are recorded anew; frames are
        // submitted in the order in which they are recorded, to the engine's queue, by this thread.
        unsafe {
            device.wait_for_fences(&[slot.fence], true, u64::MAX)?;
            device.reset_fences(&[slot.fence])?;
            device.begin_command_buffer(slot.commands, &vk::CommandBufferBeginInfo::default())?;
            let (from, before) = (Instant::now(), ALLOCATIONS.get());
            go_on(&mut crowd, frame)?;
            crowd.record(target, slot.commands)?;
            // The first frame does not count, because it also uploads the layers of all instances.
            if frame > 0 {
                host += from.elapsed();
            }
            allocations += ALLOCATIONS.get() - before;
            // Here a renderer draws from `slot.buffer`.
            device.end_command_buffer(slot.commands)?;
            let recorded = [slot.commands];
            let submit = [vk::SubmitInfo::default().command_buffers(&recorded)];
            device.queue_submit(renderer.queue, &submit, slot.fence)?;
        }
    }
    // SAFETY: nothing else uses the device.
    unsafe { device.device_wait_idle()? };
    let wall = began.elapsed();
    let found = renderer.read(slots[(FRAMES - 1) % IN_FLIGHT].memory, rows)?;
    let mut recording = Duration::ZERO;
    for frame in FRAMES..2 * FRAMES {
        let commands = slots[0].commands;
        // SAFETY: nothing is in flight, and nothing that is recorded here is submitted.
        unsafe {
            device.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default())?;
            let from = Instant::now();
            go_on(&mut crowd, frame)?;
            crowd.record(&targets[0], commands)?;
            recording += from.elapsed();
            device.end_command_buffer(commands)?;
        }
    }
    let name = engine.device_name().to_owned();
    drop((targets, crowd, engine));
    // SAFETY: the engine is dropped, and nothing is in flight.
    unsafe {
        for slot in slots {
            device.destroy_fence(slot.fence, None);
            device.destroy_buffer(slot.buffer, None);
            device.free_memory(slot.memory, None);
        }
        device.destroy_command_pool(pool, None);
        device.destroy_device(None);
        renderer.instance.destroy_instance(None);
    }
    Ok(DeviceRun {
        name,
        values: found,
        host: host / (FRAMES - 1) as u32,
        allocations,
        wall: wall / FRAMES as u32,
        recording: recording / FRAMES as u32,
    })
}

/// A result, and how long it took.
type Timed = (Vec<[f32; 4]>, Duration);

/// The same frames on the CPU: the matrices of the last one, and the time of a frame.
fn on_cpu(
    library: &CrowdLibrary,
    characters: usize,
    values: CrowdValues,
) -> Result<Timed, Box<dyn Error>> {
    let engine = Engine::new(Device::Cpu)?;
    let mut crowd = engine.crowd(library, characters, 1)?;
    start(&mut crowd)?;
    let mut found = vec![[0.0; 4]; crowd.output_len(values)];
    let began = Instant::now();
    for frame in 0..FRAMES {
        go_on(&mut crowd, frame)?;
        crowd.evaluate_into(values, &mut found)?;
    }
    Ok((found, began.elapsed() / FRAMES as u32))
}

/// The bones of the first characters, side by side.
fn picture(skeleton: &Skeleton, matrices: &[[f32; 4]]) -> Result<String, std::fmt::Error> {
    const COLUMNS: usize = 10;
    const CELL: f32 = 90.0;
    let joints = skeleton.len();
    let (characters, _) = matrices.as_chunks::<3>();
    let shown: Vec<&[[[f32; 4]; 3]]> = characters.chunks_exact(joints).take(50).collect();
    let rows = shown.len().div_ceil(COLUMNS);
    let mut text = String::new();
    writeln!(
        text,
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}" stroke="black" stroke-linecap="round">"#,
        COLUMNS as f32 * CELL,
        rows as f32 * CELL * 2.0,
    )?;
    for (i, pose) in shown.iter().enumerate() {
        let middle = ((i % COLUMNS) as f32 + 0.5) * CELL;
        let floor = ((i / COLUMNS) as f32 + 1.1) * CELL * 2.0 - CELL;
        let at = |joint: usize| {
            let [x, y, _] = pose[joint];
            (middle + x[3] * CELL * 0.6, floor - y[3] * CELL * 0.9)
        };
        for joint in 1..joints {
            // A limb's joints follow each other; its first one hangs from the spine.
            let parent = match joint {
                8 | 34 => 7,
                21 | 47 => 0,
                _ => joint - 1,
            };
            let ((x1, y1), (x2, y2)) = (at(parent), at(joint));
            writeln!(
                text,
                r#"<path d="M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}" stroke-width="3"/>"#
            )?;
        }
    }
    writeln!(text, "</svg>")?;
    Ok(text)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let characters = arguments
        .next()
        .map_or(Ok(1000), |argument| argument.parse())?;
    let library = library()?;
    let joints = library.joint_count();
    println!("{characters} characters of {joints} joints, {CLIPS} clips, slerp; a frame takes");
    let picture_path = arguments.next();
    for values in [CrowdValues::Rotations, CrowdValues::Model] {
        let (expected, time) = on_cpu(&library, characters, values)?;
        let found = on_device(&library, characters, values)?;
        println!(
            "  {values:?}: the CPU {time:.2?}, {} {:.2?}, and of the host {:.1?} ({:.1?} where nothing is submitted)",
            found.name, found.wall, found.host, found.recording
        );
        let bits = |row: &[f32; 4]| row.map(f32::to_bits);
        let pairs = found.values.iter().zip(&expected);
        let differing = pairs.filter(|(a, b)| bits(a) != bits(b)).count();
        println!(
            "{} vectors in the last frame, {differing} differ from the CPU's, {} allocations in {FRAMES} frames",
            found.values.len(),
            found.allocations
        );
        if differing > 0 || found.allocations > 0 {
            return Err("bits differ, or recording allocates".into());
        }
        if let (CrowdValues::Model, Some(path)) = (values, &picture_path) {
            std::fs::write(path, picture(&skeleton()?, &found.values)?)?;
            println!("{path} shows some of them in the last frame");
        }
    }
    Ok(())
}
