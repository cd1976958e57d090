//! A Vulkan device that is created as an application would create it.
#![allow(unsafe_code)] // creating a device is the application's part
#![allow(dead_code)] // each test program uses some of it

use std::ffi::CStr;
use std::sync::{Arc, Mutex};

use ash::vk;
use tumble::vulkan::tuning::{Mapping, PrepareArcs};
use tumble::vulkan::{QueueLock, VulkanBuffer, VulkanHandles, VulkanQueue};
use tumble::{Engine, EngineOptions, Error};

pub(crate) struct Application {
    pub(crate) instance: ash::Instance,
    pub(crate) physical_device: vk::PhysicalDevice,
    pub(crate) device: ash::Device,
    pub(crate) entry: ash::Entry,
    pub(crate) queue: vk::Queue,
    /// A queue that only copies, where the device has one.
    pub(crate) copy_queue: Option<VulkanQueue>,
    pub(crate) shader_int64: bool,
    /// Held while the queue is used.
    pub(crate) queue_lock: Arc<Mutex<()>>,
}

impl Application {
    pub(crate) fn new() -> Self {
        Self::on(0)
    }

    /// One on each device of this machine.
    pub(crate) fn all() -> Vec<Self> {
        let first = Self::new();
        // SAFETY: the instance is alive.
        let count = unsafe { first.instance.enumerate_physical_devices() }
            .unwrap()
            .len();
        std::iter::once(first)
            .chain((1..count).map(Self::on))
            .collect()
    }

    /// On the device of that index.
    fn on(index: usize) -> Self {
        // SAFETY: plain creation; everything is destroyed in `drop`.
        unsafe {
            let entry = ash::Entry::load().unwrap();
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_1);
            let info = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&info, None).unwrap();
            let physical_device = instance.enumerate_physical_devices().unwrap()[index];
            let families = instance.get_physical_device_queue_family_properties(physical_device);
            let copies = |family: &vk::QueueFamilyProperties| {
                use vk::QueueFlags as Flags;
                // NVIDIA's also binds sparse memory; families for video copy, and are not for this.
                let others = Flags::GRAPHICS
                    | Flags::COMPUTE
                    | Flags::VIDEO_DECODE_KHR
                    | Flags::VIDEO_ENCODE_KHR
                    | Flags::OPTICAL_FLOW_NV;
                let flags = family.queue_flags;
                let only_copies = flags.contains(Flags::TRANSFER) && !flags.intersects(others);
                only_copies && family.queue_count > 0
            };
            let copy_family = families.iter().position(copies).map(|index| index as u32);
            let of_family = |family| {
                vk::DeviceQueueCreateInfo::default()
                    .queue_family_index(family)
                    .queue_priorities(&[1.0])
            };
            let mut queues = vec![of_family(0)];
            queues.extend(copy_family.map(of_family));
            let has = instance.get_physical_device_features(physical_device);
            let features =
                vk::PhysicalDeviceFeatures::default().shader_int64(has.shader_int64 == vk::TRUE);
            let timeline = [ash::khr::timeline_semaphore::NAME.as_ptr()];
            let mut timelines =
                vk::PhysicalDeviceTimelineSemaphoreFeatures::default().timeline_semaphore(true);
            let mut info = vk::DeviceCreateInfo::default();
            if copy_family.is_some() {
                info = info
                    .enabled_extension_names(&timeline)
                    .push_next(&mut timelines);
            }
            let info = info.queue_create_infos(&queues).enabled_features(&features);
            let device = instance
                .create_device(physical_device, &info, None)
                .unwrap();
            let queue = device.get_device_queue(0, 0);
            let copy_queue = copy_family
                .map(|family| VulkanQueue::new(device.get_device_queue(family, 0), family));
            Self {
                instance,
                physical_device,
                device,
                entry,
                queue,
                copy_queue,
                shader_int64: has.shader_int64 == vk::TRUE,
                queue_lock: Arc::default(),
            }
        }
    }

    /// An engine on this device; it must be dropped before the device.
    pub(crate) fn engine(&self, mapping: Mapping) -> Engine {
        self.try_engine(mapping).unwrap()
    }

    pub(crate) fn try_engine(&self, mapping: Mapping) -> Result<Engine, Error> {
        let mut options = EngineOptions::default();
        options.mapping = mapping;
        if mapping == Mapping::Samples {
            options.prepare_arcs = PrepareArcs::OnDevice;
        }
        // SAFETY: the handles belong together and outlive the engine.
        unsafe { Engine::from_vulkan(self.handles(), &options) }
    }

    /// Why no engine can be made of handles that were changed.
    pub(crate) fn refused(&self, change: impl FnOnce(&mut VulkanHandles)) -> Error {
        let mut handles = self.handles();
        change(&mut handles);
        // SAFETY: the changed handle is refused before it is used.
        unsafe { Engine::from_vulkan(handles, &EngineOptions::default()) }.unwrap_err()
    }

    pub(crate) fn handles(&self) -> VulkanHandles {
        let mut handles = VulkanHandles::new(
            self.entry.clone(),
            self.instance.clone(),
            vk::API_VERSION_1_1,
            self.physical_device,
            self.device.clone(),
            VulkanQueue::new(self.queue, 0),
        );
        handles.shader_int64 = self.shader_int64;
        handles
            .with_copy_queue(self.copy_queue)
            .with_queue_lock(QueueLock::from(Arc::clone(&self.queue_lock)))
    }

    /// A buffer in memory that the host can see.
    pub(crate) fn buffer(&self, size: u64) -> (vk::Buffer, vk::DeviceMemory) {
        // SAFETY: plain creation on a device that is alive.
        unsafe {
            let info = vk::BufferCreateInfo::default().size(size).usage(
                vk::BufferUsageFlags::STORAGE_BUFFER
                    | vk::BufferUsageFlags::TRANSFER_DST
                    | vk::BufferUsageFlags::TRANSFER_SRC,
            );
            let buffer = self.device.create_buffer(&info, None).unwrap();
            let needs = self.device.get_buffer_memory_requirements(buffer);
            let types = self
                .instance
                .get_physical_device_memory_properties(self.physical_device);
            let required =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let index = (0..types.memory_type_count)
                .find(|&i| {
                    let flags = types.memory_types[i as usize].property_flags;
                    needs.memory_type_bits & 1 << i != 0 && flags.contains(required)
                })
                .unwrap();
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(index);
            let memory = self.device.allocate_memory(&info, None).unwrap();
            self.device.bind_buffer_memory(buffer, memory, 0).unwrap();
            (buffer, memory)
        }
    }

    /// Runs a kernel over buffers, which it binds as 0, 1, 2 … of set 0, and waits for it.
    pub(crate) fn run_kernel(
        &self,
        spirv: &[u32],
        entry: &CStr,
        buffers: &[&ApplicationBuffer<'_>],
        workgroups: u32,
    ) {
        let device = &self.device;
        let count = buffers.len() as u32;
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let binding = |index| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(index)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        };
        let bindings: Vec<_> = (0..count).map(binding).collect();
        // SAFETY: plain use of a device that is alive; all is destroyed below, after its work has ended.
        unsafe {
            let info = vk::ShaderModuleCreateInfo::default().code(spirv);
            let module = device.create_shader_module(&info, None).unwrap();
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let sets = [device.create_descriptor_set_layout(&info, None).unwrap()];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = device.create_pipeline_layout(&info, None).unwrap();
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(entry);
            let info = [vk::ComputePipelineCreateInfo::default()
                .stage(stage)
                .layout(layout)];
            let pipeline = device
                .create_compute_pipelines(vk::PipelineCache::null(), &info, None)
                .unwrap()[0];
            let sizes = [vk::DescriptorPoolSize {
                ty: kind,
                descriptor_count: count,
            }];
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(1)
                .pool_sizes(&sizes);
            let pool = device.create_descriptor_pool(&info, None).unwrap();
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&sets);
            let bound = device.allocate_descriptor_sets(&info).unwrap();
            for (index, buffer) in buffers.iter().enumerate() {
                let range = [vk::DescriptorBufferInfo {
                    buffer: buffer.buffer,
                    offset: 0,
                    range: vk::WHOLE_SIZE,
                }];
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(bound[0])
                    .dst_binding(index as u32)
                    .descriptor_type(kind)
                    .buffer_info(&range);
                device.update_descriptor_sets(&[write], &[]);
            }
            let commands = Commands::new(self);
            let recorded = commands.recorded(|commands| {
                let compute = vk::PipelineBindPoint::COMPUTE;
                device.cmd_bind_pipeline(commands, compute, pipeline);
                device.cmd_bind_descriptor_sets(commands, compute, layout, 0, &bound, &[]);
                device.cmd_dispatch(commands, workgroups, 1, 1);
            });
            commands.run(&[recorded]);
            device.destroy_descriptor_pool(pool, None);
            device.destroy_pipeline(pipeline, None);
            device.destroy_pipeline_layout(layout, None);
            device.destroy_descriptor_set_layout(sets[0], None);
            device.destroy_shader_module(module, None);
        }
    }

    /// The first `size` bytes of that memory.
    pub(crate) fn bytes(&self, memory: vk::DeviceMemory, size: u64) -> Vec<u8> {
        // SAFETY: nothing else uses the memory now.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let pointer = self.device.map_memory(memory, 0, size, flags).unwrap();
            let bytes = std::slice::from_raw_parts(pointer.cast::<u8>(), size as usize);
            let bytes = bytes.to_vec();
            self.device.unmap_memory(memory);
            bytes
        }
    }
}

/// A buffer of an application's in memory that the host can see, freed when it is dropped.
pub(crate) struct ApplicationBuffer<'a> {
    application: &'a Application,
    pub(crate) buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    size: u64,
}

impl<'a> ApplicationBuffer<'a> {
    /// One of these bytes.
    pub(crate) fn of(application: &'a Application, bytes: &[u8]) -> Self {
        let size = bytes.len() as u64;
        let (buffer, memory) = application.buffer(size);
        let made = Self {
            application,
            buffer,
            memory,
            size,
        };
        made.write(bytes);
        made
    }

    /// Writes all its bytes.
    pub(crate) fn write(&self, bytes: &[u8]) {
        assert_eq!(bytes.len() as u64, self.size);
        // SAFETY: nothing else uses the memory now.
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let device = &self.application.device;
            let pointer = device.map_memory(self.memory, 0, self.size, flags);
            std::slice::from_raw_parts_mut(pointer.unwrap().cast::<u8>(), bytes.len())
                .copy_from_slice(bytes);
            device.unmap_memory(self.memory);
        }
    }

    pub(crate) fn range(&self, offset: u64, size: u64) -> VulkanBuffer {
        VulkanBuffer::new(self.buffer, size).at(offset)
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.application.bytes(self.memory, self.size)
    }
}

impl Drop for ApplicationBuffer<'_> {
    fn drop(&mut self) {
        // SAFETY: nothing is in flight.
        unsafe {
            self.application.device.destroy_buffer(self.buffer, None);
            self.application.device.free_memory(self.memory, None);
        }
    }
}

impl Drop for Application {
    fn drop(&mut self) {
        // SAFETY: the engine and its clips are dropped.
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// Command buffers of an application.
pub(crate) struct Commands<'a> {
    application: &'a Application,
    pool: vk::CommandPool,
}

impl<'a> Commands<'a> {
    pub(crate) fn new(application: &'a Application) -> Self {
        let info = vk::CommandPoolCreateInfo::default();
        // SAFETY: plain creation; destroyed in `drop`.
        let pool = unsafe { application.device.create_command_pool(&info, None) }.unwrap();
        Self { application, pool }
    }

    /// A command buffer with the commands of `record`.
    pub(crate) fn recorded(&self, record: impl FnOnce(vk::CommandBuffer)) -> vk::CommandBuffer {
        let device = &self.application.device;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .command_buffer_count(1);
        // SAFETY: plain use of a device that is alive.
        unsafe {
            let commands = device.allocate_command_buffers(&info).unwrap()[0];
            let info = vk::CommandBufferBeginInfo::default();
            device.begin_command_buffer(commands, &info).unwrap();
            record(commands);
            device.end_command_buffer(commands).unwrap();
            commands
        }
    }

    /// Submits several without a wait between them, then waits.
    pub(crate) fn run(&self, all: &[vk::CommandBuffer]) {
        for &commands in all {
            let buffers = [commands];
            let submit = [vk::SubmitInfo::default().command_buffers(&buffers)];
            let fence = vk::Fence::null();
            let _lock = self.application.queue_lock.lock().unwrap();
            // SAFETY: every user of the queue holds its lock.
            unsafe {
                let device = &self.application.device;
                device
                    .queue_submit(self.application.queue, &submit, fence)
                    .unwrap();
            }
        }
        let _lock = self.application.queue_lock.lock().unwrap();
        // SAFETY: as above.
        unsafe { self.application.device.device_wait_idle() }.unwrap();
    }
}

impl Drop for Commands<'_> {
    fn drop(&mut self) {
        // SAFETY: nothing is in flight.
        unsafe {
            self.application
                .device
                .destroy_command_pool(self.pool, None);
        }
    }
}
