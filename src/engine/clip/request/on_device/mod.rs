//! Results that stay on a Vulkan device: in an application's buffer, or in memory that other interfaces import.

pub(crate) mod application_device;
mod exported;

use crate::engine::Engine;
use crate::engine::clip::request::{RequestPart, RequestSource, RequestWork, SetWork};
use crate::engine::groups::GroupedSet;
use crate::error::Error;
use crate::evaluate::pieces::PreparedWindow;
use crate::gpu::clip::VulkanClip;
use crate::machine::MachineClip;
use crate::machine::error::EvaluateError;
use crate::machine::plan::bytes_of;
use crate::memory::OutOfMemoryError;
use crate::output::window::Window;
use crate::prepare::prepared::SEGMENTS;
use crate::time::frames::Timeline;

impl RequestSource<'_> {
    pub(super) fn engine(&self) -> &Engine {
        match self {
            Self::Clip(clip) => clip.engine(),
            Self::Set { engine, .. } | Self::Grouped(GroupedSet { engine, .. }) => engine,
        }
    }

    /// Calls `work` for a window of the clip, or for the segments of the set that the window needs, with the samples
    /// and the window relative to them.
    pub(super) fn with_uploaded<T>(
        &self,
        part: &RequestPart,
        work: impl FnOnce(&VulkanClip, &Timeline, &Window) -> Result<T, EvaluateError>,
    ) -> Result<T, Error> {
        let SetWork { engine, request } = match self.work(part)? {
            RequestWork::Prepared(clip) => {
                let clip = on_vulkan(clip.uploaded()?.prepared()?)?;
                let folded = clip.data().folded(&part.timeline)?;
                return Ok(work(clip, &folded, &part.window)?);
            }
            RequestWork::Set(of_set) => of_set,
            RequestWork::Groups { .. } => return Err(Error::SeveralInterpolations),
        };
        let needed = bytes_of(&request);
        if (engine.machine.limits().memory).is_some_and(|limit| needed > limit) {
            return Err(OutOfMemoryError::new::<u8>(SEGMENTS, needed).into());
        }
        let prepared = PreparedWindow::whole(&engine.machine, &request)?;
        let clip = on_vulkan(prepared.clip())?;
        Ok(prepared.with(&part.window, |timeline, window| {
            work(clip, timeline, window)
        })?)
    }
}

/// The clip on its Vulkan device.
fn on_vulkan(clip: &dyn MachineClip) -> Result<&VulkanClip, Error> {
    VulkanClip::of(clip).ok_or(Error::BufferOnCpu)
}
