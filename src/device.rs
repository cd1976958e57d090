//! Devices on which engines evaluate.

use std::sync::Arc;

#[cfg(feature = "vulkan")]
use crate::gpu::physical::listed;
use crate::machine::ListedDevice;
use crate::machine::error::VulkanError;
use crate::machine::reports::{DeviceInfo, DeviceKind};

/// The device on which an engine evaluates: the CPU, or one Vulkan device.
#[derive(Clone)]
#[non_exhaustive]
pub enum Device {
    /// The CPU: the f32 twins of the shaders, on all cores.
    Cpu,
    /// A Vulkan device.
    Vulkan(VulkanDevice),
}

/// A Vulkan device, not yet opened.
#[derive(Clone)]
pub struct VulkanDevice {
    pub(crate) listed: Arc<dyn ListedDevice>,
}

impl VulkanDevice {
    /// Name, kind and limits.
    #[must_use]
    pub fn info(&self) -> &DeviceInfo {
        self.listed.info()
    }
}

impl std::fmt::Debug for VulkanDevice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("VulkanDevice")
            .field(&self.info().name)
            .finish()
    }
}

impl Device {
    /// Lists every Vulkan device that can compute, fastest kind first. The CPU is always available and not listed.
    ///
    /// The Vulkan loader runs the drivers' code in this process: a driver that crashes while it is loaded ends the
    /// process. (The program `tumble` loads drivers in a child process first.)
    ///
    /// # Errors
    /// When there is no Vulkan loader or no driver, or the loader fails.
    pub fn list() -> Result<Vec<Self>, VulkanError> {
        Self::of_loader(false)
    }

    /// The first Vulkan device of [`Device::list`], for tests. If there is none, this is an error, so that no test
    /// passes on the CPU alone. Software drivers are included; `VK_DRIVER_FILES` selects the driver to load.
    ///
    /// ```no_run
    /// use tumble::{Device, Engine};
    /// let engine = Engine::new(Device::first_vulkan()?)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When there is no Vulkan loader, no driver, or no device that can compute.
    pub fn first_vulkan() -> Result<Self, VulkanError> {
        Self::list()?
            .into_iter()
            .next()
            .ok_or(VulkanError::NoDevice)
    }

    /// As [`Device::list`], with the Khronos validation layer, which checks every call to the devices
    /// ([`Engine::validation_messages`](crate::engine::Engine::validation_messages)).
    ///
    /// # Errors
    /// As [`Device::list`]; also when the layer is not installed.
    pub fn list_validated() -> Result<Vec<Self>, VulkanError> {
        Self::of_loader(true)
    }

    /// The devices of the Vulkan loader, with the validation layer or without.
    fn of_loader(validation: bool) -> Result<Vec<Self>, VulkanError> {
        let vulkan = |listed| Self::Vulkan(VulkanDevice { listed });
        Ok(listed(validation)?.into_iter().map(vulkan).collect())
    }

    /// Name, kind and limits of a Vulkan device; `None` for the CPU.
    fn info(&self) -> Option<&DeviceInfo> {
        match self {
            Self::Cpu => None,
            Self::Vulkan(device) => Some(device.info()),
        }
    }

    /// Whether this is a Vulkan driver that computes on the CPU (such as Mesa's lavapipe).
    #[must_use]
    pub fn is_software(&self) -> bool {
        (self.info()).is_some_and(|info| info.kind == DeviceKind::Cpu)
    }

    /// The device's UUID (Vulkan's `deviceUUID`), 32 hexadecimal digits with dashes. It is the same in every process
    /// on the machine, and for NVIDIA's cards the same as NVML's. `None` for the CPU.
    #[must_use]
    pub fn uuid(&self) -> Option<String> {
        self.info().map(|info| info.uuid.clone())
    }

    /// The device's name: the driver's name for it, or `CPU`.
    #[must_use]
    pub fn name(&self) -> &str {
        self.info().map_or("CPU", |info| &info.name)
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Device").field(&self.name()).finish()
    }
}

#[cfg(not(feature = "vulkan"))]
fn listed(_validation: bool) -> Result<Vec<Arc<dyn ListedDevice>>, VulkanError> {
    Err(VulkanError::NotBuilt)
}
