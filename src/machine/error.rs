//! Errors of machines.

#[cfg(feature = "vulkan")]
pub(crate) mod calls;

use crate::prepare::error::SetError;
use crate::time::error::SampleTimesError;

/// Why a Vulkan device cannot be used, or failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VulkanError {
    /// The crate was compiled without the feature `vulkan`. The variant is in every build, so that enabling the feature
    /// takes nothing away.
    #[error(
        "this was built without Vulkan; build it with the feature `vulkan` of the crate `tumble`"
    )]
    NotBuilt,
    /// The Vulkan loader library was not found.
    #[error(
        "no Vulkan loader: {reason}; install it (Debian: libvulkan1 and mesa-vulkan-drivers; macOS: brew install vulkan-loader molten-vk)"
    )]
    NoLoader {
        /// The system's message.
        reason: String,
    },
    /// The loader found no driver, or none with a device that can compute.
    #[error(
        "the Vulkan loader finds no driver with a device that can compute; install one (Debian: mesa-vulkan-drivers; macOS: brew install molten-vk)"
    )]
    NoDevice,
    /// There is an NVIDIA card, but no manifest of its Vulkan driver.
    #[error(
        "no Vulkan driver for the NVIDIA card that /dev/nvidiactl shows: in a container, add the capability `graphics` (NVIDIA_DRIVER_CAPABILITIES=all); MIG instances of a card do not support Vulkan"
    )]
    NoNvidiaDriver,
    /// The process was forked from one that uses Vulkan. Drivers do not work on both sides of a fork.
    #[error(
        "Vulkan cannot be used in a process that was forked from one which uses it: start the process otherwise (spawn or forkserver in Python's multiprocessing), open the device in it alone, or use the CPU, which gives the same bits"
    )]
    Forked,
    /// The drivers did not answer in time.
    #[error(
        "the Vulkan drivers did not answer within {seconds} s; cards without NVIDIA's persistence daemon (nvidia-persistenced) and machines with many cards take long to start: run the daemon, wait longer (TUMBLE_DRIVER_SECONDS={}), or name the drivers to load in VK_DRIVER_FILES", seconds.saturating_mul(3)
    )]
    SlowDriver {
        /// The time limit in seconds.
        seconds: u64,
    },
    /// A kernel binds more storage buffers than the device allows.
    #[error(
        "the kernel {kernel} binds {needed} storage buffers, and the device allows {limit} (maxPerStageDescriptorStorageBuffers); frames at a rate and samples straight from keys need 4, explicit times 5, crowds 5: evaluate this on the CPU"
    )]
    StorageBuffers {
        /// The kernel's name.
        kernel: &'static str,
        /// The number of storage buffers that the kernel binds.
        needed: u32,
        /// The device's limit.
        limit: u32,
    },
    /// An application's queue is of a family that does not exist, or that cannot do the required work.
    #[error(
        "the queue is of family {family}, which cannot {work}; the device has {families} families, from 0"
    )]
    QueueFamily {
        /// The family's index.
        family: u32,
        /// The required work.
        work: &'static str,
        /// The number of the device's families.
        families: usize,
    },
    /// A handle of the application is null.
    #[error("`{name}` is null (VK_NULL_HANDLE)")]
    NullHandle {
        /// The handle's name: the field of `VulkanHandles` or `VulkanBuffer`.
        name: &'static str,
    },
    /// The version that an application states of its instance is below 1.1.
    #[error(
        "`api_version` is {stated}, Vulkan {}; give the version for which the instance was made (VkApplicationInfo::apiVersion), 1.1 or newer", version(*.stated)
    )]
    ApiVersion {
        /// The stated version.
        stated: u32,
    },
    /// A physical device that the application's instance does not have.
    #[error("`physical_device` is none of the {count} of `instance`")]
    OtherPhysicalDevice {
        /// The number of the instance's physical devices.
        count: usize,
    },
    /// The range of a buffer ends beyond the buffer.
    #[error(
        "the range of {size} bytes at {offset} ends beyond the buffer, which has {memory} bytes of memory"
    )]
    BufferEnd {
        /// The start of the range in bytes.
        offset: u64,
        /// The length of the range in bytes.
        size: u64,
        /// The length of the buffer's memory in bytes: the buffer's length, rounded up.
        memory: u64,
    },
    /// The application's queue lock did not call the function that was passed to it.
    #[error(
        "the application's lock of the queue (VulkanHandles::queue_lock) did not call the function that it was given"
    )]
    QueueLock,
    /// The copy queue is the same as the compute queue.
    #[error("the copy queue is the compute queue; give another, or none")]
    SameQueue,
    /// A driver crashes the process that loads it.
    #[error(
        "a Vulkan driver fails while it is loaded: {how}; remove it, or list the drivers to load in VK_DRIVER_FILES"
    )]
    Driver {
        /// How a process that loaded the driver ended.
        how: String,
    },
    /// A Vulkan call failed.
    #[cfg(feature = "vulkan")]
    #[error("{call} failed: {result:?}{}", calls::hint(*result))]
    Call {
        /// The function's name.
        call: &'static str,
        /// The returned code.
        result: ash::vk::Result,
    },
    /// The validation layer is requested but not installed.
    #[error(
        "the layer VK_LAYER_KHRONOS_validation is not installed (Debian: vulkan-validationlayers)"
    )]
    NoValidation,
    /// No memory type has the properties that a buffer needs.
    #[error(
        "the device offers no memory with the properties {properties:#x} (VkMemoryPropertyFlagBits)"
    )]
    NoMemoryType {
        /// The required properties, as `VkMemoryPropertyFlagBits`.
        properties: u32,
    },
    /// The device did not finish in time.
    #[error("the device did not finish a dispatch within {seconds} s")]
    Timeout {
        /// The time limit in seconds.
        seconds: u64,
    },
    /// The self-test found other bits than the CPU's.
    #[error(
        "{device} is not exact: self-test `{check}` differs in {differing} of {total} results; it is used only when inexact devices are allowed"
    )]
    Inexact {
        /// The device's name.
        device: String,
        /// The failed check of the self-test.
        check: &'static str,
        /// The number of results that differ.
        differing: usize,
        /// The number of results that were compared.
        total: usize,
    },
    /// A kernel computes other bits than the CPU.
    #[error(
        "{device} is not exact: the kernel `{kernel}` differs from the CPU in {differing} of {total} values; it is used only when inexact devices are allowed"
    )]
    InexactKernel {
        /// The device's name.
        device: String,
        /// The kernel's name, as in [`kernels`](crate::vulkan::kernels).
        kernel: &'static str,
        /// The number of values that differ.
        differing: usize,
        /// The number of values that were compared.
        total: usize,
    },
    /// The range of a buffer does not fit the result.
    #[error(
        "the buffer's range of {size} bytes at {offset} does not fit: the result has {needed} bytes, and starts at a multiple of {rotation}"
    )]
    BufferRange {
        /// The start of the range in bytes.
        offset: u64,
        /// The length of the range in bytes.
        size: u64,
        /// The size of a value of the result in bytes; the range must start at a multiple of it.
        rotation: u64,
        /// The length of the result in bytes.
        needed: u64,
    },
    /// A result does not fit a target's range at the offset at which it is recorded.
    #[error(
        "the result of {needed} bytes does not fit at `offset` {offset} of the target's range, which has {size} bytes; `offset` is at most {}, and a multiple of {rotation}",
        size.saturating_sub(*needed) / rotation * rotation
    )]
    ResultOffset {
        /// The offset in bytes from the start of the target's range.
        offset: u64,
        /// The length of the target's range in bytes.
        size: u64,
        /// The size of a value of the result in bytes; the offset must be a multiple of it.
        rotation: u64,
        /// The length of the result in bytes.
        needed: u64,
    },
    /// The device cannot export the memory of results.
    #[error(
        "{device} cannot share the memory of results with other APIs: {lacks}; evaluate into the host's memory instead"
    )]
    NoExport {
        /// The device's name.
        device: String,
        /// The missing capability.
        lacks: &'static str,
    },
    /// Something that stays on the device would exceed the engine's memory budget
    /// ([`EngineOptions::memory`](crate::EngineOptions::memory)), half of which is for results.
    #[error(
        "{subject} needs {bytes} bytes; the memory budget of the engine is {budget} bytes, of which half is for results: \
         set a budget of at least {}, or use the CPU for this set", bytes.saturating_mul(2)
    )]
    OverBudget {
        /// The contents.
        subject: &'static str,
        /// The required size in bytes.
        bytes: u64,
        /// The budget in bytes.
        budget: u64,
    },
    /// A buffer would exceed the device's limits.
    #[error(
        "{subject} needs {bytes} bytes, over the device's limit of {limit}; use the CPU for this set"
    )]
    TooLarge {
        /// The buffer's contents.
        subject: &'static str,
        /// The required size in bytes.
        bytes: u64,
        /// The device's limit in bytes.
        limit: u64,
    },
}

/// A version of Vulkan in digits: `1.3`.
fn version(packed: u32) -> String {
    format!("{}.{}", packed >> 22 & 0x7f, packed >> 12 & 0x3ff)
}

/// Errors of an evaluation.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EvaluateError {
    #[error(transparent)]
    Vulkan(#[from] VulkanError),
    /// A device has no memory for prepared tracks; fewer may fit.
    #[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
    #[error(transparent)]
    NoRoom(VulkanError),
    #[error(transparent)]
    Set(SetError),
}

impl EvaluateError {
    /// Converts the index of a track in a batch that starts at the track `first` into its index in the set.
    pub(crate) fn of_tracks_from(mut self, first: usize) -> Self {
        if let Self::Set(SetError::Frames(SampleTimesError::GapTooLong { track, .. })) = &mut self {
            *track += first;
        }
        self
    }
}

impl<E: Into<SetError>> From<E> for EvaluateError {
    fn from(error: E) -> Self {
        Self::Set(error.into())
    }
}
