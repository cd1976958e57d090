//! Results in memory of the engine's device that other interfaces on the same card, such as CUDA, can import.

use std::sync::Arc;

use crate::engine::clip::request::Request;
use crate::error::Error;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::external::ExportedResult;
use crate::gpu::in_flight::Target;
use crate::gpu::job::Job;
use crate::output::window::Window;

impl Request<'_> {
    /// Evaluates into memory of the engine's device that other interfaces on the same card, such as CUDA, can import.
    /// If they can wait for the device, this returns while the device is still writing.
    ///
    /// # Errors
    /// As [`Request::size`]; also when the engine is the CPU, the device cannot export memory, there is not enough
    /// memory, or the device fails.
    pub fn export(&self) -> Result<ExportedResult, Error> {
        if self.source.engine().opened().is_none() {
            return Err(Error::ExportOnCpu);
        }
        let part = self.part()?;
        let bytes = (part.window.len() as u64).saturating_mul(self.encoding.bytes() as u64);
        let export = |engine: &VulkanEngine, job: Job<'_>, window: &Window| {
            let exported = engine.exported(bytes)?;
            let target = Target::Exported(Arc::clone(&exported));
            engine.run(job, window, target, None)?;
            Ok(ExportedResult::new(exported, bytes))
        };
        (self.source).with_uploaded(&part, |clip, timeline, window| {
            let export = |engine: &VulkanEngine, job: Job<'_>| export(engine, job, window);
            clip.on_device(timeline, self.encoding, export)
        })
    }
}
