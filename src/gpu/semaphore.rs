//! A timeline semaphore: what one queue has reached, for another that waits.

use std::sync::Arc;

use ash::vk;

use crate::gpu::device::LogicalDevice;
use crate::gpu::error::{Named, VulkanError};

/// A timeline semaphore, whose device has that feature.
pub(crate) struct Semaphore {
    device: Arc<LogicalDevice>,
    raw: vk::Semaphore,
    /// The value of the point that was given last.
    last: u64,
}

/// A point on a semaphore's timeline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub(crate) semaphore: vk::Semaphore,
    pub(crate) value: u64,
}

impl Semaphore {
    pub(crate) fn new(device: &Arc<LogicalDevice>) -> Result<Self, VulkanError> {
        let mut kind =
            vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device is alive, with the feature; what is made is destroyed in `drop`.
        let raw = unsafe { device.raw.create_semaphore(&info, None) }.named("vkCreateSemaphore")?;
        device.name(raw, "tumble kernels done");
        Ok(Self {
            device: Arc::clone(device),
            raw,
            last: 0,
        })
    }

    /// The next point, later than all that were given before. One that is never reached, because
    /// its submission failed, does no harm.
    pub(crate) fn advance(&mut self) -> Point {
        self.last += 1;
        Point {
            semaphore: self.raw,
            value: self.last,
        }
    }
}

impl Drop for Semaphore {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            // Fences say that copies have ended. But Mesa's drivers that make timelines of plain
            // semaphores let go of them a moment after they signal the fence.
            self.device.settle();
            // SAFETY: created from this device; whoever submits with it waits for that before.
            unsafe { self.device.raw.destroy_semaphore(self.raw, None) };
        }
    }
}
