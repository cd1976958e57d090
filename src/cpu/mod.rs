//! The CPU: the f32 twins of the shaders, and the walk over tracks and samples
//! that feeds them.

pub(crate) mod canary;
mod dispatch;
mod engine;
mod evaluate;
mod evaluate_arc;
mod evaluate_polynomial;
mod row;
mod sine_cosine;

pub(crate) use dispatch::in_lanes;
#[cfg(test)]
pub(crate) use dispatch::tests::at_every_width;
pub use dispatch::{UnknownWidth, VectorWidth};
pub(crate) use engine::CpuEngine;
pub(crate) use sine_cosine::sine_and_fall;
