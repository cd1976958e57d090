//! Simulates drivers with other properties than lavapipe:
//!
//! * `FAULT_STORAGE_BUFFERS`: how many storage buffers a kernel may bind;
//! * `FAULT_PORTABILITY`: the device has not all of Vulkan: only instances that ask for it see
//!   it, and it is opened only with `VK_KHR_portability_subset`;
//! * `FAULT_WAIT`: milliseconds until an instance is there;
//! * `FAULT_INCOHERENT`: memory that the host caches is not coherent. The host then sees separate memory,
//!   which holds rubbish at first, and bytes go from one to the other only where it asks for that. Logged as
//!   `card invalidated` and `card flushed`.

use std::alloc::Layout;
use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{LazyLock, Mutex};
use std::time::Duration;

use ash::vk;

use crate::{Pointer, SUCCESS, Word, fault, log, real};

fn number(variable: &str) -> Option<u32> {
    Some(std::env::var(variable).ok()?.parse().unwrap())
}

static STORAGE_BUFFERS: LazyLock<Option<u32>> = LazyLock::new(|| number("FAULT_STORAGE_BUFFERS"));

static IS_PORTABILITY: LazyLock<bool> =
    LazyLock::new(|| std::env::var_os("FAULT_PORTABILITY").is_some());

static WAIT: LazyLock<Option<u32>> = LazyLock::new(|| number("FAULT_WAIT"));

static IS_INCOHERENT: LazyLock<bool> =
    LazyLock::new(|| std::env::var_os("FAULT_INCOHERENT").is_some());

/// Bytes that become visible together, at the least.
const ATOM: u64 = 256;

/// The second of two types of memory: cached and not coherent. The first is coherent and not cached.
const INCOHERENT: u32 = 1;

/// An allocation of that type: its size, and its memory as the device and the host see it.
struct Mapped {
    size: usize,
    /// Addresses, once it is mapped.
    views: Option<[usize; 2]>,
}

static MAPPED: LazyLock<Mutex<HashMap<Word, Mapped>>> = LazyLock::new(Mutex::default);

fn layout(size: usize) -> Layout {
    Layout::from_size_align(size, 4096).unwrap()
}

/// Whether the instance says that it knows such devices.
static KNOWS: AtomicBool = AtomicBool::new(false);

const SUBSET: &CStr = c"VK_KHR_portability_subset";

const EXTENSION_NOT_PRESENT: i32 = -7;

unsafe extern "system" fn vkGetPhysicalDeviceProperties(
    device: Word,
    out: *mut vk::PhysicalDeviceProperties,
) {
    // SAFETY: the real function has this type; the caller's structure.
    unsafe {
        let get =
            real!(c"vkGetPhysicalDeviceProperties" as fn(Word, *mut vk::PhysicalDeviceProperties));
        get(device, out);
        if let Some(count) = *STORAGE_BUFFERS {
            (*out).limits.max_per_stage_descriptor_storage_buffers = count;
        }
        if *IS_INCOHERENT {
            (*out).limits.non_coherent_atom_size = ATOM;
        }
    }
}

unsafe extern "system" fn vkGetPhysicalDeviceMemoryProperties(
    _device: Word,
    out: *mut vk::PhysicalDeviceMemoryProperties,
) {
    use vk::MemoryPropertyFlags as Flags;
    let both = Flags::DEVICE_LOCAL | Flags::HOST_VISIBLE;
    let mut memory = vk::PhysicalDeviceMemoryProperties {
        memory_type_count: 2,
        memory_heap_count: 1,
        ..Default::default()
    };
    memory.memory_heaps[0] = vk::MemoryHeap {
        size: 16 << 30,
        flags: vk::MemoryHeapFlags::DEVICE_LOCAL,
    };
    memory.memory_types[0].property_flags = both | Flags::HOST_COHERENT;
    memory.memory_types[INCOHERENT as usize].property_flags = both | Flags::HOST_CACHED;
    // SAFETY: the caller's structure.
    unsafe { *out = memory };
}

unsafe extern "system" fn vkGetBufferMemoryRequirements(
    device: Word,
    buffer: Word,
    out: *mut vk::MemoryRequirements,
) {
    // SAFETY: the real function has this type, and the caller's structure.
    unsafe {
        let get =
            real!(c"vkGetBufferMemoryRequirements" as fn(Word, Word, *mut vk::MemoryRequirements));
        get(device, buffer, out);
        (*out).memory_type_bits = 3;
    }
}

unsafe extern "system" fn vkAllocateMemory(
    device: Word,
    info: *const vk::MemoryAllocateInfo<'_>,
    allocator: Word,
    out: *mut Word,
) -> i32 {
    // SAFETY: the arguments are the caller's, but for the type.
    unsafe {
        let mut changed = *info;
        changed.memory_type_index = 0;
        let changed = (&raw const changed).cast();
        let result = crate::vkAllocateMemory(device, changed, allocator, out);
        if result == SUCCESS && (*info).memory_type_index == INCOHERENT {
            let (size, views) = ((*info).allocation_size as usize, None);
            MAPPED.lock().unwrap().insert(*out, Mapped { size, views });
        }
        result
    }
}

unsafe extern "system" fn vkMapMemory(
    device: Word,
    memory: Word,
    offset: u64,
    size: u64,
    flags: Word,
    out: *mut usize,
) -> i32 {
    // SAFETY: the arguments are the caller's.
    let result = unsafe { crate::vkMapMemory(device, memory, offset, size, flags, out as Word) };
    if let Some(mapped) = MAPPED.lock().unwrap().get_mut(&memory)
        && result == SUCCESS
    {
        assert_eq!((offset, mapped.views), (0, None), "mapped as a whole, once");
        // SAFETY: the size is not 0, and all of the allocation is written.
        unsafe {
            let host = std::alloc::alloc(layout(mapped.size));
            host.write_bytes(0xa5, mapped.size);
            mapped.views = Some([*out, host as usize]);
            *out = host as usize;
        }
    }
    result
}

/// Copies ranges from one view of memory to the other.
unsafe fn make_visible(
    count: u32,
    ranges: *const vk::MappedMemoryRange<'_>,
    [from, to]: [usize; 2],
) {
    // SAFETY: the caller's array.
    let ranges = unsafe { std::slice::from_raw_parts(ranges, count as usize) };
    let mapped = MAPPED.lock().unwrap();
    for range in ranges {
        let memory = &mapped[&vk::Handle::as_raw(range.memory)];
        let views = memory.views.expect("it is mapped");
        let (start, size) = (range.offset as usize, range.size as usize);
        let is_whole = |bytes: u64| bytes.is_multiple_of(ATOM);
        let ends = start + size == memory.size || is_whole(range.size);
        assert!(is_whole(range.offset) && ends && start + size <= memory.size);
        // SAFETY: both views have that many bytes.
        unsafe {
            let (from, to) = (
                (views[from] + start) as *const u8,
                (views[to] + start) as *mut u8,
            );
            std::ptr::copy_nonoverlapping(from, to, size);
        }
    }
}

unsafe extern "system" fn vkInvalidateMappedMemoryRanges(
    _device: Word,
    count: u32,
    ranges: *const vk::MappedMemoryRange<'_>,
) -> i32 {
    if let Some(result) = fault("vkInvalidateMappedMemoryRanges") {
        return result;
    }
    log("card invalidated");
    // SAFETY: the caller's array.
    unsafe { make_visible(count, ranges, [0, 1]) };
    SUCCESS
}

unsafe extern "system" fn vkFlushMappedMemoryRanges(
    _device: Word,
    count: u32,
    ranges: *const vk::MappedMemoryRange<'_>,
) -> i32 {
    if let Some(result) = fault("vkFlushMappedMemoryRanges") {
        return result;
    }
    log("card flushed");
    // SAFETY: the caller's array.
    unsafe { make_visible(count, ranges, [1, 0]) };
    SUCCESS
}

unsafe extern "system" fn vkFreeMemory(device: Word, memory: Word, allocator: Word) {
    // SAFETY: the arguments are the caller's, and the host's view is a separate allocation.
    unsafe {
        if let Some(freed) = MAPPED.lock().unwrap().remove(&memory)
            && let Some([_, host]) = freed.views
        {
            std::alloc::dealloc(host as *mut u8, layout(freed.size));
        }
        crate::vkFreeMemory(device, memory, allocator);
    }
}

unsafe extern "system" fn vkCreateInstance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: Word,
    out: *mut Word,
) -> i32 {
    if let Some(milliseconds) = *WAIT {
        std::thread::sleep(Duration::from_millis(milliseconds.into()));
    }
    let knows = vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    // SAFETY: the arguments are the caller's.
    unsafe {
        KNOWS.store((*info).flags.contains(knows), Ordering::Relaxed);
        crate::vkCreateInstance(info as Word, allocator, out)
    }
}

unsafe extern "system" fn vkEnumeratePhysicalDevices(
    instance: Word,
    count: *mut u32,
    out: Word,
) -> i32 {
    // SAFETY: the arguments are the caller's.
    unsafe {
        if *IS_PORTABILITY && !KNOWS.load(Ordering::Relaxed) {
            *count = 0;
            return SUCCESS;
        }
        crate::vkEnumeratePhysicalDevices(instance, count, out)
    }
}

unsafe extern "system" fn vkEnumerateDeviceExtensionProperties(
    device: Word,
    layer: Word,
    count: *mut u32,
    out: *mut vk::ExtensionProperties,
) -> i32 {
    // SAFETY: the arguments are the caller's, and there is room for as many as it says.
    unsafe {
        let room = *count;
        let result =
            crate::vkEnumerateDeviceExtensionProperties(device, layer, count as Word, out as Word);
        if result != SUCCESS || !*IS_PORTABILITY {
            return result;
        }
        if !out.is_null() {
            assert!(room > *count, "room for one more was asked for");
            let mut changed = vk::ExtensionProperties::default();
            for (to, byte) in changed.extension_name.iter_mut().zip(SUBSET.to_bytes()) {
                *to = byte.cast_signed();
            }
            *out.add(*count as usize) = changed;
        }
        *count += 1;
        SUCCESS
    }
}

unsafe extern "system" fn vkCreateDevice(
    physical: Word,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: Word,
    out: Word,
) -> i32 {
    // SAFETY: the caller's structure, and its names, which are strings.
    unsafe {
        let mut changed = *info;
        let names = match changed.enabled_extension_count {
            0 => &[],
            count => std::slice::from_raw_parts(changed.pp_enabled_extension_names, count as usize),
        };
        let others = names.iter().copied();
        let others: Vec<_> = others
            .filter(|&name| CStr::from_ptr(name) != SUBSET)
            .collect();
        if *IS_PORTABILITY && others.len() == names.len() {
            return EXTENSION_NOT_PRESENT;
        }
        changed.enabled_extension_count = others.len() as u32;
        changed.pp_enabled_extension_names = others.as_ptr();
        crate::vkCreateDevice(physical, &raw const changed as Word, allocator, out)
    }
}

/// The functions of such a driver, where there is to be one.
pub(crate) fn function(name: &CStr) -> Option<Pointer> {
    let (portability, wait) = (*IS_PORTABILITY, WAIT.is_some());
    let incoherent = *IS_INCOHERENT;
    let found = match name.to_str().unwrap_or_default() {
        "vkGetPhysicalDeviceProperties" if incoherent || STORAGE_BUFFERS.is_some() => {
            vkGetPhysicalDeviceProperties as *const ()
        }
        "vkGetPhysicalDeviceMemoryProperties" if incoherent => {
            vkGetPhysicalDeviceMemoryProperties as *const ()
        }
        "vkGetBufferMemoryRequirements" if incoherent => vkGetBufferMemoryRequirements as *const (),
        "vkAllocateMemory" if incoherent => vkAllocateMemory as *const (),
        "vkMapMemory" if incoherent => vkMapMemory as *const (),
        "vkInvalidateMappedMemoryRanges" if incoherent => {
            vkInvalidateMappedMemoryRanges as *const ()
        }
        "vkFlushMappedMemoryRanges" if incoherent => vkFlushMappedMemoryRanges as *const (),
        "vkFreeMemory" if incoherent => vkFreeMemory as *const (),
        "vkCreateInstance" if portability || wait => vkCreateInstance as *const (),
        "vkEnumeratePhysicalDevices" if portability => vkEnumeratePhysicalDevices as *const (),
        "vkEnumerateDeviceExtensionProperties" if portability => {
            vkEnumerateDeviceExtensionProperties as *const ()
        }
        "vkCreateDevice" if portability => vkCreateDevice as *const (),
        _ => return None,
    };
    Some(found.cast())
}
