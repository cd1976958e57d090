//! Engines: open devices that evaluate.

use std::ffi::{CString, c_char};
use std::mem::offset_of;

use tumble::vulkan::VulkanError;
use tumble::{CacheFiles, Device, Engine, EngineOptions, Error};

use crate::arguments::{Out, SizedStructure, flag, sized, text};
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code, guarded};

/// An engine: an open device, the CPU or a Vulkan device, that evaluates. Any number of threads may use it at the
/// same time.
pub struct TumbleEngine {
    pub(crate) inner: Engine,
    /// Whether the Vulkan device is the application's.
    pub(crate) is_on_application_device: bool,
    name: CString,
}

impl TumbleEngine {
    pub(crate) fn new(inner: Engine, is_on_application_device: bool) -> Self {
        let name = inner.device_name().replace('\0', "");
        let name = CString::new(name).unwrap_or_default();
        Self {
            inner,
            is_on_application_device,
            name,
        }
    }
}

impl Object for TumbleEngine {
    const NAME: &'static str = "engine";
}

/// Options for opening a device. If all members except `size` are 0, they have their defaults.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleEngineOptions {
    /// `sizeof(TumbleEngineOptions)`.
    pub size: usize,
    /// The limit of memory in bytes: on a Vulkan device for everything except results, on the CPU for the segments of a
    /// set. Larger sets are prepared piece by piece. 0: no limit.
    pub memory: u64,
    /// The number of worker threads of the CPU, up to 1024; ignored on a Vulkan device. 0: all engines share a pool
    /// with one thread for each core, or as many as the environment variable `RAYON_NUM_THREADS` says.
    pub threads: u32,
    /// 1: a Vulkan device is used although it fails the self-test; its bits may differ from the CPU's. 0: it is
    /// refused.
    pub allow_inexact: u32,
    /// The directory in which the library keeps what the driver compiled, which kernels are exact, and how fast a
    /// device is; it is created when something is written. The library reads and writes no other files on its own.
    /// Null: the directory that the environment variable `TUMBLE_CACHE_DIR` names, or `tumble` in the user's cache
    /// directory. An empty text: no file is read or written.
    pub cache_directory: *const c_char,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers and null pointers.
unsafe impl SizedStructure for TumbleEngineOptions {
    const FIRST_SIZE: usize = offset_of!(Self, cache_directory);
}

/// Opens a device and creates an engine on it.
///
/// `device` selects the device by a name in upper or lower case:
///
/// - "auto", or null: the CPU or the exact Vulkan device that is measured to be the fastest for large results;
///   the choice is made once, here;
/// - "cpu": the CPU;
/// - "vulkan": the first Vulkan device that can be opened and passes the self-test;
/// - any other text: the Vulkan device with this index, counted from 0, or the first one whose name contains the
///   text.
///
/// All devices give the same bits. `options` may be null for the defaults. The caller frees the engine with
/// `tumble_engine_free`.
///
/// # Errors
/// - `TUMBLE_RESULT_DEVICE` if there is no such device, it cannot be opened, or it fails the self-test.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if an option is out of its range.
///
/// # Safety
/// `device` must be null or a text that ends with a zero byte, `options` must be null or point to a
/// `TumbleEngineOptions`, and `engine` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_engine_open(
    device: *const c_char,
    options: *const TumbleEngineOptions,
    engine: *mut *mut TumbleEngine,
) -> TumbleResult {
    code(|| {
        let out = Out::new(engine, "engine")?;
        // SAFETY: as the caller promises.
        let (device, options) = unsafe {
            let options = TumbleEngineOptions::read(options)?;
            (text(device, "device")?, options)
        };
        let opened = open(device.unwrap_or("auto"), &options)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleEngine::new(opened, false))) };
        Ok(())
    })
}

impl TumbleEngineOptions {
    /// The options of a structure; for null the defaults.
    ///
    /// # Safety
    /// The pointer must be null or point to such a structure, whose `cache_directory` is null or a text that ends with
    /// a zero byte.
    pub(crate) unsafe fn read(pointer: *const Self) -> Result<EngineOptions, Failure> {
        // SAFETY: as the caller promises.
        let options = unsafe { sized(pointer, "options")? };
        let Some(structure) = options else {
            return Ok(EngineOptions::default());
        };
        // SAFETY: null or a text, as the caller promises.
        let directory = unsafe { text(structure.cache_directory, "options->cache_directory")? };
        let mut options = engine_options(structure)?;
        options.cache_files = match directory {
            None => CacheFiles::OfUser,
            Some("") => CacheFiles::Off,
            Some(directory) => CacheFiles::Within(directory.into()),
        };
        Ok(options)
    }
}

fn engine_options(structure: TumbleEngineOptions) -> Result<EngineOptions, Failure> {
    let mut options = EngineOptions::default();
    options.memory = (structure.memory > 0).then_some(structure.memory);
    options.thread_count = (structure.threads > 0).then_some(structure.threads as usize);
    options.allow_inexact = flag(structure.allow_inexact, "options->allow_inexact")?;
    Ok(options)
}

fn open(name: &str, options: &EngineOptions) -> Result<Engine, Failure> {
    match name.to_lowercase().as_str() {
        "auto" => Ok(Engine::auto_with(usize::MAX, options)?),
        "cpu" => Ok(Engine::with_options(Device::Cpu, options)?),
        "vulkan" => first_exact(options),
        _ => Ok(Engine::with_options(named(name)?, options)?),
    }
}

/// An engine on the first Vulkan device that can be opened; otherwise the error of the first device.
fn first_exact(options: &EngineOptions) -> Result<Engine, Failure> {
    let mut reason = None;
    for device in Device::list()? {
        match Engine::with_options(device, options) {
            Ok(engine) => return Ok(engine),
            Err(error) => reason = reason.or(Some(error)),
        }
    }
    Err(reason
        .unwrap_or(Error::Vulkan(VulkanError::NoDevice))
        .into())
}

fn named(name: &str) -> Result<Device, Failure> {
    let devices = Device::list()?;
    let index = name.parse().ok();
    let lowercase = name.to_lowercase();
    let is_it = |device: &&Device| device.name().to_lowercase().contains(&lowercase);
    let found = match index {
        Some(index) => devices.get::<usize>(index),
        None if name.is_empty() => None,
        None => devices.iter().find(is_it),
    };
    found.cloned().ok_or_else(|| {
        let names: Vec<&str> = devices.iter().map(Device::name).collect();
        let message = format!(
            "there is no device `{name}`; there are auto, cpu, vulkan and {}",
            if names.is_empty() {
                "no Vulkan devices".to_owned()
            } else {
                names.join(", ")
            }
        );
        Failure::new(TumbleResult::Device, message)
    })
}

/// Returns the name of the engine's device, "CPU" for the CPU: UTF-8, valid until the engine is freed; null if the
/// handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_engine_device_name(engine: *const TumbleEngine) -> *const c_char {
    let name = guarded(|| Ok(handle::get(engine)?.name.as_ptr()));
    name.unwrap_or(std::ptr::null())
}

/// Frees an engine. Its clips and crowds stay valid and keep the device open. Does nothing if `engine` is null.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_engine_free(engine: *mut TumbleEngine) -> TumbleResult {
    code(|| handle::free(engine))
}
