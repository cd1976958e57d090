//! Work for a device, as values that know no device.

pub(crate) mod crowd;
pub(crate) mod lists;
pub(crate) mod motion;
pub(crate) mod recording;
pub(crate) mod subgroup_instances;
pub(crate) mod whole_instances;
