//! A Vulkan loader that fails on demand. It passes calls on to the real loader; `ash` loads it in place of that one.
//!
//! * `FAULTS`: `CALL,RESULT,FIRST,COUNT` separated by blanks: from the FIRST call (counted
//!   from 1), COUNT calls of it return RESULT.
//! * `FAULT_MEMORY`: bytes that the device has; more at once is out of device memory.
//! * `FAULT_SLOW`: nanoseconds that all work takes, by the device's clock.
//! * `FAULT_LOG`: a file that gets a line for every call that can fail, and for every
//!   object that is created or destroyed, behind the number of the process.
//! * `FAULT_DEVICES`: `none` hides every device, `no-compute` their compute queues.
//! * `FAULT_CARD`: a card instead of the device (`card.rs`).
//! * Other drivers' limits and habits: `odd.rs`.
//! * `REAL_LOADER`: the path of the loader behind it.
//!
//! Built as an example, so that `cargo test` builds it; `tests/faults.rs` puts it where a
//! program finds it as `libvulkan.so.1`.
#![allow(unsafe_code, non_snake_case, clippy::missing_safety_doc, missing_docs)]

/// The real function with this name; the caller knows its type.
macro_rules! real {
    ($name:literal as fn($($argument:ty),*) $(-> $result:ty)?) => {
        std::mem::transmute::<Pointer, unsafe extern "system" fn($($argument),*) $(-> $result)?>(
            real($name),
        )
    };
}

mod card;
mod odd;

use std::collections::HashMap;
use std::ffi::{CStr, c_char, c_void};
use std::fs::File;
use std::io::Write;
use std::sync::{LazyLock, Mutex, OnceLock};

type Pointer = *const c_void;
/// A handle or a pointer; all of 64 bits.
type Word = u64;
type GetInstanceProcAddr = unsafe extern "system" fn(Word, *const c_char) -> Pointer;

const SUCCESS: i32 = 0;
const DEVICE_LOST: i32 = -4;

struct Fault {
    call: String,
    result: i32,
    first: u64,
    count: u64,
}

#[derive(Default)]
struct State {
    instance: Word,
    calls: HashMap<&'static str, u64>,
    /// A lost device stays lost.
    lost: bool,
    /// Bytes of each allocation.
    memory: HashMap<Word, u64>,
}

static STATE: LazyLock<Mutex<State>> = LazyLock::new(Mutex::default);

static FAULTS: LazyLock<Vec<Fault>> = LazyLock::new(|| {
    let text = std::env::var("FAULTS").unwrap_or_default();
    let fault = |text: &str| {
        let fields: Vec<&str> = text.split(',').collect();
        let [call, result, first, count] = fields[..] else {
            panic!("FAULTS: {text}");
        };
        Fault {
            call: call.to_owned(),
            result: result.parse().unwrap(),
            first: first.parse().unwrap(),
            count: count.parse().unwrap(),
        }
    };
    text.split_whitespace().map(fault).collect()
});

static LOG: LazyLock<Option<Mutex<File>>> = LazyLock::new(|| {
    let path = std::env::var_os("FAULT_LOG")?;
    let file = File::options().append(true).create(true).open(path);
    Some(Mutex::new(file.unwrap()))
});

fn log(line: &str) {
    if let Some(file) = &*LOG {
        let line = format!("{} {line}\n", std::process::id());
        let _ = file.lock().unwrap().write_all(line.as_bytes());
    }
}

fn hidden(kind: &str) -> bool {
    std::env::var("FAULT_DEVICES").is_ok_and(|hidden| hidden == kind)
}

/// The result that a call returns instead of the real one.
fn fault(call: &'static str) -> Option<i32> {
    let mut state = STATE.lock().unwrap();
    let count = state.calls.entry(call).or_default();
    *count += 1;
    let due = |fault: &&Fault| {
        fault.call == call && (fault.first..fault.first + fault.count).contains(count)
    };
    let mut result = FAULTS.iter().find(due).map(|fault| fault.result);
    if call == "vkCreateDevice" {
        state.lost = false;
    } else if !call.starts_with("vkEnumerate") && call != "vkCreateInstance" {
        state.lost |= result == Some(DEVICE_LOST);
        result = result.or(state.lost.then_some(DEVICE_LOST));
    }
    drop(state);
    log(&format!("call {call} {}", result.unwrap_or(SUCCESS)));
    result
}

fn real_loader() -> GetInstanceProcAddr {
    static REAL: OnceLock<(libloading::Library, GetInstanceProcAddr)> = OnceLock::new();
    let load = || {
        let path = std::env::var_os("REAL_LOADER").expect("REAL_LOADER");
        // SAFETY: the system's Vulkan loader, whose entry point has this type.
        unsafe {
            let library = libloading::Library::new(path).unwrap();
            let entry = *library.get(b"vkGetInstanceProcAddr\0").unwrap();
            (library, entry)
        }
    };
    REAL.get_or_init(load).1
}

/// The real function of that name.
fn real(name: &CStr) -> Pointer {
    let is_global = name.to_bytes().starts_with(b"vkEnumerateInstance");
    let instance = if is_global {
        0
    } else {
        STATE.lock().unwrap().instance
    };
    // SAFETY: the instance is null or alive, and the name is a string.
    let found = unsafe { real_loader()(instance, name.as_ptr()) };
    assert!(!found.is_null(), "{name:?}");
    found
}

macro_rules! name {
    ($call:ident) => {
        CStr::from_bytes_with_nul(concat!(stringify!($call), "\0").as_bytes()).unwrap()
    };
}

/// Calls that can fail: fails them, or passes them on and logs what they made. `wait` is
/// passed on in any case: the device's work must have ended before objects are destroyed.
macro_rules! fallible {
    ($($call:ident($($argument:ident),*) $kind:ident;)*) => {
        $(
            unsafe extern "system" fn $call($($argument: Word),*) -> i32 {
                let due = fault(stringify!($call));
                if stringify!($kind) != "wait" && let Some(result) = due {
                    return result;
                }
                // SAFETY: the real function has these arguments.
                let result = unsafe {
                    let real: unsafe extern "system" fn($($argument: fallible!(@word $argument)),*) -> i32 =
                        std::mem::transmute(real(name!($call)));
                    real($($argument),*)
                };
                if result == SUCCESS && stringify!($kind) == "creates" {
                    log(concat!("made ", stringify!($call)));
                }
                due.unwrap_or(result)
            }
        )*

        fn fallible(name: &CStr) -> Option<Pointer> {
            match name.to_str().unwrap_or_default() {
                $(stringify!($call) => Some($call as *const () as Pointer),)*
                _ => None,
            }
        }
    };
    (@word $argument:ident) => { Word };
}

fallible! {
    vkEnumerateInstanceVersion(out) asks;
    vkEnumerateInstanceLayerProperties(count, out) asks;
    vkEnumerateInstanceExtensionProperties(layer, count, out) asks;
    vkEnumerateDeviceExtensionProperties(device, layer, count, out) asks;
    vkCreateDevice(physical, info, allocator, out) creates;
    vkCreateDebugUtilsMessengerEXT(instance, info, allocator, out) creates;
    vkCreateBuffer(device, info, allocator, out) creates;
    vkCreateBufferView(device, info, allocator, out) creates;
    vkGetMemoryHostPointerPropertiesEXT(device, kind, pointer, out) asks;
    vkGetMemoryFdKHR(device, info, out) asks;
    vkBindBufferMemory(device, buffer, memory, offset) asks;
    vkMapMemory(device, memory, offset, size, flags, out) asks;
    vkCreateCommandPool(device, info, allocator, out) creates;
    vkAllocateCommandBuffers(device, info, out) asks;
    vkBeginCommandBuffer(commands, info) asks;
    vkEndCommandBuffer(commands) asks;
    vkResetCommandPool(device, pool, flags) asks;
    vkCreateSemaphore(device, info, allocator, out) creates;
    vkCreateFence(device, info, allocator, out) creates;
    vkResetFences(device, count, fences) asks;
    vkGetFenceStatus(device, fence) asks;
    vkWaitForFences(device, count, fences, all, timeout) wait;
    vkWaitSemaphores(device, info, timeout) wait;
    vkGetSemaphoreFdKHR(device, info, out) asks;
    vkGetSemaphoreCounterValue(device, semaphore, out) asks;
    vkQueueWaitIdle(queue) wait;
    vkDeviceWaitIdle(device) wait;
    vkQueueSubmit(queue, count, infos, fence) asks;
    vkCreateQueryPool(device, info, allocator, out) creates;
    vkCreateDescriptorPool(device, info, allocator, out) creates;
    vkResetDescriptorPool(device, pool, flags) asks;
    vkAllocateDescriptorSets(device, info, out) asks;
    vkCreateDescriptorSetLayout(device, info, allocator, out) creates;
    vkCreatePipelineLayout(device, info, allocator, out) creates;
    vkCreateShaderModule(device, info, allocator, out) creates;
    vkCreatePipelineCache(device, info, allocator, out) creates;
    vkGetPipelineCacheData(device, cache, size, out) asks;
    vkMergePipelineCaches(device, cache, count, others) asks;
    vkFlushMappedMemoryRanges(device, count, ranges) asks;
    vkInvalidateMappedMemoryRanges(device, count, ranges) asks;
    vkCreateComputePipelines(device, cache, count, infos, allocator, out) creates;
}

/// Calls that destroy an object that a call above made; null is passed on.
macro_rules! destroys {
    ($($call:ident of $made:ident;)*) => {
        $(
            unsafe extern "system" fn $call(owner: Word, object: Word, allocator: Word) {
                if object != 0 {
                    log(concat!("destroyed ", stringify!($made)));
                }
                // SAFETY: the real function has these arguments.
                unsafe {
                    let real: unsafe extern "system" fn(Word, Word, Word) =
                        std::mem::transmute(real(name!($call)));
                    real(owner, object, allocator);
                }
            }
        )*

        fn destroys(name: &CStr) -> Option<Pointer> {
            match name.to_str().unwrap_or_default() {
                $(stringify!($call) => Some($call as *const () as Pointer),)*
                _ => None,
            }
        }
    };
}

destroys! {
    vkDestroyDebugUtilsMessengerEXT of vkCreateDebugUtilsMessengerEXT;
    vkDestroyBuffer of vkCreateBuffer;
    vkDestroyBufferView of vkCreateBufferView;
    vkDestroyCommandPool of vkCreateCommandPool;
    vkDestroySemaphore of vkCreateSemaphore;
    vkDestroyFence of vkCreateFence;
    vkDestroyQueryPool of vkCreateQueryPool;
    vkDestroyDescriptorPool of vkCreateDescriptorPool;
    vkDestroyDescriptorSetLayout of vkCreateDescriptorSetLayout;
    vkDestroyPipelineLayout of vkCreatePipelineLayout;
    vkDestroyShaderModule of vkCreateShaderModule;
    vkDestroyPipelineCache of vkCreatePipelineCache;
    vkDestroyPipeline of vkCreateComputePipelines;
}

unsafe extern "system" fn vkCreateInstance(info: Word, allocator: Word, out: *mut Word) -> i32 {
    if let Some(result) = fault("vkCreateInstance") {
        return result;
    }
    // SAFETY: the real function, which needs no instance, and its arguments.
    let result = unsafe {
        let real = real_loader()(0, c"vkCreateInstance".as_ptr());
        let real: unsafe extern "system" fn(Word, Word, *mut Word) -> i32 =
            std::mem::transmute(real);
        real(info, allocator, out)
    };
    if result == SUCCESS {
        log("made vkCreateInstance");
        // SAFETY: the call succeeded and wrote it.
        STATE.lock().unwrap().instance = unsafe { *out };
    }
    result
}

unsafe extern "system" fn vkAllocateMemory(
    device: Word,
    info: *const [u64; 4],
    allocator: Word,
    out: *mut Word,
) -> i32 {
    const OUT_OF_DEVICE_MEMORY: i32 = -2;
    if let Some(result) = fault("vkAllocateMemory") {
        return result;
    }
    // SAFETY: behind the type and the chain comes the size.
    let size = unsafe { (*info)[2] };
    let used: u64 = STATE.lock().unwrap().memory.values().sum();
    let there = std::env::var("FAULT_MEMORY").map_or(u64::MAX, |bytes| bytes.parse().unwrap());
    if used + size > there {
        log(&format!("short vkAllocateMemory {size}"));
        return OUT_OF_DEVICE_MEMORY;
    }
    // SAFETY: the real function, its arguments, and what it wrote.
    unsafe {
        let real: unsafe extern "system" fn(Word, *const [u64; 4], Word, *mut Word) -> i32 =
            std::mem::transmute(real(c"vkAllocateMemory"));
        let result = real(device, info, allocator, out);
        if result == SUCCESS {
            log("made vkAllocateMemory");
            STATE.lock().unwrap().memory.insert(*out, size);
        }
        result
    }
}

/// Two time stamps, as the one caller asks for them.
unsafe extern "system" fn vkGetQueryPoolResults(
    device: Word,
    pool: Word,
    first: u32,
    count: u32,
    size: usize,
    out: *mut [u64; 2],
    stride: u64,
    flags: u32,
) -> i32 {
    if let Some(result) = fault("vkGetQueryPoolResults") {
        return result;
    }
    // SAFETY: the real function, its arguments, and what it wrote.
    unsafe {
        let real: unsafe extern "system" fn(
            Word,
            Word,
            u32,
            u32,
            usize,
            *mut [u64; 2],
            u64,
            u32,
        ) -> i32 = std::mem::transmute(real(c"vkGetQueryPoolResults"));
        let result = real(device, pool, first, count, size, out, stride, flags);
        if let Ok(slow) = std::env::var("FAULT_SLOW") {
            (*out)[1] = (*out)[0] + slow.parse::<u64>().unwrap();
        }
        result
    }
}

unsafe extern "system" fn vkFreeMemory(device: Word, memory: Word, allocator: Word) {
    if memory != 0 {
        log("destroyed vkAllocateMemory");
        STATE.lock().unwrap().memory.remove(&memory);
    }
    // SAFETY: the real function, and its arguments.
    unsafe {
        let real: unsafe extern "system" fn(Word, Word, Word) =
            std::mem::transmute(real(c"vkFreeMemory"));
        real(device, memory, allocator);
    }
}

unsafe extern "system" fn vkDestroyInstance(instance: Word, allocator: Word) {
    log("destroyed vkCreateInstance");
    // SAFETY: the real function, and its arguments.
    unsafe {
        let real: unsafe extern "system" fn(Word, Word) =
            std::mem::transmute(real_loader()(instance, c"vkDestroyInstance".as_ptr()));
        real(instance, allocator);
    }
}

unsafe extern "system" fn vkDestroyDevice(device: Word, allocator: Word) {
    log("destroyed vkCreateDevice");
    // SAFETY: the real function, and its arguments.
    unsafe {
        let real: unsafe extern "system" fn(Word, Word) =
            std::mem::transmute(real(c"vkDestroyDevice"));
        real(device, allocator);
    }
}

unsafe extern "system" fn vkEnumeratePhysicalDevices(
    instance: Word,
    count: *mut u32,
    out: Word,
) -> i32 {
    if let Some(result) = fault("vkEnumeratePhysicalDevices") {
        return result;
    }
    if hidden("none") {
        // SAFETY: the caller's counter.
        unsafe { *count = 0 };
        return SUCCESS;
    }
    // SAFETY: the real function, and its arguments.
    unsafe {
        let real: unsafe extern "system" fn(Word, *mut u32, Word) -> i32 =
            std::mem::transmute(real(c"vkEnumeratePhysicalDevices"));
        real(instance, count, out)
    }
}

/// Each of the properties is six words; the first has the flags of the queue.
unsafe extern "system" fn vkGetPhysicalDeviceQueueFamilyProperties(
    device: Word,
    count: *mut u32,
    out: *mut [u32; 6],
) {
    const COMPUTE: u32 = 2;
    // SAFETY: the real function, its arguments, and what it wrote.
    unsafe {
        let real: unsafe extern "system" fn(Word, *mut u32, *mut [u32; 6]) =
            std::mem::transmute(real(c"vkGetPhysicalDeviceQueueFamilyProperties"));
        real(device, count, out);
        if !out.is_null() && hidden("no-compute") {
            for family in std::slice::from_raw_parts_mut(out, *count as usize) {
                family[0] &= !COMPUTE;
            }
        }
    }
}

unsafe extern "system" fn vkGetDeviceProcAddr(device: Word, name: *const c_char) -> Pointer {
    // SAFETY: the caller's name is a string; the real function has these arguments.
    unsafe {
        if let Some(function) = replacement(CStr::from_ptr(name)) {
            return function;
        }
        let real: unsafe extern "system" fn(Word, *const c_char) -> Pointer =
            std::mem::transmute(real(c"vkGetDeviceProcAddr"));
        real(device, name)
    }
}

fn replacement(name: &CStr) -> Option<Pointer> {
    if let Some(special) = card::function(name).or_else(|| odd::function(name)) {
        return Some(special);
    }
    let special = match name.to_str().unwrap_or_default() {
        "vkCreateInstance" => vkCreateInstance as *const (),
        "vkAllocateMemory" => vkAllocateMemory as *const (),
        "vkGetQueryPoolResults" => vkGetQueryPoolResults as *const (),
        "vkFreeMemory" => vkFreeMemory as *const (),
        "vkDestroyInstance" => vkDestroyInstance as *const (),
        "vkDestroyDevice" => vkDestroyDevice as *const (),
        "vkEnumeratePhysicalDevices" => vkEnumeratePhysicalDevices as *const (),
        "vkGetPhysicalDeviceQueueFamilyProperties" => {
            vkGetPhysicalDeviceQueueFamilyProperties as *const ()
        }
        "vkGetDeviceProcAddr" => vkGetDeviceProcAddr as *const (),
        "vkGetInstanceProcAddr" => vkGetInstanceProcAddr as *const (),
        _ => return fallible(name).or_else(|| destroys(name)),
    };
    Some(special.cast())
}

/// The function that `ash` looks for in the library.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkGetInstanceProcAddr(
    instance: Word,
    name: *const c_char,
) -> Pointer {
    // SAFETY: the caller's name is a string.
    unsafe { replacement(CStr::from_ptr(name)).unwrap_or_else(|| real_loader()(instance, name)) }
}
