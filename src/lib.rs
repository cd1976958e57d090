//! Bulk interpolation of rotations, with the same bits on every Vulkan driver and
//! the CPU.
//!
//! Keyframe tracks go in, the rotation of every track at every frame comes out:
//!
//! ```
//! use tumble::{Device, Engine, Frames, TrackSet, method};
//! use glam::Quat;
//!
//! // 1. What was loaded: tracks of unit quaternions with key times in seconds.
//! let mut set = TrackSet::new();
//! let keys = [0.0, 0.7, 2.0, 1.1].map(Quat::from_rotation_z);
//! set.push("elbow", &[0.0, 0.5, 1.25, 2.0], &keys)?;
//!
//! // 2. Where to evaluate: the first Vulkan device that is exact, else the CPU.
//! let engine = Engine::first()?;
//!
//! // 3. A clip stays on the device; evaluate it as often as needed.
//! let clip = engine.upload(&set, method::BESSEL_OVERHAUSER)?;
//! let rotations = clip.evaluate(&Frames::fps(60))?;
//! assert_eq!(rotations.get(0, 30), Some(keys[1]));
//!
//! // 4. Another device gives the same bits.
//! let on_cpu = Engine::new(Device::Cpu)?.evaluate(&set, method::BESSEL_OVERHAUSER, &Frames::fps(60))?;
//! assert_eq!(on_cpu.as_quats(), rotations.as_quats());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The path of the data
//!
//! A [`TrackSet`] holds what was loaded. [`Frames`] says which samples to evaluate,
//! at an exact [`FrameRate`] or at any times. A [`Method`] says how the rotation
//! between keys follows from the keys. An [`Engine`] is one device; it prepares a
//! set into a [`Clip`] and evaluates it into [`Rotations`]. [`mod@reference`] is
//! the textbook in f64, which shares nothing with the engine; [`verify`] compares the
//! three.
//!
//! # What is promised
//!
//! * **Identical bits** from the CPU, at any vector width and number of threads, and
//!   from every Vulkan device that passes its canaries, at any memory budget.
//! * **Accuracy that does not decay**: at hour 24 as in the first second; slerp
//!   within 6e-7 rad of the f64 reference, cubic methods within 1e-6 rad.
//! * **Keys are met exactly**: a sample on a key returns the key's own bits (for
//!   methods that pass through their keys).

mod auto;
mod backward;
mod branchless;
mod clip;
mod clock;
mod cpu;
mod cycle;
mod device;
mod encoding;
mod engine;
mod euler;
mod formula;
mod frame_clock;
mod frame_rate;
mod gpu;
mod joints;
mod key_pieces;
pub mod method;
mod numeric;
mod output_buffer;
mod pieces;
mod plan;
mod poses;
mod prepare;
pub mod reference;
mod rotations;
mod scalar;
mod schedule;
mod segment;
mod skeleton;
mod span_block;
pub mod spirv;
mod stream;
mod time_runs;
mod tracks;
mod transforms;
mod vector_method;
pub mod verify;
mod window;

pub use clip::Clip;
pub use clock::{Frames, FramesError, MAX_FRAMES, Timeline};
pub use cpu::{UnknownWidth, VectorWidth};
pub use cycle::Outside;
pub use device::{Device, EngineOptions, Reads, Timings, Transfer, VulkanDevice};
pub use encoding::{Encoding, MatrixOrder};
pub use engine::{Engine, Error};
pub use euler::{EulerSequence, UnknownSequence};
pub use frame_rate::FrameRate;
pub use gpu::{
    CanaryReport, DeviceInfo, DeviceKind, VulkanBuffer, VulkanError, VulkanHandles, kernels,
};
pub use method::{
    Axes, Continuity, Cost, Ends, Form, Interpolation, InterpolationError, Keys, METHODS, Method,
    Path, Quantity, Speed,
};
pub use output_buffer::OutputBuffer;
pub use poses::WorldPoses;
pub use rotations::{Layout, Rotations};
pub use skeleton::{Skeleton, SkeletonError};
pub use stream::Chunk;
pub use tracks::{NORM_TOLERANCE, Tcb, Track, TrackError, TrackSet, UNIT_TOLERANCE};
pub use transforms::{Transforms, Vectors};
pub use vector_method::{UnknownVectorMethod, VectorMethod};

/// The README's example is compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
