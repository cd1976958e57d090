//! An application's Vulkan objects.

use std::fmt;
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::threads::lock;

/// An application's instance, device and queue, to evaluate on
/// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)).
///
/// The device needs no features, but a software device is faster with one
/// ([`VulkanHandles::shader_int64`]). Below Vulkan 1.2, enable `VK_KHR_shader_float_controls`
/// where it is offered.
pub struct VulkanHandles {
    /// The loaded functions; they keep the loader library open.
    pub entry: ash::Entry,
    /// The instance, of Vulkan 1.1 or newer.
    pub instance: ash::Instance,
    /// The version that it was made for (`VkApplicationInfo::apiVersion`).
    pub api_version: u32,
    /// The device's physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// Whether `VK_KHR_shader_float_controls` is enabled; ignored from Vulkan 1.2 on.
    pub shader_float_controls: bool,
    /// Whether the feature `shaderInt64` is enabled, which makes software devices faster.
    pub shader_int64: bool,
    /// A queue of the device that can compute.
    pub queue: vk::Queue,
    /// That queue's family.
    pub queue_family: u32,
    /// Another queue, on which results that are staged are copied to the host while the first one
    /// computes ([`ReadBack`](crate::gpu::options::ReadBack)). Without one, only `queue` is used. The
    /// device must have the feature `timelineSemaphore` enabled then.
    pub copy_queue: Option<VulkanQueue>,
    /// A lock that the application locks whenever it uses `queue`, from any thread; the engine locks it for
    /// each of its submissions, so that both may submit at any time. It must not be locked while the
    /// application calls the engine, which would wait for it for ever. Without one nobody else may use the
    /// queue while the engine does. The queue for copies is the engine's alone.
    pub queue_lock: Option<QueueLock>,
}

/// A lock for a queue that an application and an engine share: the application's, of whatever kind.
///
/// ```
/// use std::sync::{Arc, Mutex};
/// use tumble::vulkan::QueueLock;
///
/// let frames = Arc::new(Mutex::new(0)); // what the application's lock protects beside the queue
/// let shared = Arc::clone(&frames);
/// let lock = QueueLock::new(move |submit| {
///     let _locked = shared.lock();
///     submit();
/// });
/// ```
#[derive(Clone)]
pub struct QueueLock(Arc<Locked>);

/// Runs work while a lock is locked.
type Locked = dyn Fn(&mut dyn FnMut()) + Send + Sync;

impl QueueLock {
    /// A lock by a function that locks it, calls what it is given once, and unlocks it.
    pub fn new(locked: impl Fn(&mut dyn FnMut()) + Send + Sync + 'static) -> Self {
        Self(Arc::new(locked))
    }

    /// Does work while the lock is locked; `None` from a function that did not call it.
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
#[derive(Debug, Clone, Copy)]
pub struct VulkanQueue {
    /// The queue.
    pub queue: vk::Queue,
    /// Its family, which can copy.
    pub family: u32,
}

/// A range of a buffer on an application's device.
#[derive(Debug, Clone, Copy)]
pub struct VulkanBuffer {
    /// The buffer.
    pub buffer: vk::Buffer,
    /// Where the range starts, bytes: a multiple of the size of a stored rotation.
    pub offset: u64,
    /// Its length, bytes: at least the size of the result.
    pub size: u64,
}
