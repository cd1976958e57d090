//! Vulkan objects of an application's own.

use std::sync::Arc;

use ash::vk;

use super::device::LogicalDevice;
use super::engine::VulkanEngine;
use super::error::VulkanError;
use super::instance::Instance;
use super::physical::PhysicalDevice;
use crate::device::EngineOptions;

/// An application's instance, device and queue, to evaluate on
/// ([`Engine::from_vulkan`](crate::Engine::from_vulkan)).
///
/// The device needs no features. Where it is older than Vulkan 1.2 and offers
/// `VK_KHR_shader_float_controls`, enable that extension.
pub struct VulkanHandles {
    /// The loaded functions; they keep the loader library open.
    pub entry: ash::Entry,
    /// The instance, of Vulkan 1.1 or newer.
    pub instance: ash::Instance,
    /// The device's physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// A queue of the device that can compute.
    pub queue: vk::Queue,
    /// That queue's family.
    pub queue_family: u32,
}

impl VulkanEngine {
    /// # Safety
    /// The handles must be valid and belong together, must outlive the engine and
    /// all of its clips and results, and nobody else may use the queue while the
    /// engine does.
    pub(crate) unsafe fn from_handles(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        let instance = Instance::borrowed(handles.entry, handles.instance);
        let mut physical = PhysicalDevice::new(&instance, handles.physical_device)?
            .ok_or(VulkanError::NoDevice)?;
        physical.queue_family = handles.queue_family;
        let device = LogicalDevice::borrowed(physical, handles.device, handles.queue);
        let device: Arc<LogicalDevice> = device;
        Self::with_device(device, options)
    }
}
