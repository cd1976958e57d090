//! The logical device and its one compute queue.

use std::ffi::CString;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use ash::{ext, khr, vk};

use crate::gpu::buffer::may_be_imported;
use crate::gpu::engine::lock;
use crate::gpu::error::{Named, VulkanError};
use crate::gpu::options::Reads;
use crate::gpu::physical::{DeviceKind, PhysicalDevice};
use crate::gpu::shared_memory::SharedMemory;

/// An opened device, destroyed with its last user unless it was handed in.
pub(crate) struct LogicalDevice {
    pub(crate) raw: ash::Device,
    pub(crate) physical: PhysicalDevice,
    /// Whether its kernels read texel buffers.
    pub(crate) reads_texels: bool,
    queue: Mutex<vk::Queue>,
    names: Option<ext::debug_utils::Device>,
    /// The extension that imports the caller's memory, where it is used.
    pub(crate) borrows: Option<ext::external_memory_host::Device>,
    owned: bool,
    /// Memory of small buffers.
    pub(crate) shared: SharedMemory,
    /// A wait ran out of time: work may still run, so nothing may be destroyed.
    hung: AtomicBool,
}

impl LogicalDevice {
    pub(crate) fn new(physical: PhysicalDevice, reads: Reads) -> Result<Arc<Self>, VulkanError> {
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(physical.queue_family)
            .queue_priorities(&priorities)];
        let controls = physical.float_controls_extension;
        let mut extensions: Vec<_> = controls
            .then_some(khr::shader_float_controls::NAME.as_ptr())
            .into_iter()
            .collect();
        // Memory is imported on software devices only. They work in threads of this process: a
        // wait for them ends, and afterwards none of them touches memory that its owner may free.
        let reads_texels = physical.reads_texels(reads);
        let borrows = physical.info.kind == DeviceKind::Cpu
            && physical.lent_alignment.is_some()
            && may_be_imported(&physical, reads_texels);
        if borrows {
            extensions.push(ext::external_memory_host::NAME.as_ptr());
        }
        let features = vk::PhysicalDeviceFeatures::default().shader_int64(reads_texels);
        let info = vk::DeviceCreateInfo::default()
            .enabled_features(&features)
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions);
        let instance = &physical.instance.raw;
        // SAFETY: the physical device belongs to the instance and has this family.
        let raw =
            unsafe { instance.create_device(physical.raw, &info, None) }.named("vkCreateDevice")?;
        // SAFETY: one queue of this family was just created.
        let queue = unsafe { raw.get_device_queue(physical.queue_family, 0) };
        let borrows = borrows.then(|| ext::external_memory_host::Device::new(instance, &raw));
        Ok(Self::wrap(physical, raw, queue, reads, borrows, true))
    }

    /// An application's device; it stays the application's to destroy.
    pub(crate) fn borrowed(
        physical: PhysicalDevice,
        raw: ash::Device,
        queue: vk::Queue,
        reads: Reads,
    ) -> Arc<Self> {
        Self::wrap(physical, raw, queue, reads, None, false)
    }

    fn wrap(
        physical: PhysicalDevice,
        raw: ash::Device,
        queue: vk::Queue,
        reads: Reads,
        borrows: Option<ext::external_memory_host::Device>,
        owned: bool,
    ) -> Arc<Self> {
        let instance = &physical.instance;
        let names = instance
            .debug_utils
            .then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        let (queue, hung) = (Mutex::new(queue), AtomicBool::new(false));
        Arc::new(Self {
            raw,
            reads_texels: physical.reads_texels(reads),
            physical,
            queue,
            names,
            borrows,
            owned,
            shared: SharedMemory::default(),
            hung,
        })
    }

    /// The queue; Vulkan wants one user at a time.
    pub(crate) fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        lock(&self.queue)
    }

    /// Gives an object the name that validation and debuggers show.
    pub(crate) fn name(&self, object: impl vk::Handle, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, CString::new(name)) else {
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(object)
            .object_name(&name);
        // SAFETY: the object belongs to this device. A name that cannot be set is
        // no reason to stop.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }

    /// From now on nothing of this device is destroyed: it may still be in use.
    pub(crate) fn mark_hung(&self) {
        if !self.hung.swap(true, Ordering::Relaxed) {
            // The instance must outlive the device, which stays.
            std::mem::forget(Arc::clone(&self.physical.instance));
        }
    }

    /// Waits until the device is idle. If the wait fails, the device counts as hung.
    pub(crate) fn wait_until_idle(&self) {
        let _queue = self.queue();
        // SAFETY: the device is alive, and its queue is locked.
        match unsafe { self.raw.device_wait_idle() } {
            Ok(()) | Err(vk::Result::ERROR_DEVICE_LOST) => {}
            Err(_) => self.mark_hung(),
        }
    }

    /// Waits until the device is idle, and again if the wait fails for lack of memory.
    pub(crate) fn wait_in_any_case(&self) {
        let _queue = self.queue();
        // SAFETY: as in `wait_until_idle`.
        while let Err(error) = unsafe { self.raw.device_wait_idle() }
            && error != vk::Result::ERROR_DEVICE_LOST
        {
            std::thread::sleep(Duration::from_millis(10)); // memory may come back
        }
    }

    /// Whether it was opened here, and may be opened again here.
    pub(crate) fn is_owned(&self) -> bool {
        self.owned
    }

    /// Whether objects may be destroyed.
    pub(crate) fn may_destroy(&self) -> bool {
        !self.hung.load(Ordering::Relaxed)
    }
}

impl Drop for LogicalDevice {
    fn drop(&mut self) {
        if !self.may_destroy() {
            return;
        }
        // SAFETY: every object created from it held an `Arc` to this and is gone.
        unsafe { self.shared.free(&self.raw) };
        if self.owned {
            // SAFETY: as above.
            unsafe { self.raw.destroy_device(None) };
        }
    }
}
