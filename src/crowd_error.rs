//! Why a crowd cannot be made, changed or evaluated as asked. Places count from 0.

use crate::curve::options::InterpolationError;
use crate::gpu::error::VulkanError;
use crate::memory::OutOfMemoryError;
use crate::output::pose_error::OFFSET_STEP;
use crate::prepare::error::SetError;
use crate::threads::OutOfThreadsError;
use crate::threads::stop::StoppedError;
use crate::time::wrap::WrapMode;

/// The most clips of a library.
pub(crate) const MAX_CLIPS: usize = 1 << 16;
/// The most masks of a library, beside the one that lets everything through.
pub(crate) const MAX_MASKS: usize = 31;
/// The most instances of a crowd.
pub(crate) const MAX_INSTANCES: usize = 1_000_000;
/// The most layers of an instance.
pub(crate) const MAX_LAYERS: usize = 4;
/// The longest clip, ticks.
pub(crate) const MAX_TICKS: u32 = (1 << 31) - (1 << 18);
/// Speeds stay below this magnitude.
pub(crate) const FASTEST: f32 = 128.0;

/// Why a crowd cannot be made, changed or evaluated as asked. Places count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CrowdError {
    /// A clip of other joints than the library's skeleton.
    #[error(
        "the clip has {tracks} tracks, the skeleton has {joints} joints; give one track for each"
    )]
    Tracks {
        /// Tracks of the set.
        tracks: usize,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// A skeleton without joints.
    #[error("the skeleton has no joints; a crowd has at least one")]
    NoJoints,
    /// A library without clips.
    #[error("the library has no clips; push one")]
    NoClips,
    /// More clips than entries can name.
    #[error("the library is full: there can be {} clips", MAX_CLIPS)]
    TooManyClips,
    /// More masks than entries can name.
    #[error("the library is full: there can be {} masks", MAX_MASKS)]
    TooManyMasks,
    /// The library is larger than indices of 32 bits can tell.
    #[error(
        "the library's clips have more constants than 32 bits can count; use fewer or shorter clips"
    )]
    TooLarge,
    /// Ticks of no length.
    #[error("{ticks_per_second} ticks a second; give 1 to {}", MAX_TICKS)]
    TicksPerSecond {
        /// The ticks that were asked for.
        ticks_per_second: u32,
    },
    /// A clip that is too long for its ticks.
    #[error("the clip takes {seconds} s; at {ticks_per_second} ticks a second there can be {} s", f64::from(MAX_TICKS) / f64::from(*ticks_per_second))]
    TooLong {
        /// How long it is.
        seconds: f64,
        /// The library's ticks.
        ticks_per_second: u32,
    },
    /// The method is to give velocities.
    #[error("the interpolation gives velocities or accelerations; a crowd needs rotations")]
    NotRotations,
    /// A curve that turns so wildly that no polynomial fits it.
    #[error(
        "track {track} rotates too fast at {seconds} s for a polynomial; add a key there, or use slerp"
    )]
    TooWild {
        /// The track.
        track: usize,
        /// Where the piece starts, in the set's time.
        seconds: f64,
    },
    /// A track cannot be interpolated as asked.
    #[error(transparent)]
    Interpolation(#[from] InterpolationError),
    /// A mask or a set of matrices is not of the skeleton's joints.
    #[error("{count} {subject} were given for {joints} joints; give one for each")]
    Joints {
        /// What was given: weights or matrices.
        subject: &'static str,
        /// How many.
        count: usize,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// A weight of a mask outside 0 to 1.
    #[error("joint {joint} has the weight {weight} in the mask; weights are 0 to 1")]
    MaskWeight {
        /// The joint.
        joint: usize,
        /// Its weight.
        weight: f32,
    },
    /// An inverse bind matrix with a number that is not finite.
    #[error("the inverse bind matrix of joint {joint} has a number that is not finite")]
    BindNotFinite {
        /// The joint.
        joint: usize,
    },
    /// Skinning matrices of a library without inverse bind matrices.
    #[error("the library has no inverse bind matrices; set_inverse_bind gives it some")]
    NoInverseBind,
    /// Too many instances, or none.
    #[error("{requested} instances; there can be 1 to {}", MAX_INSTANCES)]
    Instances {
        /// Instances that were asked for.
        requested: usize,
    },
    /// Too many layers, or none.
    #[error("{requested} layers; an instance has 1 to {}", MAX_LAYERS)]
    Layers {
        /// Layers that were asked for.
        requested: usize,
    },
    /// Something that is not there.
    #[error("there is no {subject} {index}; there are {count}")]
    Missing {
        /// An instance, a layer, a clip or a mask.
        subject: &'static str,
        /// The number that was asked for, from 0.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// An instance that a list has twice.
    #[error(
        "instance {instance} is in the list again, at {position}; a list of visible instances names each once"
    )]
    Repeated {
        /// The instance.
        instance: usize,
        /// Where it comes again, from 0.
        position: usize,
    },
    /// A weight outside 0 to 1.
    #[error("the weight is {weight}; weights are 0 to 1")]
    Weight {
        /// What was given.
        weight: f32,
    },
    /// A weight, or a fade, of the layer that has none.
    #[error("the first layer has no weight; the layers above it, from 1 on, have one each")]
    FirstLayer,
    /// A speed that is no number, or too fast.
    #[error(
        "the speed is {speed}; speeds lie between -{} and {}",
        FASTEST,
        FASTEST
    )]
    Speed {
        /// What was given.
        speed: f32,
    },
    /// A wrap mode that crowds do not have.
    #[error("instances of a crowd hold, loop or mirror their clips, not {wrap:?}")]
    Wrap {
        /// What was given.
        wrap: WrapMode,
    },
    /// One of many changes is refused.
    #[error("change {change}: {reason}")]
    Change {
        /// Its place among them.
        change: usize,
        /// Why.
        reason: Box<CrowdError>,
    },
    /// A time that is no number, or out of reach.
    #[error("{seconds} s; times and steps of a crowd are finite, and within 2^52 ticks")]
    Seconds {
        /// What was given.
        seconds: f64,
    },
    /// The output given is not as large as the result.
    #[error("the output has {length} values; the result has {needed}")]
    OutputLength {
        /// Values that it has room for.
        length: usize,
        /// Values of the result.
        needed: usize,
    },
    /// The output is of another precision than the submitted result.
    #[error(
        "the submitted result has numbers of {} bits; take it with {}",
        if *is_half { "16" } else { "32" },
        if *is_half { "wait_half_into" } else { "wait_into" }
    )]
    Precision {
        /// Whether the result is in 16 bits.
        is_half: bool,
    },
    /// Tables of a library, as those of a file, that do not fit together.
    #[error(
        "the tables of the motion library do not fit together: the file is broken or of another version; save the library again"
    )]
    BrokenTables,
    /// Nothing was submitted that could be waited for.
    #[error("nothing is in flight; call submit first")]
    NothingSubmitted,
    /// The result of the submission before was not taken.
    #[error("the result of the submission before was not taken; call wait_into first")]
    StillSubmitted,
    /// A buffer on a Vulkan device is given to an engine that is the CPU, or to another engine's crowd.
    #[error(
        "the crowd was not made by an engine on the buffer's Vulkan device; make it with Engine::from_vulkan"
    )]
    OtherDevice,
    /// The range of a buffer that was given for a result does not fit it.
    #[error(
        "the buffer's range of {size} bytes at {offset} does not fit: the result has {needed} bytes, and starts at a multiple of {}",
        OFFSET_STEP
    )]
    Buffer {
        /// Where the range starts, bytes.
        offset: u64,
        /// Its length, bytes.
        size: u64,
        /// Bytes of the result.
        needed: u64,
    },
    /// The Vulkan device could not be used, or stopped working; after it was lost, the crowd must be
    /// made again.
    #[error(transparent)]
    Vulkan(#[from] VulkanError),
    /// Not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
    /// The system refused worker threads.
    #[error(transparent)]
    Threads(#[from] OutOfThreadsError),
    /// Somebody asked the work to end.
    #[error(transparent)]
    Stopped(#[from] StoppedError),
}

impl From<SetError> for CrowdError {
    fn from(error: SetError) -> Self {
        match error {
            SetError::Interpolation(error) => Self::Interpolation(error),
            SetError::OutOfMemory(error) => Self::OutOfMemory(error),
            SetError::Threads(error) => Self::Threads(error),
            SetError::Stopped(stopped) => Self::Stopped(stopped),
            // No frames are asked for when a clip is prepared.
            SetError::Frames(_) => Self::TooLarge,
        }
    }
}
