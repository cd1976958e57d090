//! An application's Vulkan objects.

use std::fmt;
use std::sync::{Arc, Mutex};

use ash::vk;

use crate::threads::lock;

/// An application's instance, device and queue, for an engine
/// ([`Engine::from_vulkan`](crate::engine::Engine::from_vulkan)).
///
/// No features of the device are required, but software devices are faster with one
/// ([`VulkanHandles::shader_int64`]). With Vulkan 1.1, enable `VK_KHR_shader_float_controls` if the device has it.
pub struct VulkanHandles {
    /// The loaded functions; they keep the loader library open.
    pub entry: ash::Entry,
    /// The instance, of Vulkan 1.1 or newer.
    pub instance: ash::Instance,
    /// The Vulkan version for which the instance was made (`VkApplicationInfo::apiVersion`).
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
    /// ([`ReadBack`](crate::gpu::options::ReadBack)). It requires the feature `timelineSemaphore` of the device.
    /// `None`: only `queue` is used.
    pub copy_queue: Option<VulkanQueue>,
    /// A lock for `queue`, so that the application and the engine may submit at any time, from any thread.
    ///
    /// The application must lock it whenever it uses `queue`; the engine locks it for each of its submissions. The
    /// application must not call the engine while it has the lock, because the engine would wait for it forever.
    /// Without a lock, nothing else may use the queue while the engine uses it. The copy queue is for the engine
    /// alone.
    pub queue_lock: Option<QueueLock>,
}

/// A lock for a queue that an application and an engine share. The application implements it with a lock of any kind.
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
#[derive(Debug, Clone, Copy)]
pub struct VulkanQueue {
    /// The queue.
    pub queue: vk::Queue,
    /// The queue's family, which can copy.
    pub family: u32,
}

/// A range of a buffer on an application's device.
#[derive(Debug, Clone, Copy)]
pub struct VulkanBuffer {
    /// The buffer.
    pub buffer: vk::Buffer,
    /// The start of the range, bytes: a multiple of the size of a stored value.
    pub offset: u64,
    /// The length of the range, bytes: at least the size of the result.
    pub size: u64,
}
