//! An engine on an application's Vulkan device. The function is unsafe, because the compiler cannot check the
//! application's promises about its handles.
#![allow(unsafe_code)]

use crate::engine::Engine;
use crate::error::Error;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanHandles;
use crate::gpu::options::EngineOptions;
use crate::gpu::recovery::Opened;

impl Engine {
    /// Makes an engine on an application's Vulkan device.
    ///
    /// # Errors
    /// As [`Engine::with_options`].
    ///
    /// # Safety
    /// The handles must be valid and belong together, and must outlive the engine and all of its clips and results.
    /// Nothing else may use the queues while the engine uses them, unless the application and the engine share
    /// [`VulkanHandles::queue_lock`].
    pub unsafe fn from_vulkan(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, Error> {
        // SAFETY: promised by the caller.
        let engine = unsafe { VulkanEngine::from_handles(handles, options) }?;
        Ok(Self::with_opened(Opened::trusted(engine, options)?))
    }
}
