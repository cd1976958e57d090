//! Prepares tracks: turns their keys into segments, the coefficients that the kernels evaluate,
//! once per clip. They do not depend on frame rate or device, so the CPU and every Vulkan device
//! evaluate the same segments.
//!
//! Arcs are computed in f32, with the operations of the arc kernel's twin. Curves are computed in
//! f64 and rounded once; curves of moderate angle that depend on four keys alone mostly in f32.

pub(crate) mod arcs;
pub(crate) mod batch;
pub(crate) mod clip_data;
pub(crate) mod constant_speed;
pub(crate) mod direct;
pub(crate) mod error;
pub(crate) mod fitting;
pub(crate) mod preparation;
pub(crate) mod prepared;
pub(crate) mod request;
pub(crate) mod smooth;
pub(crate) mod vectors;
