//! The CPU: the f32 twins of the shaders, and the walk over tracks and samples
//! that feeds them.

pub(crate) mod batches;
pub(crate) mod clip;
pub(crate) mod engine;
pub(crate) mod evaluate;
pub(crate) mod fallback;
pub(crate) mod few_samples;
mod fill;
pub(crate) mod from_keys;
pub(crate) mod row;
pub(crate) mod scratch;
pub(crate) mod sink;
pub(crate) mod sparse_times;
pub(crate) mod streaming;
