//! Errors of crowds. Indices count from 0.

use crate::curve::options::InterpolationError;
use crate::machine::error::VulkanError;
use crate::memory::OutOfMemoryError;
use crate::names::counted;
use crate::output::encoding::Encoding;
use crate::output::pose_error::OFFSET_STEP;
use crate::prepare::error::SetError;
use crate::threads::OutOfThreadsError;
use crate::threads::stop::StoppedError;
use crate::time::wrap::WrapMode;
use crate::tracks::joints::JointMatchError;

/// The maximum number of clips of a library.
pub(crate) const MAX_CLIPS: usize = 1 << 16;
/// The maximum number of masks of a library, not counting the one whose weights are all 1.
pub(crate) const MAX_MASKS: usize = 31;
/// The maximum number of instances of a crowd.
pub(crate) const MAX_INSTANCES: usize = 1_000_000;
/// The maximum number of layers of an instance.
pub(crate) const MAX_LAYERS: usize = 4;
/// The maximum length of a clip in ticks.
pub(crate) const MAX_TICKS: u32 = (1 << 31) - (1 << 18);
/// Speeds are below this magnitude.
pub(crate) const FASTEST: f32 = 128.0;

/// Why a crowd or its library cannot be made, changed or evaluated as requested. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CrowdError {
    /// The number of a clip's tracks differs from the number of the skeleton's joints.
    #[error(
        "the clip has {tracks} tracks, the skeleton has {joints} joints; give one track for each"
    )]
    Tracks {
        /// Tracks of the set.
        tracks: usize,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// The clip has other joints than the library.
    #[error(transparent)]
    OtherJoints(Box<JointMatchError>),
    /// The skeleton has no joints.
    #[error("the skeleton has no joints; a crowd has at least one")]
    NoJoints,
    /// An event is after the end of its clip.
    #[error("the event is at tick {tick}, after the clip's last tick, {ticks}")]
    EventTick {
        /// The tick of the event.
        tick: u32,
        /// The clip's length in ticks.
        ticks: u32,
    },
    /// Events since a time are requested, but the clock has not reached this time.
    #[error("events since {since} ticks, but the clock is at {clock}; give an earlier time")]
    EventsSince {
        /// The requested time in ticks.
        since: u64,
        /// The time of the clock in ticks.
        clock: u64,
    },
    /// The library has no clips.
    #[error("the library has no clips; push one")]
    NoClips,
    /// The library has the maximum number of clips.
    #[error("the library is full: there can be {} clips", MAX_CLIPS)]
    TooManyClips,
    /// The library has the maximum number of masks.
    #[error("the library is full: there can be {} masks", MAX_MASKS)]
    TooManyMasks,
    /// The library needs more constants than 32 bits can count.
    #[error(
        "the library's clips have more constants than 32 bits can count; use fewer or shorter clips"
    )]
    TooLarge,
    /// The number of ticks in a second is out of range.
    #[error("{ticks_per_second} ticks a second; give 1 to {}", MAX_TICKS)]
    TicksPerSecond {
        /// The requested number of ticks.
        ticks_per_second: u32,
    },
    /// A clip has too many ticks.
    #[error("the clip takes {seconds} s; at {ticks_per_second} ticks a second there can be {} s", f64::from(MAX_TICKS) / f64::from(*ticks_per_second))]
    TooLong {
        /// The clip's length in seconds.
        seconds: f64,
        /// The library's number of ticks in a second.
        ticks_per_second: u32,
    },
    /// The interpolation computes velocities or accelerations, not rotations.
    #[error("the interpolation gives velocities or accelerations; a crowd needs rotations")]
    NotRotations,
    /// A curve rotates so fast that no polynomial fits it.
    #[error(
        "track {track} rotates too fast at {seconds} s for a polynomial; add a key there, or use slerp"
    )]
    TooWild {
        /// The track's index in the set.
        track: usize,
        /// The start of the curve's part that was not fitted, seconds of the set's time.
        seconds: f64,
    },
    /// A track cannot be interpolated as requested.
    #[error(transparent)]
    Interpolation(#[from] InterpolationError),
    /// The number of a mask's weights, or of inverse bind matrices, differs from the number of joints.
    #[error("{count} {subject} for {}; give one for each", counted(*.joints, "joint"))]
    Joints {
        /// `weights` or the matrices.
        subject: &'static str,
        /// Their number.
        count: usize,
        /// The number of the skeleton's joints.
        joints: usize,
    },
    /// A weight of a mask is outside 0 to 1.
    #[error("joint {joint} has the weight {weight} in the mask; weights are 0 to 1")]
    MaskWeight {
        /// The joint's index.
        joint: usize,
        /// Its weight.
        weight: f32,
    },
    /// An inverse bind matrix has a number that is not finite.
    #[error("the inverse bind matrix of joint {joint} has a number that is not finite")]
    BindNotFinite {
        /// The joint's index.
        joint: usize,
    },
    /// Skinning matrices are requested, but the library has no inverse bind matrices.
    #[error(
        "the library had no inverse bind matrices when the crowd was made; call set_inverse_bind before Engine::crowd"
    )]
    NoInverseBind,
    /// The number of instances is 0 or too large.
    #[error("{requested} instances; there can be 1 to {}", MAX_INSTANCES)]
    Instances {
        /// The requested number of instances.
        requested: usize,
    },
    /// The number of layers is 0 or too large.
    #[error("{requested} layers; an instance has 1 to {}", MAX_LAYERS)]
    Layers {
        /// The requested number of layers.
        requested: usize,
    },
    /// An index is out of range.
    #[error("there is no {subject} {index}; there are {count}")]
    Missing {
        /// `instance`, `layer`, `clip` or `mask`.
        subject: &'static str,
        /// The index.
        index: usize,
        /// The number of instances, layers, clips or masks.
        count: usize,
    },
    /// An instance is in a list twice.
    #[error(
        "instance {instance} is in the list twice, again at {position}; a list of visible instances contains each once"
    )]
    Repeated {
        /// The instance's index.
        instance: usize,
        /// The list index of its second entry.
        position: usize,
    },
    /// A weight is outside 0 to 1.
    #[error("the weight is {weight}; weights are 0 to 1")]
    Weight {
        /// The weight.
        weight: f32,
    },
    /// A weight or a fade was set for the first layer, which has no weight.
    #[error("the first layer has no weight; the layers above it, from 1 on, have one each")]
    FirstLayer,
    /// A speed is NaN or too large.
    #[error(
        "the speed is {speed}; speeds lie between -{} and {}",
        FASTEST,
        FASTEST
    )]
    Speed {
        /// The speed.
        speed: f32,
    },
    /// Crowds do not have this wrap mode.
    #[error("instances of a crowd hold, loop or mirror their clips, not {wrap}")]
    Wrap {
        /// The wrap mode.
        wrap: WrapMode,
    },
    /// One of several changes is refused.
    #[error("change {change}: {reason}")]
    Change {
        /// The change's index.
        change: usize,
        /// The reason.
        reason: Box<CrowdError>,
    },
    /// A time is NaN or too large.
    #[error("{seconds} s; times and steps of a crowd are finite, and within 2^52 ticks")]
    Seconds {
        /// The time in seconds.
        seconds: f64,
    },
    /// A duration, or a time of the clock, is negative.
    #[error(
        "{seconds} s is negative; a crowd's clock starts at 0 and advances by steps of 0 s or more"
    )]
    NegativeSeconds {
        /// The duration in seconds.
        seconds: f64,
    },
    /// The output is not exactly as long as the result.
    #[error("the output has {}; the result has {needed}", counted(*.length, "value"))]
    OutputLength {
        /// The number of the output's values.
        length: usize,
        /// The number of the result's values.
        needed: usize,
    },
    /// The number of vectors is not a whole number of poses.
    #[error("{length} vectors are no whole number of poses, which have {each} each")]
    PartOfPose {
        /// The number of vectors of four numbers.
        length: usize,
        /// The number of vectors of one pose: three for each joint.
        each: usize,
    },
    /// The output's precision differs from the submitted result's.
    #[error(
        "the submitted result has numbers of {} bits; take it with {}",
        if *is_half { "16" } else { "32" },
        if *is_half { "wait_half_into" } else { "wait_into" }
    )]
    Precision {
        /// Whether the result is in 16 bits.
        is_half: bool,
    },
    /// The tables of a library, for example from a file, do not fit together.
    #[error(
        "the tables of the motion library do not fit together: the file is broken or of another version; save the library again"
    )]
    BrokenTables,
    /// There is no submission to wait for.
    #[error("nothing is in flight; call submit first")]
    NothingSubmitted,
    /// The result of the previous submission was not taken.
    #[error("the result of the submission before was not taken; call wait_into first")]
    StillSubmitted,
    /// The engine does not use the Vulkan device of the buffer.
    #[error(
        "the crowd was not made by an engine on the buffer's Vulkan device; make it with Engine::from_vulkan"
    )]
    OtherDevice,
    /// The target belongs to another crowd.
    #[error(
        "the target was made by another crowd; record it with that crowd, or make a target of this one"
    )]
    OtherCrowd,
    /// States cannot have rotations in this encoding.
    #[error(
        "states have rotations as f32, matrix or 6d, not as {encoding}; encode quaternions by Engine::encode"
    )]
    StateEncoding {
        /// The requested encoding.
        encoding: Encoding,
    },
    /// Clips cannot be copied to a device, because the engine is the CPU.
    #[error("the engine is the CPU, which has no memory of its own; open a Vulkan device")]
    OnCpu,
    /// The range of a buffer does not fit the result.
    #[error(
        "the buffer's range of {size} bytes at {offset} does not fit: the result has {needed} bytes, and starts at a multiple of {}",
        OFFSET_STEP
    )]
    Buffer {
        /// The start of the range in bytes.
        offset: u64,
        /// The length of the range in bytes.
        size: u64,
        /// The length of the result in bytes.
        needed: u64,
    },
    /// The Vulkan device cannot be used, or failed. After a lost device, make the crowd again.
    #[error(transparent)]
    Vulkan(#[from] VulkanError),
    /// There is not enough memory.
    #[error(transparent)]
    OutOfMemory(#[from] OutOfMemoryError),
    /// The system refused worker threads.
    #[error(transparent)]
    Threads(#[from] OutOfThreadsError),
    /// The work was stopped ([`Stop`](crate::Stop)).
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
            // Cannot happen: preparing a clip requests no frames.
            SetError::Frames(_) => Self::TooLarge,
        }
    }
}

impl From<JointMatchError> for CrowdError {
    fn from(error: JointMatchError) -> Self {
        Self::OtherJoints(Box::new(error))
    }
}
