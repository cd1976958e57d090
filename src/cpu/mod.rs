//! The CPU: the f32 twins of the shaders, and the walk over tracks and samples
//! that feeds them.

pub(crate) mod canary;
mod dispatch;
mod engine;
mod evaluate;
mod evaluate_arc;
mod evaluate_cumulative;
mod row;
mod sine_cosine;

pub use dispatch::VectorWidth;
pub(crate) use dispatch::arc_block;
#[cfg(test)]
pub(crate) use dispatch::arc_block_at;
pub(crate) use engine::CpuEngine;
