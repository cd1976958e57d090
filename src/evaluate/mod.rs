//! From a set to its rotations: the choice of a route, and its execution on the CPU or a Vulkan
//! device.

pub(crate) mod backend;
pub(crate) mod pieces;
pub(crate) mod uploaded;
