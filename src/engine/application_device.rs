//! An engine on an application's own Vulkan device. The function is unsafe, because the compiler cannot check what
//! the application promises of its handles.
#![allow(unsafe_code)]

use crate::engine::Engine;
use crate::error::Error;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanHandles;
use crate::gpu::options::EngineOptions;
use crate::gpu::recovery::Opened;

impl Engine {
    /// Evaluates on an application's own Vulkan device.
    ///
    /// # Errors
    /// As [`Engine::with_options`].
    ///
    /// # Safety
    /// The handles must be valid and belong together, must outlive the engine and
    /// all of its clips and results, and nobody else may use the queues while the
    /// engine does, unless both lock [`VulkanHandles::queue_lock`].
    pub unsafe fn from_vulkan(
        handles: VulkanHandles,
        options: &EngineOptions,
    ) -> Result<Self, Error> {
        // SAFETY: promised by the caller.
        let engine = unsafe { VulkanEngine::from_handles(handles, options) }?;
        Ok(Self::with_opened(Opened::trusted(engine, options)?))
    }
}
