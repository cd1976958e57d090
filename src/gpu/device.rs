//! The logical device, the queue that computes, and the queue that copies results, if there is one. Vulkan allows a
//! queue only one user at a time: each has a lock.

use std::collections::BTreeMap;
use std::ffi::CString;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, Weak};
use std::time::Duration;

use ash::vk::Handle as _;
use ash::{ext, khr, vk};

use crate::gpu::handles::{QueueLock, VulkanQueue};
use crate::gpu::kernel_check::passes::Passes;
use crate::gpu::physical::external::{may_be_exported, may_be_imported, timelines_may_be_exported};
use crate::gpu::physical::queues::{Copies, QueueIndex};
use crate::gpu::physical::upload_memory::{Placing, direct};
use crate::gpu::physical::{DeviceKind, PhysicalDevice};
use crate::gpu::pipeline_cache::PipelineCache;
use crate::gpu::shared_memory::SharedMemory;
use crate::machine::cache::Cache;
use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named;
use crate::machine::options::{EngineOptions, ReadBack};
use crate::shader::Variants;
use crate::threads::lock;

/// The purpose of a submission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum QueueLane {
    /// Kernels, with their uploads and barriers.
    Kernels,
    /// Copies of results to the host.
    Copies,
}

/// The number of times that a fence is polled, each for up to 10 ms: a minute in total.
const PATIENCE: usize = 6000;

/// An opened device. It is destroyed with its last user, unless it belongs to the application.
pub(crate) struct LogicalDevice {
    pub(crate) raw: ash::Device,
    pub(crate) physical: PhysicalDevice,
    /// Whether its kernels read texel buffers.
    pub(crate) reads_texels: bool,
    /// The rule for the memory of uploads.
    pub(crate) placing: Placing,
    queue: DeviceQueue,
    /// The queue of [`QueueLane::Copies`], if it is not the kernels' queue.
    copy_queue: Option<DeviceQueue>,
    /// Whether staged results are copied in separate submissions.
    pub(crate) copies_apart: bool,
    names: Option<ext::debug_utils::Device>,
    /// The extension that imports the caller's memory, if it is used.
    pub(crate) borrows: Option<ext::external_memory_host::Device>,
    /// The extension that exports memory, if results can be exported.
    pub(crate) exports: Option<khr::external_memory_fd::Device>,
    /// The extension that exports semaphores, if timelines can be exported.
    pub(crate) exports_timelines: Option<khr::external_semaphore_fd::Device>,
    /// Whether the engine opened the device, and may open it again.
    pub(crate) owned: bool,
    pub(crate) shared: SharedMemory,
    /// Whether a wait timed out: work may still run, so nothing may be destroyed.
    hung: AtomicBool,
    /// The process that opened the device. A process that was forked from it must not use the device.
    process: u32,
    /// The driver's compiled kernels, which are kept from process to process.
    pub(crate) pipelines: PipelineCache,
    /// The kernels that are known to be exact.
    pub(crate) passes: Arc<Passes>,
}

impl LogicalDevice {
    /// The variants of kernels that the device takes.
    pub(crate) fn variants(&self) -> Variants {
        Variants {
            reads_texels: self.reads_texels,
            converts: self.physical.converts_halves,
        }
    }

    pub(crate) fn new(
        physical: PhysicalDevice,
        options: &EngineOptions,
    ) -> Result<Arc<Self>, VulkanError> {
        let copies = physical.copies(options);
        let family = physical.queue_family;
        let priorities = [1.0; 2];
        let of_family = |family, count| {
            vk::DeviceQueueCreateInfo::default()
                .queue_family_index(family)
                .queue_priorities(&priorities[..count])
        };
        let beside = match copies {
            Copies::Together | Copies::Apart => None,
            Copies::Beside(queue) => Some(queue),
        };
        let queues: Vec<_> = match beside {
            Some(other) if other.family == family => vec![of_family(family, 2)],
            Some(other) => vec![of_family(family, 1), of_family(other.family, 1)],
            None => vec![of_family(family, 1)],
        };
        // Memory is imported on software devices only. They compute in threads of this process, so waiting for their
        // work always ends. After that, no thread uses the memory, and its owner may free it.
        let reads_texels = physical.reads_texels(options.reads);
        let borrows = physical.info.kind == DeviceKind::Cpu
            && physical.lent_alignment.is_some()
            && may_be_imported(&physical, reads_texels);
        let copies_apart = copies != Copies::Together;
        let exports = physical.memory_files && may_be_exported(&physical);
        let exports_timelines = exports
            && physical.semaphore_files
            && physical.has_timelines
            && timelines_may_be_exported(&physical);
        let timelines = copies_apart && physical.timelines_extension;
        let controls = physical.float_controls_extension;
        let extensions = [
            (controls, khr::shader_float_controls::NAME),
            (borrows, ext::external_memory_host::NAME),
            (exports, khr::external_memory_fd::NAME),
            (exports_timelines, khr::external_semaphore_fd::NAME),
            (timelines, khr::timeline_semaphore::NAME),
            (physical.portability_subset, khr::portability_subset::NAME),
        ];
        let enabled = extensions.iter().filter(|(is_enabled, _)| *is_enabled);
        let extensions: Vec<_> = enabled.map(|(_, name)| name.as_ptr()).collect();
        let features = vk::PhysicalDeviceFeatures::default().shader_int64(reads_texels);
        let mut timelines =
            vk::PhysicalDeviceTimelineSemaphoreFeatures::default().timeline_semaphore(true);
        let mut info = vk::DeviceCreateInfo::default()
            .enabled_features(&features)
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions);
        if copies_apart || exports_timelines {
            info = info.push_next(&mut timelines);
        }
        let mut halves =
            vk::PhysicalDeviceShaderFloat16Int8Features::default().shader_float16(true);
        let mut stored_halves = vk::PhysicalDevice16BitStorageFeatures::default()
            .storage_buffer16_bit_access(true)
            .uniform_and_storage_buffer16_bit_access(true);
        if physical.converts_halves {
            info = info.push_next(&mut halves).push_next(&mut stored_halves);
        }
        let instance = &physical.instance.raw;
        // SAFETY: the physical device belongs to the instance and has these families.
        let raw =
            unsafe { instance.create_device(physical.raw, &info, None) }.named("vkCreateDevice")?;
        // SAFETY: these queues were just created.
        let queue = |family, index| unsafe { raw.get_device_queue(family, index) };
        let copy_queue = beside.map(|QueueIndex { family, index }| VulkanQueue {
            queue: queue(family, index),
            family,
        });
        let first = DeviceQueue::new(queue(family, 0), family, None);
        let pipelines = PipelineCache::new(&raw, &physical, &options.cache_files);
        let borrows = borrows.then(|| ext::external_memory_host::Device::new(instance, &raw));
        let exports = exports.then(|| khr::external_memory_fd::Device::new(instance, &raw));
        let exports_timelines =
            exports_timelines.then(|| khr::external_semaphore_fd::Device::new(instance, &raw));
        let mut device = Self::with_queues(physical, raw, first, copy_queue, pipelines, options);
        (device.owned, device.borrows) = (true, borrows);
        (device.exports, device.exports_timelines) = (exports, exports_timelines);
        device.copies_apart = copies_apart;
        Ok(Arc::new(device))
    }

    /// A device that its caller must destroy, and which computes on `queue`. Staged results are copied by `copy_queue`,
    /// if there is one.
    pub(crate) fn with_queues(
        physical: PhysicalDevice,
        raw: ash::Device,
        queue: DeviceQueue,
        copy_queue: Option<VulkanQueue>,
        pipelines: PipelineCache,
        options: &EngineOptions,
    ) -> Self {
        let in_place = physical.in_place(options.transfer);
        let stay = in_place || options.read_back == ReadBack::SameQueue;
        let named = copy_queue.filter(|_| !stay);
        let instance = &physical.instance;
        let names = instance
            .debug_utils
            .then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        Self {
            raw,
            reads_texels: physical.reads_texels(options.reads),
            placing: Placing {
                uploads: options.uploads,
                in_place,
                direct: direct(&physical.memory),
            },
            queue,
            copy_queue: named.map(|named| DeviceQueue::new(named.queue, named.family, None)),
            copies_apart: named.is_some(),
            physical,
            names,
            borrows: None,
            exports: None,
            exports_timelines: None,
            owned: false,
            shared: SharedMemory::default(),
            hung: AtomicBool::new(false),
            process: std::process::id(),
            pipelines,
            passes: Passes::kept_in(&Cache::new(&options.cache_files)),
        }
    }

    /// Calls `work` with the queue of a lane, for one user at a time; `None` if the application's lock did not call
    /// its argument.
    pub(crate) fn with_queue<T>(
        &self,
        lane: QueueLane,
        work: impl FnOnce(vk::Queue) -> T,
    ) -> Option<T> {
        self.queue_of(lane).with(work)
    }

    pub(crate) fn family(&self, lane: QueueLane) -> u32 {
        self.queue_of(lane).family
    }

    fn queue_of(&self, lane: QueueLane) -> &DeviceQueue {
        match (lane, &self.copy_queue) {
            (QueueLane::Copies, Some(copy_queue)) => copy_queue,
            _ => &self.queue,
        }
    }

    /// Whether results are copied on another queue than the kernels'.
    #[cfg(feature = "lab")]
    pub(crate) fn has_copy_queue(&self) -> bool {
        self.copy_queue.is_some()
    }

    /// Locks all queues of a device that the engine opened.
    fn all_queues(&self) -> (MutexGuard<'_, ()>, Option<MutexGuard<'_, ()>>) {
        let kernels = self.queue.lock();
        (kernels, self.copy_queue.as_ref().map(DeviceQueue::lock))
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

    /// Marks the device as hung: its objects are not destroyed any more, because they may still be in use.
    pub(crate) fn mark_hung(&self) {
        if !self.hung.swap(true, Ordering::Relaxed) {
            // The device is not destroyed, so the instance must not be destroyed either.
            std::mem::forget(Arc::clone(&self.physical.instance));
        }
    }

    /// Waits until the work of a fence has ended, after a first wait failed. For a device that the engine opened,
    /// this waits until it is idle. Vulkan forbids this while others submit, as on an application's device; there the
    /// fence is polled. If all this fails, the device is marked as hung.
    pub(crate) fn wait_until_done(&self, fence: vk::Fence) {
        if !self.may_destroy() {
            return; // a device that has hung is not waited for again
        }
        if self.owned {
            return self.wait_until_idle();
        }
        for _ in 0..PATIENCE {
            // SAFETY: the fence belongs to this device, and was submitted.
            match unsafe { self.raw.wait_for_fences(&[fence], true, 10_000_000) } {
                Ok(()) | Err(vk::Result::ERROR_DEVICE_LOST) => return,
                Err(vk::Result::TIMEOUT) => {}
                Err(_) => std::thread::sleep(Duration::from_millis(10)), // memory may come back
            }
        }
        self.mark_hung();
    }

    /// Waits until the device, which the engine opened, is idle. If the wait fails, the device is marked as hung.
    fn wait_until_idle(&self) {
        let _queues = self.all_queues();
        // SAFETY: the device is alive, and its queues are locked.
        match unsafe { self.raw.device_wait_idle() } {
            Ok(()) | Err(vk::Result::ERROR_DEVICE_LOST) => {}
            Err(_) => self.mark_hung(),
        }
    }

    /// Waits until the driver has released copies that have ended. Errors are ignored.
    pub(crate) fn settle(&self) {
        // On an application's device, the engine must not wait for the compute queue.
        let lanes = match self.owned {
            true => &[QueueLane::Kernels, QueueLane::Copies][..],
            false => &[QueueLane::Copies],
        };
        for &lane in lanes {
            self.with_queue(lane, |queue| {
                // SAFETY: the device is alive, and the queue is locked.
                let _ = unsafe { self.raw.queue_wait_idle(queue) };
            });
        }
    }

    /// Waits until the device is idle, and again if the wait fails for lack of memory. The engine opened the device,
    /// because no other device imports memory.
    pub(crate) fn wait_in_any_case(&self) {
        let _queues = self.all_queues();
        // SAFETY: as in `wait_until_idle`.
        while let Err(error) = unsafe { self.raw.device_wait_idle() }
            && error != vk::Result::ERROR_DEVICE_LOST
        {
            std::thread::sleep(Duration::from_millis(10)); // memory may come back
        }
    }

    /// Whether objects may be destroyed.
    pub(crate) fn may_destroy(&self) -> bool {
        !self.hung.load(Ordering::Relaxed) && self.check_process().is_ok()
    }

    /// Returns an error in a process that was forked from the one that opened the device.
    pub(crate) fn check_process(&self) -> Result<(), VulkanError> {
        match self.process == std::process::id() {
            true => Ok(()),
            false => Err(VulkanError::Forked),
        }
    }
}

impl Drop for LogicalDevice {
    fn drop(&mut self) {
        if !self.may_destroy() {
            return;
        }
        // SAFETY: every object created from it held an `Arc` to this and was dropped.
        unsafe { self.shared.free(&self.raw) };
        // SAFETY: every object created from the device held an `Arc` to it and was dropped.
        unsafe { self.pipelines.destroy(&self.raw) };
        if self.owned {
            // SAFETY: every object created from the device held an `Arc` to it and was dropped.
            unsafe { self.raw.destroy_device(None) };
        }
    }
}

/// The lock of every queue that an engine of this process uses, by the queue's handle. All engines share it, because
/// several engines may be made of one application's device, each with a [`DeviceQueue`] for the same queue.
static LOCKS: Mutex<BTreeMap<u64, Weak<Mutex<()>>>> = Mutex::new(BTreeMap::new());

/// A queue as one engine uses it.
pub(crate) struct DeviceQueue {
    raw: vk::Queue,
    pub(crate) family: u32,
    /// The lock that all engines use for the queue.
    of_engines: Arc<Mutex<()>>,
    /// The lock that the application uses for the queue.
    of_application: Option<QueueLock>,
}

impl DeviceQueue {
    pub(crate) fn new(raw: vk::Queue, family: u32, of_application: Option<QueueLock>) -> Self {
        let mut all = lock(&LOCKS);
        let found = all.get(&raw.as_raw()).and_then(Weak::upgrade);
        let of_engines = found.unwrap_or_else(|| {
            let new = Arc::default();
            all.insert(raw.as_raw(), Arc::downgrade(&new));
            new
        });
        Self {
            raw,
            family,
            of_engines,
            of_application,
        }
    }

    /// Calls `work` while nothing else uses the queue; `None` if the application's lock did not call its argument.
    pub(crate) fn with<T>(&self, work: impl FnOnce(vk::Queue) -> T) -> Option<T> {
        // Always lock in this order. The application may use one lock for several queues, so its lock is the last.
        let _engines = self.lock();
        match &self.of_application {
            Some(shared) => shared.run(|| work(self.raw)),
            None => Some(work(self.raw)),
        }
    }

    /// Keeps all other engines from the queue.
    pub(crate) fn lock(&self) -> MutexGuard<'_, ()> {
        lock(&self.of_engines)
    }
}

impl Drop for DeviceQueue {
    fn drop(&mut self) {
        let mut all = lock(&LOCKS);
        // While the table is locked, no other thread can begin to use the lock.
        if Arc::strong_count(&self.of_engines) == 1 {
            all.remove(&self.raw.as_raw());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Handles that no driver gives.
    fn queue(handle: u64) -> DeviceQueue {
        DeviceQueue::new(vk::Queue::from_raw(u64::MAX - handle), 0, None)
    }

    #[test]
    fn work_is_done_within_the_locks_of_engines_and_application() {
        let shared = Arc::new(Mutex::new(()));
        let raw = vk::Queue::from_raw(u64::MAX - 3);
        let one = DeviceQueue::new(raw, 0, Some(QueueLock::from(Arc::clone(&shared))));
        let again = queue(3);
        let are_free = || {
            [
                shared.try_lock().is_ok(),
                again.of_engines.try_lock().is_ok(),
            ]
        };
        assert_eq!(one.with(|_| are_free()), Some([false; 2]));
        assert_eq!(again.with(|_| are_free()), Some([true, false]));
        assert_eq!(are_free(), [true; 2]);
    }

    #[test]
    fn a_queue_has_one_lock_as_long_as_an_engine_uses_it() {
        let (one, again, other) = (queue(1), queue(1), queue(2));
        assert!(Arc::ptr_eq(&one.of_engines, &again.of_engines));
        assert!(!Arc::ptr_eq(&one.of_engines, &other.of_engines));
        let held = one.lock();
        assert!(again.of_engines.try_lock().is_err() && other.of_engines.try_lock().is_ok());
        drop(held);
        let is_listed = |handle: u64| lock(&LOCKS).contains_key(&(u64::MAX - handle));
        drop(one);
        assert!(is_listed(1), "another engine uses it");
        drop((again, other));
        assert!(!is_listed(1) && !is_listed(2));
    }
}
