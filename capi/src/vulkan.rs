//! Engines on an application's own Vulkan device.

use std::ffi::{CStr, c_void};

use tumble::Engine;
use tumble::ash::vk::Handle;
use tumble::ash::{self, vk};
use tumble::vulkan::{QueueLock, VulkanBuffer, VulkanHandles, VulkanQueue};

use crate::arguments::{Out, flag, needed, vulkan};
use crate::engine::{TumbleEngine, TumbleEngineOptions};
use crate::handle;
use crate::result::{Failure, TumbleResult, code};

/// An application's Vulkan instance, device and queue. They stay the application's.
///
/// The device needs no features; a software device is faster with `shaderInt64`. Below Vulkan 1.2,
/// enable `VK_KHR_shader_float_controls` where it is offered.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleVulkan {
    /// `sizeof(TumbleVulkan)`.
    pub size: usize,
    /// `vkGetInstanceProcAddr` of the loader that the instance was made by, cast to `void (*)(void)`.
    /// The loader stays loaded as long as the engine and all that was made with it.
    pub get_instance_proc_addr: Option<unsafe extern "C" fn()>,
    /// The `VkInstance`, of Vulkan 1.1 or newer.
    pub instance: *mut c_void,
    /// The `VkPhysicalDevice` of the device.
    pub physical_device: *mut c_void,
    /// The `VkDevice`.
    pub device: *mut c_void,
    /// A `VkQueue` of the device that can compute.
    pub queue: *mut c_void,
    /// The family of that queue.
    pub queue_family: u32,
    /// The version that the instance was made for, `VkApplicationInfo.apiVersion`.
    pub api_version: u32,
    /// 1: `VK_KHR_shader_float_controls` is enabled; it does not count from Vulkan 1.2 on.
    pub shader_float_controls: u32,
    /// 1: the feature `shaderInt64` is enabled.
    pub shader_int64: u32,
    /// Another `VkQueue` of the device, which copies results to the host while the first one computes, or
    /// null. The device must have the feature `timelineSemaphore` enabled then.
    pub copy_queue: *mut c_void,
    /// The family of that queue.
    pub copy_queue_family: u32,
    /// Locks `queue`, which the application uses too, maybe on another thread; called with `queue_user` before each
    /// submission of the engine. With it goes `unlock_queue`. Null: nobody else may use the queue while the library
    /// does. The application must not hold the lock while it calls the library.
    pub lock_queue: Option<unsafe extern "C" fn(user: *mut c_void)>,
    /// Unlocks it, called after each submission on the same thread.
    pub unlock_queue: Option<unsafe extern "C" fn(user: *mut c_void)>,
    /// What both get. It must stay valid as long as the engine and all that was made with it.
    pub queue_user: *mut c_void,
}

/// What an application's functions get.
#[derive(Clone, Copy)]
struct User(*mut c_void);

impl User {
    fn pointer(&self) -> *mut c_void {
        self.0
    }
}

// SAFETY: the application promises that its functions take it on any thread.
unsafe impl Send for User {}
// SAFETY: as above.
unsafe impl Sync for User {}

fn refused(message: String) -> Failure {
    Failure::argument(message)
}

impl TumbleVulkan {
    /// The application's lock of the queue, if it has one.
    fn queue_lock(&self) -> Result<Option<QueueLock>, Failure> {
        let user = User(self.queue_user);
        match (self.lock_queue, self.unlock_queue) {
            (None, None) => Ok(None),
            (Some(lock), Some(unlock)) => Ok(Some(QueueLock::new(move |submit| {
                let user = user.pointer();
                // SAFETY: the application's functions, with what they are to get.
                unsafe { lock(user) };
                submit();
                // SAFETY: as above.
                unsafe { unlock(user) };
            }))),
            _ => Err(refused(
                "`vulkan->lock_queue` and `vulkan->unlock_queue` belong together; give both, or null for both".to_owned(),
            )),
        }
    }

    /// The functions of the loader, the instance and the device.
    ///
    /// # Safety
    /// The handles are valid, and belong together.
    unsafe fn handles(&self) -> Result<VulkanHandles, Failure> {
        let Some(get) = self.get_instance_proc_addr else {
            let message = "`vulkan->get_instance_proc_addr` is null";
            return Err(Failure::new(TumbleResult::InvalidPointer, message));
        };
        let instance: vk::Instance = vulkan(self.instance, "vulkan->instance")?;
        let physical_device = vulkan(self.physical_device, "vulkan->physical_device")?;
        let device = vulkan(self.device, "vulkan->device")?;
        let queue = vulkan(self.queue, "vulkan->queue")?;
        let copy_queue = if self.copy_queue.is_null() {
            None
        } else {
            Some(VulkanQueue {
                queue: vulkan(self.copy_queue, "vulkan->copy_queue")?,
                family: self.copy_queue_family,
            })
        };
        let shader_float_controls =
            flag(self.shader_float_controls, "vulkan->shader_float_controls")?;
        let shader_int64 = flag(self.shader_int64, "vulkan->shader_int64")?;
        if self.api_version < vk::API_VERSION_1_1 {
            let version = self.api_version;
            let (major, minor) = (
                vk::api_version_major(version),
                vk::api_version_minor(version),
            );
            return Err(refused(format!(
                "`vulkan->api_version` is {version}, Vulkan {major}.{minor}; the instance must be made for 1.1 or newer"
            )));
        }
        // SAFETY: pointers to functions have one size; the caller promises which function it is.
        let entry = unsafe {
            let get_instance_proc_addr =
                std::mem::transmute::<unsafe extern "C" fn(), vk::PFN_vkGetInstanceProcAddr>(get);
            ash::Entry::from_static_fn(ash::StaticFn {
                get_instance_proc_addr,
            })
        };
        // A function that is not there would end the program when it is called.
        let needed: [&CStr; 3] = [
            c"vkEnumeratePhysicalDevices",
            c"vkGetPhysicalDeviceProperties2",
            c"vkGetDeviceProcAddr",
        ];
        for name in needed {
            // SAFETY: the instance is valid, as the caller promises.
            if unsafe { entry.get_instance_proc_addr(instance, name.as_ptr()) }.is_none() {
                return Err(refused(format!(
                    "`vulkan->get_instance_proc_addr` does not know {} of `vulkan->instance`; give the loader's own \
                     vkGetInstanceProcAddr, and an instance of Vulkan 1.1",
                    name.to_string_lossy()
                )));
            }
        }
        // SAFETY: as above.
        let instance = unsafe { ash::Instance::load(entry.static_fn(), instance) };
        self.check_device(&instance, physical_device)?;
        // SAFETY: the device is valid, as the caller promises.
        let device = unsafe { ash::Device::load(instance.fp_v1_0(), device) };
        Ok(VulkanHandles {
            entry,
            instance,
            api_version: self.api_version,
            physical_device,
            device,
            shader_float_controls,
            shader_int64,
            queue,
            queue_family: self.queue_family,
            copy_queue,
            queue_lock: self.queue_lock()?,
        })
    }

    /// What the instance can tell: the physical device is one of its own, and the family can compute.
    fn check_device(
        &self,
        instance: &ash::Instance,
        device: vk::PhysicalDevice,
    ) -> Result<(), Failure> {
        // SAFETY: the instance is valid.
        let known = unsafe { instance.enumerate_physical_devices() };
        let known = known.map_err(|error| {
            let message = format!("vkEnumeratePhysicalDevices: {error}");
            Failure::new(TumbleResult::Device, message)
        })?;
        if !known.contains(&device) {
            return Err(refused(format!(
                "`vulkan->physical_device` is none of the {} of `vulkan->instance`",
                known.len()
            )));
        }
        // SAFETY: the physical device is the instance's.
        let families = unsafe { instance.get_physical_device_queue_family_properties(device) };
        let family = self.queue_family;
        match families.get(family as usize) {
            None => Err(refused(format!(
                "`vulkan->queue_family` is {family}; the device has {} families",
                families.len()
            ))),
            Some(properties) if !properties.queue_flags.contains(vk::QueueFlags::COMPUTE) => {
                Err(refused(format!(
                    "`vulkan->queue_family` is {family}, whose queues cannot compute"
                )))
            }
            Some(_) => match families.get(self.copy_queue_family as usize) {
                None if !self.copy_queue.is_null() => Err(refused(format!(
                    "`vulkan->copy_queue_family` is {}; the device has {} families",
                    self.copy_queue_family,
                    families.len()
                ))),
                _ => Ok(()),
            },
        }
    }
}

/// A range of an application's buffer, for what an engine on its own device left there.
pub(crate) fn buffer_range(
    is_on_application_device: bool,
    buffer: u64,
    offset: u64,
    size: u64,
) -> Result<VulkanBuffer, Failure> {
    if !is_on_application_device {
        let message = "the engine is not on the application's device; make it with \
                       tumble_engine_from_vulkan";
        return Err(Failure::argument(message));
    }
    if buffer == 0 {
        let message = "`buffer` is VK_NULL_HANDLE";
        return Err(Failure::new(TumbleResult::InvalidPointer, message));
    }
    Ok(VulkanBuffer {
        buffer: vk::Buffer::from_raw(buffer),
        offset,
        size,
    })
}

/// Creates an engine on an application's Vulkan device, for crowds that are recorded into its command buffers
/// (`tumble_crowd_record`), and for all else that engines do.
///
/// The handles stay the application's, which destroys them after it has freed the engine, its clips,
/// crowds and targets, and no call with one of them is under way. Calls that submit work (uploading,
/// evaluating, submitting; not recording) use the queue, so nobody else may at the same time: a queue
/// of the library's own is the simplest where the device has several.
///
/// # Safety
/// `vulkan` is such a structure, whose handles are valid and belong together and live as said; `options` is
/// null or such a structure, and `engine` has room for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_engine_from_vulkan(
    vulkan: *const TumbleVulkan,
    options: *const TumbleEngineOptions,
    engine: *mut *mut TumbleEngine,
) -> TumbleResult {
    code(|| {
        let out = Out::new(engine, "engine")?;
        // SAFETY: as the caller promises.
        let (structure, options) = unsafe {
            let size = |pointer: *const TumbleVulkan| (&raw const (*pointer).size).cast();
            let vulkan = needed(vulkan, size, "vulkan")?;
            (vulkan, TumbleEngineOptions::read(options)?)
        };
        // SAFETY: as the caller promises.
        let opened = unsafe { Engine::from_vulkan(structure.handles()?, &options)? };
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleEngine::new(opened, true))) };
        Ok(())
    })
}
