//! From a set to its rotations: the choice of a route, and its execution on the CPU or a Vulkan
//! device.

pub(crate) mod pieces;
pub(crate) mod route;
pub(crate) mod set;
pub(crate) mod uploaded;
