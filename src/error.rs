//! Errors of evaluations.

use std::ops::Range;

use crate::crowd_error::CrowdError;
use crate::curve::options::{InterpolationError, Quantity};
use crate::machine::error::{EvaluateError, VulkanError};
use crate::memory::OutOfMemoryError;
use crate::names::{UnknownNameError, counted};
use crate::output::encoding::{Encoding, EncodingLengthError};
use crate::output::pose_error::{PoseError, SkeletonError};
use crate::path::options::FollowError;
use crate::prepare::error::SetError;
use crate::smooth::kernel::SmoothingError;
use crate::threads::OutOfThreadsError;
use crate::threads::stop::StoppedError;
use crate::time::error::SampleTimesError;
use crate::tracks::error::TrackError;
use crate::tracks::per_track::PerTrackCountError;

/// Why an evaluation failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The sample times do not fit the set ([`SampleTimes::resolve`](crate::SampleTimes::resolve)).
    #[error(transparent)]
    SampleTimes(#[from] SampleTimesError),
    /// A track cannot be interpolated as requested.
    #[error(transparent)]
    Interpolation(#[from] InterpolationError),
    /// A path cannot be followed as requested.
    #[error(transparent)]
    Follow(#[from] FollowError),
    /// Samples cannot be smoothed as requested.
    #[error(transparent)]
    Smoothing(#[from] SmoothingError),
    /// The Vulkan device cannot be used, or failed.
    #[error(transparent)]
    Vulkan(#[from] VulkanError),
    /// A crowd cannot be made, changed or evaluated as requested.
    #[error(transparent)]
    Crowd(#[from] CrowdError),
    /// The memory for encoded rotations has another length.
    #[error(transparent)]
    EncodingLength(#[from] EncodingLengthError),
    /// The output is not exactly as long as the result.
    #[error("the output has room for {}; the result has {needed}", counted(*.length, "rotation"))]
    OutputLength {
        /// The number of the output's values.
        length: usize,
        /// The number of the result's values.
        needed: usize,
    },
    /// The number of rotations to compare differs from the number of the result's.
    #[error("{length} rotations are to be compared; the result has {needed}")]
    ComparedLength {
        /// The number of rotations to compare.
        length: usize,
        /// The number of the result's rotations: one for each sample of each track.
        needed: usize,
    },
    /// The output of an encoded result is not exactly as long as the result.
    #[error("the output has {}; the result has {needed}", counted(*.length, "byte"))]
    OutputBytes {
        /// The length of the output in bytes.
        length: usize,
        /// The length of the result in bytes.
        needed: usize,
    },
    /// The requested tracks or samples are out of range.
    #[error(
        "there are no tracks {:?} with samples {:?} in a result of {} tracks with {} samples",
        part.0, part.1, whole.0, whole.1
    )]
    NoSuchPart {
        /// The requested tracks and samples.
        part: (Range<usize>, Range<usize>),
        /// The numbers of tracks and of samples.
        whole: (usize, usize),
    },
    /// A list of interpolations or of methods is not as long as the list of tracks.
    #[error(transparent)]
    PerTrackCount(#[from] PerTrackCountError),
    /// The interpolations of tracks have different quantities, whose values no single result can hold.
    #[error(
        "the quantity of track 0 is {}, and of track {track} {}; ask for one of them at a time", first.name(), other.name()
    )]
    MixedQuantities {
        /// The quantity of the first track.
        first: Quantity,
        /// The first track that has another quantity.
        track: usize,
        /// The quantity of that track.
        other: Quantity,
    },
    /// A result that stays on the device is requested of tracks with several interpolations.
    #[error(
        "the tracks have several interpolations, whose results are put together in the host's memory; give one for all tracks to leave the result on the device"
    )]
    SeveralInterpolations,
    /// There is not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
    /// There is no such track, or a track cannot be added.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// A skeleton cannot be made.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// Poses cannot be combined as requested.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// The encoding is for rotations, and the quantity is a velocity or an acceleration.
    #[error(
        "{} stores rotations, not velocities or accelerations; use f32 or vector", encoding.name()
    )]
    EncodesRotations {
        /// The requested encoding.
        encoding: Encoding,
    },
    /// The request has an encoding other than f32, but the function returns values of four f32.
    #[error(
        "values of four f32 are asked for, and the request's encoding is {encoding}; leave the encoding out, or use `evaluate_bytes` or `evaluate_into`"
    )]
    ResultOfF32 {
        /// The request's encoding.
        encoding: Encoding,
    },
    /// Rotations are requested, but the quantity is a velocity or an acceleration.
    #[error(
        "the quantity is a velocity or an acceleration; `rates` evaluates it, and `evaluate_into` to `Vec4` or `[f32; 4]`"
    )]
    NotRotations,
    /// Velocities or accelerations are requested, but the quantity is the rotation.
    #[error("the quantity is the rotation; ask for its velocity or its acceleration")]
    NotRates,
    /// A buffer on a Vulkan device is passed to an engine that is the CPU.
    #[error(
        "this engine evaluates on the CPU and has no Vulkan device to which the buffer could belong; make one of the buffer's device with Engine::from_vulkan"
    )]
    BufferOnCpu,
    /// An exported result is requested from an engine that is the CPU, whose results are in no device's memory.
    #[error(
        "this engine evaluates on the CPU, whose results lie in the host's memory; open a Vulkan device to keep \
         them in its memory"
    )]
    ExportOnCpu,
    /// A buffer is passed to an engine that opened its device itself.
    #[error(
        "the engine opened its device itself, so no buffer of an application's can be on it; make the engine of the buffer's device with Engine::from_vulkan"
    )]
    BufferOfOther,
    /// The environment variable `TUMBLE_VECTOR_WIDTH` is not the name of a vector width.
    #[error("TUMBLE_VECTOR_WIDTH: {0}")]
    VectorWidth(UnknownNameError),
    /// The number of worker threads is out of range.
    #[error(
        "{requested} worker threads were asked for; give 1 to {max}, or none for the shared ones"
    )]
    ThreadCount {
        /// The requested number of threads.
        requested: usize,
        /// The maximum number of threads.
        max: usize,
    },
    /// The system refused worker threads.
    #[error(transparent)]
    Threads(#[from] OutOfThreadsError),
    /// The work was stopped ([`Stop`](crate::Stop)).
    #[error(transparent)]
    Stopped(#[from] StoppedError),
}

impl Error {
    /// The same error of a set of which `tracks` were selected: it names a track by its index in the set.
    pub(crate) fn of_tracks(mut self, tracks: &[usize]) -> Self {
        if let Self::Interpolation(
            InterpolationError::Antipodal { track, .. }
            | InterpolationError::OpenLoop { track, .. },
        ) = &mut self
            && let Some(&index) = tracks.get(*track)
        {
            *track = index;
        }
        self
    }
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
            EvaluateError::Vulkan(error) | EvaluateError::NoRoom(error) => Self::Vulkan(error),
            EvaluateError::Set(error) => error.into(),
        }
    }
}
