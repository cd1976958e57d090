//! What is reported of a Vulkan device and of its checks: plain values, which a build without Vulkan has too.

/// A Vulkan device that can compute: its name, and the limits that matter here.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct DeviceInfo {
    /// Name, as the driver gives it.
    pub name: String,
    /// The driver's name and version; empty where it does not report them.
    pub driver: String,
    /// Kind of device.
    pub kind: DeviceKind,
    /// Vulkan version that the device supports.
    pub api_version: String,
    /// PCI vendor.
    pub vendor_id: u32,
    /// The vendor's number for the device.
    pub device_id: u32,
    /// Vulkan's `deviceUUID`: 32 hexadecimal digits with dashes.
    pub uuid: String,
    /// Bytes that a kernel can see of one buffer.
    pub max_storage_buffer_range: u64,
    /// Bytes of the largest allocation.
    pub max_memory_allocation_size: u64,
    /// Invocations in one workgroup.
    pub max_compute_work_group_invocations: u32,
    /// Workgroups of one dispatch, along each axis.
    pub max_compute_work_group_count: [u32; 3],
    /// Alignment of offsets into buffers, bytes.
    pub min_storage_buffer_offset_alignment: u64,
    /// Bytes of memory local to the device.
    pub device_local_memory: u64,
    /// Signed zeros, infinities and NaN can be demanded (f32).
    pub preserves_signed_zero_inf_nan: bool,
    /// Rounding to nearest even can be demanded (f32).
    pub rounds_to_nearest_even: bool,
}

/// Kinds of Vulkan devices, fastest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum DeviceKind {
    /// A card with its memory on it.
    Discrete,
    /// Shares the host's memory.
    Integrated,
    /// Part of a virtual machine.
    Virtual,
    /// A software rasteriser, such as lavapipe.
    Cpu,
    /// Anything else.
    Other,
}

/// How a device did on one expression of the self-test.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SelfTestReport {
    /// What it checks: one of the errors that an inexact driver makes.
    pub name: &'static str,
    /// Results compared.
    pub total: usize,
    /// Results with other bits than the CPU's.
    pub differing: usize,
}

/// What a device makes of the expressions of the self-test where its driver is left free to compute them
/// otherwise: without the decorations that forbid it. Where no result differs, the comparison has not been seen to
/// find anything on this device.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct NegativeControl {
    /// How many results of each expression have other bits than the CPU's.
    pub expressions: Vec<SelfTestReport>,
    /// Whether the device's driver is known to compute some of them otherwise: Mesa's lavapipe does.
    pub must_differ: bool,
}

impl NegativeControl {
    /// Results with other bits than the CPU's.
    #[must_use]
    pub fn differing_count(&self) -> usize {
        self.expressions.iter().map(|report| report.differing).sum()
    }

    /// False where the driver is known to compute some expressions otherwise, and the comparison found none: then
    /// it proves nothing.
    #[must_use]
    pub fn is_conclusive(&self) -> bool {
        !self.must_differ || self.differing_count() > 0
    }
}

/// How a device did on one kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct KernelCheck {
    /// The kernel, as [`kernels`](crate::vulkan::kernels) names it.
    pub name: &'static str,
    /// Values of 32 bits compared: those that the kernel has to store, and some around them that it has to
    /// leave alone.
    pub total: usize,
    /// Values with other bits than the CPU's.
    pub differing: usize,
    /// Whether nothing was compared now, because the kernel is known to have passed on this device.
    pub remembered: bool,
}
