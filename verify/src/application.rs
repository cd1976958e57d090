//! A device as an application makes it, with nothing of the engine but its public interface: an instance of Vulkan 1.1, a
//! queue that computes, a queue that only copies (if the device has one), and the application's buffers and commands. The
//! proof of a device ([`renderer`](crate::renderer)) runs the engine on it, and measures with its time stamps.
#![allow(unsafe_code)]

use std::mem::ManuallyDrop;
use std::time::{Duration, Instant};

use ash::{khr, vk};
use tumble::lab::load_vulkan;
use tumble::vulkan::{VulkanBuffer, VulkanError, VulkanHandles, VulkanQueue};

use crate::instance::{Instance, Named};

/// The Vulkan version that the application requests.
const VERSION: u32 = vk::API_VERSION_1_1;

/// The time limit; work that takes longer has hung.
const TIMEOUT_SECONDS: u64 = 60;

/// An application's device, which is destroyed together with this.
pub(crate) struct Application {
    memory: vk::PhysicalDeviceMemoryProperties,
    clock: Clock,
    physical_device: vk::PhysicalDevice,
    has_int64: bool,
    device: ash::Device,
    queue: vk::Queue,
    queue_family: u32,
    pub(crate) copy_queue: Option<VulkanQueue>,
    pool: vk::CommandPool,
    /// Two time stamps; null if the queue has none.
    stamps: vk::QueryPool,
    /// Whether a wait timed out; then nothing may be destroyed.
    has_hung: bool,
    // The last field, so that it is destroyed last.
    instance: ManuallyDrop<Instance>,
}

/// The clock of a queue's time stamps.
#[derive(Debug, Clone, Copy)]
struct Clock {
    /// The number of valid bits of a stamp; 0 if there are no stamps.
    bits: u32,
    /// The unit of stamps in nanoseconds.
    period: f64,
}

impl Clock {
    /// The time between two stamps.
    fn between(self, start: u64, end: u64) -> Duration {
        let ticks = end.wrapping_sub(start) & (u64::MAX >> (64 - self.bits.clamp(1, 64)));
        Duration::from_nanos((ticks as f64 * self.period) as u64)
    }
}

/// The memory of an application's buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ApplicationMemory {
    /// Device memory; not visible to the host if the device has such memory.
    Device,
    /// Host memory; cached if the device has such memory.
    Host,
}

/// A buffer of the application, with a separate allocation.
pub(crate) struct ApplicationBuffer {
    device: ash::Device,
    pub(crate) raw: vk::Buffer,
    memory: vk::DeviceMemory,
    pub(crate) size: u64,
    /// Whether its memory is device-local and not visible to the host.
    pub(crate) is_hidden: bool,
}

/// The time that work took.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Elapsed {
    /// The time by the device's time stamps, if it has any.
    pub(crate) on_device: Option<Duration>,
    /// The time by the host's clock, from before the submission until the fence was seen.
    pub(crate) on_host: Duration,
}

/// The family that computes: the first that does not draw, which a desktop keeps busy; otherwise the first.
fn compute_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let computes = |family: &vk::QueueFamilyProperties| {
        family.queue_count > 0 && family.queue_flags.contains(vk::QueueFlags::COMPUTE)
    };
    let draws =
        |family: &vk::QueueFamilyProperties| family.queue_flags.contains(vk::QueueFlags::GRAPHICS);
    let alone = families
        .iter()
        .position(|family| computes(family) && !draws(family));
    let found = alone.or_else(|| families.iter().position(computes));
    found.map(|index| index as u32)
}

/// The family that only copies: it has no graphics and no compute.
fn copy_family(families: &[vk::QueueFamilyProperties], compute: u32) -> Option<u32> {
    let only_copies = |family: &vk::QueueFamilyProperties| {
        use vk::QueueFlags as Flags;
        let other = Flags::GRAPHICS
            | Flags::COMPUTE
            | Flags::VIDEO_DECODE_KHR
            | Flags::VIDEO_ENCODE_KHR
            | Flags::OPTICAL_FLOW_NV;
        let flags = family.queue_flags;
        family.queue_count > 0 && flags.contains(Flags::TRANSFER) && !flags.intersects(other)
    };
    let mut all = (0..).zip(families);
    let found = all.find(|(index, family)| *index != compute && only_copies(family));
    found.map(|(index, _)| index)
}

impl Application {
    /// Opens the physical device with this UUID.
    pub(crate) fn new(uuid: &str, validation: bool) -> Result<Self, VulkanError> {
        let instance = Instance::new(load_vulkan()?, VERSION, validation)?;
        let physical_device = instance.physical_device(uuid)?;
        // SAFETY: the instance is alive, and the physical device is one of it, here and below.
        let families =
            unsafe { (instance.raw).get_physical_device_queue_family_properties(physical_device) };
        // SAFETY: as above.
        let properties = unsafe { (instance.raw).get_physical_device_properties(physical_device) };
        // SAFETY: as above.
        let memory =
            unsafe { (instance.raw).get_physical_device_memory_properties(physical_device) };
        // SAFETY: as above.
        let has = unsafe { (instance.raw).get_physical_device_features(physical_device) };
        let has_int64 = has.shader_int64 == vk::TRUE;
        let [timelines, portability] = instance.extensions(
            physical_device,
            [khr::timeline_semaphore::NAME, khr::portability_subset::NAME],
        )?;
        let family = compute_family(&families).ok_or(VulkanError::NoDevice)?;
        let copy_family = copy_family(&families, family).filter(|_| timelines);
        let of_family = |family| {
            vk::DeviceQueueCreateInfo::default()
                .queue_family_index(family)
                .queue_priorities(&[1.0])
        };
        let mut queues = vec![of_family(family)];
        queues.extend(copy_family.map(of_family));
        let features = vk::PhysicalDeviceFeatures::default().shader_int64(has_int64);
        let extensions = [
            // An instance of Vulkan 1.1 has timelines by their extension.
            (copy_family.is_some(), khr::timeline_semaphore::NAME),
            (portability, khr::portability_subset::NAME),
        ];
        let extensions: Vec<_> = (extensions.iter())
            .filter(|(there, _)| *there)
            .map(|(_, name)| name.as_ptr())
            .collect();
        let mut timelines =
            vk::PhysicalDeviceTimelineSemaphoreFeatures::default().timeline_semaphore(true);
        let mut info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&features)
            .enabled_extension_names(&extensions);
        if copy_family.is_some() {
            info = info.push_next(&mut timelines);
        }
        // SAFETY: the physical device belongs to the instance and has these families.
        let device = unsafe { (instance.raw).create_device(physical_device, &info, None) }
            .named("vkCreateDevice")?;
        // SAFETY: these queues were just created.
        let queue = |family| unsafe { device.get_device_queue(family, 0) };
        let mut application = Self {
            memory,
            clock: Clock {
                bits: families[family as usize].timestamp_valid_bits,
                period: f64::from(properties.limits.timestamp_period),
            },
            physical_device,
            has_int64,
            queue: queue(family),
            queue_family: family,
            copy_queue: copy_family.map(|family| VulkanQueue::new(queue(family), family)),
            pool: vk::CommandPool::null(),
            stamps: vk::QueryPool::null(),
            has_hung: false,
            instance: ManuallyDrop::new(instance),
            device,
        };
        let device = &application.device;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
        // SAFETY: the device is alive; destroyed in `drop`, here and below.
        application.pool =
            unsafe { device.create_command_pool(&info, None) }.named("vkCreateCommandPool")?;
        if application.clock.bits > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2);
            // SAFETY: as above.
            application.stamps =
                unsafe { device.create_query_pool(&info, None) }.named("vkCreateQueryPool")?;
        }
        Ok(application)
    }

    /// The handles for the engine.
    pub(crate) fn handles(&self) -> VulkanHandles {
        let mut handles = VulkanHandles::new(
            self.instance.entry.clone(),
            self.instance.raw.clone(),
            VERSION,
            self.physical_device,
            self.device.clone(),
            VulkanQueue::new(self.queue, self.queue_family),
        );
        handles.shader_int64 = self.has_int64;
        handles.with_copy_queue(self.copy_queue)
    }

    /// The messages of the validation layer so far.
    pub(crate) fn validation_messages(&self) -> Vec<String> {
        self.instance.validation_messages()
    }

    /// A buffer for results, as a source and destination of copies.
    pub(crate) fn buffer(
        &self,
        size: u64,
        memory: ApplicationMemory,
    ) -> Result<ApplicationBuffer, VulkanError> {
        use vk::MemoryPropertyFlags as Flags;
        let size = size.max(16).next_multiple_of(16);
        let info = vk::BufferCreateInfo::default().size(size).usage(
            vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::TRANSFER_DST
                | vk::BufferUsageFlags::TRANSFER_SRC,
        );
        // SAFETY: the device is alive, here and below; destroyed when the buffer is dropped.
        let raw = unsafe { self.device.create_buffer(&info, None) }.named("vkCreateBuffer")?;
        let mut buffer = ApplicationBuffer {
            device: self.device.clone(),
            raw,
            memory: vk::DeviceMemory::null(),
            size,
            is_hidden: false,
        };
        // SAFETY: as above.
        let needs = unsafe { self.device.get_buffer_memory_requirements(raw) };
        let types = self.memory.memory_types_as_slice();
        let find = |with: Flags, without: Flags| {
            (0..types.len() as u32).find(|&index| {
                let flags = types[index as usize].property_flags;
                let is_allowed = needs.memory_type_bits & (1 << index) != 0;
                is_allowed && flags.contains(with) && !flags.intersects(without)
            })
        };
        let mapped = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
        let index = match memory {
            ApplicationMemory::Device => {
                let hidden = find(Flags::DEVICE_LOCAL, Flags::HOST_VISIBLE);
                buffer.is_hidden = hidden.is_some();
                hidden.or_else(|| find(Flags::DEVICE_LOCAL, Flags::empty()))
            }
            ApplicationMemory::Host => {
                let cached = find(mapped | Flags::HOST_CACHED, Flags::empty());
                cached.or_else(|| find(mapped, Flags::empty()))
            }
        };
        let required = match memory {
            ApplicationMemory::Device => Flags::DEVICE_LOCAL,
            ApplicationMemory::Host => mapped,
        };
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needs.size)
            .memory_type_index(index.ok_or(VulkanError::NoMemoryType {
                properties: required.as_raw(),
            })?);
        // SAFETY: as above.
        buffer.memory =
            unsafe { self.device.allocate_memory(&info, None) }.named("vkAllocateMemory")?;
        // SAFETY: as above; the memory is large enough and of an allowed type.
        unsafe { self.device.bind_buffer_memory(raw, buffer.memory, 0) }
            .named("vkBindBufferMemory")?;
        Ok(buffer)
    }

    /// A command buffer with the commands that `record` records, between time stamps if `is_timed` and the queue has
    /// them.
    pub(crate) fn recorded<E: From<VulkanError>>(
        &self,
        is_timed: bool,
        record: impl FnOnce(vk::CommandBuffer) -> Result<(), E>,
    ) -> Result<vk::CommandBuffer, E> {
        let device = &self.device;
        let is_timed = is_timed && self.stamps != vk::QueryPool::null();
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .command_buffer_count(1);
        // SAFETY: the device, its pools and the commands are alive, and nothing else uses them.
        let commands =
            unsafe { device.allocate_command_buffers(&info) }.named("vkAllocateCommandBuffers")?[0];
        let info = vk::CommandBufferBeginInfo::default();
        // SAFETY: as above.
        unsafe { device.begin_command_buffer(commands, &info) }.named("vkBeginCommandBuffer")?;
        if is_timed {
            let start = vk::PipelineStageFlags::TOP_OF_PIPE;
            // SAFETY: recording is on, and the pool has two queries.
            unsafe {
                device.cmd_reset_query_pool(commands, self.stamps, 0, 2);
                device.cmd_write_timestamp(commands, start, self.stamps, 0);
            }
        }
        record(commands)?;
        if is_timed {
            let end = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
            // SAFETY: as above.
            unsafe { device.cmd_write_timestamp(commands, end, self.stamps, 1) };
        }
        // SAFETY: as above.
        unsafe { device.end_command_buffer(commands) }.named("vkEndCommandBuffer")?;
        Ok(commands)
    }

    /// Records a copy of the first `size` bytes, which waits for all commands before it; the host and all later
    /// commands see the copy.
    pub(crate) fn copy(
        &self,
        commands: vk::CommandBuffer,
        from: &ApplicationBuffer,
        to: &ApplicationBuffer,
        size: u64,
    ) {
        use vk::{AccessFlags as Access, PipelineStageFlags as Stages};
        let region = [vk::BufferCopy::default().size(size.min(from.size).min(to.size))];
        self.barrier(
            commands,
            [Stages::ALL_COMMANDS, Stages::TRANSFER],
            [
                Access::MEMORY_WRITE,
                Access::TRANSFER_READ | Access::TRANSFER_WRITE,
            ],
        );
        // SAFETY: recording is on, and both ranges lie within their buffers.
        unsafe { (self.device).cmd_copy_buffer(commands, from.raw, to.raw, &region) };
        self.barrier(
            commands,
            [Stages::TRANSFER, Stages::HOST | Stages::ALL_COMMANDS],
            [
                Access::TRANSFER_WRITE,
                Access::HOST_READ | Access::MEMORY_READ | Access::MEMORY_WRITE,
            ],
        );
    }

    /// Records that a whole buffer is filled with a word.
    pub(crate) fn fill(&self, commands: vk::CommandBuffer, buffer: &ApplicationBuffer, word: u32) {
        // SAFETY: recording is on, and the buffer's size is a multiple of 4.
        unsafe { (self.device).cmd_fill_buffer(commands, buffer.raw, 0, buffer.size, word) };
    }

    fn barrier(
        &self,
        commands: vk::CommandBuffer,
        [from, to]: [vk::PipelineStageFlags; 2],
        [wrote, sees]: [vk::AccessFlags; 2],
    ) {
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(wrote)
            .dst_access_mask(sees)];
        let none = vk::DependencyFlags::empty();
        // SAFETY: recording is on.
        unsafe {
            (self.device).cmd_pipeline_barrier(commands, from, to, none, &memory, &[], &[]);
        }
    }

    /// Submits commands one after another, without a wait between them, and waits for the last.
    pub(crate) fn run(&mut self, all: &[vk::CommandBuffer]) -> Result<Elapsed, VulkanError> {
        let device = &self.device;
        // SAFETY: the device is alive, here and below, and nothing else uses its queue now.
        let fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }
            .named("vkCreateFence")?;
        let started = Instant::now();
        let submitted = (0..).zip(all).try_for_each(|(index, &commands)| {
            let commands = [commands];
            let info = [vk::SubmitInfo::default().command_buffers(&commands)];
            let last = index + 1 == all.len();
            let fence = if last { fence } else { vk::Fence::null() };
            // SAFETY: as above.
            unsafe { device.queue_submit(self.queue, &info, fence) }
        });
        let timeout = TIMEOUT_SECONDS * 1_000_000_000;
        // SAFETY: as above.
        let waited =
            submitted.and_then(|()| unsafe { device.wait_for_fences(&[fence], true, timeout) });
        let on_host = started.elapsed();
        if waited == Err(vk::Result::TIMEOUT) {
            self.has_hung = true;
            return Err(VulkanError::Timeout {
                seconds: TIMEOUT_SECONDS,
            });
        }
        if waited.is_err() {
            // SAFETY: as above. Submitted work must end before the fence is destroyed.
            let _ = unsafe { device.device_wait_idle() };
        }
        // SAFETY: as above.
        unsafe { device.destroy_fence(fence, None) };
        waited.named("vkQueueSubmit")?;
        Ok(Elapsed {
            on_device: None,
            on_host,
        })
    }

    /// Runs commands that were recorded with time stamps.
    pub(crate) fn timed(&mut self, commands: vk::CommandBuffer) -> Result<Elapsed, VulkanError> {
        let mut elapsed = self.run(&[commands])?;
        if self.stamps != vk::QueryPool::null() {
            let mut stamps = [0u64; 2];
            let flags = vk::QueryResultFlags::TYPE_64;
            // SAFETY: the pool has two queries, and the commands that write them have ended.
            let read =
                unsafe { (self.device).get_query_pool_results(self.stamps, 0, &mut stamps, flags) };
            elapsed.on_device = (read.is_ok())
                .then(|| self.clock.between(stamps[0], stamps[1]))
                .filter(|time| !time.is_zero());
        }
        Ok(elapsed)
    }

    /// Resets all command buffers, none of which may be in flight.
    pub(crate) fn forget_commands(&self) {
        let flags = vk::CommandPoolResetFlags::RELEASE_RESOURCES;
        // SAFETY: nothing is in flight, because `run` waits. If the reset fails, the commands keep their memory until
        // the pool is destroyed.
        let _ = unsafe { self.device.reset_command_pool(self.pool, flags) };
    }
}

impl ApplicationBuffer {
    /// A range of the buffer, for the engine.
    pub(crate) fn range(&self, offset: u64, size: u64) -> VulkanBuffer {
        VulkanBuffer::new(self.raw, size).at(offset)
    }

    /// The first bytes of a buffer in host memory, which nothing may write at this time.
    pub(crate) fn bytes(&self, size: usize) -> Result<Vec<u8>, VulkanError> {
        let size = size.min(self.size as usize);
        let flags = vk::MemoryMapFlags::empty();
        // SAFETY: the memory is the buffer's alone, visible to the host (`ApplicationMemory::Host`), and
        // unmapped again below.
        let pointer = unsafe { (self.device).map_memory(self.memory, 0, vk::WHOLE_SIZE, flags) }
            .named("vkMapMemory")?;
        // SAFETY: so many bytes are mapped, and nothing writes them.
        let bytes = unsafe { std::slice::from_raw_parts(pointer.cast::<u8>(), size) }.to_vec();
        // SAFETY: mapped above.
        unsafe { self.device.unmap_memory(self.memory) };
        Ok(bytes)
    }
}

impl Drop for ApplicationBuffer {
    fn drop(&mut self) {
        // SAFETY: created from this device, which the owner of the buffer keeps; no work uses it any more,
        // because `Application::run` waits. Null is allowed.
        unsafe {
            self.device.destroy_buffer(self.raw, None);
            self.device.free_memory(self.memory, None);
        }
    }
}

impl Drop for Application {
    fn drop(&mut self) {
        if self.has_hung {
            return;
        }
        // SAFETY: engines, clips and buffers of it are gone; null is allowed. The instance is dropped once, after its
        // device.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.device.destroy_query_pool(self.stamps, None);
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            ManuallyDrop::drop(&mut self.instance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NVIDIA's copy engines are also for sparse memory; the family for video copies too, and is left alone.
    #[test]
    fn the_copy_queue_is_one_that_neither_draws_nor_computes() {
        use vk::QueueFlags as Flags;
        let all = Flags::GRAPHICS | Flags::COMPUTE | Flags::TRANSFER;
        let copies = Flags::TRANSFER | Flags::SPARSE_BINDING;
        let families = |flags: &[Flags]| -> Vec<vk::QueueFamilyProperties> {
            let of = |&flags| {
                vk::QueueFamilyProperties::default()
                    .queue_count(1)
                    .queue_flags(flags)
            };
            flags.iter().map(of).collect()
        };
        let card = families(&[
            all,
            Flags::TRANSFER | Flags::VIDEO_DECODE_KHR,
            copies,
            Flags::COMPUTE | copies,
        ]);
        assert_eq!(compute_family(&card), Some(3));
        assert_eq!(copy_family(&card, 3), Some(2));
        let software = families(&[all]);
        assert_eq!(compute_family(&software), Some(0));
        assert_eq!(copy_family(&software, 0), None);
    }

    /// Stamps of few bits begin again at 0.
    #[test]
    fn a_clock_that_overflows_gives_the_time_between() {
        let clock = Clock {
            bits: 36,
            period: 2.0,
        };
        let found = clock.between((1 << 36) - 5, 10);
        assert_eq!(found, Duration::from_nanos(30));
    }
}
