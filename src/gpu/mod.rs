//! Vulkan, through `ash`: the only place, with the CPU's feature dispatch, that is
//! not safe Rust. One type owns one Vulkan object and destroys it.
#![allow(unsafe_code)]

mod buffer;
mod canary;
mod device;
mod engine;
mod error;
mod handles;
mod instance;
mod lent;
mod mapped;
mod opened;
mod pass;
mod physical;
mod pipeline;
mod run;
mod sampled;
mod singles;
mod slot;
mod submission;
mod work_list;

pub use canary::CanaryReport;
pub(crate) use engine::{ClipBuffers, EvaluateError, Job, VulkanEngine};
pub use error::VulkanError;
pub use handles::{VulkanBuffer, VulkanHandles};
pub(crate) use opened::Opened;
pub use physical::{DeviceInfo, DeviceKind};
pub(crate) use physical::{PhysicalDevice, list};
pub(crate) use pipeline::PoseKernel;
pub use pipeline::kernels;
