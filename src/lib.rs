//! Bulk interpolation of rotations with the same bits on every Vulkan driver and
//! the CPU.
mod clip;
mod clock;
mod cpu;
mod engine;
mod gpu;
pub mod method;
mod numeric;
mod prepare;
pub mod reference;
mod rotations;
mod schedule;
mod segment;
pub mod spirv;
mod tracks;

pub use clock::{FrameRate, Frames, FramesError, MAX_FRAMES, Timeline};
pub use cpu::VectorWidth;
pub use engine::{Clip, Device, Engine, EngineOptions, Error, Transfer, VulkanDevice};
pub use gpu::{CanaryReport, DeviceInfo, DeviceKind, VulkanError, VulkanHandles};
pub use method::{Ends, Form, Interpolation, InterpolationError, METHODS, Method, Path};
pub use rotations::{Layout, Rotations};
pub use tracks::{NORM_TOLERANCE, Track, TrackError, TrackSet};
