//! Descriptions of the work of a Vulkan device, lists of samples and recordings, as values that do not depend on a
//! device.

pub(crate) mod crowd;
pub(crate) mod lists;
pub(crate) mod motion;
pub(crate) mod recording;
pub(crate) mod subgroup_instances;
pub(crate) mod whole_instances;
