//! Calls of Vulkan that fail.

use ash::vk;

use crate::machine::error::VulkanError;

impl VulkanError {
    /// The code of a failed call.
    fn code(&self) -> Option<vk::Result> {
        match self {
            Self::Call { result, .. } => Some(*result),
            _ => None,
        }
    }

    /// Whether the device is lost: its memory is gone, and it must be opened again.
    pub(crate) fn is_lost(&self) -> bool {
        self.code() == Some(vk::Result::ERROR_DEVICE_LOST)
    }

    /// Whether memory ran out: the same work in smaller windows may succeed.
    pub(crate) fn is_out_of_memory(&self) -> bool {
        matches!(
            self.code(),
            Some(
                vk::Result::ERROR_OUT_OF_HOST_MEMORY
                    | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
                    | vk::Result::ERROR_OUT_OF_POOL_MEMORY
                    | vk::Result::ERROR_FRAGMENTED_POOL
                    | vk::Result::ERROR_TOO_MANY_OBJECTS
            )
        )
    }
}

/// The advice for a user about a failed call; empty if there is none.
pub(super) fn hint(result: vk::Result) -> &'static str {
    match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            "; lower the memory budget"
        }
        vk::Result::ERROR_DEVICE_LOST => "; the driver gave up on the device",
        _ => "",
    }
}

/// Adds the name of the failed function to an error.
pub(crate) trait Named<T> {
    fn named(self, call: &'static str) -> Result<T, VulkanError>;
}

impl<T> Named<T> for ash::prelude::VkResult<T> {
    fn named(self, call: &'static str) -> Result<T, VulkanError> {
        self.map_err(|result| VulkanError::Call { call, result })
    }
}
