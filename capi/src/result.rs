//! Result codes, the message of the last error, and the conversion of panics to errors.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use tumble::crowd::CrowdError;
use tumble::vulkan::VulkanError;
use tumble::{Error, PoseError, SkeletonError, TrackError};
use tumble_formats::Diagnostic;

/// The result code of a call. If it is not `TUMBLE_RESULT_OK`, `tumble_last_error` returns a message with the reason.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TumbleResult {
    /// Success.
    Ok = 0,
    /// A pointer is null where null is not allowed, or is not aligned for its type.
    InvalidPointer = 1,
    /// A handle is null, was freed, never existed, or belongs to an object of another type.
    InvalidHandle = 2,
    /// An argument is invalid: an unknown constant or name, a number out of its range, an array that is too large for
    /// memory, a structure whose `size` is not that of a known version, text that is not UTF-8, or objects that do not
    /// belong together.
    InvalidArgument = 3,
    /// The memory for a result does not have the required size, or a range of a buffer is too short or not aligned.
    WrongSize = 4,
    /// There is no track, sample, clip, joint, mask, instance, layer or message with this index.
    OutOfRange = 5,
    /// Keys, times, a skeleton, a mask, a request or a file are refused. The message says where the error is.
    InvalidInput = 6,
    /// There is not enough memory.
    OutOfMemory = 7,
    /// The device does not exist, cannot be opened, does not compute the CPU's bits, or failed; or the system refused
    /// to start worker threads.
    Device = 8,
    /// An internal error of the library. Please report it, with the message.
    Internal = 9,
    /// The call is not possible in this state of the object: nothing was submitted, the result of a submission was
    /// not taken, it has another precision, or the object lacks data, such as clips or inverse bind matrices.
    WrongState = 10,
}

/// Why a call failed.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) code: TumbleResult,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn new(code: TumbleResult, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }

    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Self::new(TumbleResult::InvalidArgument, message)
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let code = match &error {
            Error::Track(TrackError::NoSuchTrack { .. }) => TumbleResult::OutOfRange,
            Error::Vulkan(error) => vulkan_code(error),
            Error::Threads(_) => TumbleResult::Device,
            Error::OutputLength { .. }
            | Error::OutputBytes { .. }
            | Error::ComparedLength { .. } => TumbleResult::WrongSize,
            Error::Pose(PoseError::Buffer { .. }) => TumbleResult::WrongSize,
            Error::Pose(_) => TumbleResult::InvalidArgument,
            Error::OutOfMemory(_) => TumbleResult::OutOfMemory,
            Error::NoSuchPart { .. } => TumbleResult::OutOfRange,
            Error::ThreadCount { .. } | Error::VectorWidth(_) => TumbleResult::InvalidArgument,
            _ => TumbleResult::InvalidInput,
        };
        match error {
            Error::Crowd(error) => error.into(),
            Error::BufferOnCpu => Self::new(
                code,
                "this engine evaluates on the CPU and has no Vulkan device to which the buffer could belong; make one of the buffer's device with tumble_engine_from_vulkan",
            ),
            Error::Pose(PoseError::TrackMajor) => Self::new(
                code,
                "the poses of a skeleton lie track by track in the buffer; evaluate them with TUMBLE_LAYOUT_FRAME_MAJOR",
            ),
            Error::NotRotations => Self::new(
                code,
                "the quantity is a velocity or an acceleration; ask for rotations here",
            ),
            error => Self::new(code, error.to_string()),
        }
    }
}

impl From<VulkanError> for Failure {
    fn from(error: VulkanError) -> Self {
        Self::new(vulkan_code(&error), error.to_string())
    }
}

fn vulkan_code(error: &VulkanError) -> TumbleResult {
    match error {
        VulkanError::BufferRange { .. }
        | VulkanError::BufferEnd { .. }
        | VulkanError::ResultOffset { .. } => TumbleResult::WrongSize,
        VulkanError::NullHandle { .. } => TumbleResult::InvalidPointer,
        VulkanError::QueueFamily { .. }
        | VulkanError::SameQueue
        | VulkanError::ApiVersion { .. }
        | VulkanError::OtherPhysicalDevice { .. } => TumbleResult::InvalidArgument,
        _ => TumbleResult::Device,
    }
}

impl From<TrackError> for Failure {
    fn from(error: TrackError) -> Self {
        let code = match error {
            TrackError::NoSuchTrack { .. } => TumbleResult::OutOfRange,
            _ => TumbleResult::InvalidInput,
        };
        Self::new(code, error.to_string())
    }
}

impl From<SkeletonError> for Failure {
    fn from(error: SkeletonError) -> Self {
        let code = match error {
            SkeletonError::OutOfMemory(_) => TumbleResult::OutOfMemory,
            _ => TumbleResult::InvalidInput,
        };
        Self::new(code, error.to_string())
    }
}

impl From<CrowdError> for Failure {
    fn from(error: CrowdError) -> Self {
        let reason = match &error {
            CrowdError::Change { reason, .. } => reason,
            error => error,
        };
        let code = match reason {
            CrowdError::Vulkan(error) => vulkan_code(error),
            CrowdError::Threads(_) => TumbleResult::Device,
            CrowdError::OutOfMemory(_) => TumbleResult::OutOfMemory,
            CrowdError::Missing { .. } => TumbleResult::OutOfRange,
            CrowdError::OutputLength { .. } | CrowdError::Buffer { .. } => TumbleResult::WrongSize,
            CrowdError::NothingSubmitted
            | CrowdError::StillSubmitted
            | CrowdError::Precision { .. }
            | CrowdError::NoClips
            | CrowdError::NoInverseBind => TumbleResult::WrongState,
            CrowdError::TicksPerSecond { .. }
            | CrowdError::Instances { .. }
            | CrowdError::Layers { .. }
            | CrowdError::Weight { .. }
            | CrowdError::FirstLayer
            | CrowdError::Repeated { .. }
            | CrowdError::Speed { .. }
            | CrowdError::Wrap { .. }
            | CrowdError::Seconds { .. }
            | CrowdError::NegativeSeconds { .. }
            | CrowdError::EventTick { .. }
            | CrowdError::EventsSince { .. }
            | CrowdError::OtherDevice
            | CrowdError::OtherCrowd => TumbleResult::InvalidArgument,
            _ => TumbleResult::InvalidInput,
        };
        Self::new(code, crowd_words(&error))
    }
}

/// The message of a crowd's error, with the function names of this interface, and masks that are counted from 1.
fn crowd_words(error: &CrowdError) -> String {
    match error {
        CrowdError::Missing {
            subject: "mask",
            index,
            count,
        } => {
            let mask = index.saturating_add(1);
            format!("there is no mask {mask}; there are {count}, which count from 1")
        }
        CrowdError::Change { change, reason } => format!("change {change}: {}", crowd_words(reason)),
        CrowdError::NoClips => {
            "the library has no clips; tumble_crowd_library_push gives it one".to_owned()
        }
        CrowdError::NoInverseBind => {
            "the library had no inverse bind matrices when the crowd was made; call \
             tumble_crowd_library_set_inverse_bind before tumble_crowd_new"
                .to_owned()
        }
        CrowdError::NothingSubmitted => {
            "nothing is in flight; call tumble_crowd_submit first".to_owned()
        }
        CrowdError::StillSubmitted => {
            "the result of the submission before was not taken; call tumble_crowd_wait first".to_owned()
        }
        CrowdError::Precision { is_half: true } => {
            "the result is in 16 bits; take it with tumble_crowd_wait_half".to_owned()
        }
        CrowdError::Precision { is_half: false } => {
            "the result is in 32 bits; take it with tumble_crowd_wait".to_owned()
        }
        CrowdError::OtherDevice => {
            "the crowd was not made by an engine on the buffer's Vulkan device; make it with tumble_engine_from_vulkan".to_owned()
        }
        error => error.to_string(),
    }
}

impl From<tumble::SampleTimesError> for Failure {
    fn from(error: tumble::SampleTimesError) -> Self {
        Self::new(TumbleResult::InvalidInput, error.to_string())
    }
}

impl From<Diagnostic> for Failure {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::new(TumbleResult::InvalidInput, diagnostic.to_string())
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// Returns the message of the last failed call of this thread: UTF-8, never null, empty if no call has failed.
///
/// The text belongs to the library. It stays valid until another call of this thread fails, or the thread ends;
/// successful calls do not change it.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_last_error() -> *const c_char {
    // While a thread ends, its message may already have been destroyed.
    let message = LAST.try_with(|last| last.borrow().as_ptr());
    message.unwrap_or(c"".as_ptr())
}

fn remember(message: &str) {
    let bytes: Vec<u8> = message.bytes().filter(|&byte| byte != 0).collect();
    let message = CString::new(bytes).unwrap_or_default();
    let _ = LAST.try_with(|last| last.replace(message));
}

/// The result of some work. If it fails or panics, the code of the error, whose message is stored for this thread.
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, TumbleResult> {
    // After a panic, a value that is only partly changed is dropped, or its lock is poisoned. So no later call uses it.
    let done = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| Err(of_panic(&*panic)));
    done.map_err(|failure| {
        remember(&failure.message);
        failure.code
    })
}

/// The result code of some work; the message of an error is stored for this thread.
pub(crate) fn code(work: impl FnOnce() -> Result<(), Failure>) -> TumbleResult {
    guarded(work).err().unwrap_or(TumbleResult::Ok)
}

fn of_panic(panic: &(dyn Any + Send)) -> Failure {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let reason = text.or_else(|| panic.downcast_ref::<&str>().copied());
    let message = format!(
        "internal error: {}; this is a mistake in tumble {}: please report it with the call",
        reason.unwrap_or("no reason given"),
        env!("CARGO_PKG_VERSION"),
    );
    Failure::new(TumbleResult::Internal, message)
}
