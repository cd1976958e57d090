//! TODO-DOC

pub(crate) mod frame_clock;
pub(crate) mod frame_rate;
pub(crate) mod frames;
pub(crate) mod interval_blocks;
pub(crate) mod key_samples;
pub(crate) mod runs;
pub(crate) mod spans;
pub(crate) mod times;
pub(crate) mod wrap;
