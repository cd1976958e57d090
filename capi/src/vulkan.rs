//! Engines on an application's Vulkan device.

use std::ffi::{CStr, c_void};
use std::mem::offset_of;

use tumble::Engine;
use tumble::ash::vk::Handle;
use tumble::ash::{self, vk};
use tumble::vulkan::{QueueLock, VulkanBuffer, VulkanHandles, VulkanQueue};

use crate::arguments::{Out, SizedStructure, flag, needed, vulkan};
use crate::engine::{TumbleEngine, TumbleEngineOptions};
use crate::handle;
use crate::result::{Failure, TumbleResult, code};

/// An application's Vulkan instance, device and queue, for `tumble_engine_from_vulkan`. The library does not destroy
/// them.
///
/// No features of the device are required, but software devices are faster with `shaderInt64`. Below Vulkan 1.2,
/// enable `VK_KHR_shader_float_controls` if the device has it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleVulkan {
    /// `sizeof(TumbleVulkan)`.
    pub size: usize,
    /// `vkGetInstanceProcAddr` of the loader that created the instance, cast to `void (*)(void)`. The loader must
    /// stay loaded until the engine and all objects that were made with it are freed.
    pub get_instance_proc_addr: Option<unsafe extern "C" fn()>,
    /// The `VkInstance`, of Vulkan 1.1 or newer.
    pub instance: *mut c_void,
    /// The `VkPhysicalDevice` of `device`.
    pub physical_device: *mut c_void,
    /// The `VkDevice`.
    pub device: *mut c_void,
    /// A `VkQueue` of the device, of a family that can compute.
    pub queue: *mut c_void,
    /// The family of `queue`.
    pub queue_family: u32,
    /// The Vulkan version for which the instance was created, `VkApplicationInfo.apiVersion`: 1.1 or newer. If
    /// it is newer than the loader's, the loader's counts.
    pub api_version: u32,
    /// 1 if `VK_KHR_shader_float_controls` is enabled, otherwise 0; ignored from Vulkan 1.2 on.
    pub shader_float_controls: u32,
    /// 1 if the feature `shaderInt64` is enabled, otherwise 0.
    pub shader_int64: u32,
    /// Another `VkQueue` of the device, on which results are copied to the host while `queue` computes, or null. The
    /// device must then have the feature `timelineSemaphore` enabled, and only the library may use this queue.
    pub copy_queue: *mut c_void,
    /// The family of `copy_queue`; ignored if that is null.
    pub copy_queue_family: u32,
    /// A function that locks `queue`, or null. The library calls this function with `queue_user` before each submission
    /// to `queue`, on any thread, and `unlock_queue` after the submission. The application must use the same lock for
    /// `queue`, and must not hold the lock when it calls the library, which would wait forever. If `lock_queue` is
    /// null, `unlock_queue` must be null too, and the application must not use `queue` during a call that submits to
    /// it. Several engines on one queue need no lock among themselves.
    pub lock_queue: Option<unsafe extern "C" fn(user: *mut c_void)>,
    /// The function that unlocks `queue`; the library calls it on the thread that called `lock_queue`.
    pub unlock_queue: Option<unsafe extern "C" fn(user: *mut c_void)>,
    /// The argument of `lock_queue` and `unlock_queue`. It must stay valid until the engine and all objects that were
    /// made with it are freed.
    pub queue_user: *mut c_void,
    /// The application's `VkPipelineCache`, in which the library makes its pipelines, or 0 (`VK_NULL_HANDLE`). It must
    /// have been created without `VK_PIPELINE_CACHE_CREATE_EXTERNALLY_SYNCHRONIZED_BIT`, and must stay valid until the
    /// engine and all objects that were made with it are freed. The library neither reads this cache from a file nor writes it to one. 0: the library makes a cache and
    /// keeps it in a file (`TumbleEngineOptions.cache_directory`).
    pub pipeline_cache: u64,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers, null pointers and absent functions.
unsafe impl SizedStructure for TumbleVulkan {
    const FIRST_SIZE: usize = offset_of!(Self, pipeline_cache);
}

/// The argument of the application's functions that lock and unlock the queue.
#[derive(Clone, Copy)]
struct User(*mut c_void);

impl User {
    fn pointer(&self) -> *mut c_void {
        self.0
    }
}

// SAFETY: the pointer is only passed to the application's functions, which accept it on any thread, as the application
// promises.
unsafe impl Send for User {}
// SAFETY: as above.
unsafe impl Sync for User {}

fn refused(message: String) -> Failure {
    Failure::argument(message)
}

impl TumbleVulkan {
    /// The application's lock of the queue; `None` if both functions are null.
    fn queue_lock(&self) -> Result<Option<QueueLock>, Failure> {
        let user = User(self.queue_user);
        match (self.lock_queue, self.unlock_queue) {
            (None, None) => Ok(None),
            (Some(lock), Some(unlock)) => Ok(Some(QueueLock::new(move |submit| {
                let user = user.pointer();
                // SAFETY: the application's functions, with the application's `user`.
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
    /// The handles must be valid and belong together.
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
            Some(VulkanQueue::new(
                vulkan(self.copy_queue, "vulkan->copy_queue")?,
                self.copy_queue_family,
            ))
        };
        let shader_float_controls =
            flag(self.shader_float_controls, "vulkan->shader_float_controls")?;
        let shader_int64 = flag(self.shader_int64, "vulkan->shader_int64")?;
        // SAFETY: pointers to functions have one size; the caller promises which function it is.
        let entry = unsafe {
            let get_instance_proc_addr =
                std::mem::transmute::<unsafe extern "C" fn(), vk::PFN_vkGetInstanceProcAddr>(get);
            ash::Entry::from_static_fn(ash::StaticFn {
                get_instance_proc_addr,
            })
        };
        // A null function pointer would crash the program when it is called.
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
        // SAFETY: the device is valid, as the caller promises.
        let device = unsafe { ash::Device::load(instance.fp_v1_0(), device) };
        let mut handles = VulkanHandles::new(
            entry,
            instance,
            self.api_version,
            physical_device,
            device,
            VulkanQueue::new(queue, self.queue_family),
        );
        handles.shader_float_controls = shader_float_controls;
        handles.shader_int64 = shader_int64;
        let cache =
            (self.pipeline_cache != 0).then(|| vk::PipelineCache::from_raw(self.pipeline_cache));
        Ok(handles
            .with_copy_queue(copy_queue)
            .with_queue_lock(self.queue_lock()?)
            .with_pipeline_cache(cache))
    }
}

/// A range of an application's buffer, for results of an engine on the application's device.
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
    Ok(VulkanBuffer::new(vk::Buffer::from_raw(buffer), size).at(offset))
}

/// Creates an engine on an application's Vulkan device. It evaluates as any other engine, and can record crowds,
/// clips and passes into the application's command buffers (`tumble_crowd_record`, `tumble_clip_record`,
/// `tumble_pass_record`).
///
/// The Vulkan objects belong to the application. It may destroy them only after it has freed the engine, its clips,
/// crowds and targets, and after all calls with these have returned. The caller frees the engine with
/// `tumble_engine_free`. `options` may be null for the defaults.
///
/// These calls submit to the queue: this one, `tumble_upload`, `tumble_evaluate`, `tumble_clip_evaluate`,
/// `tumble_clip_evaluate_to_buffer`, `tumble_request_evaluate`, `tumble_clip_target_new`, `tumble_timed_target_new`,
/// `tumble_pass_to_buffer`, `tumble_pass_target_new`, `tumble_crowd_new`, `tumble_crowd_target_new`, `tumble_crowd_stage_target_new`,
/// `tumble_crowd_evaluate`, `tumble_crowd_evaluate_half` and `tumble_crowd_submit`.
/// All others do not. Without `lock_queue`, the application must not use the queue while one of them runs. The simplest
/// solution is a queue that only the library uses, if the device has several. Any number of engines may be created on
/// one queue: they take turns.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_POINTER` if a required handle or function is null.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the version is below 1.1, or the physical device or a queue family does not
///   fit.
/// - `TUMBLE_RESULT_DEVICE` if the device fails the self-test.
///
/// # Safety
/// `vulkan` must point to a `TumbleVulkan` whose handles are valid, belong together and live as long as described;
/// `options` must be null or point to a `TumbleEngineOptions`; and `engine` must point to memory for a handle.
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
            let vulkan = needed(vulkan, "vulkan")?;
            (vulkan, TumbleEngineOptions::read(options)?)
        };
        // SAFETY: as the caller promises.
        let opened = unsafe { Engine::from_vulkan(structure.handles()?, &options)? };
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleEngine::new(opened, true))) };
        Ok(())
    })
}
