//! Keys to segments: the constants that the kernels read, computed once per clip; arcs in
//! f32 as a kernel could, curves in f64 and rounded once, those that turn moderately and know
//! their four keys mostly in f32. Independent of frame rate and
//! device, so the CPU and every Vulkan device evaluate the same segments.

pub(crate) mod arcs;
pub(crate) mod batch;
pub(crate) mod both_sides;
pub(crate) mod clip_data;
pub(crate) mod constant_velocity;
pub(crate) mod double;
pub(crate) mod error;
pub(crate) mod motion;
pub(crate) mod nodes;
pub(crate) mod preparation;
pub(crate) mod prepared;
pub(crate) mod single;
pub(crate) mod steps;
pub(crate) mod tangent_weights;
pub(crate) mod vectors;
