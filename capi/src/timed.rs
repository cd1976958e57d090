//! Clips on an application's Vulkan device, recorded at times that are known only when they are recorded.

use std::ffi::c_void;

use tumble::Request;
use tumble::vulkan::TimedTarget;

use crate::arguments::{list, vulkan};
use crate::clip::TumbleClip;
use crate::handle::{self, Object};
use crate::request::{TumbleRequest, new_target};
use crate::result::{TumbleResult, code};

/// A timed target: everything that is needed to record samples of a clip at other times in each frame, and the range of
/// the application's buffer that receives them.
pub struct TumbleTimedTarget {
    inner: TimedTarget,
}

impl Object for TumbleTimedTarget {
    const NAME: &'static str = "timed target";
}

/// Prepares a request of a clip for recording at times that are given when it is recorded: for a clip at another time
/// in each frame, without a submission.
///
/// The request's own times only say how many samples of each track are recorded: for one pose, one listed time. The
/// buffer and its range are as for `tumble_clip_target_new`. The application frees the target with
/// `tumble_timed_target_free` before it destroys the buffer or the device.
///
/// # Errors
/// As `tumble_clip_target_new`.
///
/// # Safety
/// As for `tumble_clip_target_new`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_timed_target_new(
    clip: *const TumbleClip,
    request: *const TumbleRequest,
    buffer: u64,
    offset: u64,
    size: u64,
    target: *mut *mut TumbleTimedTarget,
) -> TumbleResult {
    let made = |request: Request<'_>, buffer| {
        // SAFETY: as the caller promises.
        let inner = unsafe { request.timed_target(buffer)? };
        Ok(TumbleTimedTarget { inner })
    };
    // SAFETY: as the caller promises.
    unsafe { new_target(clip, request, [buffer, offset, size], target, made) }
}

/// Records an evaluation at `times`, which are in seconds, into the application's command buffer `commands`, a
/// `VkCommandBuffer`. The times are those of all tracks; there must be as many as the request has samples.
///
/// The result starts `offset` bytes after the start of the target's range, a multiple of the bytes of a value, and has
/// the bits that `tumble_clip_evaluate` gives at listed times. Nothing is submitted or waited for. The commands contain
/// about 28 bytes for each sample of a track. Barriers are included, as for `tumble_clip_record`. Several recordings of a
/// target may be in flight on one queue. Commands that are submitted again evaluate the same times.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if the result does not fit there or `offset` is not aligned.
/// - `TUMBLE_RESULT_INVALID_INPUT` if there is another number of times, or a time is not finite.
/// - `TUMBLE_RESULT_OUT_OF_MEMORY` if there is not enough memory.
///
/// After any error nothing is recorded.
///
/// # Safety
/// `times` must have `time_count` numbers. The command buffer must be as for `tumble_clip_record`, and nothing else may
/// use it during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_timed_target_record(
    target: *const TumbleTimedTarget,
    commands: *mut c_void,
    offset: u64,
    times: *const f64,
    time_count: usize,
) -> TumbleResult {
    code(|| {
        let target = handle::get(target)?;
        let commands = vulkan(commands, "commands")?;
        // SAFETY: as the caller promises.
        let times = unsafe { list(times, time_count, "times")? };
        // SAFETY: as the caller promises.
        Ok(unsafe { target.inner.record(commands, offset, times) }?)
    })
}

/// Frees a timed target. Does nothing if `target` is null.
///
/// # Safety
/// All work that was recorded with the target must have ended, and none may be submitted later.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_timed_target_free(target: *mut TumbleTimedTarget) -> TumbleResult {
    code(|| handle::free(target))
}
