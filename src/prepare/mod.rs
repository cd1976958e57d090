//! Keys to segments: the constants that the kernels read, computed once per clip; arcs in
//! f32 as a kernel could, curves in f64 and rounded once, those that turn moderately and know
//! their four keys mostly in f32. Independent of frame rate and
//! device, so the CPU and every Vulkan device evaluate the same segments.

pub(crate) mod arcs;
pub(crate) mod batch;
pub(crate) mod clip_data;
pub(crate) mod constant_speed;
pub(crate) mod direct;
pub(crate) mod error;
pub(crate) mod fitting;
pub(crate) mod preparation;
pub(crate) mod prepared;
pub(crate) mod smooth;
pub(crate) mod steps;
pub(crate) mod vectors;
pub(crate) mod waiting_curves;
