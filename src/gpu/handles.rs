//! Vulkan objects of an application's own.

use ash::vk;

use super::device::LogicalDevice;
use super::engine::VulkanEngine;
use super::error::VulkanError;
use super::instance::Instance;
use super::physical::PhysicalDevice;
use crate::device::EngineOptions;
use crate::engine::{Engine, Error};

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

impl Engine {
    /// Evaluates on an application's own Vulkan device.
    ///
    /// # Errors
    /// As [`Engine::with_options`].
    ///
    /// # Safety
    /// The handles must be valid and belong together, must outlive the engine and
    /// all of its clips and results, and nobody else may use the queue while the
    /// engine does.
    pub unsafe fn from_vulkan(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, Error> {
        // SAFETY: promised by the caller.
        let engine = unsafe { VulkanEngine::from_handles(handles, options) }?;
        let info = engine.info().clone();
        Self::trusted(engine, info, options)
    }
}

impl VulkanEngine {
    /// # Safety
    /// The handles must be valid and belong together, must outlive the engine and
    /// all of its clips and results, and nobody else may use the queue while the
    /// engine does.
    unsafe fn from_handles(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, VulkanError> {
        let instance = Instance::borrowed(handles.entry, handles.instance);
        let mut physical = PhysicalDevice::new(&instance, handles.physical_device)?
            .ok_or(VulkanError::NoDevice)?;
        physical.queue_family = handles.queue_family;
        let device = LogicalDevice::borrowed(physical, handles.device, handles.queue);
        Self::with_device(device, options)
    }
}
