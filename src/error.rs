//! Why an evaluation failed.

use std::ops::Range;

use crate::crowd_error::CrowdError;
use crate::curve::options::InterpolationError;
use crate::gpu::error::{EvaluateError, VulkanError};
use crate::memory::OutOfMemoryError;
use crate::names::UnknownNameError;
use crate::output::encoding::Encoding;
use crate::output::pose_error::{PoseError, SkeletonError};
use crate::path::options::FollowError;
use crate::prepare::error::SetError;
use crate::smooth::kernel::SmoothingError;
use crate::threads::OutOfThreadsError;
use crate::threads::stop::StoppedError;
use crate::time::error::SampleTimesError;
use crate::tracks::error::TrackError;

/// Why an evaluation failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The samples asked for do not fit the set.
    #[error(transparent)]
    SampleTimes(#[from] SampleTimesError),
    /// A track cannot be interpolated as asked.
    #[error(transparent)]
    Interpolation(#[from] InterpolationError),
    /// A path cannot be followed as asked.
    #[error(transparent)]
    Follow(#[from] FollowError),
    /// Samples cannot be smoothed as asked.
    #[error(transparent)]
    Smoothing(#[from] SmoothingError),
    /// The Vulkan device could not be used, or stopped working.
    #[error(transparent)]
    Vulkan(#[from] VulkanError),
    /// A crowd cannot be made, changed or evaluated as asked.
    #[error(transparent)]
    Crowd(#[from] CrowdError),
    /// The output given is not as large as the result.
    #[error("the output has room for {length} rotations; the result has {needed}")]
    OutputLength {
        /// Rotations that it has room for.
        length: usize,
        /// Rotations of the result.
        needed: usize,
    },
    /// Rotations that are to be compared with a result are not as many as it has.
    #[error("{length} rotations are to be compared; the result has {needed}")]
    ComparedLength {
        /// Rotations to compare.
        length: usize,
        /// Rotations of the result: one for each sample of each track.
        needed: usize,
    },
    /// The memory given for an encoded result is not as large as it.
    #[error("the output has {length} bytes; the result has {needed}")]
    OutputBytes {
        /// Bytes that it has room for.
        length: usize,
        /// Bytes of the result.
        needed: usize,
    },
    /// A result has no such part.
    #[error(
        "there are no tracks {:?} with samples {:?} in a result of {} tracks with {} samples",
        part.0, part.1, whole.0, whole.1
    )]
    NoSuchPart {
        /// The tracks and the samples asked for.
        part: (Range<usize>, Range<usize>),
        /// How many tracks and samples there are.
        whole: (usize, usize),
    },
    /// Not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
    /// There is no such track.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// A skeleton cannot be made.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// Poses cannot be put together as asked.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// Velocities and accelerations are no rotations, and cannot be stored as such.
    #[error(
        "{} stores rotations, not velocities or accelerations; use f32 or vector", encoding.name()
    )]
    EncodesRotations {
        /// What was asked for.
        encoding: Encoding,
    },
    /// A request has an encoding, and what is asked of it gives values of four f32.
    #[error(
        "values of four f32 are asked for, and the request's encoding is {encoding}; leave the encoding out, or use `evaluate_bytes` or `evaluate_into`"
    )]
    ResultOfF32 {
        /// What was asked for.
        encoding: Encoding,
    },
    /// Rotations are asked for, and the quantity is a velocity or an acceleration.
    #[error(
        "the quantity is a velocity or an acceleration; `rates` evaluates it, and `evaluate_into` to `Vec4` or `[f32; 4]`"
    )]
    NotRotations,
    /// Rates of change are asked for, and the quantity is the rotation.
    #[error("the quantity is the rotation; ask for its velocity or its acceleration")]
    NotRates,
    /// A buffer on a Vulkan device is given to an engine that is the CPU.
    #[error(
        "this engine evaluates on the CPU and has no Vulkan device to which the buffer could belong; make one of the buffer's device with Engine::from_vulkan"
    )]
    BufferOnCpu,
    /// Results of the CPU lie in no device's memory.
    #[error(
        "this engine evaluates on the CPU, whose results lie in the host's memory; open a Vulkan device to have them in a device's"
    )]
    ExportOnCpu,
    /// A buffer is given to an engine that opened its device itself.
    #[error(
        "the engine opened its device itself, so no buffer of an application's can be on it; make the engine of the buffer's device with Engine::from_vulkan"
    )]
    BufferOfOther,
    /// The environment's `TUMBLE_VECTOR_WIDTH` names no vector width.
    #[error("TUMBLE_VECTOR_WIDTH: {0}")]
    VectorWidth(#[from] UnknownNameError),
    /// That many worker threads cannot be asked for.
    #[error(
        "{requested} worker threads were asked for; give 1 to {max}, or none for the shared ones"
    )]
    ThreadCount {
        /// Threads that were asked for.
        requested: usize,
        /// The most that can be asked for.
        max: usize,
    },
    /// The system refused worker threads.
    #[error(transparent)]
    Threads(#[from] OutOfThreadsError),
    /// Somebody asked the work to end.
    #[error(transparent)]
    Stopped(#[from] StoppedError),
}

impl From<SetError> for Error {
    fn from(error: SetError) -> Self {
        match error {
            SetError::Frames(error) => Self::SampleTimes(error),
            SetError::Interpolation(error) => Self::Interpolation(error),
            SetError::OutOfMemory(error) => Self::OutOfMemory(error),
            SetError::Threads(error) => Self::Threads(error),
            SetError::Stopped(stopped) => Self::Stopped(stopped),
        }
    }
}

impl From<EvaluateError> for Error {
    fn from(error: EvaluateError) -> Self {
        match error {
            EvaluateError::Vulkan(error) => Self::Vulkan(error),
            EvaluateError::Set(error) => error.into(),
        }
    }
}
