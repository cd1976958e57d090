//! Bulk interpolation of rotation keyframes, with the same bits on the CPU and on every Vulkan device that passes the
//! self-test.
//!
//! From keyframe tracks, an engine evaluates the rotation of every track at every frame:
//!
//! ```
//! use tumble::{Device, Engine, SampleTimes, TrackSet, method};
//! use glam::Quat;
//!
//! // 1. The loaded motion: tracks of unit quaternions with key times in seconds.
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
//! # Types
//!
//! A [`TrackSet`] has the keys of all tracks. [`SampleTimes`] are the times of the samples: at an exact
//! [`FrameRate`], or any times. A [`Method`] defines the curve through the keys. An [`Engine`] uses one device; it
//! prepares a set as a [`Clip`] and evaluates it to [`Rotations`]. [`mod@reference`] has the textbook formulas in
//! f64, without code of the engine; [`verify`] compares the device, the CPU and the reference.
//!
//! # Topics
//!
//! * **Results larger than memory**: [`Request::stream`] passes one chunk to your closure while the next one is
//!   evaluated. [`Clip::request`] and [`Engine::request`] evaluate some samples of some tracks, in an encoding, into
//!   the caller's memory. [`OutputBuffer`] is memory that is fast to fill.
//! * **One pose at a time**, such as in a game's loop: [`Clip::sampler`] gives a [`Sampler`], which evaluates single
//!   samples and poses on the calling thread and allocates nothing.
//! * **Skeletons**: [`Engine::transforms`] evaluates translations, rotations and scales, and
//!   [`Engine::local_to_model`] multiplies them along a [`Skeleton`] to model matrices, for skinning also by inverse
//!   bind matrices. [`Engine::world`] does this for rotations at fixed offsets. [`Engine::blend`], [`Engine::mix`]
//!   and [`Engine::add`] combine layers of poses.
//! * **Crowds**: in [`crowd`], a [`CrowdLibrary`](crowd::CrowdLibrary) has the clips of a skeleton, and a
//!   [`Crowd`](crowd::Crowd) plays them: many instances, each at its own time, with layers, evaluated to matrices for
//!   skinning. For many characters that play the same [`Clip`] at different times, without a skeleton, evaluate the
//!   clip once: pass their times in increasing order to [`SampleTimes::at`]. In [`Layout::FrameMajor`], each row of the
//!   result is one character.
//! * **An application's Vulkan device** ([`vulkan`]): [`Engine::from_vulkan`] takes a renderer's device and a queue.
//!   [`Crowd::record`](crowd::Crowd::record) records a crowd's poses into its command buffers. [`Request::target`]
//!   and [`Request::to_buffer`] write a clip's results to the renderer's buffer, where [`Engine::pass`] blends them
//!   and evaluates skeletons. `examples/application_device.rs` is a complete program, with two queue families,
//!   persistent buffers, and the warm-up.
//! * **Bodies on paths and smoothing**: [`Engine::follow`] moves bodies along [`paths`]; [`Engine::smooth`] removes
//!   noise from samples.
//! * **Names of options**: every option has `ALL`, `name`, [`Display`](std::fmt::Display) and
//!   [`FromStr`](std::str::FromStr), with the names that the program and the bindings use:
//!   `"mirror".parse::<WrapMode>()`.
//! * **Other encodings and quantities**: an [`Encoding`] stores rotations in 16 bits, as matrices or as angles; the
//!   device converts them. [`Engine::rates`] evaluates angular velocities and accelerations.
//! * **Correctness on your machine**: [`verify::verify`] compares a device with the CPU, bit for bit, and both with
//!   [`mod@reference`].
//!
//! [`glam`], [`bytemuck`] and [`ash`] are re-exported in the versions that this crate uses. Functions that take [`glam::Quat`] also
//! take `[f32; 4]`, `x y z w`; [`CrowdLibrary::set_inverse_bind`](crowd::CrowdLibrary::set_inverse_bind) also takes rows
//! of matrices.
//!
//! # Guarantees
//!
//! * **Identical bits** from the CPU, at any vector width and number of threads, and from every Vulkan device that
//!   passes the self-test, at any memory budget.
//! * **Accuracy that does not depend on time**: at hour 24 as in the first second. Slerp is within 6e-7 rad of the
//!   f64 reference, cubic methods within 1e-6 rad.
//! * **Exact keys**: a sample at a key's time has the key's bits (for methods that pass through their keys).

// Tests may use functions whose last bit differs between systems (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]
// The smallest build (build/main.rs) does not call code that is only faster.
#![cfg_attr(smallest, allow(dead_code, unused_imports))]

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
// Measurements within the engine, which need its private parts. They are for the crate `tumble-verify`, which names
// them for users.
#[cfg(feature = "lab")]
#[doc(hidden)]
pub mod lab;
mod machine;
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
// Without the feature `vulkan`, kernels do not run, and some of this is unused.
#[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
mod shader;
mod simd;
mod smooth;
mod stream;
mod threads;
mod time;
mod tracks;
// Some twins are used only by checks of devices.
#[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
mod twin;
pub mod verify;
#[cfg(feature = "vulkan")]
mod work;

pub use crate::curve::options::{
    Axes, Ends, InterpolationError, InterpolationWarning, KeySigns, Quantity, Speed,
};
pub use crate::device::Device;
pub use crate::engine::Engine;
pub use crate::engine::clip::Clip;
pub use crate::engine::clip::request::Request;
pub use crate::engine::clip::sampler::Sampler;
pub use crate::error::Error;
pub use crate::machine::options::{CacheFiles, EngineOptions};
pub use crate::memory::{OutOfMemoryError, available_memory};
pub use crate::method::interpolation::Interpolation;
pub use crate::method::interpolation_options::{
    InterpolationOption, InterpolationOptions, OptionValue, OptionValueError,
};
pub use crate::method::vector_method::{ScalarQuantity, VectorMethod};
pub use crate::method::{METHODS, Method};
pub use crate::names::UnknownNameError;
pub use crate::output::buffer::OutputBuffer;
pub use crate::output::component_type::ComponentType;
pub use crate::output::encoding::{Encoding, EncodingLengthError, EncodingOptions, MatrixOrder};
pub use crate::output::euler::{EulerSequence, EulerSequenceError};
pub use crate::output::pose_error::{PassOperand, PoseError, SkeletonError};
pub use crate::output::rotations::{Layout, Rotations, Samples, SamplesError, Vectors};
pub use crate::output::scalars::Scalars;
pub use crate::output::signs::{continue_signs, signs_differ, signs_jump};
pub use crate::output::value::OutputValue;
pub use crate::pose::affine::AffineMatrix;
pub use crate::pose::local_to_model::ModelMatrices;
pub use crate::pose::poses::WorldPoses;
pub use crate::pose::skeleton::Skeleton;
pub use crate::pose::transforms::Transforms;
pub use crate::simd::dispatch::VectorWidth;
pub use crate::smooth::kernel::{Smoothing, SmoothingEnds, SmoothingError, SmoothingKernel};
pub use crate::stream::Chunk;
pub use crate::threads::stop::{Stop, StoppedError};
pub use crate::threads::{OutOfThreadsError, on_threads, set_thread_count};
pub use crate::time::error::{MAX_FRAMES, SampleTimesError};
pub use crate::time::frame_rate::FrameRate;
pub use crate::time::frames::{SampleTimes, Timeline};
pub use crate::time::time_base::TimeBase;
pub use crate::time::wrap::WrapMode;
pub use crate::tracks::error::{NORM_TOLERANCE, TrackError};
pub use crate::tracks::joints::{JointMatchError, JointPairs, Joints};
pub use crate::tracks::per_track::{PerTrack, PerTrackCountError, TrackGroup};
pub use crate::tracks::rotation::Rotation;
pub use crate::tracks::set::key_data::Tcb;
pub use crate::tracks::set::scalars::ScalarKeys;
pub use crate::tracks::set::vectors::{Channel, VectorKeys};
pub use crate::tracks::set::{Track, TrackSet, UNIT_TOLERANCE};

pub mod paths {
    //! Bodies that follow paths: their positions and rotations.
    //!
    //! A path is a track of translations ([`TrackSet::push_path`](crate::TrackSet::push_path)).
    //! [`Engine::follow`](crate::Engine::follow) moves a body along each path by the options [`Follow`], and returns
    //! positions and rotations ([`Followed`]).
    //!
    //! * A [`VectorMethod`](crate::VectorMethod) defines the curve through the points.
    //! * [`PathSpeed`] defines the speed on the path: by the key times, constant, or eased in and out.
    //! * [`Direction`] is where the body faces: along the path, ahead on it, to a point, or to another body.
    //! * [`PathFrame`] defines the rotation about that direction, and [`Twist`] what is done with the roll that
    //!   remains after one round of a closed path.
    //! * [`BodyAxis`] names the axes of the body that face forward and up.
    //!
    //! Formulas and their sources are in `docs/paths.md`.

    pub use crate::path::options::{
        BodyAxis, Direction, Follow, FollowError, FollowWarning, PathFrame, Twist,
    };
    pub use crate::path::speed::PathSpeed;
    pub use crate::pose::follow::Followed;
}

pub mod trees {
    //! Kinematic trees: where the bodies of a robot are for the values of its joints.
    //!
    //! A [`Tree`] is made of [`TreeBody`]s, or read from MJCF or URDF by the crate `tumble-formats`.
    //! [`Tree::poses`] and [`Tree::motions`] compute all bodies for a [`Configuration`] of the joints in f64, with the
    //! same bits on every processor; [`Tree::walk`] those of many configurations.

    pub use crate::pose::tree::{
        BodyArrays, BodyMotion, BodyOrder, BodyPose, BodyRows, BodyVelocity, Configuration,
        ConfigurationRates, FrameWords, JointCounts, JointKind, JointTracks, Mimic, Siblings, Tree,
        TreeBody, TreeError, TreeFrames, TreeJoint, TreeWalk, WalkMemory,
    };
}

pub mod vulkan {
    //! Vulkan devices: their properties, their checks, and use of an application's device.
    //!
    //! [`Device::list`](crate::Device::list) lists the devices of the machine as [`VulkanDevice`]s with their
    //! [`DeviceInfo`]. [`Engine::new`](crate::Engine::new) opens one.
    //!
    //! * **Exactness**: a device is checked when it is opened ([`SelfTestReport`]), and each kernel before its first
    //!   use ([`KernelCheck`]). A [`NegativeControl`] checks that the comparison finds differences. [`VulkanError`]
    //!   says why a device was refused.
    //! * **Timing**: [`Engine::take_timings`](crate::Engine::take_timings) returns [`Timings`].
    //! * **An application's device** (feature `vulkan`): [`Engine::from_vulkan`](crate::Engine::from_vulkan) takes
    //!   `VulkanHandles` and a `VulkanQueue`; a `QueueLock` is a lock for a queue. Results are written to a
    //!   `VulkanBuffer`: at once by `Request::to_buffer`, or recorded into the application's commands by a
    //!   `ClipTarget`, a `TimedTarget` or a `CrowdTarget`. A `CrowdStage` continues a crowd's matrices after the application has changed
    //!   them. A `PosePass` blends, mixes or adds poses in such buffers, or evaluates a
    //!   skeleton; a `PassTarget` records it.
    //! * **Memory for other interfaces on the same card**, such as CUDA: an `ExportedResult`.
    //!
    //! Without the feature `vulkan`, no device is listed (`VulkanError::NotBuilt`), and the types for an
    //! application's device do not exist.

    pub use crate::device::VulkanDevice;
    pub use crate::machine::error::VulkanError;
    pub use crate::machine::options::Timings;
    pub use crate::machine::reports::{
        DeviceInfo, DeviceKind, KernelCheck, NegativeControl, SelfTestReport,
    };
    pub use crate::shader::kernels;
    #[cfg(feature = "vulkan")]
    pub use crate::{
        engine::clip::request::on_device::application_device::TimedTarget,
        gpu::clip::ClipTarget,
        gpu::crowd::CrowdTarget,
        gpu::external::ExportedResult,
        gpu::handles::{QueueLock, VulkanBuffer, VulkanHandles, VulkanQueue},
        gpu::passes::PassTarget,
        gpu::recorded::{CommandScopes, CommandUsers},
        pose::pass::{PassRequest, PosePass},
    };

    pub mod tuning {
        //! How an engine uses its device, for measurements and tests. Every choice gives the same bits, and
        //! `Automatic`, the default of each, is right for programs.

        pub use crate::machine::options::{
            Mapping, PrepareArcs, ReadBack, Reads, RunLanes, Transfer, Uploads,
        };
    }
}

#[cfg(feature = "vulkan")]
pub use ash;
pub use bytemuck;
pub use glam;

/// The examples of the README and of the guide are compiled and run as tests.
#[cfg(doctest)]
mod guide {
    #[doc = include_str!("../README.md")]
    struct Readme;
    #[cfg(feature = "vulkan")]
    #[doc = include_str!("../docs/crowd.md")]
    struct Crowds;
    #[doc = include_str!("../docs/library.md")]
    struct Library;
    #[doc = include_str!("../docs/your-tests.md")]
    struct YourTests;
}
