//! Bulk interpolation of rotations, with the same bits on every Vulkan driver and
//! the CPU.
//!
//! Keyframe tracks go in, the rotation of every track at every frame comes out:
//!
//! ```
//! use tumble::{Device, Engine, SampleTimes, TrackSet, method};
//! use glam::Quat;
//!
//! // 1. What was loaded: tracks of unit quaternions with key times in seconds.
//! let mut set = TrackSet::new();
//! let keys = [0.0, 0.7, 2.0, 1.1].map(Quat::from_rotation_z);
//! set.push("elbow", &[0.0, 0.5, 1.25, 2.0], &keys)?;
//!
//! // 2. Where to evaluate: the fastest device that is there.
//! let engine = Engine::auto()?;
//!
//! // 3. A clip stays on the device; evaluate it as often as needed.
//! let clip = engine.upload(&set, method::BESSEL_OVERHAUSER)?;
//! let rotations = clip.evaluate(&SampleTimes::fps(60))?;
//! assert_eq!(rotations.get(0, 30), Some(keys[1]));
//!
//! // 4. Another device gives the same bits.
//! let on_cpu = Engine::new(Device::Cpu)?.evaluate(&set, method::BESSEL_OVERHAUSER, &SampleTimes::fps(60))?;
//! assert_eq!(on_cpu.as_quats(), rotations.as_quats());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The path of the data
//!
//! A [`TrackSet`] holds what was loaded. [`SampleTimes`] says which samples to evaluate,
//! at an exact [`FrameRate`] or at any times. A [`Method`] says how the rotation
//! between keys follows from the keys. An [`Engine`] is one device; it prepares a
//! set into a [`Clip`] and evaluates it into [`Rotations`]. [`mod@reference`] is
//! the textbook in f64, which shares nothing with the engine; [`verify`] compares the
//! three.
//!
//! # Where to go on
//!
//! * **Results larger than memory**: [`Request::stream`] gives a chunk at a time
//!   while the next one is evaluated; [`Clip::request`] and [`Engine::request`] ask for some samples of some
//!   tracks, encoded, into memory of your own. [`OutputBuffer`] is memory that is quick to fill.
//! * **Skeletons**: [`Engine::transforms`] evaluates translations, rotations and scales, and
//!   [`Engine::local_to_model`] makes matrices in the model of them along a [`Skeleton`], for skinning
//!   with inverse bind matrices. [`Engine::world`] does so for rotations on fixed offsets.
//!   [`Engine::blend`], [`Engine::mix`] and [`Engine::add`] put layers of poses together.
//! * **Crowds**: in [`crowd`], a [`CrowdLibrary`](crowd::CrowdLibrary) holds the clips of a skeleton, and a
//!   [`Crowd`](crowd::Crowd) plays them: many instances, each at its own time, with layers, into matrices for skinning. Without a skeleton, many
//!   characters at their own times in one [`Clip`] are one call with [`SampleTimes::at`], a sample for each,
//!   in [`Layout::FrameMajor`]; give the times in increasing order.
//! * **Your own Vulkan device** ([`vulkan`]): [`Engine::from_vulkan`] takes a renderer's device and a queue,
//!   [`Crowd::record`](crowd::Crowd::record) records a crowd's poses into its command buffers, and
//!   [`Request::target`] and [`Request::to_buffer`] leave a clip's in the renderer's buffer, where [`Engine::pass`]
//!   blends them and walks skeletons. `examples/application_device.rs`
//!   is a whole program, with two queue families, buffers that are kept, and the warm-up.
//! * **Bodies that travel**: [`Engine::follow`] moves them along [`paths`], [`Engine::smooth`] takes the
//!   noise from samples.
//! * **Names of options**: every option has `ALL`, `name`, [`Display`](std::fmt::Display) and
//!   [`FromStr`](std::str::FromStr), as the program and the bindings use them: `"mirror".parse::<WrapMode>()`.
//! * **Smaller results**: an [`Encoding`] stores rotations in 16 bits, as matrices or as angles, made on
//!   the device. [`Engine::rates`] gives angular velocities and accelerations.
//! * **How right is it here**: [`verify::verify`] compares a device with the CPU, bit for bit, and both
//!   with [`mod@reference`].
//!
//! [`glam`] and [`ash`] are re-exported in the versions that the interface uses; functions that take
//! [`glam::Quat`] take `[f32; 4]`, `x y z w`, too.
//!
//! # What is promised
//!
//! * **Identical bits** from the CPU, at any vector width and number of threads, and
//!   from every Vulkan device that passes the self-test, at any memory budget.
//! * **Accuracy that does not decay**: at hour 24 as in the first second; slerp
//!   within 6e-7 rad of the f64 reference, cubic methods within 1e-6 rad.
//! * **Keys are met exactly**: a sample on a key returns the key's own bits (for
//!   methods that pass through their keys).

// Tests may use what systems round differently (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]
// What only Vulkan uses lies beside what the CPU does too.
#![cfg_attr(not(feature = "vulkan"), allow(dead_code, unused_imports))]

mod checks;
mod cpu;
pub mod crowd;
mod crowd_error;
mod curve;
mod device;
mod engine;
mod error;
mod evaluate;
mod fit;
mod from_keys;
#[cfg(feature = "vulkan")]
mod gpu;
#[cfg(not(feature = "vulkan"))]
#[path = "gpu/absent.rs"]
mod gpu;
mod math;
mod memory;
pub mod method;
#[doc(hidden)]
pub mod names;
mod output;
mod path;
mod pose;
mod prepare;
pub mod reduce;
pub mod reference;
mod shader;
mod simd;
mod smooth;
mod stream;
mod threads;
mod time;
mod tracks;
mod twin;
pub mod verify;

pub use crate::curve::options::{
    Axes, Ends, InterpolationError, InterpolationWarning, KeySigns, Quantity, Speed,
};
pub use crate::device::Device;
pub use crate::engine::Engine;
pub use crate::engine::clip::Clip;
pub use crate::engine::clip::request::Request;
pub use crate::error::Error;
pub use crate::gpu::options::EngineOptions;
pub use crate::memory::OutOfMemoryError;
pub use crate::method::interpolation::Interpolation;
pub use crate::method::vector_method::VectorMethod;
pub use crate::method::{METHODS, Method};
pub use crate::names::UnknownNameError;
pub use crate::output::buffer::OutputBuffer;
pub use crate::output::component_type::ComponentType;
pub use crate::output::encoding::{Encoding, EncodingLengthError, EncodingOptions, MatrixOrder};
pub use crate::output::euler::{EulerSequence, EulerSequenceError};
pub use crate::output::pose_error::{PassOperand, PoseError, SkeletonError};
pub use crate::output::rotations::{Layout, Rotations, Samples, SamplesError, Vectors};
pub use crate::output::signs::{continue_signs, signs_differ, signs_jump};
pub use crate::output::value::OutputValue;
pub use crate::pose::local_to_model::ModelMatrices;
pub use crate::pose::poses::WorldPoses;
pub use crate::pose::skeleton::Skeleton;
pub use crate::pose::transforms::Transforms;
pub use crate::simd::dispatch::VectorWidth;
pub use crate::smooth::kernel::{Smoothing, SmoothingEnds, SmoothingError, SmoothingKernel};
pub use crate::stream::Chunk;
pub use crate::threads::stop::{Stop, StoppedError};
pub use crate::threads::{OutOfThreadsError, on_threads};
pub use crate::time::error::{MAX_FRAMES, SampleTimesError};
pub use crate::time::frame_rate::FrameRate;
pub use crate::time::frames::{SampleTimes, Timeline};
pub use crate::time::time_base::TimeBase;
pub use crate::time::wrap::WrapMode;
pub use crate::tracks::error::{NORM_TOLERANCE, TrackError};
pub use crate::tracks::rotation::Rotation;
pub use crate::tracks::set::key_data::Tcb;
pub use crate::tracks::set::vectors::{Channel, VectorKeys};
pub use crate::tracks::set::{Track, TrackSet, UNIT_TOLERANCE};

pub mod paths {
    //! Bodies that follow paths: where they are, how they are turned, and when.
    //!
    //! A path is a track of translations ([`TrackSet::push_path`](crate::TrackSet::push_path)).
    //! [`Engine::follow`](crate::Engine::follow) moves a body along each, as [`Follow`] says, and gives
    //! [`Followed`]: positions and rotations.
    //!
    //! * The curve through the points is that of a [`VectorMethod`](crate::VectorMethod).
    //! * [`PathSpeed`] says when a body is where: by the keys' times, at one speed, or eased in and out.
    //! * [`Direction`] says where it faces: along the path, ahead on it, to a point, or to another body.
    //! * [`PathFrame`] says how it is turned about that direction, and [`Twist`] what a closed path does with the
    //!   roll that is left over after one round.
    //! * [`BodyAxis`] names the axes of the body that face forward and up.
    //!
    //! Formulas and their sources are in `docs/paths.md`.

    pub use crate::path::options::{
        BodyAxis, Direction, Follow, FollowError, FollowWarning, PathFrame, Twist,
    };
    pub use crate::path::speed::PathSpeed;
    pub use crate::pose::follow::Followed;
}

pub mod vulkan {
    //! Vulkan devices: which there are, how they did in the checks, and how an application shares its own.
    //!
    //! [`Device::list`](crate::Device::list) lists the devices of the machine, each a [`VulkanDevice`] with its
    //! [`DeviceInfo`]. An engine on one is opened as any other.
    //!
    //! * **Is it exact?** A device is checked when it is opened ([`SelfTestReport`]), each of its kernels before it
    //!   is used ([`KernelCheck`]), and the check itself by a [`NegativeControl`]. [`VulkanError`] says what a device
    //!   refused.
    //! * **Where did the time go?** [`Engine::take_timings`](crate::Engine::take_timings) gives [`Timings`].
    //! * **An application's own device** (feature `vulkan`):
    //!   [`Engine::from_vulkan`](crate::Engine::from_vulkan) takes its `VulkanHandles` and a `VulkanQueue`, whose lock
    //!   is a `QueueLock`. Results go into a `VulkanBuffer`: at once by `Request::to_buffer`, or recorded into the
    //!   application's commands by a `ClipTarget` or a `CrowdTarget`. A `PosePass` blends, mixes or adds what lies in
    //!   such buffers, or walks a skeleton: a `PassTarget` records it.
    //! * **Memory for others on the same card**, such as CUDA: an `ExportedResult`.
    //!
    //! Without the feature `vulkan` no device is listed (`VulkanError::NotBuilt`); the types of an application's own
    //! device are left out.

    pub use crate::device::VulkanDevice;
    #[cfg(feature = "vulkan")]
    pub use crate::gpu::clip_target::ClipTarget;
    #[cfg(feature = "vulkan")]
    pub use crate::gpu::crowd::CrowdTarget;
    #[cfg(feature = "prove")]
    pub use crate::gpu::engine::choices::EngineChoices;
    pub use crate::gpu::error::VulkanError;
    #[cfg(feature = "vulkan")]
    pub use crate::gpu::exported::ExportedResult;
    #[cfg(feature = "vulkan")]
    pub use crate::gpu::handles::{QueueLock, VulkanBuffer, VulkanHandles, VulkanQueue};
    pub use crate::gpu::options::Timings;
    #[cfg(feature = "vulkan")]
    pub use crate::gpu::pass_target::PassTarget;
    #[cfg(feature = "prove")]
    pub use crate::gpu::physical::details::{
        DeviceDetails, FloatControlsReport, Limits, MemoryHeap, MemoryType, QueueFamily,
    };
    pub use crate::gpu::reports::{
        DeviceInfo, DeviceKind, KernelCheck, NegativeControl, SelfTestReport,
    };
    #[cfg(feature = "vulkan")]
    pub use crate::pose::pass::{PassRequest, PosePass};
    pub use crate::shader::kernels;

    pub mod tuning {
        //! How an engine uses its device, for measurements and tests: every choice gives the same bits, and
        //! `Automatic`, the default of each, is right for programs.

        pub use crate::gpu::options::{Mapping, PrepareArcs, ReadBack, Reads, Transfer, Uploads};
    }
}

#[cfg(feature = "vulkan")]
pub use ash;
pub use glam;

/// The examples of the README and of the guide are compiled and run as tests.
#[cfg(doctest)]
mod guide {
    #[doc = include_str!("../README.md")]
    struct Readme;
    #[doc = include_str!("../docs/library.md")]
    struct Library;
    #[doc = include_str!("../docs/your-tests.md")]
    struct YourTests;
}
