//! An application's Vulkan objects.

use std::fmt;
use std::sync::{Arc, Mutex};

use ash::vk::{self, Handle as _};

use crate::machine::error::VulkanError;
use crate::machine::error::calls::Named as _;
use crate::names::fields::with_fields;
use crate::threads::lock;

/// An application's instance, device and queue, for an engine
/// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)).
///
/// No features of the device are required, but software devices are faster with one
/// ([`VulkanHandles::shader_int64`]). With Vulkan 1.1, enable `VK_KHR_shader_float_controls` if the device has it.
#[derive(Clone)]
#[non_exhaustive]
pub struct VulkanHandles {
    /// The loaded functions; they keep the loader library open.
    pub entry: ash::Entry,
    /// The instance, of Vulkan 1.1 or newer.
    pub instance: ash::Instance,
    /// The Vulkan version for which the instance was made (`VkApplicationInfo::apiVersion`), 1.1 or newer. If it is
    /// newer than the loader's, the loader's counts.
    pub api_version: u32,
    /// The physical device of `device`.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// Whether `VK_KHR_shader_float_controls` is enabled; ignored from Vulkan 1.2 on.
    pub shader_float_controls: bool,
    /// Whether the feature `shaderInt64` is enabled, which makes software devices faster.
    pub shader_int64: bool,
    /// A queue of the device, of a family that can compute.
    pub queue: vk::Queue,
    /// The family of `queue`.
    pub queue_family: u32,
    /// A second queue, on which staged results are copied to the host while `queue` computes
    /// ([`ReadBack`](crate::machine::options::ReadBack)). It requires the feature `timelineSemaphore` of the device.
    /// `None`: only `queue` is used.
    pub copy_queue: Option<VulkanQueue>,
    /// A lock for `queue`, so that the application and the engine may submit at any time, from any thread.
    ///
    /// The application must hold the lock whenever it uses `queue`; the engine holds the lock during each submission.
    /// The application must not call the engine while it holds the lock, because the engine would wait forever. Without
    /// a lock, the application must not use the queue during a call of the engine that submits. These calls submit:
    /// [`Engine::from_vulkan`](crate::engine::Engine::from_vulkan) and [`Engine::warm`](crate::engine::Engine::warm),
    /// uploads, all evaluations and streams, the checks of kernels, the functions called `to_buffer`, `target`,
    /// `timed_target` and `stage_target`, [`Engine::crowd`](crate::engine::Engine::crowd), and a crowd's `submit`.
    /// Functions called `record` and those that change a crowd's library or layers do not, and neither does dropping an
    /// object.
    ///
    /// Engines need no lock among themselves: all engines of a process that use one queue take turns. If several
    /// engines use a queue together with the application, give the same lock to each. The copy queue is for engines
    /// alone.
    pub queue_lock: Option<QueueLock>,
    /// The application's pipeline cache, in which the engine makes its pipelines. It must outlive the engine, and must
    /// have been created without `VK_PIPELINE_CACHE_CREATE_EXTERNALLY_SYNCHRONIZED_BIT`. The engine neither reads it from
    /// a file nor writes it to one. `None`: the engine makes a cache, and keeps it in a file ([`EngineOptions::cache_files`](crate::machine::options::EngineOptions)).
    pub pipeline_cache: Option<vk::PipelineCache>,
}

with_fields! {
    VulkanHandles:
    with_copy_queue(copy_queue: Option<VulkanQueue>),
    with_queue_lock(queue_lock: Option<QueueLock>),
    with_pipeline_cache(pipeline_cache: Option<vk::PipelineCache>),
}

impl fmt::Debug for VulkanHandles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("VulkanHandles")
            .field("api_version", &self.api_version)
            .field("physical_device", &self.physical_device)
            .field("queue", &self.queue)
            .field("queue_family", &self.queue_family)
            .finish_non_exhaustive()
    }
}

impl VulkanHandles {
    /// Handles of an instance, of a device and of a queue, without optional features. `api_version` is the Vulkan version
    /// for which the instance was made (`VkApplicationInfo::apiVersion`).
    #[must_use]
    pub fn new(
        entry: ash::Entry,
        instance: ash::Instance,
        api_version: u32,
        physical_device: vk::PhysicalDevice,
        device: ash::Device,
        queue: VulkanQueue,
    ) -> Self {
        Self {
            entry,
            instance,
            api_version,
            physical_device,
            device,
            shader_float_controls: false,
            shader_int64: false,
            queue: queue.queue,
            queue_family: queue.family,
            copy_queue: None,
            queue_lock: None,
            pipeline_cache: None,
        }
    }

    /// States that the application has enabled `VK_KHR_shader_float_controls` on the device.
    #[must_use]
    pub fn with_shader_float_controls(self) -> Self {
        Self {
            shader_float_controls: true,
            ..self
        }
    }

    /// States that the application has enabled the feature `shaderInt64` on the device.
    #[must_use]
    pub fn with_shader_int64(self) -> Self {
        Self {
            shader_int64: true,
            ..self
        }
    }

    /// Refuses handles that are null, and a version that is too old. Returns the version of which functions may be used.
    pub(crate) fn check(&self) -> Result<u32, VulkanError> {
        let handles = [
            ("instance", self.instance.handle().as_raw()),
            ("physical_device", self.physical_device.as_raw()),
            ("device", self.device.handle().as_raw()),
            ("queue", self.queue.as_raw()),
            (
                "copy_queue",
                self.copy_queue.map_or(1, |copies| copies.queue.as_raw()),
            ),
            (
                "pipeline_cache",
                self.pipeline_cache.map_or(1, vk::Handle::as_raw),
            ),
        ];
        if let Some((name, _)) = handles.iter().find(|(_, handle)| *handle == 0) {
            return Err(VulkanError::NullHandle { name });
        }
        // SAFETY: no requirements beyond a loaded entry.
        let loader = unsafe { self.entry.try_enumerate_instance_version() }
            .named("vkEnumerateInstanceVersion")?
            .unwrap_or(vk::API_VERSION_1_0);
        let stated = self.api_version;
        usable_version(stated, loader).ok_or(VulkanError::ApiVersion { stated })
    }
}

/// The version of an instance that was made for the version `stated`, by a loader of the version `loader`; `None` if it
/// is older than 1.1. If an application states a newer version than its loader has, the loader's counts. Vulkan has no query
/// for the version of an instance, so a mistake cannot be detected.
fn usable_version(stated: u32, loader: u32) -> Option<u32> {
    let is_vulkan = vk::api_version_variant(stated) == 0; // another variant is another interface, such as Vulkan SC
    (is_vulkan && stated >= vk::API_VERSION_1_1).then_some(stated.min(loader))
}

/// A lock for a queue that an application and an engine share. The application implements it with a lock of any kind.
///
/// ```
/// use std::sync::{Arc, Mutex};
/// use tumble::vulkan::QueueLock;
///
/// let frames = Arc::new(Mutex::new(0)); // other data that the application's lock protects
/// let shared = Arc::clone(&frames);
/// let lock = QueueLock::new(move |submit| {
///     let _locked = shared.lock();
///     submit();
/// });
/// ```
#[derive(Clone)]
pub struct QueueLock(Arc<Locked>);

/// A function that calls its argument while a lock is locked.
type Locked = dyn Fn(&mut dyn FnMut()) + Send + Sync;

impl QueueLock {
    /// Makes a lock from a function that locks, calls its argument once, and unlocks.
    pub fn new(locked: impl Fn(&mut dyn FnMut()) + Send + Sync + 'static) -> Self {
        Self(Arc::new(locked))
    }

    /// Calls `work` while the lock is locked; `None` if the application's function did not call its argument.
    pub(crate) fn run<T>(&self, work: impl FnOnce() -> T) -> Option<T> {
        let (mut work, mut done) = (Some(work), None);
        (self.0)(&mut || {
            if let Some(work) = work.take() {
                done = Some(work());
            }
        });
        done
    }
}

impl From<Arc<Mutex<()>>> for QueueLock {
    fn from(mutex: Arc<Mutex<()>>) -> Self {
        Self::new(move |work| {
            let _locked = lock(&mutex);
            work();
        })
    }
}

impl fmt::Debug for QueueLock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("QueueLock").finish_non_exhaustive()
    }
}

/// A queue of an application's device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct VulkanQueue {
    /// The queue.
    pub queue: vk::Queue,
    /// The queue's family, which can copy.
    pub family: u32,
}

impl VulkanQueue {
    /// A queue of a family.
    #[must_use]
    pub fn new(queue: vk::Queue, family: u32) -> Self {
        Self { queue, family }
    }
}

/// A range of a buffer on an application's device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct VulkanBuffer {
    /// The buffer.
    pub buffer: vk::Buffer,
    /// The start of the range in bytes: a multiple of the size of a stored value, and for crowds, stages and passes of 256.
    pub offset: u64,
    /// The length of the range in bytes: at least the size of the result.
    pub size: u64,
}

impl VulkanBuffer {
    /// The first `size` bytes of a buffer.
    #[must_use]
    pub fn new(buffer: vk::Buffer, size: u64) -> Self {
        Self {
            buffer,
            offset: 0,
            size,
        }
    }

    /// A range of the same size that starts at another offset in bytes.
    #[must_use]
    pub fn at(self, offset: u64) -> Self {
        Self { offset, ..self }
    }

    /// Refuses a null buffer, and a range that ends beyond the buffer. Vulkan tells neither a buffer's length nor its
    /// usages; its memory is at least as long as the buffer.
    pub(crate) fn check(&self, device: &ash::Device) -> Result<(), VulkanError> {
        if self.buffer == vk::Buffer::null() {
            return Err(VulkanError::NullHandle { name: "buffer" });
        }
        // SAFETY: the buffer belongs to the device, as the caller who makes requests of it promises.
        let memory = unsafe { device.get_buffer_memory_requirements(self.buffer) }.size;
        match self.offset.checked_add(self.size) {
            Some(end) if end <= memory => Ok(()),
            _ => Err(VulkanError::BufferEnd {
                offset: self.offset,
                size: self.size,
                memory,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_newer_version_than_the_loader_s_is_the_loader_s() {
        let version = |minor, patch| vk::make_api_version(0, 1, minor, patch);
        for (stated, loader, usable) in [
            (version(1, 0), version(3, 280), Some(version(1, 0))),
            (version(3, 0), version(3, 280), Some(version(3, 0))),
            (version(4, 0), version(1, 70), Some(version(1, 70))),
            (version(1000, 0), version(3, 280), Some(version(3, 280))),
            (version(0, 4095), version(3, 280), None),
            (0, version(3, 280), None),
            (vk::make_api_version(1, 1, 1, 0), version(3, 280), None),
            (u32::MAX, version(3, 280), None),
        ] {
            assert_eq!(usable_version(stated, loader), usable, "{stated} {loader}");
        }
    }
}
