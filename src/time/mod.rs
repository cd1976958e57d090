//! TODO-DOC

pub(crate) mod frame_clock;
pub(crate) mod frame_rate;
pub(crate) mod frames;
pub(crate) mod interval_block;
pub(crate) mod key_samples;
pub(crate) mod reversed;
pub(crate) mod runs;
pub(crate) mod time_runs;
pub(crate) mod window;
pub(crate) mod wrap;
