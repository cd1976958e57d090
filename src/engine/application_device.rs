//! An engine on an application's Vulkan device. The function is unsafe, because the compiler cannot check the
//! application's promises about its handles.
#![allow(unsafe_code)]

use std::sync::Arc;

use crate::engine::Engine;
use crate::error::Error;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanHandles;
use crate::gpu::opened::Opened;
use crate::machine::options::EngineOptions;

impl Engine {
    /// Makes an engine on an application's Vulkan device.
    ///
    /// # Errors
    /// * As [`Engine::with_options`].
    /// * When a handle is null, or [`VulkanHandles::api_version`] is below 1.1.
    /// * When the physical device does not belong to the instance.
    /// * When the family of `queue` cannot compute, or that of the copy queue cannot copy.
    ///
    /// # Safety
    /// The handles must be valid and belong together, and must outlive the engine and all of its clips and results.
    /// The application must not use the queues while the engine uses them, unless the application and the engine
    /// share [`VulkanHandles::queue_lock`]. Several engines may use the same queues.
    pub unsafe fn from_vulkan(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, Error> {
        // SAFETY: as the caller promises.
        let engine = unsafe { VulkanEngine::from_handles(handles, options) }?;
        Ok(Self {
            machine: Arc::new(Opened::trusted(engine, options)?),
        })
    }

    /// The Vulkan device; `None` on the CPU.
    pub(crate) fn opened(&self) -> Option<&Opened> {
        Opened::of(&*self.machine)
    }
}
