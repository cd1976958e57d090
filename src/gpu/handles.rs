//! Vulkan objects of an application's own.

use std::sync::Arc;

use ash::vk;

use crate::gpu::device::LogicalDevice;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::error::VulkanError;
use crate::gpu::instance::Instance;
use crate::gpu::options::EngineOptions;
use crate::gpu::physical::PhysicalDevice;
use crate::shader::spirv::FloatControls;

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
}

/// A queue of an application's own device.
#[derive(Debug, Clone, Copy)]
pub struct VulkanQueue {
    /// The queue.
    pub queue: vk::Queue,
    /// Its family, which can copy.
    pub family: u32,
}

/// A range of a buffer on an application's own device.
#[derive(Debug, Clone, Copy)]
pub struct VulkanBuffer {
    /// The buffer.
    pub buffer: vk::Buffer,
    /// Where the range starts, bytes: a multiple of the size of a stored rotation.
    pub offset: u64,
    /// Its length, bytes: at least the size of the result.
    pub size: u64,
}

impl VulkanEngine {
    /// # Safety
    /// As [`Engine::from_vulkan`](crate::engine::Engine::from_vulkan) says.
    pub(crate) unsafe fn from_handles(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        let instance = Instance::borrowed(handles.entry, handles.instance);
        let mut physical = PhysicalDevice::new(&instance, handles.physical_device)?
            .ok_or(VulkanError::NoDevice)?;
        physical.queue_family = handles.queue_family;
        if handles.api_version < vk::API_VERSION_1_2 && !handles.shader_float_controls {
            // The application did not enable what the device offers.
            physical.float_controls = FloatControls::default();
        }
        physical.has_int64 &= handles.shader_int64;
        let device = LogicalDevice::borrowed(
            physical,
            handles.device,
            handles.queue,
            handles.copy_queue,
            options,
        );
        Ok(Self::new(Arc::new(device), options))
    }
}
