//! The CPU: the f32 twins of the shaders, and the walk over tracks and samples
//! that feeds them.

mod arc;
mod arc_tangent;
pub(crate) mod canary;
mod cubic_lanes;
mod destination;
mod dispatch;
mod engine;
mod evaluate;
mod evaluate_arc;
mod evaluate_polynomial;
mod few;
mod gentle;
mod lanes;
mod long;
mod matrix;
mod memory;
mod mend;
mod pose_add;
mod pose_blend;
mod pose_mix;
mod pose_world;
mod poses;
mod quaternion;
mod row;
mod sample_lanes;
mod sampled;
mod sine_cosine;
mod stage;
mod store_axis_angle;
mod store_euler;
mod store_f16;
mod store_snorm16;

pub(crate) use arc::{arc, middle_and_tangent};
#[cfg(test)]
pub(crate) use dispatch::tests::at_every_width;
pub(crate) use dispatch::{InLanes, in_lanes};
pub use dispatch::{UnknownWidth, VectorWidth};
pub(crate) use engine::CpuEngine;
pub(crate) use evaluate::FEW;
pub(crate) use gentle::{
    Gentle, Turn, across, along, both, brought_behind, chord_of, gentle, minus, signed, step_vector,
};
pub(crate) use lanes::{Doubles, Lanes, Number, canonical};
pub(crate) use long::{first_sample, is_in_stretches};
pub(crate) use matrix::rows;
pub(crate) use mend::{LEFT_OUT, Row};
pub(crate) use poses::{add, blend, mix, world};
pub(crate) use sample_lanes::any_turns;
pub(crate) use sampled::{Straight, straight};
pub(crate) use sine_cosine::{short_sine_and_fall, sine_and_fall};
pub(crate) use store_axis_angle::axis_angle;
pub(crate) use store_euler::euler;
pub(crate) use store_f16::to_half;
pub(crate) use store_snorm16::to_snorm;
