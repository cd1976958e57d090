//! The layer that `shaders/poses/add.wgsl` adds; the function of `shaders/crowd/layers.wgsl` is the same.

pub(crate) use crate::twin::functions::rotation_added as pose;
