//! From seconds to frames: frame rates, requested samples, wrap modes, and which span of a track or
//! which interval between keys each sample falls into. Results do not depend on the window of
//! samples that is asked for.

pub(crate) mod frame_clock;
pub(crate) mod frame_rate;
pub(crate) mod frames;
pub(crate) mod interval_blocks;
pub(crate) mod key_samples;
pub(crate) mod moment;
pub(crate) mod runs;
pub(crate) mod spans;
pub(crate) mod time_base;
pub(crate) mod times;
pub(crate) mod wrap;
