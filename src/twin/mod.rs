//! Twins: the functions of the shaders once more in Rust, with the same names and the same order of
//! operations, so that the CPU gives the bits of an exact Vulkan device.

pub(crate) mod arc_between;
pub(crate) mod arc_tangent;
pub(crate) mod axis_angle;
pub(crate) mod crowd_layers;
pub(crate) mod crowd_matrices;
pub(crate) mod crowd_times;
pub(crate) mod euler;
pub(crate) mod evaluate;
pub(crate) mod evaluate_arc;
pub(crate) mod evaluate_polynomial;
pub(crate) mod f16;
pub(crate) mod matrix;
pub(crate) mod pose_add;
pub(crate) mod pose_blend;
pub(crate) mod pose_mix;
pub(crate) mod pose_smooth;
pub(crate) mod pose_steps;
pub(crate) mod pose_world;
pub(crate) mod quaternion;
pub(crate) mod self_test;
pub(crate) mod sine_cosine;
pub(crate) mod small_angle;
pub(crate) mod snorm16;

#[cfg(test)]
#[path = "../../tests/twins/mod.rs"]
mod tests;
