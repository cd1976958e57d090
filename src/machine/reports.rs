//! Reports of a Vulkan device and of its checks: plain values, which also a build without Vulkan has.

/// A Vulkan device that can compute: its name, and the limits that the engine uses.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct DeviceInfo {
    /// The driver's name for the device.
    pub name: String,
    /// The driver's name and version; empty if the driver does not report them.
    pub driver: String,
    /// The kind of device.
    pub kind: DeviceKind,
    /// The Vulkan version that the device supports.
    pub api_version: String,
    /// The PCI vendor ID.
    pub vendor_id: u32,
    /// The vendor's ID of the device.
    pub device_id: u32,
    /// The device's UUID (Vulkan's `deviceUUID`): 32 hexadecimal digits with dashes.
    pub uuid: String,
    /// The maximum number of bytes of one buffer that a kernel can access.
    pub max_storage_buffer_range: u64,
    /// The maximum size of an allocation in bytes.
    pub max_memory_allocation_size: u64,
    /// The maximum number of invocations in one workgroup.
    pub max_compute_work_group_invocations: u32,
    /// The maximum number of workgroups of one dispatch, along each axis.
    pub max_compute_work_group_count: [u32; 3],
    /// The alignment of offsets into storage buffers in bytes.
    pub min_storage_buffer_offset_alignment: u64,
    /// The size of device-local memory in bytes.
    pub device_local_memory: u64,
    /// Whether signed zeros, infinities and NaN can be preserved (f32).
    pub preserves_signed_zero_inf_nan: bool,
    /// Whether rounding to nearest even can be required (f32).
    pub rounds_to_nearest_even: bool,
}

/// Kinds of Vulkan devices, fastest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum DeviceKind {
    /// A graphics card with its memory.
    Discrete,
    /// A device that shares the host's memory.
    Integrated,
    /// A device of a virtual machine.
    Virtual,
    /// A software rasteriser, such as lavapipe.
    Cpu,
    /// Anything else.
    Other,
}

/// The result of one expression of the self-test.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SelfTestReport {
    /// The name of the check: an error that inexact drivers make.
    pub name: &'static str,
    /// The number of results that were compared.
    pub total: usize,
    /// The number of results whose bits differ from the CPU's.
    pub differing: usize,
}

/// The results of the self-test's expressions without the decorations that forbid the driver to change them. If no
/// result differs, the comparison has not been shown to detect differences on this device.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct NegativeControl {
    /// For each expression, the number of results whose bits differ from the CPU's.
    pub expressions: Vec<SelfTestReport>,
    /// Whether the driver is known to change some of the expressions, as Mesa's lavapipe does.
    pub must_differ: bool,
}

impl NegativeControl {
    /// The number of results whose bits differ from the CPU's.
    #[must_use]
    pub fn differing_count(&self) -> usize {
        self.expressions.iter().map(|report| report.differing).sum()
    }

    /// Whether the control is conclusive: `false` if the driver is known to change some expressions, but no result
    /// differs.
    #[must_use]
    pub fn is_conclusive(&self) -> bool {
        !self.must_differ || self.differing_count() > 0
    }
}

/// The result of the check of one kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct KernelCheck {
    /// The kernel's name, as in [`kernels`](crate::vulkan::kernels).
    pub name: &'static str,
    /// The number of values of 32 bits that were compared: those that the kernel must write, and some around them
    /// that it must not change.
    pub total: usize,
    /// The number of values whose bits differ from the CPU's.
    pub differing: usize,
    /// Whether nothing was compared now, because the kernel is known to have passed on this device.
    pub remembered: bool,
    /// Whether the kernel differs and the engine uses other kernels instead, which have the CPU's bits.
    pub replaced: bool,
}
