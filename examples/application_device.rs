//! Poses on an application's Vulkan device.
//!
//! A renderer has its device and its queues already. This program makes such a device, gives the engine
//! a queue of it, and lets it write the poses of every frame into a buffer of the renderer's, from
//! which another queue family, where there is one, copies them. Then two clips are evaluated, mixed and
//! walked to the world in one submission, without a way back to the host between. At the end the bits are
//! compared with the CPU's.
#![allow(clippy::disallowed_methods)] // poses to look at
#![allow(unsafe_code)] // Vulkan's handles are the application's to promise

use std::error::Error;

use ash::vk;
use glam::Quat;
use tumble::vulkan::{PosePass, VulkanBuffer, VulkanHandles, VulkanQueue};
use tumble::{
    Clip, Device, Engine, EngineOptions, Layout, SampleTimes, Skeleton, TrackSet, ash, glam, method,
};

const TRACKS: u64 = 60;
/// Bytes of the poses of one frame.
const SIZE: u64 = TRACKS * 16;
/// Bytes of the same in the world, where a position is beside each rotation.
const WORLD: u64 = 2 * SIZE;
/// Bytes from one pose to the next in a buffer of several: passes bind ranges from multiples of 256 on.
const STEP: u64 = SIZE.next_multiple_of(256);

/// A renderer's objects: a device, a queue for the engine, and one for drawing.
struct Renderer {
    entry: ash::Entry,
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    has_int64: bool,
    /// For the engine alone: it submits to this queue, and the application must not do so at the same time.
    compute: (vk::Queue, u32),
    /// The renderer's. The same one where the device has no other: then they alternate.
    graphics: (vk::Queue, u32),
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
            let with = |flags: vk::QueueFlags, other: Option<u32>| {
                let all = (0..).zip(&families);
                let mut found = all.filter(|(_, family)| family.queue_flags.intersects(flags));
                found.find(|(family, _)| Some(*family) != other)
            };
            let compute = with(vk::QueueFlags::COMPUTE, None)
                .ok_or("no queue computes")?
                .0;
            let graphics =
                with(vk::QueueFlags::GRAPHICS, Some(compute)).map_or(compute, |found| found.0);
            let mut used = vec![compute, graphics];
            used.dedup();
            let queues: Vec<_> = used
                .iter()
                .map(|&family| {
                    vk::DeviceQueueCreateInfo::default()
                        .queue_family_index(family)
                        .queue_priorities(&[1.0])
                })
                .collect();
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
            let queue = |family| (device.get_device_queue(family, 0), family);
            let (compute, graphics) = (queue(compute), queue(graphics));
            Ok(Self {
                entry,
                instance,
                physical_device,
                device,
                has_int64,
                compute,
                graphics,
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
            VulkanQueue::new(self.compute.0, self.compute.1),
        );
        handles.shader_int64 = self.has_int64;
        // SAFETY: the handles belong together, and `main` closes the engine before them.
        unsafe { Engine::from_vulkan(handles, &EngineOptions::default()) }
    }

    /// A buffer that both queue families may use, so that no transfer of ownership is needed.
    fn buffer(
        &self,
        size: u64,
        usage: vk::BufferUsageFlags,
        memory: vk::MemoryPropertyFlags,
    ) -> Result<(vk::Buffer, vk::DeviceMemory), Box<dyn Error>> {
        let families = [self.compute.1, self.graphics.1];
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let info = match families[0] == families[1] {
            true => info,
            false => info
                .sharing_mode(vk::SharingMode::CONCURRENT)
                .queue_family_indices(&families),
        };
        // SAFETY: plain creation on a device that is alive.
        unsafe {
            let buffer = self.device.create_buffer(&info, None)?;
            let needs = self.device.get_buffer_memory_requirements(buffer);
            let types = self
                .instance
                .get_physical_device_memory_properties(self.physical_device);
            let index = (0..types.memory_type_count).find(|&index| {
                let flags = types.memory_types[index as usize].property_flags;
                needs.memory_type_bits & 1 << index != 0 && flags.contains(memory)
            });
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(index.ok_or("no such memory")?);
            let memory = self.device.allocate_memory(&info, None)?;
            self.device.bind_buffer_memory(buffer, memory, 0)?;
            Ok((buffer, memory))
        }
    }

    /// Stands for the drawing of a renderer: its queue copies the poses to memory that the host reads.
    fn draw(&self, from: vk::Buffer, to: vk::Buffer) -> Result<(), Box<dyn Error>> {
        self.submit(self.graphics, |commands| {
            let region = vk::BufferCopy::default().size(SIZE);
            // SAFETY: the commands are in recording, and the buffers are alive and as long as the copy.
            unsafe { self.device.cmd_copy_buffer(commands, from, to, &[region]) };
            Ok(())
        })
    }

    /// Submits what is recorded to a queue, and waits for it.
    fn submit(
        &self,
        (queue, family): (vk::Queue, u32),
        record: impl FnOnce(vk::CommandBuffer) -> Result<(), Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        // SAFETY: plain use of a device that is alive; the fence is waited for before anything is freed.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
            let pool = self.device.create_command_pool(&info, None)?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            let commands = self.device.allocate_command_buffers(&info)?;
            let info = vk::CommandBufferBeginInfo::default();
            self.device.begin_command_buffer(commands[0], &info)?;
            record(commands[0])?;
            self.device.end_command_buffer(commands[0])?;
            let fence = self
                .device
                .create_fence(&vk::FenceCreateInfo::default(), None)?;
            let submit = vk::SubmitInfo::default().command_buffers(&commands);
            self.device.queue_submit(queue, &[submit], fence)?;
            self.device.wait_for_fences(&[fence], true, u64::MAX)?;
            self.device.destroy_fence(fence, None);
            self.device.destroy_command_pool(pool, None);
        }
        Ok(())
    }

    /// The content of memory that the host sees.
    fn read(&self, memory: vk::DeviceMemory, size: u64) -> Result<Vec<[f32; 4]>, vk::Result> {
        // SAFETY: the memory has at least `size` bytes, and the commands that write it have ended.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let pointer = self.device.map_memory(memory, 0, size, flags)?;
            let values = std::slice::from_raw_parts(pointer.cast(), size as usize / 16).to_vec();
            self.device.unmap_memory(memory);
            Ok(values)
        }
    }

    fn close(self, buffers: [(vk::Buffer, vk::DeviceMemory); 3]) {
        // SAFETY: the engine is dropped, and nothing is in flight.
        unsafe {
            for (buffer, memory) in buffers {
                self.device.destroy_buffer(buffer, None);
                self.device.free_memory(memory, None);
            }
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// A clip of a minute, with a key a second.
fn clip(speed: f32) -> Result<TrackSet, Box<dyn Error>> {
    let times: Vec<f64> = (0..=60).map(f64::from).collect();
    let mut set = TrackSet::new();
    for track in 0..TRACKS {
        let keys: Vec<Quat> = (0..=60u8)
            .map(|key| Quat::from_rotation_y((track as f32 * 0.1 + f32::from(key) * speed).sin()))
            .collect();
        set.push(format!("joint{track}"), &times, &keys)?;
    }
    Ok(set)
}

/// Writes the poses of one moment into the renderer's buffer.
fn pose(clip: &Clip, time: f64, buffer: vk::Buffer) -> Result<(), tumble::Error> {
    let range = VulkanBuffer::new(buffer, SIZE);
    let frames = SampleTimes::at(vec![time]);
    // SAFETY: the buffer is the device's, has memory and these usages, and nothing else uses it until
    // this returns: `draw` waits for its fence.
    unsafe {
        clip.request(&frames)
            .layout(Layout::FrameMajor)
            .to_buffer(range)
    }
}

/// Evaluates two clips at one moment, mixes them by a quarter and walks the skeleton down to the world: four things in one
/// submission, each of which sees what the one before it left in the buffer.
fn mixed_in_world(
    renderer: &Renderer,
    [walk, run]: [&Clip; 2],
    skeleton: &Skeleton,
    time: f64,
    [(buffer, _), (seen, seen_memory)]: [(vk::Buffer, vk::DeviceMemory); 2],
) -> Result<Vec<[f32; 4]>, Box<dyn Error>> {
    let range = |index: u64, size| VulkanBuffer::new(buffer, size).at(index * STEP);
    let [from, to, local] = [0, 1, 2].map(|index| range(index, SIZE));
    let world = range(3, WORLD);
    let engine = walk.engine();
    let frames = SampleTimes::at(vec![time]);
    let pass = |pass| engine.pass(pass, TRACKS as usize, 1, Layout::FrameMajor);
    let mix = PosePass::Mix {
        from,
        to,
        weight: 0.25,
    };
    // SAFETY: the buffer is the device's, has memory and these usages, and lives longer than the targets, which
    // live until `submit` has waited.
    let (walk, run, mix, walked) = unsafe {
        (
            walk.request(&frames)
                .layout(Layout::FrameMajor)
                .target(from)?,
            run.request(&frames).layout(Layout::FrameMajor).target(to)?,
            pass(mix).target(local)?,
            pass(PosePass::World { local, skeleton }).target(world)?,
        )
    };
    renderer.submit(renderer.compute, |commands| {
        let region = vk::BufferCopy::default()
            .src_offset(world.offset)
            .size(WORLD);
        // SAFETY: the commands are in recording, and of a family that computes.
        unsafe {
            walk.record(commands, 0)?;
            run.record(commands, 0)?;
            mix.record(commands);
            walked.record(commands);
            renderer
                .device
                .cmd_copy_buffer(commands, buffer, seen, &[region]);
        }
        Ok(())
    })?;
    Ok(renderer.read(seen_memory, WORLD)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let renderer = Renderer::new()?;
    let pose_buffer = renderer.buffer(
        SIZE,
        vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC,
        vk::MemoryPropertyFlags::DEVICE_LOCAL,
    )?;
    let several = renderer.buffer(
        3 * STEP + WORLD,
        vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC,
        vk::MemoryPropertyFlags::DEVICE_LOCAL,
    )?;
    let seen = renderer.buffer(
        WORLD,
        vk::BufferUsageFlags::TRANSFER_DST,
        vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT,
    )?;
    let sets = [clip(0.7)?, clip(1.9)?];
    let skeleton = Skeleton::chain(TRACKS as usize, 0.2)?;
    // Both are kept for all frames: an upload prepares the keys, and costs as much as many frames.
    let engine = renderer.engine()?;
    let clip = engine.upload(&sets[0], method::BESSEL_OVERHAUSER)?;
    // The first call with a method compiles its kernel, which takes up to a quarter of a second. So make this call
    // while a level loads.
    pose(&clip, 0.0, pose_buffer.0)?;

    let mut drawn = Vec::new();
    let times: Vec<f64> = (0..120).map(|frame| f64::from(frame) / 60.0).collect();
    for &time in &times {
        pose(&clip, time, pose_buffer.0)?;
        renderer.draw(pose_buffer.0, seen.0)?;
        drawn.extend(renderer.read(seen.1, SIZE)?);
    }
    let other = engine.upload(&sets[1], method::SLERP)?;
    let buffers = [several, seen];
    let in_world = mixed_in_world(&renderer, [&clip, &other], &skeleton, 12.3, buffers)?;
    let name = engine.device_name().to_owned();
    drop((clip, other, engine));
    renderer.close([pose_buffer, several, seen]);

    let cpu = Engine::new(Device::Cpu)?;
    let expected = cpu
        .request(&sets[0], method::BESSEL_OVERHAUSER, &SampleTimes::at(times))
        .layout(Layout::FrameMajor)
        .evaluate()?;
    let moment = SampleTimes::at(vec![12.3]);
    let at_moment = |set, method| {
        let request = cpu.request(set, method, &moment);
        request.layout(Layout::FrameMajor).evaluate()
    };
    let walk = at_moment(&sets[0], method::BESSEL_OVERHAUSER)?;
    let mixed = cpu.mix(&walk, &at_moment(&sets[1], method::SLERP)?, 0.25)?;
    let expected_in_world = cpu.world(&mixed, &skeleton)?;
    let differing = |found: &[[f32; 4]], expected: &[[f32; 4]]| {
        let bits = |value: &[f32; 4]| value.map(f32::to_bits);
        let pairs = found.iter().zip(expected);
        pairs.filter(|(a, b)| bits(a) != bits(b)).count()
    };
    let rotations = differing(&drawn, expected.as_arrays());
    let joints = differing(&in_world, expected_in_world.as_slice());
    println!(
        "{} rotations on {name}, {rotations} differ from the CPU's",
        drawn.len()
    );
    println!("{TRACKS} joints of two clips mixed, in the world, {joints} values differ");
    if rotations + joints > 0 {
        return Err("bits differ".into());
    }
    Ok(())
}
