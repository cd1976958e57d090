//! Crowds: many instances of one skeleton, each at its own time in clips of its own, evaluated in one
//! go on the CPU or on a Vulkan device, with the same bits.

pub(crate) mod clip_tables;
pub(crate) mod clock;
pub(crate) mod instances;
pub(crate) mod lay_over;
pub(crate) mod layer;
pub(crate) mod library;
pub(crate) mod on_cpu;
#[cfg(feature = "vulkan")]
pub(crate) mod own_device;
pub(crate) mod player;
pub(crate) mod states;
