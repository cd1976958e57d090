//! A card made of the one device behind the loader, which is a software device with one queue and one
//! kind of memory: with a queue that only copies, and with memory of the device's, of the host's, and of
//! both. `FAULT_CARD` says which card: `rebar` (the host sees all of the device's memory), `window` (it
//! sees 256 MiB), or `full` (it sees all, and none is left there).
//!
//! Work for the copying queue is held back until the program asks whether it has ended, and runs after
//! all work that was submitted to the other queue meanwhile: work that relies on another order than its
//! semaphores say gives other bits. Lines of the log:
//!
//! * `card copies`: something was submitted to the copying queue;
//! * `card beside`: kernels were submitted while copies were held back;
//! * `card disorder`: a copy waits for nothing, or for a semaphore that no submission signals;
//! * `card memory TYPE`: an allocation.

use std::ffi::CStr;
use std::sync::{LazyLock, Mutex, MutexGuard};

use ash::vk;

use crate::{Pointer, SUCCESS, Word, fault, log, real};

static KIND: LazyLock<Option<String>> = LazyLock::new(|| std::env::var("FAULT_CARD").ok());

const OUT_OF_DEVICE_MEMORY: i32 = -2;

/// The memory types: the device's, the host's, both, and the host's that it caches.
const TYPES: u32 = 4;
const BOTH: u32 = 2;

/// The target of the copying queue's handle, which only has to be an address.
static COPIES: u64 = 0;

fn copy_queue() -> Word {
    &raw const COPIES as Word
}

#[derive(Default)]
struct Queues {
    /// The one queue behind both.
    real: Word,
    /// The work that was submitted to the copying queue and has not run.
    held: Vec<Copy>,
    /// The points that submissions to the other queue will reach.
    coming: Vec<(vk::Semaphore, u64)>,
}

/// A submission without its pointers.
struct Copy {
    commands: Vec<vk::CommandBuffer>,
    waits: Vec<(vk::Semaphore, u64)>,
    stages: Vec<vk::PipelineStageFlags>,
    fence: vk::Fence,
}

static QUEUES: LazyLock<Mutex<Queues>> = LazyLock::new(Mutex::default);

fn queues() -> MutexGuard<'static, Queues> {
    QUEUES.lock().unwrap()
}

/// The slice of a structure of Vulkan's.
unsafe fn slice<'a, T>(first: *const T, count: u32) -> &'a [T] {
    match count {
        0 => &[],
        // SAFETY: promised by the caller.
        _ => unsafe { std::slice::from_raw_parts(first, count as usize) },
    }
}

/// The semaphores of a submission with their values: those it waits for, and those it signals.
unsafe fn points(info: &vk::SubmitInfo<'_>) -> [Vec<(vk::Semaphore, u64)>; 2] {
    let mut next = info.p_next.cast::<vk::BaseInStructure<'_>>();
    // SAFETY: a chain of structures, and the arrays of this one.
    unsafe {
        while !next.is_null() && (*next).s_type != vk::StructureType::TIMELINE_SEMAPHORE_SUBMIT_INFO
        {
            next = (*next).p_next;
        }
        if next.is_null() {
            return [Vec::new(), Vec::new()];
        }
        let values = &*next.cast::<vk::TimelineSemaphoreSubmitInfo<'_>>();
        let joined = |semaphores: &[vk::Semaphore], values: &[u64]| {
            let pairs = semaphores.iter().copied().zip(values.iter().copied());
            pairs.collect()
        };
        [
            joined(
                slice(info.p_wait_semaphores, info.wait_semaphore_count),
                slice(
                    values.p_wait_semaphore_values,
                    values.wait_semaphore_value_count,
                ),
            ),
            joined(
                slice(info.p_signal_semaphores, info.signal_semaphore_count),
                slice(
                    values.p_signal_semaphore_values,
                    values.signal_semaphore_value_count,
                ),
            ),
        ]
    }
}

unsafe extern "system" fn vkQueueSubmit(
    queue: Word,
    count: u32,
    infos: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> i32 {
    let mut queues = queues();
    // SAFETY: the caller's array.
    let all = unsafe { slice(infos, count) };
    if queue != copy_queue() {
        if !queues.held.is_empty() {
            log("card beside");
        }
        // SAFETY: the arguments are the caller's.
        let result = unsafe {
            crate::vkQueueSubmit(
                queue,
                u64::from(count),
                infos as Word,
                vk::Handle::as_raw(fence),
            )
        };
        if result == SUCCESS {
            for info in all {
                // SAFETY: as above.
                let [_, reached] = unsafe { points(info) };
                queues.coming.extend(reached);
            }
        }
        return result;
    }
    if let Some(result) = fault("vkQueueSubmit") {
        return result;
    }
    log("card copies");
    for info in all {
        // SAFETY: as above.
        let ([waits, _], commands, stages) = unsafe {
            (
                points(info),
                slice(info.p_command_buffers, info.command_buffer_count).to_vec(),
                slice(info.p_wait_dst_stage_mask, info.wait_semaphore_count).to_vec(),
            )
        };
        if waits.is_empty() || waits.iter().any(|point| !queues.coming.contains(point)) {
            log("card disorder");
        }
        queues.held.push(Copy {
            commands,
            waits,
            stages,
            fence,
        });
    }
    SUCCESS
}

/// Submits the work that was held back.
fn release() {
    let mut queues = queues();
    let held = std::mem::take(&mut queues.held);
    for copy in held {
        let (semaphores, values): (Vec<_>, Vec<_>) = copy.waits.into_iter().unzip();
        let mut timelines =
            vk::TimelineSemaphoreSubmitInfo::default().wait_semaphore_values(&values);
        let info = vk::SubmitInfo::default()
            .command_buffers(&copy.commands)
            .wait_semaphores(&semaphores)
            .wait_dst_stage_mask(&copy.stages)
            .push_next(&mut timelines);
        // SAFETY: the real function; the caller keeps what it submitted, and the queue is locked.
        let result = unsafe {
            let submit = real!(
                c"vkQueueSubmit" as fn(Word, u32, *const vk::SubmitInfo<'_>, vk::Fence) -> i32
            );
            submit(queues.real, 1, &raw const info, copy.fence)
        };
        assert_eq!(result, SUCCESS, "a copy is submitted");
    }
}

unsafe extern "system" fn vkWaitForFences(
    device: Word,
    count: Word,
    fences: Word,
    all: Word,
    timeout: Word,
) -> i32 {
    release();
    // SAFETY: the arguments are the caller's.
    unsafe { crate::vkWaitForFences(device, count, fences, all, timeout) }
}

unsafe extern "system" fn vkGetFenceStatus(device: Word, fence: Word) -> i32 {
    release();
    // SAFETY: as above.
    unsafe { crate::vkGetFenceStatus(device, fence) }
}

unsafe extern "system" fn vkQueueWaitIdle(_: Word) -> i32 {
    release();
    let queue = queues().real;
    // SAFETY: the one queue there is.
    unsafe { crate::vkQueueWaitIdle(queue) }
}

unsafe extern "system" fn vkDeviceWaitIdle(device: Word) -> i32 {
    release();
    // SAFETY: as above.
    unsafe { crate::vkDeviceWaitIdle(device) }
}

unsafe extern "system" fn vkGetPhysicalDeviceProperties(
    device: Word,
    out: *mut vk::PhysicalDeviceProperties,
) {
    // SAFETY: the real function, and what it wrote.
    unsafe {
        let get =
            real!(c"vkGetPhysicalDeviceProperties" as fn(Word, *mut vk::PhysicalDeviceProperties));
        get(device, out);
        (*out).device_type = vk::PhysicalDeviceType::DISCRETE_GPU;
    }
}

unsafe extern "system" fn vkGetPhysicalDeviceQueueFamilyProperties(
    device: Word,
    count: *mut u32,
    out: *mut vk::QueueFamilyProperties,
) {
    // SAFETY: the real function, the caller's counter, and room for as many as it says.
    unsafe {
        let mut one = 1;
        let get = real!(
            c"vkGetPhysicalDeviceQueueFamilyProperties"
                as fn(Word, *mut u32, *mut vk::QueueFamilyProperties)
        );
        if !out.is_null() && *count > 1 {
            get(device, &raw mut one, out);
            *out.add(1) = vk::QueueFamilyProperties::default()
                .queue_flags(vk::QueueFlags::TRANSFER)
                .queue_count(1);
        }
        *count = 2;
    }
}

unsafe extern "system" fn vkGetPhysicalDeviceMemoryProperties(
    _device: Word,
    out: *mut vk::PhysicalDeviceMemoryProperties,
) {
    use vk::MemoryPropertyFlags as Flags;
    let host = Flags::HOST_VISIBLE | Flags::HOST_COHERENT;
    let window = u32::from(KIND.as_deref() == Some("window")) * 2;
    let types = [
        (Flags::DEVICE_LOCAL, 0),
        (host, 1),
        (Flags::DEVICE_LOCAL | host, window),
        (host | Flags::HOST_CACHED, 1),
    ];
    let local = vk::MemoryHeapFlags::DEVICE_LOCAL;
    let heaps = [
        (16 << 30, local),
        (32 << 30, vk::MemoryHeapFlags::empty()),
        (256 << 20, local),
    ];
    let mut memory = vk::PhysicalDeviceMemoryProperties {
        memory_type_count: TYPES,
        memory_heap_count: 2 + window / 2,
        ..Default::default()
    };
    for (to, (property_flags, heap_index)) in memory.memory_types.iter_mut().zip(types) {
        *to = vk::MemoryType {
            property_flags,
            heap_index,
        };
    }
    for (to, (size, flags)) in memory.memory_heaps.iter_mut().zip(heaps) {
        *to = vk::MemoryHeap { size, flags };
    }
    // SAFETY: the caller's structure.
    unsafe { *out = memory };
}

unsafe extern "system" fn vkGetBufferMemoryRequirements(
    device: Word,
    buffer: Word,
    out: *mut vk::MemoryRequirements,
) {
    // SAFETY: the real function, and what it wrote.
    unsafe {
        let get =
            real!(c"vkGetBufferMemoryRequirements" as fn(Word, Word, *mut vk::MemoryRequirements));
        get(device, buffer, out);
        assert_eq!(
            (*out).memory_type_bits,
            1,
            "the device has one type of memory"
        );
        (*out).memory_type_bits = (1 << TYPES) - 1;
    }
}

unsafe extern "system" fn vkAllocateMemory(
    device: Word,
    info: *const vk::MemoryAllocateInfo<'_>,
    allocator: Word,
    out: *mut Word,
) -> i32 {
    // SAFETY: the caller's structure.
    let mut info = unsafe { *info };
    log(&format!("card memory {}", info.memory_type_index));
    if info.memory_type_index == BOTH && KIND.as_deref() == Some("full") {
        return OUT_OF_DEVICE_MEMORY;
    }
    info.memory_type_index = 0;
    // SAFETY: the arguments are the caller's, but for the type.
    unsafe { crate::vkAllocateMemory(device, (&raw const info).cast(), allocator, out) }
}

unsafe extern "system" fn vkCreateDevice(
    physical: Word,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: Word,
    out: Word,
) -> i32 {
    // SAFETY: the caller's structures.
    let mut info = unsafe { *info };
    info.queue_create_info_count = 1;
    // SAFETY: the arguments are the caller's, but for the second family, which is not there.
    unsafe { crate::vkCreateDevice(physical, &raw const info as Word, allocator, out) }
}

unsafe extern "system" fn vkGetDeviceQueue(device: Word, family: u32, index: u32, out: *mut Word) {
    assert_eq!(index, 0, "each family has one queue");
    if family == 1 {
        // SAFETY: the caller's handle.
        unsafe { *out = copy_queue() };
        return;
    }
    // SAFETY: the real function, and what it wrote.
    unsafe {
        real!(c"vkGetDeviceQueue" as fn(Word, u32, u32, *mut Word))(device, family, 0, out);
        queues().real = *out;
    }
}

unsafe extern "system" fn vkCreateCommandPool(
    device: Word,
    info: *const vk::CommandPoolCreateInfo<'_>,
    allocator: Word,
    out: Word,
) -> i32 {
    // SAFETY: the caller's structure.
    let mut info = unsafe { *info };
    info.queue_family_index = 0;
    // SAFETY: the arguments are the caller's, but for the family.
    unsafe { crate::vkCreateCommandPool(device, &raw const info as Word, allocator, out) }
}

unsafe extern "system" fn vkCreateBuffer(
    device: Word,
    info: *const vk::BufferCreateInfo<'_>,
    allocator: Word,
    out: Word,
) -> i32 {
    // SAFETY: the caller's structure.
    let mut info = unsafe { *info };
    if info.sharing_mode == vk::SharingMode::CONCURRENT {
        log("card shared");
        info.sharing_mode = vk::SharingMode::EXCLUSIVE;
        info.queue_family_index_count = 0;
    }
    // SAFETY: the arguments are the caller's, but for the second family.
    unsafe { crate::vkCreateBuffer(device, &raw const info as Word, allocator, out) }
}

/// The card's functions, where there is to be one.
pub(crate) fn function(name: &CStr) -> Option<Pointer> {
    KIND.as_ref()?;
    let function = match name.to_str().unwrap_or_default() {
        "vkQueueSubmit" => vkQueueSubmit as *const (),
        "vkWaitForFences" => vkWaitForFences as *const (),
        "vkGetFenceStatus" => vkGetFenceStatus as *const (),
        "vkQueueWaitIdle" => vkQueueWaitIdle as *const (),
        "vkDeviceWaitIdle" => vkDeviceWaitIdle as *const (),
        "vkGetPhysicalDeviceProperties" => vkGetPhysicalDeviceProperties as *const (),
        "vkGetPhysicalDeviceQueueFamilyProperties" => {
            vkGetPhysicalDeviceQueueFamilyProperties as *const ()
        }
        "vkGetPhysicalDeviceMemoryProperties" => vkGetPhysicalDeviceMemoryProperties as *const (),
        "vkGetBufferMemoryRequirements" => vkGetBufferMemoryRequirements as *const (),
        "vkAllocateMemory" => vkAllocateMemory as *const (),
        "vkCreateDevice" => vkCreateDevice as *const (),
        "vkGetDeviceQueue" => vkGetDeviceQueue as *const (),
        "vkCreateCommandPool" => vkCreateCommandPool as *const (),
        "vkCreateBuffer" => vkCreateBuffer as *const (),
        _ => return None,
    };
    Some(function.cast())
}
