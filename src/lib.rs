//! Bulk interpolation of rotations with the same bits on every Vulkan driver and
//! the CPU.
mod clock;
pub mod method;
mod numeric;
pub mod reference;
mod tracks;

pub use clock::{FrameRate, Frames, FramesError, MAX_FRAMES, Timeline};
pub use tracks::{NORM_TOLERANCE, Track, TrackError, TrackSet};
